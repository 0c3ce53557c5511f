"""Forces, counts and energies over a load path, in a CSV file."""

from __future__ import annotations

import csv
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from keyword import iskeyword
from pathlib import Path
from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from .. import compat
from ..checked import is_real_number
from ..compat import Array
from ..errors import ContactError, as_path, raise_everywhere, together, writing
from ..host.forms import check_supports
from ..interface.pairs import Pair
from ..options.methods import Penalty
from ..problem import CoupledProblem
from .body_columns import BodyColumns

_COUNTS = ("time", "iterations", "halvings", "active", "min_gap", "max_pressure")


def _check_more(more: Any) -> dict[str, Callable[[], float]]:
    """Functions by name, or an error."""
    more = {} if more is None else more
    if not (isinstance(more, Mapping) and all(map(callable, more.values()))):
        raise ContactError(
            f"more must be functions by name of the column, not {more!r}"
        )
    return dict(more)


def _check_energy(energy: Any) -> None:
    """Raise unless the energy is a functional or None."""
    if energy is not None and not (
        isinstance(energy, ufl.Form) and not energy.arguments()
    ):
        raise ContactError(
            "energy must be a UFL functional: a form without test function"
        )


def _number_fault(values: Mapping[str, Any]) -> str | None:
    """A message on a value that is no number, if there is one."""
    for name, value in values.items():
        try:
            float(value)
        except (TypeError, ValueError):
            return f"{name} of a record must be a number, not {value!r}"
    return None


def _column_fault(columns: Sequence[Any]) -> str | None:
    """A message on names of columns that cannot be used, if there are any."""
    for i, name in enumerate(columns):
        text = isinstance(name, str) and name.isidentifier() and not iskeyword(name)
        if not text or name.startswith("_"):
            return f"column {name!r} of a history is no name that an attribute may have"
        if name in columns[:i]:
            return f"column {name!r} of a history is there twice"
    return None


def _listed(rows: Any) -> list[list[float]]:
    """Records as lists of numbers."""
    try:
        return [[float(value) for value in row] for row in rows]
    except (TypeError, ValueError):
        raise ContactError(
            f"rows must be records, as of History.rows, not {rows!r}"
        ) from None


class History:
    """Records results of each accepted step, and writes them to a CSV file. Collective.

    Parameters
    ----------
    problem
        Problem that is solved.
    file
        Path of the file; rank 0 writes it, a line for each record at once. It begins
        with the first record, in place of an older one. None: nothing is written.
    reactions
        Dirichlet condition, or a list of them, by the name of the support.
    energy
        UFL functional of the stored energy.
    more
        Functions without argument that give a number, by the name of their column.
        Every rank calls them, and the number is that of rank 0.

    Attributes
    ----------
    columns
        - ``time``: load factor; ``iterations``, ``halvings``: of the load step;
        - ``active``: integration points in contact; ``min_gap`` (length; NaN where
          the bodies are out of reach), ``max_pressure``: over these points;
        - ``force_0_x``, ...: contact force on slave surface 0; with friction its parts
          ``normal_0_x``, ... and ``tangential_0_x``, ...; of several contacts the
          surfaces are numbered on, in the order of the problem's list;
        - ``radial_0``, ...: if contact is axisymmetric, see `results.Resultant`;
        - ``force_<slave>_<master>_x``, ...: the same of every pair that has names, or
          whose slave has several masters, by the names or else the tags of its
          surfaces (`Pair.label`): ``force_ring_plate_x``, ``force_3_7_x``;
        - ``reaction_<name>_x``, ...: `NonlinearProblem.reactions`;
        - of every rigid body by its name ``push_<name>_x``, ``moment_<name>_x``: force of
          contact on it and moment about its centre; ``translation_<name>_x``,
          ``rotation_<name>_x``: its motion; ``work_<name>``: what it has done on the
          slaves so far, by the mean of each step's forces. In 2D ``moment_<name>`` and
          ``rotation_<name>`` are numbers;
        - ``energy``; with friction ``friction_work``: the work that tangential
          tractions have taken so far; with a penalty ``stored_normal`` and, with
          friction, ``stored_tangential``: `Contact.stored_energy`. The work of the loads
          is ``energy + stored_normal + friction_work``, to the error of the steps, and
          ``friction_work`` includes ``stored_tangential``.
    rows
        The records, with these names as attributes.

    Examples
    --------
    >>> history = History(problem, "history.csv", {"top": bcs[1]}, energy * ufl.dx)
    >>> LoadSteps(solver, apply, steps=5, history=history).run()
    >>> history["reaction_top_y"]
    """

    def __init__(
        self,
        problem: CoupledProblem,
        file: str | Path | None = None,
        reactions: Mapping[str, Any] | None = None,
        energy: ufl.Form | None = None,
        more: Mapping[str, Callable[[], float]] | None = None,
    ) -> None:
        if not isinstance(problem, CoupledProblem):
            raise ContactError(
                f"problem must be a NonlinearProblem, not {type(problem).__name__}"
            )
        self.problem, self._comm = problem, problem.comm
        with together(self._comm):
            self.path = None if file is None else as_path(file)
            self._reactions = check_supports("reactions", reactions)
            self._more = _check_more(more)
            _check_energy(energy)
        self._energy = None if energy is None else compat.form(energy)
        self._of_bodies = BodyColumns(problem.contact)
        self.columns: tuple[str, ...] = tuple(self._names())
        raise_everywhere(self._comm, _column_fault(self.columns))
        self._row: Any = namedtuple("Row", self.columns)  # type: ignore[misc]
        self.rows: list[Any] = []
        self._begun = False

    def __repr__(self) -> str:
        file = "no file" if self.path is None else f"file {str(self.path)!r}"
        columns = ", ".join(self.columns)
        return f"<History of {len(self)} records, {file}, columns {columns}>"

    def _names(self) -> list[str]:
        """Columns, in the order of `_values`."""
        axes = "xyz"[: self.problem.contact.u.function_space.mesh.geometry.dim]
        vectors = []
        for i, zone in enumerate(self.problem.contact.zones):
            parts = ["force"] + ["normal", "tangential"] * zone.frictional
            vectors += [f"{part}_{i}" for part in parts]
        for pair in filter(self._has_columns, self.problem.contact.pairs):
            frictional = self.problem.contact.zones[pair.surface].frictional
            parts = ["force"] + ["normal", "tangential"] * frictional
            vectors += [f"{part}_{pair.label}" for part in parts]
        vectors += [f"reaction_{name}" for name in self._reactions]
        names = [*_COUNTS, *(f"{v}_{x}" for v in vectors for x in axes)]
        if self.problem.contact.axisymmetric:
            names += [f"radial_{i}" for i in range(len(self.problem.contact.zones))]
        names += self._of_bodies.names
        names += ["energy"] * (self._energy is not None)
        names += ["friction_work"] * self._frictional
        return names + [f"stored_{part}" for part in self._stored] + list(self._more)

    def _has_columns(self, pair: Pair) -> bool:
        """Whether a pair has a name, or is not the only one of its surface."""
        if pair.slave_name is not None or pair.master_name is not None:
            return True
        surfaces = [p.surface for p in self.problem.contact.pairs]
        return surfaces.count(pair.surface) > 1

    @property
    def _frictional(self) -> bool:
        return any(zone.frictional for zone in self.problem.contact.zones)

    @property
    def _stored(self) -> list[str]:
        """Parts of the energy that penalties store."""
        contacts = self.problem.contact.contacts
        if not any(isinstance(one.method, Penalty) for one in contacts):
            return []
        return ["normal"] + ["tangential"] * self._frictional

    def include(self, more: Mapping[str, Callable[[], float]]) -> None:
        """Add functions to `more`, or replace those of their names. Collective.

        Raises
        ------
        ContactError
            If columns would be added to a history that has records.
        """
        columns = (*self.columns, *(name for name in more if name not in self._more))
        fault = _column_fault(columns)
        if self.rows and len(columns) > len(self.columns):
            fault = f"a history that has records takes no more columns: {list(more)}"
        raise_everywhere(self._comm, fault)
        self._more.update(more)
        self.columns = columns
        self._row = namedtuple("Row", columns)  # type: ignore[misc]

    def record(self, time: float, iterations: int = 0, halvings: int = 0) -> None:
        """Add the present state, after a solve and before `Contact.advance`.

        Collective.

        Raises
        ------
        ContactError
            If the file cannot be written.
        """
        given = {"time": time, "iterations": iterations, "halvings": halvings}
        raise_everywhere(self._comm, _number_fault(given))
        values = [*given.values(), *self._values()]
        more = {name: number() for name, number in self._more.items()}
        # Only rank 0 evaluates and writes them
        problem = _number_fault(more) if self._comm.rank == 0 else None
        raise_everywhere(self._comm, problem)
        values = self._comm.bcast([*values, *more.values()], root=0)
        values = [float(value) for value in values]
        self.rows.append(self._row(*values))
        self._write(self.rows[-1:] if self._begun else self.rows)

    def _values(self) -> list[float]:
        """Values of all columns but the user's. Collective."""
        contact = self.problem.contact
        counts = contact.statistics
        gap = counts.min_gap if counts.hits else np.nan
        values: list[Any] = [counts.active_points, gap]
        values.append(counts.max_pressure)
        forces = [
            (i, contact.results.resultant(i, None)) for i in range(len(contact.zones))
        ]
        pairs = contact.pairs
        if any(map(self._has_columns, pairs)):
            found = zip(pairs, contact.results.resultants())
            forces += [(p.surface, force) for p, force in found if self._has_columns(p)]
        for i, force in forces:
            values.extend(force.force)
            if contact.zones[i].frictional:
                values.extend((*force.normal, *force.tangential))
        if self._reactions:
            for reaction in self.problem.reactions(self._reactions).values():
                values.extend(reaction)
        if contact.axisymmetric:
            values.extend(force.radial for _, force in forces[: len(contact.zones)])
        values += self._of_bodies.values(self.rows[-1]._asdict() if self.rows else None)
        if self._energy is not None:
            values.append(self._comm.allreduce(fem.assemble_scalar(self._energy)))
        if self._frictional:
            before = self.rows[-1].friction_work if self.rows else 0.0
            values.append(before + contact.friction_work())
        return values + [contact.stored_energy(part) for part in self._stored]

    def _write(self, rows: Sequence[Sequence[float]]) -> None:
        """Append rows to the file. The first rows begin a new file. Collective."""
        with writing(self._comm, self.path, OSError):
            if self.path is not None and self._comm.rank == 0:
                mode = "a" if self._begun else "w"
                with open(self.path, mode, newline="", encoding="utf-8") as file:
                    writer = csv.writer(file, lineterminator="\n")
                    if not self._begun:
                        writer.writerow(self.columns)
                    writer.writerows(rows)
        self._begun = True

    def __getitem__(self, column: str) -> Array:
        """A column over all records, (n,)."""
        if column not in self.columns:
            raise ContactError(
                f"a history has no column {column!r}, but {', '.join(self.columns)}"
            )
        return np.array([getattr(row, column) for row in self.rows])

    def vectors(self, name: str) -> Array:
        """Columns of a vector over all records, such as ``"force_0"``, (n, d)."""
        dim = self.problem.contact.u.function_space.mesh.geometry.dim
        return np.column_stack([self[f"{name}_{x}"] for x in "xyz"[:dim]])

    def __len__(self) -> int:
        return len(self.rows)

    def resume(
        self, rows: Sequence[Sequence[float]] | None = None, until: float = np.inf
    ) -> None:
        """Go on from earlier records, in a new run. Collective.

        The file is then written anew with them. A last line that is incomplete, because
        the earlier run was killed, is left out.

        Parameters
        ----------
        rows
            Records, as of `rows`; None: those of the file, read on rank 0.
        until
            Leave out records after this load factor, at which the new run starts.

        Raises
        ------
        ContactError
            If the file is none of this problem's, or there is none.
        """
        found, problem = [], None
        with together(self._comm):
            if rows is not None:
                found = _listed(rows)
            if not is_real_number(until):
                raise ContactError(f"until must be a load factor, not {until!r}")
        if rows is None and self._comm.rank == 0:
            found, problem = self._read()
        raise_everywhere(self._comm, problem)
        found = self._comm.bcast(found, root=0)
        raise_everywhere(self._comm, self._row_fault(found))
        kept = [self._row(*values) for values in found]
        self.rows = [row for row in kept if row.time <= until * (1.0 + 1e-12)]
        self._begun = False
        self._write(self.rows)

    def _row_fault(self, rows: Sequence[Sequence[float]]) -> str | None:
        """A message on records that do not fit the columns, if there are any."""
        n = len(self.columns)
        for i, values in enumerate(rows):
            if len(values) != n:
                return f"record {i} has {len(values)} values, this history {n} columns"
        return None

    def _read(self) -> tuple[list[list[float]], str | None]:
        """Complete records of the file, or a message on what is wrong with it."""
        if self.path is None:
            return [], "a history without a file has none to go on from"
        try:
            text = self.path.read_text(encoding="utf-8")
            # The line that a killed run was writing has no end
            head, *lines = csv.reader(text.split("\n")[:-1])
            if tuple(head) != self.columns:
                return [], f"{self.path} has other columns than this history"
            return [[float(x) for x in values] for values in lines], None
        except (OSError, ValueError) as error:
            return [], f"{self.path} cannot be read: {error}"

"""Forces, counts and energies over a load path, in a CSV file."""

from __future__ import annotations

import csv
from collections import namedtuple
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from keyword import iskeyword
from pathlib import Path
from typing import Any

import numpy as np
import ufl

from ..arguments import new_file, writing
from ..core.compat import Array
from ..core.errors import (
    ContactError,
    is_real_number,
    is_truth_value,
    positive,
    raise_everywhere,
    require_agreement,
    together,
)
from ..core.options.methods import Penalty
from ..core.problem import CoupledProblem
from ..core.solvers.solver import require_problem
from ..core.state import Quantity
from ..results import looking
from ..results.reactions import check_supports
from ..results.sums import Resultant
from .functionals import check_functional, functional
from .patch_columns import (
    BodyColumns,
    Part,
    SupportWork,
    checked_axes,
    parts_of,
    patch_columns,
    torque_columns,
)
from .rows import checked, numbers, present_name, read_records

# First words of columns that `symmetry` multiplies: sums over the model
_SUMS = (
    *("force_", "normal_", "tangential_", "radial_", "reaction_", "push_"),
    *("moment_", "torque_", "area_", "work_", "energy", "friction_work", "stored_"),
)


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
        UFL functional of the stored energy; of bodies on meshes of their own a list of
        one for each.
    more
        Functions without argument that give a number, by the name of their column.
        Every rank calls them, and rank 0 gives the number.
    patches
        Whether the area in contact, the centre of pressure and the largest pressure of
        each slave surface and each named pair are columns.
    axes
        Axes by name: in 3D a point and a direction, in 2D a point. Of each, the torque
        of contact on the slaves is a column.
    works
        Dirichlet condition, or a list of them, by the name of the support: its work on
        the bodies is a column.
    symmetry
        How many parts like the model make the whole: 2 for a half, 4 for a quarter.
        Forces, moments, torques, areas, works and energies are multiplied by it, all
        components alike, even where those of the parts would cancel. Pressures, gaps,
        centres, motions and `more` are not multiplied.

    Attributes
    ----------
    columns
        - ``time``: load factor; ``iterations``, ``halvings``: of the load step;
        - ``active``: integration points in contact; ``min_gap`` (length; NaN where
          the bodies are out of reach), ``max_pressure``: over these points,
          of dual multipliers over nodes;
        - ``force_ring_plate_x``, ...: contact force on the slave of a pair, by the names
          of slave and master, or else their tags (`Pair.label`). A pair without a name
          that you gave has the number of its slave surface: ``force_0_x``, ...; with
          several contacts the numbers continue, in the order of the problem's list. A
          slave with several masters has columns of each pair by its label, and those of
          their sum by its number;
        - ``normal_ring_plate_x``, ..., ``tangential_ring_plate_x``, ...: with friction the
          parts of that force; ``radial_ring_plate``: if contact is axisymmetric, see
          `results.Resultant`;
        - ``force_on_<name>_x``, ...: with ``pairs="all"`` the contact force on every
          tag and every body without one, named as in `results.meetings`;
        - ``reaction_<name>_x``, ...: `NonlinearProblem.reactions`;
        - of every rigid body by its name ``push_<name>_x``, ``moment_<name>_x``: force of
          contact on it and moment about its centre; ``translation_<name>_x``,
          ``rotation_<name>_x``: its motion; ``work_<name>``: its work on the slaves so
          far, by the mean of each step's forces. In 2D ``moment_<name>`` and
          ``rotation_<name>`` are numbers;
        - ``area_ring_plate``, ``centre_ring_plate_x``, ..., ``max_pressure_ring_plate``
          (`patches`; NaN where nothing presses), ``torque_<axis>_ring_plate`` (`axes`): of
          pairs and surfaces, as forces are; ``work_<name>`` (`works`): so far, by the mean
          of each step's forces at each node;
        - ``energy``; with friction ``friction_work``: what friction has taken so far,
          `Contact.friction_work`; of a penalty ``stored_normal``, of its friction and
          of elastic slip ``stored_tangential``: `Contact.stored_energy`; with adhesion
          ``adhesion_work``, what damage has taken so far, and ``stored_adhesion``. The
          work of the loads is the sum of these columns, to the error of the steps.
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
        energy: ufl.Form | Sequence[ufl.Form] | None = None,
        more: Mapping[str, Callable[[], float]] | None = None,
        patches: bool = False,
        axes: Mapping[str, Any] | None = None,
        works: Mapping[str, Any] | None = None,
        symmetry: float = 1.0,
    ) -> None:
        require_problem(problem)
        self.problem, self._comm = problem, problem.comm
        more = {} if more is None else more
        with together(self._comm):
            self.path = None if file is None else new_file(self._comm, file)
            supports = check_supports("reactions", reactions)
            if not (isinstance(more, Mapping) and all(map(callable, more.values()))):
                message = f"more must be functions by name of the column, not {more!r}"
                raise ContactError(message)
            works = check_supports("works", works)
            if not is_truth_value(patches):
                raise ContactError(f"patches must be True or False, not {patches!r}")
            turns = checked_axes(problem, axes)
            forms = check_functional("energy", energy)
            self.symmetry = positive("symmetry", symmetry)
        require_agreement(self._comm, symmetry=self.symmetry)
        self._more = dict(more)
        self._dim: int = problem.contact.u.function_space.mesh.geometry.dim
        # Label in the columns by the one that a pair had beside it
        self._other_names: dict[str, str] = {}
        parts = self._parts()
        self._works = SupportWork(problem, works)
        self._sources = list(self._own_columns(supports, forms, parts))
        if patches:
            self._sources += patch_columns(problem, parts)
        self._sources += torque_columns(turns, parts)
        last = self._works.values
        if works:
            self._sources.append((self._works.names, lambda: last(self._last())))
        own = [name for names, _ in self._sources for name in names]
        self._sums = [name for name in own if name.startswith(_SUMS)]
        self._set_columns(["time", "iterations", "halvings", *own, *self._more])
        self.rows: list[Any] = []
        self._awaited: set[str] = set()  # columns of records that nothing gives yet
        self._begun = False

    def __repr__(self) -> str:
        file = "no file" if self.path is None else f"file {str(self.path)!r}"
        columns = ", ".join(self.columns)
        return f"<History of {len(self)} records, {file}, columns {columns}>"

    def _set_columns(self, columns: Sequence[Any]) -> None:
        """Make rows of these columns from now on. Collective."""
        with together(self._comm):
            for i, name in enumerate(columns):
                text = isinstance(name, str) and name.isidentifier()
                if not text or iskeyword(name) or name.startswith("_"):
                    raise ContactError(
                        f"column {name!r} of a history is no name that an attribute may "
                        "have"
                    )
                if name in columns[:i]:
                    raise ContactError(f"column {name!r} of a history is there twice")
        self.columns: tuple[str, ...] = tuple(columns)
        self._row: Any = namedtuple("Row", columns)  # type: ignore[misc]

    def _last(self) -> dict[str, float] | None:
        """Return the last record of the model by name."""
        if not self.rows:
            return None
        return self._scaled(self.rows[-1]._asdict(), 1.0 / self.symmetry)

    def _scaled(self, row: dict[str, float], factor: float) -> dict[str, float]:
        """Multiply the sums of a record."""
        return row | {name: factor * row[name] for name in self._sums}

    def _parts(self) -> list[Part]:
        """List what has columns: slave surfaces, and the pairs of those that meet several
        masters. A surface of one pair goes by that pair's name, if it has one."""
        contact, found = self.problem.contact, list[Part]()
        for i, zone in enumerate(contact.zones):
            own = [(k, p) for k, p in enumerate(contact.pairs) if p.surface == i]
            label, other = str(i), own[0][1].label
            if len(own) == 1:
                if own[0][1].is_named and not zone.facets.meets_itself:
                    label, other = other, label
                self._other_names[other] = label
                own = []
            found.append((label, i, None, partial(contact.resultant, i, None)))
            for k, pair in own:
                master = zone.facets.master_tags.index(pair.master)
                found.append(
                    (pair.label, i, master, partial(contact.results.of_pair, k))
                )
        return found

    def _own_columns(
        self, supports: Mapping[str, Any], energy: Sequence[ufl.Form], parts: list[Part]
    ) -> Iterator[tuple[list[str], Callable[[], Any]]]:
        """Yield names of columns with the function that finds their values."""
        contact: Any = self.problem.contact
        axes = "xyz"[: self._dim]
        zones = contact.zones
        yield ["active", "min_gap", "max_pressure"], self._counts
        for label, i, _, find in parts:
            kinds = ["force"] + ["normal", "tangential"] * zones[i].frictional
            names = [f"{kind}_{label}_{x}" for kind in kinds for x in axes]
            yield names, partial(parts_of, find, kinds)
        for label, find in contact.results.parts_of_all():
            names = [f"force_on_{label}_{x}" for x in axes]
            yield names, partial(parts_of, find, ["force"])
        if supports:
            names = [f"reaction_{name}_{x}" for name in supports for x in axes]
            yield names, lambda: np.hstack([*self.problem.reactions(supports).values()])
        for label, _, _, find in parts if contact.system.axisymmetric else ():
            yield [f"radial_{label}"], partial(parts_of, find, ["radial"])
        bodies = BodyColumns(contact)
        yield bodies.names, lambda: bodies.values(self._last())
        if energy:
            yield ["energy"], functional(energy, self._comm)
        frictional = any(zone.frictional for zone in zones)
        if frictional:
            none = {"friction_work": 0.0}
            yield ["friction_work"], lambda: (
                (self._last() or none)["friction_work"] + contact.friction_work()
            )
        of = [one.surfaces.options for one in contact.contacts]
        penalty = any(isinstance(one.method, Penalty) for one in of)
        elastic = penalty and frictional or any(one.has_elastic_slip for one in of)
        for part in ["normal"] * penalty + ["tangential"] * elastic:
            yield [f"stored_{part}"], partial(contact.stored_energy, part)
        bonds = [one.bond for one in contact.contacts if one.bond is not None]
        if bonds:
            yield ["adhesion_work"], lambda: sum(one.dissipated() for one in bonds)
            yield ["stored_adhesion"], lambda: sum(one.stored() for one in bonds)

    def _counts(self) -> list[float]:
        counts = self.problem.contact.statistics
        gap = counts.min_gap if counts.hits else np.nan
        return [counts.active_points, gap, counts.max_pressure]

    def include(self, more: Mapping[str, Callable[[], float]]) -> None:
        """Add functions to `more`, or replace those with the same names. Collective.

        Raises
        ------
        ContactError
            If columns would be added to a history that has records.
        """
        given = self._more.keys() | self._awaited
        new = [name for name in more if name not in given]
        fault = f"a history that has records takes no more columns: {list(more)}"
        raise_everywhere(self._comm, fault if self.rows and new else None)
        self._set_columns([*self.columns, *new])
        self._more.update(more)
        self._awaited -= more.keys()

    def require_columns(self) -> None:
        """Raise where nothing gives columns that the records go on from have.
        Collective."""
        fault = None
        if self._awaited:
            fault = (
                f"the records that the history goes on from have {sorted(self._awaited)}, "
                "which nothing gives here: go on as they began, with the same control= "
                "or stabilize="
            )
        raise_everywhere(self._comm, fault)

    def quantities(self) -> Iterator[Quantity]:
        """Yield what the next record goes on from besides the last one."""
        yield from self._works.quantities()

    def record(self, time: float, iterations: int = 0, halvings: int = 0) -> None:
        """Add the present state, after a solve and before `Contact.advance`.

        Collective.

        Raises
        ------
        ContactError
            If the file cannot be written.
        """
        self.require_columns()
        with together(self._comm):
            row = numbers(
                {"time": time, "iterations": iterations, "halvings": halvings}
            )
        with looking.at(self.problem.contact.zones):
            for names, values in self._sources:
                row |= zip(names, np.atleast_1d(values()).tolist())
        row = self._scaled(row, self.symmetry)
        more = {name: number() for name, number in self._more.items()}
        with together(self._comm):
            if self._comm.rank == 0:  # it alone evaluates and writes them
                row |= numbers(more)
        self.rows.append(self._row(**self._comm.bcast(row, root=0)))
        self._write(self.rows[-1:] if self._begun else self.rows)

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
        name = present_name(column, self.columns, self._other_names)
        return np.array([getattr(row, name) for row in self.rows])

    def vectors(self, name: str) -> Array:
        """Columns of a vector over all records, such as ``"force_0"``, (n, d)."""
        return np.column_stack([self[f"{name}_{x}"] for x in "xyz"[: self._dim]])

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
            If the file is of another problem, or there is none.
        """
        found: list[list[float]] = []
        with together(self._comm):
            if not is_real_number(until):
                raise ContactError(f"until must be a load factor, not {until!r}")
            if rows is not None:
                found = checked(rows, len(self.columns))
            elif self._comm.rank == 0:
                found = read_records(self.path, self.columns)
        kept = [self._row(*values) for values in self._comm.bcast(found, root=0)]
        self.rows = [row for row in kept if row.time <= until * (1.0 + 1e-12)]
        self._works.begin_here()
        self._begin_anew()

    def go_on(self, columns: Sequence[str], rows: Sequence[Sequence[float]]) -> None:
        """Go on from records whose columns may be more than there are here: those wait
        until they are included. Collective."""
        self._awaited = set(columns[len(self.columns) :])
        self._set_columns(columns)
        self.rows = [self._row(*row) for row in rows]
        self._begin_anew()

    def _begin_anew(self) -> None:
        """Write the file anew with the records. Collective."""
        self._begun = False
        self._write(self.rows)

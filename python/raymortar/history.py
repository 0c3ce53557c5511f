"""Forces, counts and energies over a load path, in a CSV file."""

from __future__ import annotations

import csv
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from . import compat
from .compat import Array
from .errors import raise_everywhere, writing
from .problem import NonlinearProblem

_COUNTS = ("time", "iterations", "halvings", "active", "min_gap", "max_pressure")


class History:
    """What happened at each accepted step, kept and written to a CSV file. Collective.

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
          ``normal_0_x``, ... and ``tangential_0_x``, ...;
        - ``reaction_<name>_x``, ...: `NonlinearProblem.reactions`;
        - ``energy``; with friction ``friction_work``: the work that tangential
          tractions have taken so far. With the elastic penalty that includes what its
          springs store.
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
        problem: NonlinearProblem,
        file: str | Path | None = None,
        reactions: Mapping[str, Any] | None = None,
        energy: ufl.Form | None = None,
        more: Mapping[str, Callable[[], float]] | None = None,
    ) -> None:
        self.problem, self._comm = problem, problem.comm
        self.path = None if file is None else Path(file)
        self._reactions, self._more = dict(reactions or {}), dict(more or {})
        self._energy = None if energy is None else compat.form(energy)
        self.columns: tuple[str, ...] = tuple(self._names())
        self._row: Any = namedtuple("Row", self.columns)  # type: ignore[misc]
        self.rows: list[Any] = []
        self._begun = False

    def _names(self) -> list[str]:
        """Columns, in the order of `_values`."""
        axes = "xyz"[: self.problem.contact.u.function_space.mesh.geometry.dim]
        parts = ["force"] + ["normal", "tangential"] * self._frictional
        zones = range(len(self.problem.contact.zones))
        vectors = [f"{part}_{zone}" for zone in zones for part in parts]
        vectors += [f"reaction_{name}" for name in self._reactions]
        names = [*_COUNTS, *(f"{v}_{x}" for v in vectors for x in axes)]
        names += ["energy"] * (self._energy is not None)
        return names + ["friction_work"] * self._frictional + list(self._more)

    @property
    def _frictional(self) -> bool:
        return self.problem.contact.friction is not None

    def record(self, time: float, iterations: int = 0, halvings: int = 0) -> None:
        """Add the present state, after a solve and before `Contact.advance`.

        Collective.

        Raises
        ------
        ContactError
            If the file cannot be written.
        """
        values = self._comm.bcast(self._values(time, iterations, halvings), root=0)
        self.rows.append(self._row(*values))
        self._write(self.rows[-1:] if self._begun else self.rows)

    def _values(self, time: float, iterations: int, halvings: int) -> list[float]:
        contact = self.problem.contact
        counts = contact.statistics
        gap = counts.min_gap if counts.hits else np.nan
        values: list[Any] = [time, iterations, halvings, counts.active_points, gap]
        values.append(counts.max_pressure)
        for zone in range(len(contact.zones)):
            force = contact.resultant(zone)
            values.extend(force.force)
            if self._frictional:
                values.extend((*force.normal, *force.tangential))
        if self._reactions:
            for reaction in self.problem.reactions(self._reactions).values():
                values.extend(reaction)
        if self._energy is not None:
            values.append(self._comm.allreduce(fem.assemble_scalar(self._energy)))
        if self._frictional:
            before = self.rows[-1].friction_work if self.rows else 0.0
            values.append(before + contact.friction_work())
        return [float(v) for v in (*values, *(f() for f in self._more.values()))]

    def _write(self, rows: Sequence[Sequence[float]]) -> None:
        """Add rows to the file, or begin it with them. Collective."""
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

        The file is then written anew with them. A line that was cut short, as the run
        before was, is left out.

        Parameters
        ----------
        rows
            Records, as of `rows`; None: those of the file, read on rank 0.
        until
            Leave out what is later than this load factor, that of the restart.

        Raises
        ------
        ContactError
            If the file is none of this problem's, or there is none.
        """
        found, problem = [list(values) for values in rows or ()], None
        if rows is None and self._comm.rank == 0:
            found, problem = self._read()
        raise_everywhere(self._comm, problem)
        kept = [self._row(*values) for values in self._comm.bcast(found, root=0)]
        self.rows = [row for row in kept if row.time <= until * (1.0 + 1e-12)]
        self._begun = False
        self._write(self.rows)

    def _read(self) -> tuple[list[list[float]], str | None]:
        """Whole records of the file, or what is wrong with it."""
        if self.path is None:
            return [], "a history without a file has none to go on from"
        try:
            text = self.path.read_text(encoding="utf-8")
            # What a run was cut short in has no end
            head, *lines = csv.reader(text.split("\n")[:-1])
            if tuple(head) != self.columns:
                return [], f"{self.path} has other columns than this history"
            return [[float(x) for x in values] for values in lines], None
        except (OSError, ValueError) as error:
            return [], f"{self.path} cannot be read: {error}"

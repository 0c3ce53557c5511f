"""Checkpoints of a path: files from which any number of ranks go on."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from dolfinx.fem import Function, FunctionSpace

from .. import versions
from ..arguments import new_file
from ..core import compat
from ..core.compat import Array
from ..core.discretization.joined import parts_of
from ..core.errors import (
    ContactError,
    is_real_number,
    raise_everywhere,
    require_agreement,
    together,
)
from ..core.options.methods import AugmentedLagrangian
from ..core.problem import CoupledProblem
from ..core.solvers.solver import require_problem
from ..core.state import Owners, Quantity, State, of_function
from . import facet_tables
from .history import History
from .output import by_mesh
from .patch_columns import rigid_bodies
from .settings import settings
from .tables import Table, as_list, read_head, read_tables, write_tables

# Of nodes of the same mesh, over its size: a mesh may be made anew by arithmetic
SAME_PLACE = 1e-10


class Checkpoint:
    """Writes the state of a path to a file, and goes back to it in another run.

    The file has all unknowns, the multipliers, the accepted step with the history of
    friction, rigid bodies, the coefficients of contact, and Functions of yours. Another
    run makes the same problem on the same mesh, and may have another number of ranks or
    another partition. Collective.

    Parameters
    ----------
    problem
        Problem that is solved.
    file
        Path of the file. `write` replaces an older one once the new one is whole.
    more
        Further Functions on the meshes of the displacements, such as plastic strains.
    history
        `History` whose records the file has too; `read` lets it go on from these.

    Raises
    ------
    ContactError
        For Functions on another mesh, or in a space whose dofs depend on the partition:
        edge elements, and continuous ones above degree 2.

    Examples
    --------
    >>> checkpoint = Checkpoint(problem, "press.chk", more=[plastic], history=history)
    >>> begin = checkpoint.read() if checkpoint.exists() else 0.0
    >>> steps = round(40 * (1.0 - begin))
    >>> for step in LoadSteps(solver, apply, steps, path=(begin, 1.0), history=history):
    ...     checkpoint.write(step.factor)
    """

    def __init__(
        self,
        problem: CoupledProblem,
        file: str | Path,
        more: Sequence[Function] = (),
        history: History | None = None,
    ) -> None:
        require_problem(problem)
        self.problem, self.history, self._comm = problem, history, problem.comm
        self._bodies = rigid_bodies(problem.contact.zones)
        displacements = parts_of(problem.contact.u)
        self._meshes = [u.function_space.mesh for u in displacements]
        with together(self._comm):
            self.path = new_file(self._comm, file)
            if history is not None and not isinstance(history, History):
                raise ContactError(f"history must be a History, not {history!r}")
            by_mesh(more, self._meshes)  # or it raises
        self._more = list(more)
        require_agreement(
            self._comm, file=str(file), more=len(more), history=history is not None
        )
        with together(self._comm):
            for k, mesh in enumerate(self._meshes):
                if np.any(versions.cells_as_given(mesh) < 0):
                    raise ContactError(f"mesh {k} does not know the order of its cells")
            for one in filter(_is_by_cell, self._quantities()):
                if versions.turns_with_cells(one.by):
                    text = "is in a space whose dofs depend on the partition"
                    raise ContactError(f"{one.name} {text}")

    def __repr__(self) -> str:
        return f"<Checkpoint {str(self.path)!r} of {self.problem!r}>"

    def exists(self) -> bool:
        """Whether there is a file. Collective."""
        return bool(self._comm.bcast(self.path.is_file(), root=0))

    def _quantities(self) -> list[Quantity]:
        """All that the file has: what is set for a step, the state, what a history goes
        on from, Functions."""
        found = [
            *settings(self.problem, self._bodies),
            *self.problem.contact.states.quantities(),
        ]
        if self.history is not None:
            found += self.history.quantities()
        for k, f in enumerate(self._more):
            if not any(_is_of(f, one) for one in found):  # more than once
                found.append(of_function(f"more[{k}] {f.name}", f))
        return found

    # Writing

    def write(self, time: float) -> None:
        """Write the present state, after a step has been accepted. Collective.

        Parameters
        ----------
        time
            Load factor, which `read` returns.

        Raises
        ------
        ContactError
            If the file cannot be written, or if time is no number.
        """
        with together(self._comm):
            if not (is_real_number(time) and np.isfinite(time)):
                raise ContactError(f"time must be a load factor, not {time!r}")
        self.problem.contact.unknowns.pull()
        found = self._quantities()
        tables = [
            *self._by_cell(found),
            *facet_tables.written(self.problem.contact.u, found),
        ]
        alike = ((one.name, one.read()) for one in found if one.by is None)
        head = {
            "time": float(time),
            "bodies": [body.name for body in self._bodies],
            "contacts": [
                {"slave": list(map(str, one.surfaces.tags)), "law": _law(one)}
                for one in self.problem.contact.contacts
            ],
            "arrays": {name: as_list(of) for name, of in alike if of is not None},
        }
        if self.history is not None:
            rows = [list(row) for row in self.history.rows]
            head["history"] = {"columns": list(self.history.columns), "rows": rows}
        write_tables(self._comm, self.path, head, tables)

    def _by_cell(self, quantities: Iterable[Quantity]) -> Iterator[Table]:
        """Yield nodes of the cells of each mesh, by which another mesh is known, and
        arrays by cell. Collective."""
        found = []
        for k, mesh in enumerate(self._meshes):
            nodes = compat.geometry_dofmap(mesh)[: versions.owned_cells(mesh)]
            x = mesh.geometry.x[nodes].reshape(len(nodes), 3 * nodes.shape[1])
            found.append((f"mesh {k}", mesh, x))
        for one in filter(_is_by_cell, quantities):
            array = one.read()
            if array is not None:
                values = versions.values_by_cell(one.by, array)
                found.append((one.name, one.by.mesh, values))
        for name, mesh, values in found:
            numbers = versions.cells_as_given(mesh)
            yield Table(name, self._comm.allreduce(len(numbers)), numbers, values)

    # Reading

    def read(self) -> float:
        """Go back to the state of the file; return its load factor. Collective.

        Raises
        ------
        ContactError
            If there is no such file, if it is cut short, or if it is of another mesh,
            law, other fields, bodies or columns; nothing is then changed.
        """
        contact = self.problem.contact
        head = read_head(self._comm, self.path)
        there = {one["name"]: one for one in head["tables"]}
        found = [
            one
            for one in self._quantities()
            # A state may be older than who has extended it, and have what is to come
            if not (_is_by_cell(one) and Owners.has(one.name))
            or (one.name in there and one.read() is not None)
        ]
        tables = list(self._by_cell(found))
        raise_everywhere(self._comm, self._fault_of(head, tables, found))
        known = [there[table.name] for table in tables]
        springs = [
            there[one.name]
            for one in filter(facet_tables.is_by_facet, found)
            if one.name in there
        ]
        of = {**head, "tables": known + springs}
        numbers = [table.number for table in tables]
        numbers += [np.arange(table["rows"]) for table in springs]
        rows = read_tables(self._comm, self.path, of, numbers)
        raise_everywhere(self._comm, self._other_mesh(tables, rows))
        state = State((name, np.array(of)) for name, of in head["arrays"].items())
        held = dict(zip((one["name"] for one in springs), rows[len(tables) :]))
        on_facets = dict(facet_tables.found(contact.u, found, held))
        other = next((name for name, of in on_facets.items() if of is None), None)
        text = self._says(f"{other}: the slave surface has other facets")
        raise_everywhere(self._comm, None if other is None else text)
        state.update((name, of) for name, of in on_facets.items() if of is not None)
        of_cells = rows[len(self._meshes) :]
        for one, values in zip(filter(_is_by_cell, found), of_cells):
            f = Function(one.by)
            versions.set_by_cell(f, values)
            state[one.name] = f.x.array
        own = {one.name for one in contact.states.quantities()}
        for one in found:
            if one.name not in own:
                one.write(state.pop(one.name, None))
        contact.restore(state)
        waiting = contact.states.owners.waiting
        for table in head["tables"]:
            if Owners.has(table["name"]) and table["name"] not in state:
                waiting[table["name"]] = partial(self._late, head, table)
        contact.states.owners.claim()
        if contact.system.updates == 0:
            contact.update()
        self.problem.evaluate()
        if self.history is not None:
            saved = head["history"]
            self.history.go_on(saved["columns"], saved["rows"])
        return float(head["time"])

    def _late(self, head: Any, table: Any, one: Quantity) -> Array:
        """Read an array by cell whose owner has been made after the others were read.
        Collective."""
        f, numbers = Function(one.by), [versions.cells_as_given(one.by.mesh)]
        of = {**head, "tables": [table]}
        versions.set_by_cell(f, read_tables(self._comm, self.path, of, numbers)[0])
        return f.x.array

    def _says(self, text: str) -> str:
        return f"{self.path} is of another problem: {text}"

    def _fault_of(
        self, head: Any, tables: Sequence[Table], quantities: Iterable[Quantity]
    ) -> str | None:
        """Why the file is none of this problem, if so; rows are not looked at."""
        contacts = zip(head["contacts"], self.problem.contact.contacts)
        for k, (known, one) in enumerate(contacts):
            law, own = known.get("law"), _law(one)
            if law and own and law != own:
                return self._says(f"its contact[{k}] has {law}, here is {own}")
        names = {table.name for table in tables}
        saved = [
            one
            for one in head["tables"]
            if one["name"] in names
            or not (one["name"].startswith("springs") or Owners.has(one["name"]))
        ]
        for k, table in enumerate(tables):
            name = saved[k]["name"] if k < len(saved) else None
            if name != table.name:
                return self._says(f"it has {name or 'nothing'}, here is {table.name}")
            there = saved[k]["rows"], saved[k]["width"]
            here = table.rows, table.values.shape[1]
            if there != here:
                return self._says(
                    f"its {name} has {there[0]} cells with {there[1]} values, here are "
                    f"{here[0]} with {here[1]}"
                )
        if len(saved) > len(tables):
            return self._says(f"it has {saved[len(tables)]['name']}, which is not here")
        bodies = [body.name for body in self._bodies]
        if bodies != head["bodies"]:
            return self._says(
                f"its rigid bodies are {head['bodies']}, here are {bodies}"
            )
        for one in quantities:
            array = head["arrays"].get(one.name)
            if one.by is None and (array is None or one.fault is not None):
                fault = one.fault_of(None if array is None else np.array(array))
                if fault is not None:
                    return self._says(fault)
        if self.history is not None:
            return self._fault_of_columns(head.get("history", {}).get("columns", []))
        return None

    def _fault_of_columns(self, columns: Sequence[str]) -> str | None:
        """Why records do not fit. Further columns at their end wait for what will
        include them: `LoadSteps` does."""
        assert self.history is not None
        own = self.history.columns
        if tuple(columns[: len(own)]) != own:
            return self._says(f"its history has the columns {list(columns)}")
        return None

    def _other_mesh(
        self, tables: Sequence[Table], found: Sequence[Array]
    ) -> str | None:
        """Name the first cell of a mesh that is elsewhere in the file, if any is."""
        for table, x in zip(tables[: len(self._meshes)], found):
            size = np.abs(table.values).max(initial=0.0)
            off = np.abs(table.values - x).max(axis=1, initial=0.0) > SAME_PLACE * size
            if off.any():
                cell = table.number[off].min()
                return self._says(f"cell {cell} of {table.name} is at another place")
        return None


def _law(contact: Any) -> str | None:
    """Say what the values of a multiplier mean, if there is one."""
    method = contact.method
    if not isinstance(method, AugmentedLagrangian):
        return None
    dual = "multiplier='dual' and " * method.is_dual
    return f"{dual}condition={method.condition!r}"


def _is_by_cell(one: Quantity) -> bool:
    return isinstance(one.by, FunctionSpace)


def _is_of(f: Function, one: Quantity) -> bool:
    """Whether an array belongs to a Function."""
    if not (_is_by_cell(one) and one.by.mesh is f.function_space.mesh):
        return False
    array = one.read()
    return array is not None and np.shares_memory(array, f.x.array)

"""Checkpoints of a path: files from which any number of ranks go on."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from dolfinx.fem import Function, FunctionSpace

from .. import compat
from ..compat import Array
from ..discretization.joined import parts_of
from ..errors import (
    ContactError,
    is_real_number,
    new_file,
    raise_everywhere,
    require_agreement,
    together,
)
from ..interface.coefficients import SAME, PairCoefficients
from ..interface.present import JointState
from ..options.methods import AugmentedLagrangian
from ..problem import CoupledProblem
from ..solvers.solver import require_problem
from .history import History
from .output import by_mesh
from .patch_columns import rigid_bodies
from .spring_tables import found_springs, of_other_facets, written
from .tables import Table, as_list, read_head, read_tables, write_tables

# Of nodes of the same mesh, over its size: a mesh may be made anew by arithmetic
SAME_PLACE = 1e-10


@dataclass
class _Field:
    """Values of a space, as the array of this rank's dofs, ghosts included."""

    name: str
    V: FunctionSpace
    array: Array


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
                if np.any(compat.cells_as_given(mesh) < 0):
                    raise ContactError(f"mesh {k} does not know the order of its cells")
            for field in self._fields(problem.contact.state()):
                if compat.turns_with_cells(field.V):
                    text = "is in a space whose dofs depend on the partition"
                    raise ContactError(f"{field.name} {text}")

    def __repr__(self) -> str:
        return f"<Checkpoint {str(self.path)!r} of {self.problem!r}>"

    def exists(self) -> bool:
        """Whether there is a file. Collective."""
        return bool(self._comm.bcast(self.path.is_file(), root=0))

    def _fields(self, state: Any) -> Iterator[_Field]:
        """Yield what the file has by cell: the unknowns, a state, Functions."""
        contact = self.problem.contact
        unknowns, first = contact.unknowns, state.parts[0]
        for k, f in enumerate(unknowns.functions):
            yield _Field(f"unknown[{k}] {f.name}", f.function_space, f.x.array)
        for k, one in enumerate(unknowns.displacements):
            own = first.u_old[unknowns.u_places(k)]
            yield _Field(f"accepted[{k}] {one.given.name}", one.u.function_space, own)
        for k, (part, of_part) in enumerate(zip(contact.parts, state.parts)):
            if part.surfaces.multiplier is not None:
                f = part.surfaces.multiplier
                yield _Field(f"multiplier {k}", f.function_space, f.x.array)
            if of_part.slip is not None:
                yield _Field(f"slip {k}", part.surfaces.scalar, of_part.slip)
            if of_part.augmentation is not None:
                own = of_part.augmentation
                yield _Field(f"augmentation {k}", part.surfaces.scalar, own)
        for k, f in enumerate(self._more):
            yield _Field(f"more[{k}] {f.name}", f.function_space, f.x.array)

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
        state = self.problem.contact.state()
        springs = written(self.problem.contact, state)
        tables = [*self._by_cell(self._fields(state)), *springs]
        head = {
            "time": float(time),
            "steps": self.problem.steps_accepted,
            "bodies": [
                {
                    "name": b.name,
                    "moved": as_list(b.cpp.moved),
                    "turned": as_list(b.cpp.turned),
                }
                for b in self._bodies
            ],
            "contacts": [
                {
                    "gamma": one.gamma if is_real_number(one.gamma) else None,
                    "scale": one.gamma_scale,
                    "soft": one.assembly.gamma_is_soft,
                    # By pair; none of a number and of other coefficients
                    "tables": [as_list(t) for t in getattr(one.gamma, "tables", ())]
                    if one.assembly.gamma_is_soft
                    else None,
                    "law": _law(one),
                    "motions": [as_list(motion) for motion in part.old_motions],
                    "freedoms": [as_list(values) for values in part.freedoms],
                }
                for one, part in zip(self.problem.contact.contacts, state.parts)
            ],
        }
        if self.history is not None:
            rows = [list(row) for row in self.history.rows]
            head["history"] = {"columns": list(self.history.columns), "rows": rows}
        write_tables(self._comm, self.path, head, tables)

    def _by_cell(self, fields: Iterable[_Field]) -> Iterator[Table]:
        """Yield nodes of the cells of each mesh, by which another mesh is known, and
        fields by cell. Collective."""
        found = []
        for k, mesh in enumerate(self._meshes):
            nodes = compat.geometry_dofmap(mesh)[: compat.owned_cells(mesh)]
            x = mesh.geometry.x[nodes].reshape(len(nodes), 3 * nodes.shape[1])
            found.append((f"mesh {k}", mesh, x))
        for f in fields:
            found.append((f.name, f.V.mesh, compat.values_by_cell(f.V, f.array)))
        for name, mesh, values in found:
            numbers = compat.cells_as_given(mesh)
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
        contact, state = self.problem.contact, self.problem.contact.state()
        head = read_head(self._comm, self.path)
        fields = list(self._fields(state))
        tables = list(self._by_cell(fields))
        springs = head["tables"][len(tables) :]
        raise_everywhere(self._comm, self._fault_of(head, tables))
        numbers = [table.number for table in tables]
        numbers += [np.arange(table["rows"]) for table in springs]
        found = read_tables(self._comm, self.path, head, numbers)
        raise_everywhere(self._comm, self._other_mesh(tables, found))
        held = dict(zip((one["name"] for one in springs), found[len(tables) :]))
        other = of_other_facets(self.problem.contact, held)
        text = f"slave surface {other} has other facets"
        raise_everywhere(self._comm, None if other is None else self._says(text))
        kept = list(found_springs(self.problem.contact, held))

        # Arrays of the user's Functions, and of the copy of the state
        for field, values in zip(fields, found[len(self._meshes) :]):
            f = Function(field.V)
            compat.set_by_cell(f, values)
            field.array[:] = f.x.array
        arrays = {field.name: field.array for field in fields}
        for body, known in zip(self._bodies, head["bodies"]):
            body.cpp.moved, body.cpp.turned = known["moved"], known["turned"]
        self._set_gamma(head["contacts"])
        contact.restore(self._state(state, arrays, kept, head["contacts"]))
        if contact.updates == 0:
            contact.update()
        self.problem.evaluate()
        self.problem.steps_accepted = int(head["steps"])
        self.problem.restored = tuple(self._more)
        if self.history is not None:
            self.history.resume(head["history"]["rows"])
        return float(head["time"])

    def _state(
        self, state: Any, arrays: dict[str, Array], kept: Any, known: Any
    ) -> Any:
        """A state of the contacts with the values of the file."""
        contact = self.problem.contact
        unknowns = contact.unknowns
        unknowns.pull()
        u_old = np.empty_like(state.parts[0].u_old)
        for k, one in enumerate(unknowns.displacements):
            u_old[unknowns.u_places(k)] = arrays[f"accepted[{k}] {one.given.name}"]
        parts, kept = [], iter(kept)
        for k, (part, of_part) in enumerate(zip(state.parts, known)):
            springs = [next(kept) for _ in part.traction_old]
            motions = [np.array(m).reshape(-1, 15) for m in of_part["motions"]]
            new = replace(
                part,
                u=unknowns.u.x.array.copy(),
                u_old=u_old,
                multiplier=arrays.get(f"multiplier {k}"),
                traction_old=[one.nodal for one in springs],
                unknowns=None if part.unknowns is None else unknowns.values(),
                old_motions=motions,
                freedoms=[np.array(values) for values in of_part["freedoms"]],
                slip=arrays.get(f"slip {k}"),
                augmentation=arrays.get(f"augmentation {k}"),
                spring_points=[one.points for one in springs],
            )
            parts.append(new)
        return parts[0] if len(parts) == 1 else JointState(tuple(parts))

    def _set_gamma(self, known: Any) -> None:
        """Set the coefficients: a path may have changed them, and the automatic ones
        differ by rounding with the partition. Collective."""
        for one, saved in zip(self.problem.contact.contacts, known):
            factor = saved["scale"] / one.gamma_scale
            if saved.get("tables") and isinstance(one.gamma, PairCoefficients):
                # No multiple of the automatic ones
                tables = [np.array(table) for table in saved["tables"]]
                one.set_gamma(PairCoefficients(one.gamma.interfaces, tables))
            elif saved["gamma"] is not None:
                one.set_gamma(saved["gamma"])
            elif isinstance(one.gamma, PairCoefficients) and abs(factor - 1.0) > SAME:
                one.set_gamma(factor * one.gamma)
            if saved.get("soft"):
                one.assembly.soft_gamma = one.gamma

    def _says(self, text: str) -> str:
        return f"{self.path} is of another problem: {text}"

    def _fault_of(self, head: Any, tables: Sequence[Table]) -> str | None:
        """Why the file is none of this problem, if so; rows are not looked at."""
        contacts = zip(head["contacts"], self.problem.contact.contacts)
        for k, (known, one) in enumerate(contacts):
            law, own = known.get("law"), _law(one)  # older files have none
            if law and own and law != own:
                return self._says(f"its contact[{k}] has {law}, here is {own}")
        saved = [one for one in head["tables"] if not one["name"].startswith("springs")]
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
        theirs = [body["name"] for body in head["bodies"]]
        if bodies != theirs:
            return self._says(f"its rigid bodies are {theirs}, here are {bodies}")
        if self.history is not None:
            columns = head.get("history", {}).get("columns")
            if columns != list(self.history.columns):
                return self._says(f"its history has the columns {columns}")
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
    sides = " and exchanged sides" * bool(contact.surfaces.exchanged)
    return f"{dual}condition={method.condition!r}{sides}"

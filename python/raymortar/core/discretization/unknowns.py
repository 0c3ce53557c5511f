"""Unknowns of a problem: the displacement alone, or with further fields.

Contact works on a displacement with its own space, which is a copy if the user's is a
part of a mixed Function. It knows the index of each of its dofs among the
unknowns.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, NamedTuple

from mpi4py import MPI

import numpy as np
import numpy.typing as npt
from dolfinx.fem import Function, FunctionSpace

from .. import compat
from ..compat import Array, Mask
from ..errors import ContactError, described
from .joined import (
    Displacement,
    JoinedDisplacement,
    Places,
    check_given,
    places_of,
    unrolled,
)

# Relative difference of a value between ranks that share a dof: they may find it in
# different cells. Smaller increments count as zero
ROUNDING = 8.0 * float(np.finfo(float).eps)


@dataclass(frozen=True)
class Field:
    """Unknowns with one unit, whose residuals are measured together.

    Attributes
    ----------
    name
        For messages.
    rows
        Indices of its owned dofs among the owned unknowns of this rank, (n,).
    local
        The same among all local unknowns, ghosts included.
    """

    name: str
    rows: Places
    local: Places


@dataclass(frozen=True)
class _Sorted:
    """Dirichlet conditions, their identities, the conditions of each Function, and
    whether they prescribe each owned unknown."""

    bcs: tuple[Any, ...]
    ids: tuple[int, ...]
    by_function: list[list[Any]]
    owned: npt.NDArray[np.bool_]


class Lacking(NamedTuple):
    """Prescribed minus present values of the unknowns, 0 where nothing is prescribed.

    Attributes
    ----------
    fixed
        Whether conditions prescribe each owned unknown.
    owned
        Of the owned unknowns.
    increment, of_u
        Of the local unknowns and of the local displacements, without rounding.
    values
        Present values of the local unknowns.
    """

    fixed: Mask
    owned: Array
    increment: Array
    of_u: Array
    values: Array


class Unknowns:
    """The unknowns that a user solves for, one Function or several.

    *Local unknowns* are the ghosted arrays of all Functions, one after the other;
    *owned unknowns* the owned parts of these. Both are unrolled.

    Parameters
    ----------
    given
        Displacement: a Function on a space of its own, or a part of a mixed one such as
        ``w.sub(0)``; or a list of them, each on its own mesh.

    Attributes
    ----------
    u
        Displacement on a space of its own: the user's, or a copy.
    displacements
        The displacement of each mesh.
    is_plain
        Whether the displacement of one Function is the only unknown.
    functions
        What is solved for. Until a problem is made, the displacement as it was given.
    starts, owned_starts
        First local and first owned unknown of each Function, then their number.
    u_local, u_owned
        Local unknowns of the displacement's local dofs, and owned ones of its owned dofs.
    """

    def __init__(self, given: Function | Sequence[Function]) -> None:
        several = list(given) if isinstance(given, (list, tuple)) else [given]
        check_given(several)
        self.displacements = [Displacement(f, k) for k, f in enumerate(several)]
        self.functions: list[Function] = several
        own = [d.u for d in self.displacements]
        self.u: Any = own[0] if len(own) == 1 else JoinedDisplacement(own)
        # Spaces of the functions, once a problem has set them
        self.spaces: list[FunctionSpace] | None = None
        if all(d.component is None for d in self.displacements):
            self.spaces = [f.function_space for f in several]
        self._update()
        # The last conditions, which each iteration asks for
        self._sorted: _Sorted | None = None
        self.pull()

    @property
    def comm(self) -> MPI.Comm:
        """Communicator of the mesh."""
        return self.u.function_space.mesh.comm

    @property
    def name(self) -> str:
        """Name of the displacement, for messages."""
        return ", ".join(d.given.name for d in self.displacements)

    @property
    def only(self) -> Displacement:
        """The displacement, of one mesh."""
        if len(self.displacements) > 1:
            raise ContactError(
                f"the displacements {self.name} are on meshes of their own: this is "
                "for bodies on one mesh"
            )
        return self.displacements[0]

    @property
    def is_known(self) -> bool:
        """Whether all unknowns are known, the other parts of mixed Functions among
        them."""
        return not any(
            compat.element_info(f.function_space).is_sub_space for f in self.functions
        )

    def solve_for(self, functions: Sequence[Function], settled: bool) -> None:
        """Take what a problem solves for."""
        places = [d.place_among(functions) for d in self.displacements]
        if None in places:
            raise ContactError(self.absence(functions))
        same = len(functions) == len(self.functions) and all(
            compat.same_values(f, g) for f, g in zip(functions, self.functions)
        )
        if settled and not same:
            raise ContactError(
                "contact is of a problem with other unknowns: make another Contact"
            )
        for d, place in zip(self.displacements, places):
            assert place is not None
            d.at = place
        self.functions = list(functions)
        self.spaces = [f.function_space for f in functions]
        self._update()
        self._sorted = None

    def _update(self) -> None:
        """Find what the present functions determine."""
        maps = [compat.unknowns_of(f) for f in self.functions]
        owned = [bs * index_map.size_local for index_map, bs in maps]
        self._arrays = [f.x.array for f in self.functions]
        self.starts = np.cumsum([0, *map(len, self._arrays)])
        self.owned_starts = np.cumsum([0, *owned])
        # Whether the displacement of one Function is the only unknown
        one = len(self.functions) == 1
        moved = self.displacements
        self.is_plain = one and moved[0].component is None
        self.u_local = self._places(self.starts, [len(d.dofs) for d in moved])
        self.u_owned = self._places(self.owned_starts, [d.size_owned for d in moved])

    def absence(self, functions: Sequence[Function]) -> str:
        """A message for Functions of which none has the displacement."""
        names = ", ".join(f.name for f in functions)
        return (
            f"the displacement {self.name} that Contact was given is none of the "
            f"unknowns [{names}], nor a part of one"
        )

    # Places of unknowns

    def _places(self, starts: Places, sizes: Sequence[int]) -> Places | slice:
        """Unknowns of the first dofs of each displacement, in the order of `u`'s
        dofs."""
        if self.is_plain:
            return slice(0, sizes[0])
        places = np.empty(sum(sizes), dtype=np.int64)
        for k, (d, n) in enumerate(zip(self.displacements, sizes)):
            places[self.u_places(k)[:n]] = d.dofs[:n] + starts[d.at]
        return places

    def u_places(self, k: int) -> Places:
        """Index in `u` of each local dof of the k-th displacement."""
        _, bs = compat.unknowns_of(self.displacements[k].u)
        blocks = places_of(self.u, k)
        if blocks is None:
            return np.arange(len(self.u.x.array))
        return unrolled(blocks, bs)

    def fields(self) -> list[Field]:
        """The unknowns by their unit: the displacement, further Functions, and the
        other parts of mixed ones."""
        local = np.arange(self.starts[-1])[self.u_local]
        rows = np.arange(self.owned_starts[-1])[self.u_owned]
        found = [Field(self.name, rows, local)]
        moved = {(d.at, d.component) for d in self.displacements}
        for k, f in enumerate(self.functions):
            for name, dofs, part in self._parts(f):
                if (k, part) in moved:
                    continue
                owned = dofs[dofs < np.diff(self.owned_starts)[k]]
                found.append(
                    Field(name, owned + self.owned_starts[k], dofs + self.starts[k])
                )
        return found

    @staticmethod
    def _parts(f: Function) -> list[tuple[str, Places, int | None]]:
        """Name, local dofs and number of the parts of a Function's element."""
        V = f.function_space
        if not compat.element_info(V).is_mixed:
            return [(f.name, np.arange(len(f.x.array)), None)]
        return [
            (f"{f.name}.sub({i})", compat.dofs_of_part(V, i), i)
            for i in range(compat.num_parts(V))
        ]

    # Values

    def pull(self) -> None:
        """Copy the displacement from the user's Functions."""
        for d in self.displacements:
            d.pull()
        if isinstance(self.u, JoinedDisplacement):
            self.u.x.array[:] = self.values()[self.u_local]

    def values(self) -> Array:
        """Copy of all local unknowns."""
        # A residual asks: `concatenate` enters further functions
        arrays = self._arrays
        return arrays[0].copy() if len(arrays) == 1 else np.concatenate(arrays)

    def set_values(self, values: Array) -> None:
        """Set all local unknowns, the displacement included."""
        starts = self.starts
        for f, begin, end in zip(self.functions, starts, starts[1:]):
            f.x.array[:] = values[begin:end]
        self.pull()

    @contextmanager
    def lent(self) -> Iterator[Array]:
        """Give a copy of all local unknowns; what changes within is undone at the end."""
        before = self.values()
        try:
            yield before.copy()
        finally:
            self.set_values(before)

    def owned_values(self) -> Array:
        """Copy of all owned unknowns."""
        return self.owned_part(self.values())

    def owned_part(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """The owned entries of an array over the local unknowns."""
        if len(self.functions) == 1:
            return values[: self.owned_starts[-1]]
        sizes = np.diff(self.owned_starts)
        return np.concatenate(
            [values[start : start + n] for start, n in zip(self.starts, sizes)]
        )

    # Dirichlet conditions

    def conditions(self, bcs: Sequence[Any]) -> list[list[Any]]:
        """Dirichlet conditions by the Function that they are on."""
        return self._conditions(bcs).by_function

    def _conditions(self, bcs: Sequence[Any]) -> _Sorted:
        """Sort conditions, unless they are the last ones."""
        if self._sorted is None or self._sorted.ids != tuple(map(id, bcs)):
            by_function = self._sort(bcs)
            markers = [
                compat.prescribed_values(one, *compat.unknowns_of(f))[0]
                for one, f in zip(by_function, self.functions)
            ]
            marker = np.concatenate(markers)
            owned = self.owned_part(marker) == 1
            ids = tuple(map(id, bcs))
            self._sorted = _Sorted(tuple(bcs), ids, by_function, owned)
        return self._sorted

    def _sort(self, bcs: Sequence[Any]) -> list[list[Any]]:
        """Conditions by their Functions."""
        spaces = self.spaces or [d.given.function_space for d in self.displacements]
        found: list[list[Any]] = [[] for _ in spaces]
        for i, bc in enumerate(bcs):
            if not hasattr(bc, "dof_indices"):
                raise ContactError(
                    f"boundary condition {i} is no Dirichlet condition, but {described(bc)}"
                )
            of = [k for k, V in enumerate(spaces) if compat.has_condition(V, bc)]
            if not of:
                where = (
                    "the space of the displacement: make it with u.function_space or a "
                    "sub-space of it"
                    if self.is_plain
                    else "a space of the unknowns or a sub-space of one"
                )
                raise ContactError(f"boundary condition {i} is not on {where}")
            found[of[0]].append(bc)
        return found

    def prescribed(self, bcs: Sequence[Any]) -> tuple[npt.NDArray[np.int8], Array]:
        """Local unknowns that conditions prescribe, and their values (0 elsewhere)."""
        parts = [
            compat.prescribed_values(one, *compat.unknowns_of(f))
            for one, f in zip(self.conditions(bcs), self.functions)
        ]
        marker, values = zip(*parts)
        return np.concatenate(marker), np.concatenate(values)

    def fault_of_conditions(self, bcs: Sequence[Any]) -> str | None:
        """Name the first condition with values that are not finite."""
        if np.isfinite(self.prescribed(bcs)[1]).all():
            return None
        for i, bc in enumerate(bcs):
            values = self.prescribed([bc])[1]
            bad = values[~np.isfinite(values)]
            if len(bad):
                return f"bcs[{i}] prescribes {bad[0]} at {len(bad)} unknown(s)"
        return None

    def owned_prescribed(self, bcs: Sequence[Any]) -> npt.NDArray[np.bool_]:
        """Whether conditions prescribe an owned unknown. Not to be written."""
        return self._conditions(bcs).owned

    def prescribed_u(self, bcs: Sequence[Any]) -> tuple[npt.NDArray[np.int8], Array]:
        """Local displacements that conditions prescribe, and their values."""
        marker, values = self.prescribed(bcs)
        return marker[self.u_local], values[self.u_local]

    def lacking(self, bcs: Sequence[Any]) -> Lacking:
        """Find the increments that prescribed unknowns still need."""
        known, starts = self._conditions(bcs), self.starts
        found, values = np.zeros(starts[-1]), self.values()
        for k, conditions in enumerate(known.by_function):
            if conditions:
                part = found[starts[k] : starts[k + 1]]
                compat.set_bc(part, conditions, self._arrays[k])
        increment = found * (np.abs(found) > ROUNDING * np.abs(values))
        of_u = increment[self.u_local]
        return Lacking(known.owned, self.owned_part(found), increment, of_u, values)

    def increment_u(self, bcs: Sequence[Any], u: Array) -> Array:
        """Find the increments from a ghosted array u to prescribed values; else 0."""
        marker, values = self.prescribed_u(bcs)
        increment = np.where(marker == 1, values - u, 0.0)
        return increment * (np.abs(increment) > ROUNDING * np.abs(u))

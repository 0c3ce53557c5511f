"""Displacements as a user gives them, mesh by mesh, and as one.

Each body may have its own mesh. Local dofs of all are the owned ones of all spaces, then
the ghosts of all spaces: the order that arrays of one space have.
"""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import dolfinx.la
import numpy as np
import numpy.typing as npt
from dolfinx.fem import Function, FunctionSpace

from .. import compat
from ..compat import Array, Indices
from ..errors import ContactError, of_type

Global = npt.NDArray[np.int64]
Places = npt.NDArray[np.int64]

# The k-th part's global numbers begin at k times this, more than a mesh has
NUMBERS_OF_PART = 1 << 48


class Displacement:
    """A displacement on one mesh.

    Attributes
    ----------
    given
        A Function on a space of its own, or a part of a mixed one such as ``w.sub(0)``.
    u
        The displacement on its own space: the user's Function, or a copy of the part.
    component
        Number of the part of a mixed Function. None if it is no part.
    at
        Number of the user's Function that has it.
    """

    def __init__(self, given: Function, at: int) -> None:
        self.given, self.u, self.at = given, given, at
        self.component: int | None = None
        self._dofs: Places | None = None
        V = given.function_space
        if compat.element_info(V).is_sub_space:
            own, self._dofs = compat.collapsed(V)
            self.u = Function(own, name=given.name)
            self.component = compat.component(V)
            self.pull()

    @property
    def size_owned(self) -> int:
        """Number of owned dofs."""
        index_map, bs = compat.unknowns_of(self.u)
        return int(index_map.size_local * bs)

    @property
    def dofs(self) -> Places:
        """Index of each local dof in the array of the Function that has it."""
        return np.arange(len(self.u.x.array)) if self._dofs is None else self._dofs

    def place_among(self, functions: Sequence[Function]) -> int | None:
        """Number of the Function that has it, None if none of them does."""
        return next(
            (i for i, f in enumerate(functions) if compat.same_values(f, self.given)),
            None,
        )

    def pull(self) -> None:
        """Update the copy."""
        if self._dofs is not None:
            self.u.x.array[:] = self.given.x.array[self._dofs]


def check_given(functions: Sequence[Any]) -> None:
    """Raise unless displacements are Functions, each on its own mesh."""
    for f in functions:
        of_type("u", f, Function, "a Function")
    if not functions:
        raise ContactError("u must be a Function, or a list of one for each mesh")
    for i, f in enumerate(functions):
        mesh = f.function_space.mesh
        for g in functions[:i]:
            both = f"the displacements {g.name} and {f.name} are on"
            if compat.on_mesh(g, mesh):
                raise ContactError(
                    f"{both} one mesh: one Function serves all of its bodies"
                )
            if g.function_space.mesh.geometry.dim != mesh.geometry.dim:
                raise ContactError(f"{both} meshes of different dimension")


class JoinedMap:
    """Several index maps as one; `places` has the local index of all that each has."""

    def __init__(self, maps: Sequence[Any]) -> None:
        self.maps, count = list(maps), len(maps)
        owned = [one.size_local for one in maps]
        ghosts = [one.num_ghosts for one in maps]
        self.size_local, self.num_ghosts = sum(owned), sum(ghosts)
        self.size_global = sum(one.size_global for one in maps)
        starts = np.cumsum([0, *owned, *ghosts], dtype=np.int32)
        runs = [np.arange(*ends) for ends in zip(starts, starts[1:])]
        self.places: list[Indices] = [
            np.concatenate(pair) for pair in zip(runs[:count], runs[count:])
        ]

    def local_to_global(self, local: Indices) -> Global:
        """A number for each local index, the same on all ranks."""
        numbers = np.empty(self.size_local + self.num_ghosts, dtype=np.int64)
        for k, (one, places) in enumerate(zip(self.maps, self.places)):
            numbers[places] = compat.local_to_global(one) + k * NUMBERS_OF_PART
        return numbers[local]

    def create_vector(self, bs: int) -> JoinedVector:
        """Zero vector of doubles."""
        return JoinedVector(self, bs)


class JoinedVector:
    """Vector over joined maps, with the methods of DOLFINx's vectors that are used."""

    def __init__(self, index_map: JoinedMap, bs: int) -> None:
        self._map, self._bs = index_map, bs
        n = index_map.size_local + index_map.num_ghosts
        self.array: Array = np.zeros(n * bs)
        self._parts = [
            dolfinx.la.vector(one, bs, dtype=np.float64) for one in index_map.maps
        ]

    def _exchange(self, scatter: str, *mode: Any) -> None:
        table = self.array.reshape(-1, self._bs)
        for part, places in zip(self._parts, self._map.places):
            part.array[:] = table[places].ravel()
            getattr(part, scatter)(*mode)
            table[places] = part.array.reshape(-1, self._bs)

    def scatter_forward(self) -> None:
        """Send the owners' values to the ghosts. Collective."""
        self._exchange("scatter_forward")

    def scatter_reverse(self, mode: Any) -> None:
        """Send the ghosts' values to their owners. Collective."""
        self._exchange("scatter_reverse", mode)


class JoinedSpace:
    """Spaces of vectors on several meshes as one; `mesh` is what these have alike."""

    def __init__(self, parts: Sequence[FunctionSpace]) -> None:
        self.parts, first = list(parts), parts[0].mesh
        self.mesh = SimpleNamespace(
            comm=first.comm,
            geometry=SimpleNamespace(dim=first.geometry.dim),
            topology=SimpleNamespace(dim=first.topology.dim),
        )
        self.index_map = JoinedMap([V.dofmap.index_map for V in self.parts])
        self.dofmap = SimpleNamespace(
            index_map=self.index_map,
            index_map_bs=compat.element_info(parts[0]).block_size,
        )

    def tabulate_dof_coordinates(self) -> Array:
        """Positions of all local dofs, (n, 3)."""
        x = np.empty((self.index_map.size_local + self.index_map.num_ghosts, 3))
        for V, places in zip(self.parts, self.index_map.places):
            x[places] = V.tabulate_dof_coordinates()
        return x


class JoinedDisplacement:
    """Displacements on several meshes as one, with a copy of their values."""

    def __init__(self, parts: Sequence[Function]) -> None:
        self.parts, self.name = list(parts), ", ".join(f.name for f in parts)
        self.function_space = JoinedSpace([f.function_space for f in parts])
        self.x = self.function_space.index_map.create_vector(
            self.function_space.dofmap.index_map_bs
        )


def places_of(u: Any, k: int) -> Indices | None:
    """Local block dofs of the k-th part in a displacement; None if there is one part."""
    joined = isinstance(u, JoinedDisplacement)
    return u.function_space.index_map.places[k] if joined else None


def parts_of(u: Any) -> list[Function]:
    """The displacements on single meshes that a displacement consists of."""
    return u.parts if isinstance(u, JoinedDisplacement) else [u]


def unrolled(blocks: Indices, bs: int) -> Places:
    """Dofs of block dofs, component by component."""
    return (bs * blocks[:, None].astype(np.int64) + np.arange(bs)).ravel()

"""Spaces of displacements on several meshes as one: each body may have its own mesh.

Local dofs are the owned ones of all spaces, then the ghosts of all spaces: the order
that arrays of one space have.
"""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import dolfinx.la
import numpy as np
import numpy.typing as npt
from dolfinx.fem import Function, FunctionSpace

from ..compat import Array, Indices, element_info, local_to_global

Global = npt.NDArray[np.int64]

# The k-th part's global numbers begin at k times this, more than a mesh has
NUMBERS_OF_PART = 1 << 48


class JoinedMap:
    """Several index maps as one.

    Attributes
    ----------
    maps
        The parts.
    places
        Local index of every local index of each part.
    """

    def __init__(self, maps: Sequence[Any]) -> None:
        self.maps = list(maps)
        owned = [one.size_local for one in maps]
        ghosts = [one.num_ghosts for one in maps]
        self.size_local, self.num_ghosts = sum(owned), sum(ghosts)
        self.size_global = sum(one.size_global for one in maps)
        starts = np.cumsum([0, *owned, *ghosts], dtype=np.int32)
        runs = [np.arange(*ends) for ends in zip(starts, starts[1:])]
        count = len(self.maps)
        self.places: list[Indices] = [
            np.concatenate([runs[k], runs[k + count]]) for k in range(count)
        ]

    def local_to_global(self, local: Indices) -> Global:
        """A number for each local index, the same on all ranks."""
        numbers = np.empty(self.size_local + self.num_ghosts, dtype=np.int64)
        for k, (one, places) in enumerate(zip(self.maps, self.places)):
            numbers[places] = local_to_global(one) + k * NUMBERS_OF_PART
        return numbers[local]

    def create_vector(self, bs: int) -> JoinedVector:
        """Zero vector of doubles."""
        return JoinedVector(self, bs)


class JoinedVector:
    """A vector over joined maps, with the methods of DOLFINx's that are used."""

    def __init__(self, index_map: JoinedMap, bs: int) -> None:
        self._map, self._bs = index_map, bs
        n = index_map.size_local + index_map.num_ghosts
        self.array: Array = np.zeros(n * bs)
        self._parts = [
            dolfinx.la.vector(one, bs, dtype=np.float64) for one in index_map.maps
        ]

    def _exchange(self, scatter: Any) -> None:
        table = self.array.reshape(-1, self._bs)
        for part, places in zip(self._parts, self._map.places):
            part.array[:] = table[places].ravel()
            scatter(part)
            table[places] = part.array.reshape(-1, self._bs)

    def scatter_forward(self) -> None:
        """Send the owners' values to the ghosts. Collective."""
        self._exchange(lambda part: part.scatter_forward())

    def scatter_reverse(self, mode: Any) -> None:
        """Send the ghosts' values to their owners. Collective."""
        self._exchange(lambda part: part.scatter_reverse(mode))


class JoinedSpace:
    """Spaces of vectors on several meshes, as one space.

    Attributes
    ----------
    parts
        The spaces.
    mesh
        What all meshes have in common: communicator and dimensions.
    """

    def __init__(self, parts: Sequence[FunctionSpace]) -> None:
        self.parts = list(parts)
        first = self.parts[0].mesh
        self.mesh = SimpleNamespace(
            comm=first.comm,
            geometry=SimpleNamespace(dim=first.geometry.dim),
            topology=SimpleNamespace(dim=first.topology.dim),
        )
        self.index_map = JoinedMap([V.dofmap.index_map for V in self.parts])
        self.dofmap = SimpleNamespace(
            index_map=self.index_map, index_map_bs=element_info(parts[0]).block_size
        )

    def tabulate_dof_coordinates(self) -> Array:
        """Positions of all local dofs, (n, 3)."""
        n = self.index_map.size_local + self.index_map.num_ghosts
        x = np.empty((n, 3))
        for V, places in zip(self.parts, self.index_map.places):
            x[places] = V.tabulate_dof_coordinates()
        return x


class JoinedDisplacement:
    """Displacements on several meshes as one, with a copy of their values.

    Attributes
    ----------
    parts
        The displacements, each on a space of its own.
    """

    def __init__(self, parts: Sequence[Function]) -> None:
        self.parts = list(parts)
        self.function_space = JoinedSpace([f.function_space for f in parts])
        self.x = self.function_space.index_map.create_vector(
            self.function_space.dofmap.index_map_bs
        )
        self.name = ", ".join(f.name for f in parts)


def places_of(u: Any, k: int) -> Indices | None:
    """Local block dofs of the k-th part in a displacement. None if there is one
    part."""
    joined = isinstance(u, JoinedDisplacement)
    return u.function_space.index_map.places[k] if joined else None


def parts_of(u: Any) -> list[Function]:
    """The displacements on single meshes that a displacement consists of."""
    return u.parts if isinstance(u, JoinedDisplacement) else [u]


def unrolled(blocks: Indices, bs: int) -> npt.NDArray[np.int64]:
    """Dofs of block dofs, component by component."""
    return (bs * blocks[:, None].astype(np.int64) + np.arange(bs)).ravel()

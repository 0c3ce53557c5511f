"""All exterior facets of a mesh, by tag and body."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from mpi4py import MPI

import numpy as np
import numpy.typing as npt
from dolfinx.mesh import Mesh

from ..core import compat
from ..core.compat import Array, Indices
from ..core.discretization.facets import Facets, Global, all_exterior_facets
from ..core.discretization.ranks import index_among, of_all
from ..core.discretization.surfaces import Bodies, find_bodies
from ..core.discretization.tagged import Part
from ..core.hooks import hooks

# Coordinates of bodies that differ by less than this share of the model's size are the
# same: nodes on round bodies that are alike need not be
_SAME_PLACE = 1e-3


def all_facets(
    u: Any, mesh: Mesh, facet_tags: Any
) -> tuple[list[Facets], tuple[Part, ...]]:
    """Sort all exterior facets of a mesh by tag and body. Collective.

    Tags may be None. Parts are the same on all ranks, and bodies are numbered by the
    place of their middle.
    """
    if facet_tags is not None:
        for check in hooks.on_tags:
            check(mesh, facet_tags, None, "")
    facets, _ = all_exterior_facets(mesh)
    tags = _tags(facets, facet_tags)
    bodies = find_bodies(u.function_space)
    number = _by_place(u, bodies)[
        bodies.dofs[compat.dofmap_array(u.function_space)[facets.cells, 0]]
    ]
    rows = np.column_stack([tags, number])
    known = np.unique(of_all(mesh.comm, np.unique(rows, axis=0))[0], axis=0)
    of_tag = known[:, 0].tolist()
    parts, chosen = [], []
    for tag, body in known.tolist():
        alone = tag >= 0 and of_tag.count(tag) == 1
        parts.append(Part(None if tag < 0 else tag, None if alone else body))
        mine = facets.some((rows == (tag, body)).all(axis=1))
        chosen.append(replace(mine, tag=tag))
    return chosen, tuple(parts)


def _tags(facets: Facets, facet_tags: Any) -> Global:
    """Tag of each facet, -1: none."""
    if facet_tags is None:
        return np.full(len(facets.facets), -1)
    place = index_among(facet_tags.indices, facets.facets)
    return np.append(facet_tags.values, -1).astype(np.int64)[place]


def _by_place(u: Any, bodies: Bodies) -> Indices:
    """Number of each body in the order of the middles of their boxes. Collective.

    Means of nodes depend on the mesh, which another unit of length may change.
    """
    V = u.function_space
    n = V.dofmap.index_map.size_local
    x, body = V.tabulate_dof_coordinates()[:n], bodies.dofs[:n]
    ends = np.full((bodies.count, 6), np.inf)
    np.minimum.at(ends, body, np.column_stack([x, -x]))
    V.mesh.comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MIN)
    size = float(-ends.min(axis=0).reshape(2, 3).sum(axis=0).min())
    order = in_order(0.5 * (ends[:, :3] - ends[:, 3:]), _SAME_PLACE * size)
    return np.argsort(order).astype(np.int32)


def levels(coordinates: Array, tolerance: float) -> npt.NDArray[np.int64]:
    """Whole numbers in the order of each coordinate, (n, d), equal where values next to
    each other differ by no more than a tolerance."""
    order = np.argsort(coordinates, axis=0, kind="stable")
    steps = np.diff(np.take_along_axis(coordinates, order, axis=0), axis=0)
    counts = np.cumsum(steps > tolerance, axis=0)
    found = np.zeros(coordinates.shape, dtype=np.int64)
    np.put_along_axis(found, order[1:], counts, axis=0)
    return found


def in_order(places: Array, tolerance: float) -> Indices:
    """Order of places (n, 3) by x, then y, then z, whose values may be off by rounding.

    Values next to each other that differ by no more than the tolerance are the same.
    """
    return np.lexsort(levels(places, tolerance).T[::-1])

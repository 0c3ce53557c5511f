"""Surfaces that meet themselves: their facets by tag and body, and their neighbours."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.mesh import Mesh
from scipy.sparse import csr_array

from .. import compat
from ..compat import Array, Indices
from ..partitions import levels
from .bodies import Bodies, find_bodies
from .facets import Facets, Global, all_exterior_facets, check_tags
from .ranks import index_among, of_all
from .reference_facets import N_CORNERS, middle_normals, units
from .surfaces import Surface

# Coordinates of bodies that differ by less than this share of the model's size are the
# same: nodes on round bodies that are alike need not be
_SAME_PLACE = 1e-3
# Facets that share a vertex and turn away from each other by more than 45 degrees, their
# middles behind each other, have a wedge of material between them
_SHARP, _IN_PLANE = np.cos(np.pi / 4.0), 1e-6


@dataclass(frozen=True)
class Part:
    """Facets of a tag and of a body.

    Attributes
    ----------
    tag
        Their tag; None: they have none.
    body
        Number of their body, where facets of the tag are of several or have no tag;
        else None.
    """

    tag: int | None
    body: int | None


def all_facets(
    u: Any, mesh: Mesh, facet_tags: Any
) -> tuple[list[Facets], tuple[Part, ...]]:
    """Sort all exterior facets of a mesh by tag and body. Collective.

    Tags may be None. Parts are the same on all ranks, and bodies are numbered by the
    place of their middle.
    """
    if facet_tags is not None:
        check_tags(mesh, facet_tags)
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
    number = np.empty(bodies.count, dtype=np.int32)
    number[order] = np.arange(bodies.count, dtype=np.int32)
    return number


def in_order(places: Array, tolerance: float) -> Indices:
    """Order of places (n, 3) by x, then y, then z, whose values may be off by rounding.

    Values next to each other that differ by no more than the tolerance are the same.
    """
    return np.lexsort(levels(places, tolerance).T[::-1])


def corner_ids(surface: Surface) -> Global:
    """Global numbers of the corners of facets, (n_facets, n)."""
    corners = surface.facet_dofs[:, : N_CORNERS[surface.shape]]
    return surface.dof_ids[corners]


def facets_that_never_meet(
    slave: Surface, master: Surface, comm: MPI.Comm
) -> tuple[Global, Global]:
    """List the master facets of all ranks that each slave facet never meets.

    They are itself and those beyond a sharp edge or corner, behind which the material
    is [theory (3.14)]. Returns offsets (slave facets + 1,) and global numbers,
    ascending for each slave facet. Collective.
    """
    middles, n = _middles(master)
    ids, corners, middles, n = of_all(
        comm, master.facet_ids, corner_ids(master), middles, n
    )
    mine, mine_n = _middles(slave)
    row, other = _pairs_at_vertices(corner_ids(slave), corners)
    way = middles[other] - mine[row]
    cosine = np.einsum("pd,pd->p", mine_n[row], n[other])
    # Height of either middle over the other facet, over the distance
    length = np.linalg.norm(way, axis=1) + np.finfo(float).tiny
    heights = np.einsum("pd,kpd->kp", way, np.array([mine_n[row], -n[other]])) / length
    is_notch = (heights > -_IN_PLANE).all(axis=0)
    never = (slave.facet_ids[row] == ids[other]) | ((cosine < _SHARP) & ~is_notch)
    row, number = row[never], ids[other[never]]
    order = np.lexsort([number, row])
    offsets = np.searchsorted(row[order], np.arange(len(mine) + 1))
    return offsets.astype(np.int64), number[order].astype(np.int64)


def _middles(surface: Surface) -> tuple[Array, Array]:
    """Middles of the undeformed facets, by their corners, and unit normals, (n, d)."""
    nodes = surface.nodes[:, : N_CORNERS[surface.shape]]
    return nodes.mean(axis=1), units(middle_normals(surface.shape, 1, nodes))


def _pairs_at_vertices(mine: Global, others: Global) -> tuple[Indices, Indices]:
    """Rows of two tables (facets, corners) that have a number in common, each once."""
    corners = np.concatenate([mine, others])
    known, number = np.unique(corners, return_inverse=True)
    row = np.repeat(np.arange(len(corners)), corners.shape[1])
    shape = len(corners), len(known)
    has = csr_array((np.ones(len(row)), (row, number.ravel())), shape=shape)
    row, met = (has[: len(mine)] @ has[len(mine) :].T).nonzero()
    return row, met

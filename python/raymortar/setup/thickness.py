"""Thickness of the body behind its facets, by rays through the cells of the mesh."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx.mesh import Mesh

from ..core import compat
from ..core.compat import Array, Indices, Mask
from ..core.discretization.facets import (
    FACET_SHAPE,
    Facets,
    coordinates,
    dot,
    facet_corners,
    match_points,
    middle_normals,
    points_inward,
    units,
)
from ..core.discretization.ranks import index_among, of_all

# A ray stops after this many cells: the body is thicker than its length
MOST_CELLS = 64
# Number of rays that are advanced together, so that their cells fit into the cache
RAYS_AT_ONCE = 4096


# A ray from the middle of a facet into the body, at its present end
_FIELDS = [
    ("length", float),  # so far
    ("cell", np.int32),  # the one that it goes through
    ("facet", np.int32),  # the one by which it entered the cell
    ("crossed", np.int32),  # cells so far
    ("number", np.int64),  # at home
    ("home", np.int32),  # rank
]
Rays = npt.NDArray[Any]


class Cells:
    """The cells of this rank, as rays need them. Collective."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh, cell, tdim = mesh, compat.cell_name(mesh), mesh.topology.dim
        self.shape, self.x = FACET_SHAPE[cell], coordinates(mesh)
        element = compat.basix_element(cell, compat.geometry_degree(mesh))
        columns = match_points(element.points, element.vertices)
        # Nodes (cells, corners), corners of facets, and facets (cells, facets of a cell)
        self.corners = compat.geometry_dofmap(mesh)[:, columns]
        self.of_facet = np.array(element.facet_vertices)
        self.facets = compat.connectivity_table(mesh, tdim, tdim - 1)
        links = compat.connectivity(mesh, tdim - 1, tdim)
        sizes = np.diff(links.offsets)
        of_link = np.repeat(np.arange(len(sizes)), sizes)
        place = np.arange(len(links.array)) - links.offsets[of_link]
        owned = links.array < mesh.topology.index_map(tdim).size_local
        # Owned cells of each facet, (facets, 2); -1: none
        self.beside = np.full((len(sizes), 2), -1, dtype=np.int32)
        self.beside[of_link[owned], place[owned]] = links.array[owned]
        self.is_exterior = np.zeros(len(sizes), dtype=bool)
        self.is_exterior[compat.exterior_facets(mesh)] = True

    def _planes(self, cell: Indices, way: Array, x: Array) -> tuple[Array, Array]:
        """Slope of a way along the outward normals of the facets of cells, and height
        of a point above them, (n, facets) each."""
        nodes = self.x[self.corners[cell]]
        points = nodes[:, self.of_facet]
        middle, m = points.mean(axis=2), middle_normals(self.shape, 1, points)
        outward = dot(m, middle - nodes.mean(axis=1)[:, None])
        m = np.where(outward[..., None] < 0.0, -m, m)
        return dot(m, way[:, None]), dot(m, x[:, None] - middle)

    def contain(self, cell: Indices, x: Array) -> Mask:
        """Whether each cell, taken as straight, has its point inside, (n,)."""
        return (self._planes(cell, x, x)[1] < 0.0).all(axis=1)

    def cross(self, rays: Rays) -> tuple[Indices, Array]:
        """Facet by which each ray leaves its cell, and its length up to there.

        In a convex cell it is the first plane, among those that face along the ray,
        that the ray meets.
        """
        slope, height = self._planes(rays["cell"], rays["direction"], rays["start"])
        facets = self.facets[rays["cell"]]
        ahead = (slope > 0.0) & (facets != rays["facet"][:, None])
        with np.errstate(divide="ignore", invalid="ignore"):
            length = np.where(ahead, -height / slope, np.inf)
        first, rows = length.argmin(axis=1), np.arange(len(rays))
        return facets[rows, first], np.maximum(length[rows, first], rays["length"])


def _start(mesh: Mesh, facets: Facets) -> Rays:
    """Rays from the middle of some facets, straight into their cells."""
    corners, n = facet_corners(mesh, facets), len(facets.cells)
    m = units(middle_normals(FACET_SHAPE[compat.cell_name(mesh)], 1, corners))
    d = mesh.geometry.dim
    rays = np.zeros(n, dtype=[*_FIELDS, ("start", float, d), ("direction", float, d)])
    rays["start"] = corners.mean(axis=1)
    rays["direction"] = np.where(points_inward(mesh, facets)[:, None], m, -m)
    rays["cell"], rays["facet"] = facets.cells, facets.facets
    rays["number"], rays["home"] = np.arange(n), mesh.comm.rank
    return rays


def _walk(cells: Cells, rays: Rays, most: float) -> tuple[list[Rays], list[Rays]]:
    """Rays that have ended, and those that leave this rank's cells."""
    ended, leaving = [], []
    while len(rays):
        rays["facet"], rays["length"] = cells.cross(rays)
        rays["crossed"] += 1
        over = cells.is_exterior[rays["facet"]] | (rays["length"] >= most)
        over |= rays["crossed"] >= MOST_CELLS
        rays["cell"] = cells.beside[rays["facet"]].sum(axis=1) - rays["cell"]
        gone = ~over & (rays["cell"] < 0)
        ended.append(rays[over])
        leaving.append(rays[gone])
        rays = rays[~over & ~gone]
    return ended, leaving


def _arrived(cells: Cells, mine: Rays) -> Rays:
    """Rays that left cells of other ranks and go on in cells of this rank.

    Facets between ranks are told by global numbers. Collective.
    """
    comm, topology = cells.mesh.comm, cells.mesh.topology
    facet_map = topology.index_map(topology.dim - 1)
    numbers = compat.local_to_global(facet_map, mine["facet"])
    wanted, rays = of_all(comm, numbers, mine)
    rank = np.repeat(np.arange(comm.size), comm.allgather(len(mine)))
    rays["facet"] = index_among(compat.local_to_global(facet_map), wanted)
    rays = rays[(rank != comm.rank) & (rays["facet"] >= 0)]
    rays["cell"] = cells.beside[rays["facet"]].max(axis=1, initial=-1)
    return rays[rays["cell"] >= 0]


def thickness_behind(cells: Cells, facets: Facets, most: float) -> Array:
    """Length of the undeformed body behind the middle of facets. Collective.

    Along the normals of exterior facets of this rank, from cell to cell, which are taken
    as straight, to where the ray leaves the body. Where the thickness is more than
    `most` or more than `MOST_CELLS` cells, a length that it exceeds, (n_facets,).
    """
    comm, rays = cells.mesh.comm, _start(cells.mesh, facets)
    ended = [rays[:0]]
    while comm.allreduce(len(rays)):
        leaving = [rays[:0]]
        for k in range(0, len(rays), RAYS_AT_ONCE):
            done, gone = _walk(cells, rays[k : k + RAYS_AT_ONCE], most)
            ended += done
            leaving += gone
        rays = _arrived(cells, np.concatenate(leaving))
    mine = np.concatenate(ended)
    (away,) = of_all(comm, mine[mine["home"] != comm.rank])
    home = np.concatenate([mine, away])
    home = home[home["home"] == comm.rank]
    result = np.full(len(facets.cells), most)
    result[home["number"]] = np.minimum(home["length"], most)
    return result


def behind(mesh: Mesh) -> Callable[[Facets, float], Array]:
    """`thickness_behind` in the cells of a mesh, which are gathered once. Collective."""
    return partial(thickness_behind, Cells(mesh))

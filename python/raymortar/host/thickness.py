"""Thickness of the body behind its facets, by rays through the cells of the mesh."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import numpy as np
import numpy.typing as npt
from dolfinx.mesh import Mesh

from .. import compat
from ..compat import Array, Indices, Mask
from .facets import Facets, coordinates, facet_corners, points_inward
from .reference_facets import FACET_SHAPE, match_points, middle_normals

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

    def _planes(self, cell: Indices) -> tuple[Array, Array]:
        """Middles and outward normals of the facets of cells, (n, facets, d) each."""
        nodes = self.x[self.corners[cell]]
        points = nodes[:, self.of_facet]
        middle, m = points.mean(axis=2), middle_normals(self.shape, 1, points)
        outward = np.einsum("rfd,rfd->rf", m, middle - nodes.mean(axis=1)[:, None])
        return middle, np.where(outward[..., None] < 0.0, -m, m)

    def contain(self, cell: Indices, x: Array) -> Mask:
        """Whether each cell, taken as straight, has its point inside, (n,)."""
        middle, m = self._planes(cell)
        height = np.einsum("rfd,rfd->rf", m, x[:, None] - middle)
        inside: Mask = (height < 0.0).all(axis=1)
        return inside

    def cross(self, rays: Rays) -> tuple[Indices, Array]:
        """Facet by which each ray leaves its cell, and its length up to there.

        In a convex cell it is the first plane, among those that face along the ray,
        that the ray meets.
        """
        middle, m = self._planes(rays["cell"])
        slope = np.einsum("rfd,rd->rf", m, rays["direction"])
        height = np.einsum("rfd,rfd->rf", m, middle - rays["start"][:, None])
        facets = self.facets[rays["cell"]]
        ahead = (slope > 0.0) & (facets != rays["facet"][:, None])
        with np.errstate(divide="ignore", invalid="ignore"):
            length = np.where(ahead, height / slope, np.inf)
        first, rows = length.argmin(axis=1), np.arange(len(rays))
        return facets[rows, first], np.maximum(length[rows, first], rays["length"])


def _start(mesh: Mesh, facets: Facets) -> Rays:
    """Rays from the middle of some facets, straight into their cells."""
    corners, n = facet_corners(mesh, facets), len(facets.cells)
    start, inward = corners.mean(axis=1), points_inward(mesh, facets)
    m = middle_normals(FACET_SHAPE[compat.cell_name(mesh)], 1, corners)
    m = np.where(inward[:, None], m, -m)
    kind = _FIELDS + [(name, float, start.shape[1]) for name in ("start", "direction")]
    rays = np.zeros(n, dtype=kind)
    rays["start"], rays["direction"] = start, m / np.linalg.norm(m, axis=1)[:, None]
    rays["cell"], rays["facet"] = facets.cells, facets.facets
    rays["number"], rays["home"] = np.arange(n), mesh.comm.rank
    return rays


def _walk(cells: Cells, rays: Rays, most: float) -> tuple[list[Rays], list[Rays]]:
    """Rays that have ended, and those that leave this rank's cells."""
    ended, leaving = [], []
    while len(rays):
        rays["facet"], rays["length"] = cells.cross(rays)
        rays["crossed"] += 1
        beside = cells.beside[rays["facet"]]
        over = cells.is_exterior[rays["facet"]] | (rays["length"] >= most)
        over |= rays["crossed"] >= MOST_CELLS
        rays["cell"] = beside.sum(axis=1) - rays["cell"]
        gone = ~over & (rays["cell"] < 0)
        ended.append(rays[over])
        leaving.append(rays[gone])
        rays = rays[~over & ~gone]
    return ended, leaving


def _arrived(cells: Cells, rays: list[Rays]) -> Rays:
    """Rays that left cells of other ranks and go on in cells of this rank.

    Facets between ranks are told by global numbers. Collective.
    """
    mesh = cells.mesh
    comm, facet_map = mesh.comm, mesh.topology.index_map(mesh.topology.dim - 1)
    known = compat.local_to_global(facet_map)
    order = np.argsort(known)
    mine = np.concatenate(rays)
    sent = comm.allgather((compat.local_to_global(facet_map, mine["facet"]), mine))
    del sent[comm.rank]
    if not sent or not len(order):
        return mine[:0]
    wanted, arrived = (np.concatenate(parts) for parts in zip(*sent))
    place = np.minimum(np.searchsorted(known, wanted, sorter=order), len(order) - 1)
    arrived["facet"] = facet = order[place]
    arrived["cell"] = cell = cells.beside[facet].max(axis=1, initial=-1)
    return arrived[(known[facet] == wanted) & (cell >= 0)]


def thickness_behind(cells: Cells, facets: Facets, most: float) -> Array:
    """Length of the undeformed body behind the middle of facets. Collective.

    Along the normals of exterior facets of this rank, from cell to cell, which are taken
    as straight, to where the ray leaves the body. Where the thickness is more than
    `most` or more than `MOST_CELLS` cells, a length that it exceeds, (n_facets,).
    """
    mesh, rays = cells.mesh, _start(cells.mesh, facets)
    ended = [rays[:0]]
    while mesh.comm.allreduce(len(rays), op=MPI.SUM):
        leaving = [rays[:0]]
        for k in range(0, len(rays), RAYS_AT_ONCE):
            done, gone = _walk(cells, rays[k : k + RAYS_AT_ONCE], most)
            ended += done
            leaving += gone
        rays = _arrived(cells, leaving)
    mine, rank = np.concatenate(ended), mesh.comm.rank
    away = mesh.comm.allgather(mine[mine["home"] != rank])
    mine = np.concatenate([mine, *away])
    mine = mine[mine["home"] == rank]
    result = np.full(len(facets.cells), most)
    result[mine["number"]] = np.minimum(mine["length"], most)
    return result

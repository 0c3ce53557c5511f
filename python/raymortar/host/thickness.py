"""Thickness of the body behind its facets, by rays through the cells of the mesh."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

from mpi4py import MPI

import numpy as np
from dolfinx.mesh import Mesh

from .. import compat
from ..compat import Array, Indices, Mask
from .facets import Facets, Global, cell_corners, coordinates, facet_corners
from .reference_facets import match_points, normals

# A ray stops after this many cells: the body is thicker than its length
MOST_CELLS = 64
# Number of rays that are advanced together, so that their cells fit into the cache
RAYS_AT_ONCE = 4096


@dataclass
class _Rays:
    """Rays from the middle of facets into the body, at their present ends."""

    start: Array  # (n, d)
    direction: Array  # (n, d), unit vectors
    length: Array  # (n,), so far
    cell: Indices  # (n,), the cell that each goes through
    facet: Indices  # (n,), the facet by which it entered the cell
    crossed: Indices  # (n,), cells so far
    number: Global  # (n,), at home
    home: Indices  # (n,), rank

    def __len__(self) -> int:
        return len(self.cell)

    def __getitem__(self, chosen: Array | Mask | slice) -> _Rays:
        return _Rays(*(getattr(self, f.name)[chosen] for f in fields(self)))


def _joined(parts: list[_Rays]) -> _Rays:
    return _Rays(
        *(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(_Rays))
    )


@dataclass
class Cells:
    """The cells of this rank, as rays need them. Collective."""

    mesh: Mesh
    x: Array = field(init=False)
    corners: Indices = field(init=False)  # (cells, n), geometry nodes
    of_facet: Indices = field(init=False)  # (facets of a cell, n), of its corners
    facets: Indices = field(init=False)  # (cells, facets of a cell)
    beside: Indices = field(init=False)  # (facets, 2), owned cells; -1: none
    is_exterior: Mask = field(init=False)  # (facets,)

    def __post_init__(self) -> None:
        mesh, cell = self.mesh, compat.cell_name(self.mesh)
        tdim = mesh.topology.dim
        element = compat.basix_element(cell, compat.geometry_degree(mesh))
        columns = match_points(element.points, element.vertices)
        self.x = coordinates(mesh)
        self.corners = compat.geometry_dofmap(mesh)[:, columns]
        self.of_facet = np.array(compat.basix_element(cell, 1).facet_vertices)
        self.facets = compat.connectivity_table(mesh, tdim, tdim - 1)
        links = compat.connectivity(mesh, tdim - 1, tdim)
        sizes = np.diff(links.offsets)
        of_link = np.repeat(np.arange(len(sizes)), sizes)
        place = np.arange(len(links.array)) - links.offsets[of_link]
        owned = links.array < mesh.topology.index_map(tdim).size_local
        self.beside = np.full((len(sizes), 2), -1, dtype=np.int32)
        self.beside[of_link[owned], place[owned]] = links.array[owned]
        self.is_exterior = np.zeros(len(sizes), dtype=bool)
        self.is_exterior[compat.exterior_facets(mesh)] = True

    def _planes(self, cell: Indices) -> tuple[Array, Array]:
        """Middles and outward normals of the facets of cells, (n, facets, d) each."""
        nodes = self.x[self.corners[cell]]
        points = nodes[:, self.of_facet]
        middle, m = points.mean(axis=2), _normals(points)
        outward = np.einsum("rfd,rfd->rf", m, middle - nodes.mean(axis=1)[:, None])
        return middle, np.where(outward[..., None] < 0.0, -m, m)

    def contain(self, cell: Indices, x: Array) -> Mask:
        """Whether each cell, taken as straight, has its point inside, (n,)."""
        middle, m = self._planes(cell)
        height = np.einsum("rfd,rfd->rf", m, x[:, None] - middle)
        inside: Mask = (height < 0.0).all(axis=1)
        return inside

    def cross(self, rays: _Rays) -> tuple[Indices, Array]:
        """Facet by which each ray leaves its cell, and its length up to there.

        In a convex cell it is the first plane, among those that face along the ray,
        that the ray meets.
        """
        middle, m = self._planes(rays.cell)
        slope = np.einsum("rfd,rd->rf", m, rays.direction)
        height = np.einsum("rfd,rfd->rf", m, middle - rays.start[:, None])
        facets = self.facets[rays.cell]
        ahead = (slope > 0.0) & (facets != rays.facet[:, None])
        with np.errstate(divide="ignore", invalid="ignore"):
            length = np.where(ahead, height / slope, np.inf)
        first, rows = length.argmin(axis=1), np.arange(len(rays))
        return facets[rows, first], np.maximum(length[rows, first], rays.length)


def _normals(points: Array) -> Array:
    """Normals of flat facets, with either sign; points are (..., corners, d)."""
    if points.shape[-1] == 2:
        return normals((points[..., 1, :] - points[..., 0, :])[None])
    first, last = points[..., 0, :], points[..., -1, :]
    if points.shape[-2] == 3:
        return normals(np.stack([points[..., 1, :] - first, last - first]))
    return normals(np.stack([last - first, points[..., 2, :] - points[..., 1, :]]))


def _start(mesh: Mesh, facets: Facets) -> _Rays:
    """Rays from the middle of some facets, straight into their cells."""
    corners, n = facet_corners(mesh, facets), len(facets.cells)
    start, m = corners.mean(axis=1), _normals(corners)
    inward = np.einsum("fd,fd->f", m, cell_corners(mesh, facets).mean(axis=1) - start)
    m = np.where(inward[:, None] < 0.0, -m, m)
    return _Rays(
        start,
        m / np.linalg.norm(m, axis=1)[:, None],
        np.zeros(n),
        facets.cells,
        facets.facets,
        np.zeros(n, dtype=np.int32),
        np.arange(n),
        np.full(n, mesh.comm.rank, dtype=np.int32),
    )


def _walk(cells: Cells, rays: _Rays, most: float) -> tuple[list[_Rays], list[_Rays]]:
    """Rays that have ended, and those that leave this rank's cells."""
    ended, leaving = [], []
    while len(rays):
        rays.facet, rays.length = cells.cross(rays)
        rays.crossed = rays.crossed + 1
        beside = cells.beside[rays.facet]
        over = cells.is_exterior[rays.facet] | (rays.length >= most)
        over |= rays.crossed >= MOST_CELLS
        rays.cell = np.where(beside[:, 0] == rays.cell, beside[:, 1], beside[:, 0])
        gone = ~over & (rays.cell < 0)
        ended.append(rays[over])
        leaving.append(rays[gone])
        rays = rays[~over & ~gone]
    return ended, leaving


def _arrived(cells: Cells, rays: list[_Rays]) -> _Rays:
    """Rays that left cells of other ranks and go on in cells of this rank.

    Facets between ranks are told by global numbers. Collective.
    """
    mesh = cells.mesh
    comm, facet_map = mesh.comm, mesh.topology.index_map(mesh.topology.dim - 1)
    everything = np.arange(len(cells.beside), dtype=np.int32)
    known = compat.local_to_global(facet_map, everything)
    order = np.argsort(known)
    mine = _joined(rays)
    sent = comm.allgather((compat.local_to_global(facet_map, mine.facet), mine))
    others = [pair for rank, pair in enumerate(sent) if rank != comm.rank]
    if not others or not len(order):
        return mine[:0]
    wanted, all_rays = np.concatenate([w for w, _ in others]), [r for _, r in others]
    rays_here = _joined(all_rays)
    place = np.minimum(np.searchsorted(known, wanted, sorter=order), len(order) - 1)
    facet = order[place].astype(np.int32)
    cell = cells.beside[facet].max(axis=1, initial=-1)
    here = (known[facet] == wanted) & (cell >= 0)
    rays_here.facet, rays_here.cell = facet, cell
    return rays_here[here]


def thickness_behind(cells: Cells, facets: Facets, most: float) -> Array:
    """Length of the undeformed body behind the middle of facets. Collective.

    Along the facet's normal, from cell to cell, to where the ray leaves the body.

    Parameters
    ----------
    cells
        Cells of the mesh, taken as straight.
    facets
        Exterior facets of this rank.
    most
        More than this need not be known. Length.

    Returns
    -------
    ndarray
        Shape (n_facets,): the thickness, or, where it is more than `most` or more than
        `MOST_CELLS` cells, a length that it exceeds.
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
    mine = _joined(ended)
    away = mine[mine.home != mesh.comm.rank]
    home = [r[r.home == mesh.comm.rank] for r in mesh.comm.allgather(away)]
    result = np.full(len(facets.cells), most)
    for part in (mine[mine.home == mesh.comm.rank], *home):
        result[part.number] = np.minimum(part.length, most)
    return result

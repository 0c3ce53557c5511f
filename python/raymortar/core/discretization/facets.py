"""Facets of reference cells, with functions on them, and tagged facets of a mesh, their
nodes and dofs turned outward.

Functions marked *collective* must be called by every rank, with or without facets of its
own.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx.fem import FunctionSpace
from dolfinx.mesh import Mesh

from .. import compat
from ..compat import Array, Indices, Mask
from ..errors import spoken_tag
from ..hooks import hooks

FACET_SHAPE = {
    "triangle": "interval",
    "quadrilateral": "interval",
    "tetrahedron": "triangle",
    "hexahedron": "quadrilateral",
}

N_CORNERS = {"interval": 2, "triangle": 3, "quadrilateral": 4}

# Reference coordinates are O(1); nodes are at least 1/2 apart.
MATCH_TOLERANCE = 1e-10

# A radius below this share of the mesh's size counts as zero
ON_AXIS = 1e-12


def facet_nodes(shape: str, degree: int) -> Array:
    """Nodes of a reference facet of degree 1 or 2, shape (n, d - 1).

    The first ones are those of degree 1. The C++ library relies on this order.
    """
    return compat.basix_element(shape, degree).points


def shape_functions(shape: str, degree: int, points: Array) -> tuple[Array, Array]:
    """Evaluate the Lagrange functions on a reference facet at points (n_points, d - 1).

    Values have the shape (n_points, n), gradients (d - 1, n_points, n).
    """
    table = compat.tabulate(shape, degree, points)
    return table[0], table[1:]


def interpolate(shape: str, degree: int, nodal: Array, points: Array) -> Array:
    """Values at one point (n, d - 1) of each facet, by nodal values (n, nodes, ...)."""
    return np.einsum("qa,qa...->q...", shape_functions(shape, degree, points)[0], nodal)


def normals(tangents: Array) -> Array:
    """Normals m (..., d) of facets, by their tangents dx/dxi_i (d - 1, ..., d).

    Their length is the surface Jacobian.
    """
    if len(tangents) == 2:
        return np.cross(tangents[0], tangents[1])
    return np.stack([tangents[0, ..., 1], -tangents[0, ..., 0]], axis=-1)


def middle_normals(shape: str, degree: int, nodes: Array) -> Array:
    """Normals m (..., d) in the middle of facets with nodes (..., n, d)."""
    middle = facet_nodes(shape, 1).mean(axis=0, keepdims=True)
    _, gradients = shape_functions(shape, degree, middle)
    return normals(np.einsum("ia,...ad->i...d", gradients[:, 0], nodes))


def units(vectors: Array) -> Array:
    """Scale vectors (..., d) to length 1."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def dot(a: Array, b: Array) -> Array:
    """Products of vectors (..., d), (...)."""
    return np.einsum("...d,...d->...", a, b)


def match_points(points: Array, targets: Array) -> list[int]:
    """Index among points of each target."""
    distances = np.linalg.norm(points[None] - targets[:, None], axis=2)
    matches = distances.argmin(axis=1)
    if np.any(distances[np.arange(len(targets)), matches] > MATCH_TOLERANCE):
        raise RuntimeError("a node of a facet is not a node of its cell")
    return matches.tolist()


@functools.lru_cache(maxsize=None)
def cell_facet_nodes(cell: str, degree: int) -> Indices:
    """Cell nodes of each local facet, in raymortar's order, not yet turned outward.

    Found by position, so that no numbering convention of a version is relied on.
    Indices into the nodes of the cell's element, (n_local_facets, n).
    """
    shape = FACET_SHAPE[cell]
    element = compat.basix_element(cell, degree)
    values, _ = shape_functions(shape, 1, facet_nodes(shape, degree))
    rows = [
        match_points(element.points, values @ element.vertices[list(vertices)])
        for vertices in element.facet_vertices
    ]
    return np.array(rows, dtype=np.int32)


@functools.lru_cache(maxsize=None)
def reflection(shape: str, degree: int) -> Indices:
    """Permutation of a facet's nodes that reverses its normal, shape (n,).

    The ends of an interval change places, as do xi and eta of a triangle or
    quadrilateral.
    """
    nodes = facet_nodes(shape, degree)
    mirrored = 1 - nodes if shape == "interval" else nodes[:, ::-1]
    return np.array(match_points(nodes, mirrored), dtype=np.int32)


Global = npt.NDArray[np.int64]

# Facets of a cell are at most six, so that cell * 8 + local facet is unique.
FACETS_PER_CELL = 8


@dataclass(frozen=True)
class Facets:
    """Exterior facets with one tag, of the cells owned by this rank.

    Attributes
    ----------
    tag, name
        Their tag, and its name, if it was given one.
    facets, cells, local_facets
        Local index of each facet, of its cell, and its number within that cell,
        shape (n_facets,), int32.
    """

    tag: int
    facets: Indices
    cells: Indices
    local_facets: Indices
    name: str | None = None

    @property
    def spoken(self) -> str:
        """Their tag, for a message."""
        return spoken_tag(self.tag, self.name)

    def some(self, marks: Mask) -> Facets:
        """Facets that are marked, (n_facets,)."""
        facets, cells, local = self.facets, self.cells, self.local_facets
        return Facets(self.tag, facets[marks], cells[marks], local[marks], self.name)


def join(facets_list: Sequence[Facets]) -> Facets:
    """Several sets of facets as one, in their order. Its tag has no meaning."""
    rows = zip(*((one.facets, one.cells, one.local_facets) for one in facets_list))
    facets, cells, local_facets = (np.concatenate(columns) for columns in rows)
    return Facets(-1, facets, cells, local_facets)


def coordinates(mesh: Mesh) -> Array:
    """Positions of the geometry nodes, shape (n_nodes, gdim)."""
    return mesh.geometry.x[:, : mesh.geometry.dim]


def node_table(mesh: Mesh, facets: Facets) -> Indices:
    """Geometry nodes of facets, not turned outward, shape (n_facets, n)."""
    columns = cell_facet_nodes(compat.cell_name(mesh), compat.geometry_degree(mesh))
    dofmap = compat.geometry_dofmap(mesh)
    return dofmap[facets.cells[:, None], columns[facets.local_facets]]


def cell_corners(mesh: Mesh, facets: Facets) -> Array:
    """Vertices of each facet's cell, shape (n_facets, n_vertices, gdim)."""
    cell = compat.cell_name(mesh)
    element = compat.basix_element(cell, compat.geometry_degree(mesh))
    columns = match_points(element.points, element.vertices)
    return coordinates(mesh)[compat.geometry_dofmap(mesh)[facets.cells][:, columns]]


def facet_corners(mesh: Mesh, facets: Facets) -> Array:
    """Vertices of each facet, not turned outward, shape (n_facets, n, gdim)."""
    n = N_CORNERS[FACET_SHAPE[compat.cell_name(mesh)]]
    return coordinates(mesh)[node_table(mesh, facets)[:, :n]]


def midpoints(mesh: Mesh, facets: Facets) -> Array:
    """Centre of each facet's vertices, shape (n_facets, gdim)."""
    return facet_corners(mesh, facets).mean(axis=1)


def points_inward(mesh: Mesh, facets: Facets) -> npt.NDArray[np.bool_]:
    """Whether the normal at each facet's centre points into its cell, before facets are
    turned."""
    shape = FACET_SHAPE[compat.cell_name(mesh)]
    corners = facet_corners(mesh, facets)
    m = middle_normals(shape, 1, corners)
    outward = corners.mean(axis=1) - cell_corners(mesh, facets).mean(axis=1)
    return np.einsum("fd,fd->f", m, outward) < 0


def _outward(mesh: Mesh, facets: Facets, degree: int) -> Indices:
    """Nodes of facets in elements of their cells, turned outward, (n_facets, n)."""
    cell = compat.cell_name(mesh)
    table = cell_facet_nodes(cell, degree)[facets.local_facets]
    turned = table[:, reflection(FACET_SHAPE[cell], degree)]
    return np.where(points_inward(mesh, facets)[:, None], turned, table)


def facet_dof_table(V: FunctionSpace, facets: Facets) -> Indices:
    """Local block dofs of facets, turned outward, shape (n_facets, n)."""
    nodes = _outward(V.mesh, facets, compat.element_info(V).degree)
    return compat.dofmap_array(V)[facets.cells[:, None], nodes]


def facet_node_table(mesh: Mesh, facets: Facets) -> Indices:
    """Local geometry nodes of facets, turned outward, shape (n_facets, n)."""
    nodes = _outward(mesh, facets, compat.geometry_degree(mesh))
    return compat.geometry_dofmap(mesh)[facets.cells[:, None], nodes]


def reference_corners(mesh: Mesh, facets: Facets) -> Array:
    """Corners of facets, turned outward, in the reference coordinates of their cells,
    (n_facets, n, tdim)."""
    points: Array = compat.basix_element(compat.cell_name(mesh), 1).points
    return points[_outward(mesh, facets, 1)]


def facet_ids(mesh: Mesh, facets: Facets) -> Global:
    """Globally unique number of each facet."""
    cell_map = mesh.topology.index_map(mesh.topology.dim)
    cells = compat.local_to_global(cell_map, facets.cells)
    return cells * FACETS_PER_CELL + facets.local_facets


# Looking them up


def facets_of_mesh(mesh: Mesh, tag: int, facets: Indices) -> Facets:
    """Look up cell and local number of facets with one local cell. Collective."""
    tdim = mesh.topology.dim
    to_cells = compat.connectivity(mesh, tdim - 1, tdim)
    of_cells = compat.connectivity_table(mesh, tdim, tdim - 1)
    cells = to_cells.array[to_cells.offsets[facets]]
    local_facets = (of_cells[cells] == facets[:, None]).argmax(axis=1)
    return Facets(tag, facets, cells.astype(np.int32), local_facets.astype(np.int32))


def all_exterior_facets(mesh: Mesh) -> tuple[Facets, Global]:
    """All exterior facets of this rank's cells, and their global numbers. Collective."""
    facets = facets_of_mesh(mesh, -1, compat.exterior_facets(mesh))
    return facets, facet_ids(mesh, facets)


def tagged_facets(
    mesh: Mesh, facet_tags: Any, tag: int, role: str, name: str | None = None
) -> Facets:
    """Find the boundary facets with a tag, each on the rank that owns its cell.

    Collective. The role, slave or master, and a name are for messages: about tags of other
    entities, a tag that does not occur, or facets inside the body.
    """
    spoken = f"{role} {spoken_tag(tag, name)}"
    for check in hooks.on_tags:
        check(mesh, facet_tags, tag, spoken)
    tagged = facet_tags.indices[facet_tags.values == tag]
    exterior = np.intersect1d(tagged, compat.exterior_facets(mesh))
    return replace(facets_of_mesh(mesh, tag, exterior), name=name)


# Solids of revolution: coordinates are (r, z) of a half plane, about the axis r = 0


def size_of(X: Array) -> float:
    """Largest magnitude of a coordinate on this rank."""
    return float(np.abs(X).max(initial=0.0))


def on_axis(mesh: Mesh, facets: Facets) -> tuple[Mask, Array]:
    """Find the facets on the axis, and the nodes of all."""
    X = coordinates(mesh)
    nodes = X[node_table(mesh, facets)]
    return (nodes[:, :, 0] <= ON_AXIS * size_of(X)).all(axis=1), nodes


def off_axis(mesh: Mesh, facets: Facets) -> Facets:
    """Leave out facets on the axis."""
    return facets.some(~on_axis(mesh, facets)[0])

"""Tagged facets of a DOLFINx mesh as plain arrays, and the checks of the input.

Facets of one surface have their nodes in the order of the Basix element on the
reference facet, turned such that the normal points out of the cell: with the tangents
t_i = dx/dxi_i, m = t_1 x t_2 in 3D and m = (t_y, -t_x) in 2D. Functions marked
*collective* must be called by every rank, with or without facets of its own.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx.fem import Function, FunctionSpace
from dolfinx.mesh import Mesh
from mpi4py import MPI

from . import compat
from .compat import Array, Indices
from .errors import raise_everywhere

Global = npt.NDArray[np.int64]

FACET_SHAPE = {
    "triangle": "interval",
    "quadrilateral": "interval",
    "tetrahedron": "triangle",
    "hexahedron": "quadrilateral",
}

# Nodes of the degree-2 reference facets; the first ones are those of degree 1. The
# C++ library relies on this order.
FACET_NODES = {
    "interval": np.array([[0], [1], [0.5]]),
    "triangle": np.array([[0, 0], [1, 0], [0, 1], [0.5, 0.5], [0, 0.5], [0.5, 0]]),
    "quadrilateral": np.array(
        [[0, 0], [1, 0], [0, 1], [1, 1], [0.5, 0], [0, 0.5], [1, 0.5], [0.5, 1]]
        + [[0.5, 0.5]]
    ),
}
N_CORNERS = {"interval": 2, "triangle": 3, "quadrilateral": 4}

# Reference coordinates are O(1); nodes are at least 1/2 apart.
MATCH_TOLERANCE = 1e-10
# A facet narrower than this fraction of its cell has no usable normal.
MIN_RELATIVE_WIDTH = 1e-12
# Facets of a cell are at most six, so that cell * 8 + local facet is unique.
FACETS_PER_CELL = 8


# Reference facets


def facet_nodes(shape: str, degree: int) -> Array:
    """Nodes of a reference facet of degree 1 or 2, shape (n, d - 1)."""
    nodes = FACET_NODES[shape]
    return nodes if degree == 2 else nodes[: N_CORNERS[shape]]


def _monomials(shape: str, degree: int) -> list[tuple[int, ...]]:
    """Exponents of the monomials that span the facet's polynomials."""
    if shape == "interval":
        return [(i,) for i in range(degree + 1)]
    pairs = [(i, j) for i in range(degree + 1) for j in range(degree + 1)]
    return [p for p in pairs if shape == "quadrilateral" or sum(p) <= degree]


def _evaluate(exponents: Sequence[tuple[int, ...]], points: Array) -> Array:
    """Monomials at points, shape (n_points, n_monomials)."""
    return np.prod(points[:, None, :] ** np.array(exponents)[None], axis=2)


def _differentiate(
    exponents: Sequence[tuple[int, ...]], points: Array, axis: int
) -> Array:
    """First derivatives of monomials at points, shape (n_points, n_monomials)."""
    powers = np.array(exponents)
    factors = powers[:, axis].copy()
    powers[:, axis] = np.maximum(powers[:, axis] - 1, 0)
    return factors * np.prod(points[:, None, :] ** powers[None], axis=2)


def shape_functions(shape: str, degree: int, points: Array) -> tuple[Array, Array]:
    """Lagrange functions on a reference facet, in raymortar's node order.

    Parameters
    ----------
    shape, degree
        Facet shape, and degree 1 or 2.
    points
        Reference points, shape (n_points, d - 1).

    Returns
    -------
    values, gradients
        Shapes (n_points, n) and (d - 1, n_points, n).
    """
    exponents = _monomials(shape, degree)
    coefficients = np.linalg.inv(_evaluate(exponents, facet_nodes(shape, degree)))
    derivatives = [
        _differentiate(exponents, points, axis) for axis in range(points.shape[1])
    ]
    return _evaluate(exponents, points) @ coefficients, derivatives @ coefficients


def normals(tangents: Array) -> Array:
    """Un-normalised normals m of facets.

    Parameters
    ----------
    tangents
        dx/dxi_i, shape (d - 1, ..., d).

    Returns
    -------
    ndarray
        m, shape (..., d); its length is the surface Jacobian.
    """
    if len(tangents) == 2:
        return np.cross(tangents[0], tangents[1])
    return np.stack([tangents[0, ..., 1], -tangents[0, ..., 0]], axis=-1)


def _match(points: Array, targets: Array) -> list[int]:
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

    Parameters
    ----------
    cell, degree
        Cell type, and degree 1 or 2 of the element.

    Returns
    -------
    ndarray
        Shape (n_local_facets, n), indices into the nodes of the cell's element.
    """
    shape = FACET_SHAPE[cell]
    element = compat.basix_element(cell, degree)
    values, _ = shape_functions(shape, 1, facet_nodes(shape, degree))
    rows = []
    for vertices in element.facet_vertices:
        rows.append(_match(element.points, values @ element.vertices[list(vertices)]))
    return np.array(rows, dtype=np.int32)


@functools.lru_cache(maxsize=None)
def reflection(shape: str, degree: int) -> Indices:
    """Permutation of a facet's nodes that reverses its normal, shape (n,).

    The ends of an interval change places, as do xi and eta of a triangle or
    quadrilateral.
    """
    nodes = facet_nodes(shape, degree)
    mirrored = 1 - nodes if shape == "interval" else nodes[:, ::-1]
    return np.array(_match(nodes, mirrored), dtype=np.int32)


# Tagged facets


@dataclass(frozen=True)
class Facets:
    """Exterior facets with one tag, of the cells owned by this rank.

    Attributes
    ----------
    tag
        Their value in the MeshTags.
    facets, cells, local_facets
        Local index of each facet, of its cell, and its number within that cell,
        shape (n_facets,), int32.
    """

    tag: int
    facets: Indices
    cells: Indices
    local_facets: Indices


def _join(facets_list: Sequence[Facets]) -> Facets:
    """Several sets of facets one after the other; the tag loses its meaning."""
    columns = [
        np.concatenate([getattr(facets, name) for facets in facets_list])
        for name in ("facets", "cells", "local_facets")
    ]
    return Facets(-1, *columns)


def _facets_of_mesh(mesh: Mesh, tag: int, facets: Indices) -> Facets:
    """Look up cell and local number of facets with one local cell. Collective."""
    tdim = mesh.topology.dim
    to_cells = compat.connectivity(mesh, tdim - 1, tdim)
    of_cells = compat.connectivity_table(mesh, tdim, tdim - 1)
    cells = to_cells.array[to_cells.offsets[facets]]
    local_facets = (of_cells[cells] == facets[:, None]).argmax(axis=1)
    return Facets(tag, facets, cells.astype(np.int32), local_facets.astype(np.int32))


def _existing_tags(comm: MPI.Comm, facet_tags: Any) -> list[int]:
    """All tags that occur on any rank. Collective."""
    values = comm.allgather(np.unique(facet_tags.values).tolist())
    return sorted(set().union(*values))


def _check_tags(mesh: Mesh, facet_tags: Any, tag: int, role: str) -> None:
    """Refuse tags of the wrong dimension, and unknown tags. Collective."""
    comm, tdim = mesh.comm, mesh.topology.dim
    message = None
    if not all(hasattr(facet_tags, name) for name in ("dim", "indices", "values")):
        message = f"facet_tags must be MeshTags, not {type(facet_tags).__name__}"
    elif facet_tags.dim != tdim - 1:
        message = (
            f"facet_tags are tags of entities of dimension {facet_tags.dim}; facets "
            f"of this mesh have dimension {tdim - 1}"
        )
    elif not compat.on_mesh(facet_tags, mesh):
        message = "facet_tags are of another mesh than the displacement"
    raise_everywhere(comm, message)
    if comm.allreduce(int(np.sum(facet_tags.values == tag))) == 0:
        raise_everywhere(
            comm,
            f"no facet has the {role} tag {tag}; the tags that exist are "
            f"{_existing_tags(comm, facet_tags)}",
        )


def _with_owned_cell(mesh: Mesh, facets: Indices) -> Indices:
    """Those of some facets that bound at least one owned cell. Collective."""
    tdim = mesh.topology.dim
    to_cells = compat.connectivity(mesh, tdim - 1, tdim)
    owned = to_cells.array < mesh.topology.index_map(tdim).size_local
    counts = np.concatenate([[0], np.cumsum(owned)])
    first, last = to_cells.offsets[facets], to_cells.offsets[facets + 1]
    return facets[counts[last] > counts[first]]


def _marked_anywhere(index_map: Any, entities: Indices) -> npt.NDArray[np.bool_]:
    """Local entities that any rank has among some of its own. Collective."""
    marker = compat.create_la_vector(index_map)
    marker.array[entities.ravel()] = 1
    # By way of the owners, who may have none of them themselves
    compat.scatter_reverse_add(marker)
    compat.scatter_forward(marker)
    return marker.array > 0


def _check_exterior(mesh: Mesh, interior: Indices, tag: int, role: str) -> None:
    """Refuse the interior facets that carry the tag. Collective."""
    tdim = mesh.topology.dim
    midpoints = _midpoints(mesh, _facets_of_mesh(mesh, tag, interior[:1]))
    # A facet between two ranks is found by both
    facet_map = mesh.topology.index_map(tdim - 1)
    marked = _marked_anywhere(facet_map, interior)[: facet_map.size_local]
    count = mesh.comm.allreduce(int(marked.sum()))
    message = None
    if len(midpoints) > 0:
        message = (
            f"{count} facet(s) with the {role} tag {tag} lie inside the body, "
            f"between two cells, for example at {_format(midpoints[0])}: contact needs "
            "boundary facets, so the bodies must not share nodes"
        )
    raise_everywhere(mesh.comm, message)


def tagged_facets(mesh: Mesh, facet_tags: Any, tag: int, role: str) -> Facets:
    """Boundary facets with a tag, each on the rank that owns its cell. Collective.

    Parameters
    ----------
    mesh
        Mesh.
    facet_tags
        MeshTags of its facets.
    tag
        Tag of the surface.
    role
        ``"slave"`` or ``"master"``, for messages.

    Raises
    ------
    ContactError
        If the tags are not of facets, the tag does not occur, or facets inside the
        body carry it.
    """
    _check_tags(mesh, facet_tags, tag, role)
    exterior = compat.exterior_facets(mesh)
    tagged = facet_tags.indices[facet_tags.values == tag]
    # Without ghost cells a facet between two ranks has one local cell on each, so
    # the number of local cells does not tell inside from outside.
    others = np.setdiff1d(tagged, exterior)
    _check_exterior(mesh, _with_owned_cell(mesh, others), tag, role)
    return _facets_of_mesh(mesh, tag, np.intersect1d(tagged, exterior))


# Geometry of facets


def _coordinates(mesh: Mesh) -> Array:
    """Positions of the geometry nodes, shape (n_nodes, gdim)."""
    return mesh.geometry.x[:, : mesh.geometry.dim]


def _node_table(mesh: Mesh, facets: Facets) -> Indices:
    """Geometry nodes of facets, not turned outward, shape (n_facets, n)."""
    columns = cell_facet_nodes(compat.cell_name(mesh), compat.geometry_degree(mesh))
    dofmap = compat.geometry_dofmap(mesh)
    return dofmap[facets.cells[:, None], columns[facets.local_facets]]


def _cell_corners(mesh: Mesh, facets: Facets) -> Array:
    """Vertices of each facet's cell, shape (n_facets, n_vertices, gdim)."""
    cell = compat.cell_name(mesh)
    element = compat.basix_element(cell, compat.geometry_degree(mesh))
    columns = _match(element.points, element.vertices)
    return _coordinates(mesh)[compat.geometry_dofmap(mesh)[facets.cells][:, columns]]


def _facet_corners(mesh: Mesh, facets: Facets) -> Array:
    """Vertices of each facet, not turned outward, shape (n_facets, n, gdim)."""
    n = N_CORNERS[FACET_SHAPE[compat.cell_name(mesh)]]
    return _coordinates(mesh)[_node_table(mesh, facets)[:, :n]]


def _midpoints(mesh: Mesh, facets: Facets) -> Array:
    """Centre of each facet's vertices, shape (n_facets, gdim)."""
    return _facet_corners(mesh, facets).mean(axis=1)


def _format(point: Array) -> str:
    """Coordinates for a message."""
    return "(" + ", ".join(f"{x:.6g}" for x in point) + ")"


def _points_inward(mesh: Mesh, facets: Facets) -> npt.NDArray[np.bool_]:
    """Whether the normal at each facet's centre points into its cell, unturned."""
    shape = FACET_SHAPE[compat.cell_name(mesh)]
    corners = _facet_corners(mesh, facets)
    centre = facet_nodes(shape, 1).mean(axis=0, keepdims=True)
    _, gradients = shape_functions(shape, 1, centre)
    m = normals(np.einsum("ia,fad->ifd", gradients[:, 0], corners))
    outward = corners.mean(axis=1) - _cell_corners(mesh, facets).mean(axis=1)
    return np.einsum("fd,fd->f", m, outward) < 0


def _turn_outward(
    table: Indices, inward: npt.NDArray[np.bool_], shape: str, degree: int
) -> Indices:
    """Reflect the rows of a facet table whose normal points inward."""
    turned = table[:, reflection(shape, degree)]
    return np.where(inward[:, None], turned, table).astype(np.int32)


def facet_dof_table(V: FunctionSpace, facets: Facets) -> Indices:
    """Local block dofs of facets, turned outward, shape (n_facets, n)."""
    mesh, degree = V.mesh, compat.element_info(V).degree
    cell = compat.cell_name(mesh)
    columns = cell_facet_nodes(cell, degree)[facets.local_facets]
    table = compat.dofmap_array(V)[facets.cells[:, None], columns]
    inward = _points_inward(mesh, facets)
    return _turn_outward(table, inward, FACET_SHAPE[cell], degree)


def facet_node_table(mesh: Mesh, facets: Facets) -> Indices:
    """Local geometry nodes of facets, turned outward, shape (n_facets, n)."""
    shape = FACET_SHAPE[compat.cell_name(mesh)]
    table, inward = _node_table(mesh, facets), _points_inward(mesh, facets)
    return _turn_outward(table, inward, shape, compat.geometry_degree(mesh))


# Surfaces


@dataclass(frozen=True)
class Surface:
    """A union of tagged facets in the reference configuration, one rank's share.

    Attributes
    ----------
    shape
        ``"interval"``, ``"triangle"`` or ``"quadrilateral"``.
    gdim
        Dimension d of the space.
    displacement_degree
        Degree p of the displacement on a facet.
    node_degree
        Degree k = max(p, degree of the geometry) of the positions on a facet.
    dofs
        Local block dofs of the displacement space in use, sorted, (n_dofs,), int32.
    dof_ids
        Their global indices, (n_dofs,), int64.
    facet_dofs
        Displacement dofs of each facet, (n_facets, n_p), int32, indices into ``dofs``.
    X
        Reference positions of the nodes, (n_nodes, d). Length.
    node_ids
        Global identification of the nodes, (n_nodes,), int64.
    facet_nodes
        Nodes of each facet, (n_facets, n_k), int32, indices into ``X``.
    facet_ids
        Global cell index * 8 + local facet, (n_facets,), int64: unique over ranks.
    zone
        Which of the joined sets each facet is from, (n_facets,), int32.

    Notes
    -----
    If k = p, nodes and dofs are the same and in the same order. If k = 2 > p = 1,
    the nodes are those of the geometry.
    """

    shape: str
    gdim: int
    displacement_degree: int
    node_degree: int
    dofs: Indices
    dof_ids: Global
    facet_dofs: Indices
    X: Array
    node_ids: Global
    facet_nodes: Indices
    facet_ids: Global
    zone: Indices


def _compress(table: Indices) -> tuple[Indices, Indices]:
    """Sorted unique entries of a table, and the table as indices into them."""
    used, inverse = np.unique(table, return_inverse=True)
    return used.astype(np.int32), inverse.reshape(table.shape).astype(np.int32)


def _facet_ids(mesh: Mesh, facets: Facets) -> Global:
    """Globally unique number of each facet."""
    cell_map = mesh.topology.index_map(mesh.topology.dim)
    cells = compat.local_to_global(cell_map, facets.cells)
    return cells * FACETS_PER_CELL + facets.local_facets


def build_surface(u: Function, facets_list: Sequence[Facets]) -> Surface:
    """Arrays of a union of facets with different tags.

    Parameters
    ----------
    u
        Displacement, of a space accepted by :func:`check_space`.
    facets_list
        At least one set of facets; no facet may be in two of them.
    """
    V, mesh = u.function_space, u.function_space.mesh
    gdim, p = mesh.geometry.dim, compat.element_info(V).degree
    facets = _join(facets_list)
    dofs, facet_dofs = _compress(facet_dof_table(V, facets))
    dof_ids = compat.local_to_global(V.dofmap.index_map, dofs)
    if compat.geometry_degree(mesh) > p:
        nodes, table = _compress(facet_node_table(mesh, facets))
        X, node_ids = _coordinates(mesh)[nodes], compat.geometry_nodes_global(mesh)
        node_ids = node_ids[nodes]
    else:
        X, node_ids, table = V.tabulate_dof_coordinates()[dofs, :gdim], dof_ids, None
    counts = [len(part.facets) for part in facets_list]
    return Surface(
        shape=FACET_SHAPE[compat.cell_name(mesh)],
        gdim=gdim,
        displacement_degree=p,
        node_degree=max(p, compat.geometry_degree(mesh)),
        dofs=dofs,
        dof_ids=dof_ids,
        facet_dofs=facet_dofs,
        X=np.ascontiguousarray(X),
        node_ids=node_ids,
        facet_nodes=facet_dofs if table is None else table,
        facet_ids=_facet_ids(mesh, facets),
        zone=np.repeat(np.arange(len(counts), dtype=np.int32), counts),
    )


# Checks of the input


def _mesh_fault(mesh: Mesh) -> str | None:
    """What is wrong with the mesh, if anything."""
    gdim, cell = mesh.geometry.dim, compat.cell_name(mesh)
    if gdim not in (2, 3):
        return f"the mesh is in a space of dimension {gdim}; contact needs 2 or 3"
    if mesh.topology.dim != gdim:
        return (
            f"cells of dimension {mesh.topology.dim} in a space of dimension {gdim}: "
            "shells, membranes and beams are not supported"
        )
    if cell not in FACET_SHAPE:
        return (
            f"the mesh has {cell} cells; supported are meshes of one of "
            f"{', '.join(FACET_SHAPE)}"
        )
    if compat.geometry_degree(mesh) > 2:
        return (
            f"the geometry of the mesh has degree {compat.geometry_degree(mesh)}; "
            "supported are 1 and 2"
        )
    return None


def _element_fault(V: FunctionSpace) -> str | None:
    """What is wrong with the displacement's element, if anything."""
    info, gdim = compat.element_info(V), V.mesh.geometry.dim
    if info.is_sub_space:
        return (
            "the displacement is a view into a larger space; contact needs a Function "
            "on a space of its own (collapse the sub-space)"
        )
    if info.is_mixed:
        return (
            "the displacement's element is mixed or holds values at quadrature points; "
            "contact needs a plain Lagrange one"
        )
    if not info.is_lagrange:
        return "the displacement's element is not a Lagrange element"
    if info.is_discontinuous:
        return "the displacement's element is discontinuous"
    if info.value_shape != (gdim,) or info.block_size != gdim:
        return (
            f"the displacement has values of shape {info.value_shape}; contact needs "
            f"vectors of shape {(gdim,)}"
        )
    if info.degree not in (1, 2):
        return f"the displacement has degree {info.degree}; supported are 1 and 2"
    return None


def _value_fault(u: Function) -> str | None:
    """What is wrong with the displacement's values on this rank, if anything."""
    values = u.x.array
    if not compat.scalar_type_is_real() or values.dtype != np.float64:
        kind = values.dtype if compat.scalar_type_is_real() else "complex PETSc"
        return f"contact needs real numbers in double precision, not {kind}"
    count = int(np.sum(~np.isfinite(values)))
    return f"the displacement has {count} value(s) not finite" if count > 0 else None


def check_space(u: Function) -> None:
    """Refuse displacements that raymortar cannot handle. Collective.

    Raises
    ------
    ContactError
        If the mesh is not of triangles, quadrilaterals, tetrahedra or hexahedra of
        degree 1 or 2, the space not of continuous Lagrange vectors of degree 1 or 2,
        the numbers not doubles, or some values not finite.
    """
    V = u.function_space
    message = _mesh_fault(V.mesh) or _element_fault(V) or _value_fault(u)
    raise_everywhere(V.mesh.comm, message)


def _facet_vertices(mesh: Mesh, facets: Facets) -> Indices:
    """Local topology vertices of facets, shape (n_facets, n). Collective."""
    element = compat.basix_element(compat.cell_name(mesh), 1)
    columns = np.array(element.facet_vertices)[facets.local_facets]
    to_vertices = compat.connectivity_table(mesh, mesh.topology.dim, 0)
    return to_vertices[facets.cells[:, None], columns]


def check_pair(mesh: Mesh, slave: Facets, master: Facets) -> None:
    """Refuse a slave and a master surface that touch in the mesh. Collective.

    Raises
    ------
    ContactError
        If they share vertices (hence also if they share facets).
    """
    vertices, vertex_map = _facet_vertices(mesh, slave), mesh.topology.index_map(0)
    # The two surfaces may sit on different ranks
    shared = _marked_anywhere(vertex_map, vertices)
    shared &= _marked_anywhere(vertex_map, _facet_vertices(mesh, master))
    count = mesh.comm.allreduce(int(shared[: vertex_map.size_local].sum()))
    message = None
    if np.any(shared[vertices]):
        # Both follow Basix's order of the facet's vertices.
        corners = _vertex_coordinates(mesh, slave)
        message = (
            f"the slave surface (tag {slave.tag}) and the master surface (tag "
            f"{master.tag}) share {count} vertex(es), for example at "
            f"{_format(corners[shared[vertices]][0])}: they must be apart in the mesh"
        )
    raise_everywhere(mesh.comm, message)


def _vertex_coordinates(mesh: Mesh, facets: Facets) -> Array:
    """Positions of :func:`_facet_vertices`, shape (n_facets, n, gdim)."""
    element = compat.basix_element(compat.cell_name(mesh), 1)
    columns = np.array(element.facet_vertices)[facets.local_facets]
    corners = _cell_corners(mesh, facets)
    return np.take_along_axis(corners, columns[:, :, None], axis=1)


def _areas(mesh: Mesh, facets: Facets) -> Array:
    """Reference area (length in 2D) of each facet, shape (n_facets,)."""
    degree, shape = compat.geometry_degree(mesh), FACET_SHAPE[compat.cell_name(mesh)]
    points, weights = compat.quadrature(shape, 2 * degree)
    _, gradients = shape_functions(shape, degree, points)
    nodes = _coordinates(mesh)[_node_table(mesh, facets)]
    tangents = np.einsum("iqa,fad->ifqd", gradients, nodes)
    return np.linalg.norm(normals(tangents), axis=-1) @ weights


def _extent(points: Array) -> Array:
    """Diagonal of the bounding box of each set of points (n, n_points, d)."""
    return np.linalg.norm(points.max(axis=1) - points.min(axis=1), axis=-1)


def check_areas(mesh: Mesh, facets: Facets) -> None:
    """Refuse facets without area, or at coordinates that are not finite. Collective.

    The width of a facet (its length in 2D, else its area over its diameter) is
    compared with the diameter of its cell: an edge is never short against itself.

    Raises
    ------
    ContactError
        Naming the tag, and the cell and midpoint of the first such facet.
    """
    area = _areas(mesh, facets)
    smallest = MIN_RELATIVE_WIDTH * _extent(_cell_corners(mesh, facets))
    if mesh.geometry.dim == 3:
        smallest = smallest * _extent(_facet_corners(mesh, facets))
    message = None
    # Written so that NaN is bad.
    bad = np.flatnonzero(~((area > smallest) & np.isfinite(area)))
    if len(bad) > 0:
        first = bad[0]
        cell = _facet_ids(mesh, facets)[first] // FACETS_PER_CELL
        fault = "no area" if np.isfinite(area[first]) else "coordinates not finite"
        message = (
            f"{len(bad)} facet(s) with tag {facets.tag} have {fault}, the first on "
            f"cell {cell} at {_format(_midpoints(mesh, facets)[first])}"
        )
    raise_everywhere(mesh.comm, message)

"""Measures of tagged parts of a mesh, integrated without DOLFINx's forms.

Nothing is compiled, so that the tests of meshes are quick. All functions but the
local ones are collective.
"""

from mpi4py import MPI

import basix
import numpy as np

from raymortar.core import compat

QUADRATURE_DEGREE = 6


def lagrange(cell, degree, points):
    """Shape functions of a cell and their gradients, (1 + d, points, nodes)."""
    element = basix.create_element(
        basix.ElementFamily.P,
        getattr(basix.CellType, cell),
        degree,
        basix.LagrangeVariant.equispaced,
    )
    return element.tabulate(1, np.asarray(points))[..., 0]


def _tabulate(mesh, points):
    """Derivatives (d, points, nodes) of the geometry's shape functions."""
    return lagrange(compat.cell_name(mesh), compat.geometry_degree(mesh), points)[1:]


def cell_nodes(mesh, owned=True):
    """Coordinates of the nodes of this rank's cells, (n, nodes, d)."""
    d = mesh.geometry.dim
    nodes = mesh.geometry.x[compat.geometry_dofmap(mesh)][:, :, :d]
    return nodes[: mesh.topology.index_map(d).size_local] if owned else nodes


def jacobians(mesh, points):
    """Jacobians of this rank's owned cells at reference `points`: (n, points, d, d)."""
    return np.einsum("aqn,cni->cqia", _tabulate(mesh, points), cell_nodes(mesh))


def check_points(mesh):
    """Nodes and quadrature points of the reference cell."""
    cell = compat.cell_name(mesh)
    points, _ = compat.quadrature(cell, QUADRATURE_DEGREE)
    nodes = compat.basix_element(cell, compat.geometry_degree(mesh)).points
    return np.vstack([points, nodes])


def smallest_jacobian(mesh):
    """Smallest determinant at nodes and quadrature points, over the cell's largest."""
    det = np.linalg.det(jacobians(mesh, check_points(mesh)))
    smallest = (det.min(axis=1) / np.abs(det).max(axis=1)).min(initial=1.0)
    return mesh.comm.allreduce(smallest, op=MPI.MIN)


def volume(mesh, cell_tags, tag):
    """Volume (area) of the cells with a tag."""
    points, weights = compat.quadrature(compat.cell_name(mesh), QUADRATURE_DEGREE)
    det = np.linalg.det(jacobians(mesh, points)) @ weights
    owned = cell_tags.indices < len(det)
    cells = cell_tags.indices[owned & (cell_tags.values == tag)]
    return mesh.comm.allreduce(det[cells].sum(), op=MPI.SUM)


def owned_facets(mesh, facet_tags, tag):
    """Owned facets with a tag."""
    count = mesh.topology.index_map(mesh.topology.dim - 1).size_local
    chosen = (facet_tags.indices < count) & (facet_tags.values == tag)
    return facet_tags.indices[chosen]


def facet_cells(mesh, facets):
    """A cell of each facet, and the facet's number in it."""
    tdim = mesh.topology.dim
    width = len(compat.basix_element(compat.cell_name(mesh), 1).facet_vertices)
    table = compat.connectivity_table(mesh, tdim, tdim - 1).reshape(-1, width)
    links = compat.connectivity(mesh, tdim - 1, tdim)
    cells = links.array[links.offsets[facets]]
    return cells, np.argmax(table[cells] == np.asarray(facets)[:, None], axis=1)


def facet_nodes(mesh, facets):
    """Coordinates of the geometry nodes of each facet, (n, nodes, d)."""
    element = compat.basix_element(compat.cell_name(mesh), compat.geometry_degree(mesh))
    dofs = np.array(element.facet_dofs)
    cells, local = facet_cells(mesh, facets)
    nodes = cell_nodes(mesh, owned=False)[cells]
    return np.take_along_axis(nodes, dofs[local][:, :, None], axis=1)


def _facet_tangents(mesh, facets):
    """Tangents (n, points, d, d - 1) at quadrature points, and the weights."""
    cell, d = compat.cell_name(mesh), mesh.geometry.dim
    reference = compat.basix_element(cell, 1)
    shape = {2: "interval", 3: "triangle" if cell == "tetrahedron" else "quadrilateral"}
    points, weights = compat.quadrature(shape[d], QUADRATURE_DEGREE)
    cells, local = facet_cells(mesh, facets)
    nodes = cell_nodes(mesh, owned=False)
    tangents = np.zeros((len(facets), len(weights), d, d - 1))
    for i, vertices in enumerate(reference.facet_vertices):
        corners = reference.vertices[list(vertices)]
        edges = corners[1:d] - corners[0]
        shape_gradients = _tabulate(mesh, corners[0] + points @ edges)
        mine = local == i
        J = np.einsum("aqn,cni->cqia", shape_gradients, nodes[cells[mine]])
        tangents[mine] = J @ edges.T
    return tangents, weights


def area(mesh, facet_tags, tag):
    """Measure of the facets with a tag."""
    facets = owned_facets(mesh, facet_tags, tag)
    tangents, weights = _facet_tangents(mesh, facets)
    gram = np.einsum("cqia,cqib->cqab", tangents, tangents)
    local = (np.sqrt(np.linalg.det(gram)) @ weights).sum()
    return mesh.comm.allreduce(local, op=MPI.SUM)


def exterior_area(mesh):
    """Measure of the whole boundary."""
    facets = compat.exterior_facets(mesh)
    tags = compat.meshtags(mesh, mesh.topology.dim - 1, facets, 1)
    return area(mesh, tags, 1)


def facet_counts(mesh, facet_tags, largest):
    """Number of facets in the whole mesh with each tag up to `largest`."""
    values = [owned_facets(mesh, facet_tags, tag).size for tag in range(largest + 1)]
    return mesh.comm.allreduce(np.array(values), op=MPI.SUM)


def aspect_ratios(mesh):
    """Largest ratio of the singular values of each owned cell's Jacobian."""
    singular = np.linalg.svd(jacobians(mesh, check_points(mesh)), compute_uv=False)
    return (singular[:, :, 0] / singular[:, :, -1]).max(axis=1)

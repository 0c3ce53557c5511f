"""Small meshes of the unit square or cube, from arrays, and their tagged sides."""

from itertools import permutations

from mpi4py import MPI

import numpy as np
from dolfinx import fem
from dolfinx import mesh as dmesh

from meshes.from_arrays import create_mesh
from raymortar.core import compat
from raymortar.core.discretization.facets import normals, shape_functions, tagged_facets

COMM = MPI.COMM_WORLD
CELLS = ["triangle", "quadrilateral", "tetrahedron", "hexahedron"]
DEGREES = [(1, 1), (1, 2), (2, 1), (2, 2)]  # of displacement, of geometry


def unit_cells(cell):
    """Corners of the cells that fill the unit square or cube."""
    square = np.array([[0.0, 0], [1, 0], [0, 1], [1, 1]])
    if cell == "triangle":
        return square[[[0, 1, 3], [0, 2, 3]]]
    if cell == "quadrilateral":
        return square[None]
    if cell == "hexahedron":
        bottom = np.column_stack([square, np.zeros(4)])
        return np.vstack([bottom, bottom + [0, 0, 1]])[None]
    # Kuhn's six tetrahedra: walk from 0 to (1, 1, 1) along the axes in any order.
    steps = [np.eye(3)[list(order)] for order in permutations(range(3))]
    return np.array([np.vstack([np.zeros(3), s.cumsum(axis=0)]) for s in steps])


def corner_functions(cell, points):
    """(Bi, tri)linear functions of the corners at reference points."""
    if cell in ("triangle", "tetrahedron"):
        return np.column_stack([1 - points.sum(axis=1), points])
    columns = []
    for a in range(2 ** points.shape[1]):
        bits = np.array([a >> i & 1 for i in range(points.shape[1])])
        columns.append(np.prod(np.where(bits, points, 1 - points), axis=1))
    return np.column_stack(columns)


def box_arrays(cell, n, degree, offset=0.0, move=lambda x: x):
    """Cells and points of n^d boxes in the unit square or cube."""
    corners = unit_cells(cell)
    gdim = corners.shape[2]
    grid = np.stack(np.meshgrid(*[np.arange(n)] * gdim, indexing="ij"), axis=-1)
    corners = (grid.reshape(-1, 1, 1, gdim) + corners).reshape(-1, *corners.shape[1:])
    values = corner_functions(cell, compat.basix_element(cell, degree).points)
    points = np.einsum("ab,cbd->cad", values, corners / n)
    keys = np.round(points * 60).astype(int).reshape(-1, gdim)
    _, first, cells = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    x = move(points.reshape(-1, gdim)[first])
    x[:, -1] += offset
    return cells.reshape(points.shape[:2]), x


def build(cell, arrays, degree=1, ghosts=False, comm=COMM):
    """Distribute arrays that live on the first rank."""
    cells, x = arrays
    if comm.rank > 0:
        cells, x = cells[:0], x[:0]
    return create_mesh(comm, cells, x, cell, degree, ghosts)


def box(cell, n=2, degree=1, ghosts=False, comm=COMM, **options):
    return build(cell, box_arrays(cell, n, degree, **options), degree, ghosts, comm)


def curve(x):
    """Smooth bend that keeps the shape of the cells."""
    return x + 0.08 * np.sin(2 * x[:, ::-1] + np.arange(x.shape[1]))


def displacement(mesh, degree=1):
    return fem.Function(compat.vector_space(mesh, degree))


def tag_sides(mesh, *sides):
    """Tags 1, 2, ... on the boundary facets at coordinate ``axis`` = ``value``."""
    tdim = mesh.topology.dim
    entities, values = [], []
    for tag, (axis, value) in enumerate(sides, 1):
        found = dmesh.locate_entities_boundary(
            mesh, tdim - 1, lambda x: np.isclose(x[axis], value)
        )
        entities.append(found)
        values.append(np.full(len(found), tag))
    return compat.meshtags(
        mesh, tdim - 1, np.concatenate(entities), np.concatenate(values)
    )


def whole_boundary(mesh):
    facets = compat.exterior_facets(mesh)
    tags = compat.meshtags(mesh, mesh.topology.dim - 1, facets, 7)
    return tagged_facets(mesh, tags, 7, "slave")


def integrate(surface, integrand):
    """Integral over all ranks' facets of a function of (x, m)."""
    points, weights = compat.quadrature(surface.shape, 8)
    values, gradients = shape_functions(surface.shape, surface.node_degree, points)
    nodes = surface.X[surface.facet_nodes]
    x = np.einsum("qa,fad->fqd", values, nodes)
    m = normals(np.einsum("iqa,fad->ifqd", gradients, nodes))
    return COMM.allreduce(np.einsum("q,fq...->...", weights, integrand(x, m)))

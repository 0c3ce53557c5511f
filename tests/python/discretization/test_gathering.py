"""Facets on rank 0, for pictures."""

import numpy as np
import pytest
from dolfinx import fem
from problems import COMM

from meshes.scenes import two_blocks
from raymortar.core import compat
from raymortar.plotting.frames import gather_boundary, gather_cells


def area(polygons):
    """Area of polygons (n, k, 3), which are flat."""
    following = np.roll(polygons, -1, axis=1)
    return 0.5 * np.linalg.norm(np.cross(polygons, following).sum(axis=1), axis=1)


@pytest.mark.mpi
@pytest.mark.parametrize("cell, corners", [("tetrahedron", 3), ("hexahedron", 4)])
def test_curved_facets_have_the_nodes_amid_their_edges_in_between(cell, corners):
    scene = two_blocks(COMM, 3, cell, 2)
    u = fem.Function(compat.vector_space(scene.mesh, 2))
    u.interpolate(lambda x: x**2)
    straight = gather_boundary(scene.mesh, u)
    found = gather_boundary(scene.mesh, u, parts=2)
    if COMM.rank > 0:
        assert all(part is None for part in found)
        return
    x, values = found
    assert x.shape == values.shape == (len(straight[0]), 2 * corners, 3)
    np.testing.assert_allclose(x[:, ::2], straight[0], atol=1e-14)
    mean = 0.5 * (x[:, ::2] + np.roll(x[:, ::2], -1, axis=1))
    np.testing.assert_allclose(x[:, 1::2], mean, atol=1e-14)
    np.testing.assert_allclose(values, x**2, atol=1e-13)
    np.testing.assert_allclose(area(x), area(straight[0]), atol=1e-13)


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ["triangle", "quadrilateral"])
def test_edges_of_degree_2_are_drawn_as_arcs(cell):
    """Two blocks bent by a quadratic map, by their nodes and by a displacement."""

    def bent(x):
        return np.array([0.3 * x[1] ** 2, -0.2 * x[0] * x[1]])

    mesh = two_blocks(COMM, 2, cell, 2, geometry_degree=2).mesh
    X = mesh.geometry.x.copy()
    mesh.geometry.x[:, :2] += bent(X.T).T
    u = fem.Function(compat.vector_space(mesh, 2))
    found = gather_cells(mesh, u)
    mesh.geometry.x[:] = X
    u.interpolate(bent)
    moved = gather_cells(mesh, u)
    if COMM.rank > 0:
        return
    x = moved[0]
    corners = {"triangle": 3, "quadrilateral": 4}[cell]
    assert x.shape[1] > 3 * corners and x.shape[1] % corners == 0
    exact = x[..., :2] + bent(x.reshape(-1, 3).T).T.reshape(*x.shape[:2], 2)
    np.testing.assert_allclose(found[0][..., :2], exact, atol=1e-13)
    np.testing.assert_allclose((x[..., :2] + moved[1]), exact, atol=1e-13)

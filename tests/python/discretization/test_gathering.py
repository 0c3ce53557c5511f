"""Facets on rank 0, for pictures."""

import numpy as np
import pytest
from dolfinx import fem
from problems import COMM

from meshes.scenes import two_blocks
from raymortar import compat
from raymortar.plotting.frames import gather_boundary


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
    found = gather_boundary(scene.mesh, u, is_curved=True)
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

"""Angles at the edges of the undeformed boundary."""

from __future__ import annotations

import boxes
import numpy as np
import pytest
from boxes import COMM

from raymortar.host.edges import Edges
from raymortar.host.facets import coordinates, exterior_facets, facet_node_table


def around(x):
    """The unit box as a sector of 0.8 rad of a ring or a tube, of radii 1 and 2."""
    r, angle = 1.0 + x[:, 1], 0.8 * x[:, 0]
    rest = [x[:, 2]] if x.shape[1] == 3 else []
    return np.column_stack([r * np.sin(angle), r * np.cos(angle), *rest])


def chosen(mesh, where):
    """Rows of the boundary facets whose nodes all fulfil a condition."""
    facets = exterior_facets(mesh)
    nodes = coordinates(mesh)[facet_node_table(mesh, facets)]
    return facets, np.array([bool(np.all(where(x))) for x in nodes], dtype=bool)


def count(mask):
    return COMM.allreduce(int(np.count_nonzero(mask)))


@pytest.mark.mpi
@pytest.mark.parametrize("cell", boxes.CELLS)
def test_a_box_is_flat_between_sharp_edges(cell):
    mesh = boxes.box(cell, 3)
    facets, _ = chosen(mesh, lambda x: True)
    edges = Edges(mesh)
    assert edges.are_smooth(facets).all()
    sharp = edges.are_sharp(facets)
    expected = {"triangle": 8, "quadrilateral": 8, "hexahedron": 48, "tetrahedron": 60}
    assert count(sharp) == expected[cell]


@pytest.mark.mpi
@pytest.mark.parametrize("cell", boxes.CELLS)
@pytest.mark.parametrize("degree", (1, 2))
def test_a_round_side_is_smooth_where_facets_bend(cell, degree):
    mesh = boxes.box(cell, 4, degree=degree, move=around)
    round_one = lambda x: np.isclose(np.linalg.norm(x[:, :2], axis=1), 2.0, atol=0.02)
    facets, outer = chosen(mesh, round_one)
    assert count(outer) > 0
    smooth = Edges(mesh).are_smooth(facets)
    # Triangles in the corners have two sharp edges and the diagonal of a flat facet
    corners = 8 if cell == "tetrahedron" else 0
    assert count(smooth[outer]) == (count(outer) if degree == 2 else corners)
    flat = ~outer & ~chosen(mesh, lambda x: np.linalg.norm(x[:, :2], axis=1) < 1.02)[1]
    assert smooth[flat].all()

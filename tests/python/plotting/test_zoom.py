"""Polygons of bodies that a zoom cuts."""

import numpy as np
import pytest

from raymortar.plotting.clipping import within

BOX = np.array([0.2, 0.2, -1.0]), np.array([0.8, 0.7, 1.0])


def area(polygon):
    spokes = polygon - polygon[0]
    normal = np.cross(spokes, np.roll(spokes, -1, axis=0)).sum(axis=0)
    return 0.5 * np.linalg.norm(normal)


def squares(n):
    """The unit square in n x n squares, moved by (0.1, 0, 0), with the values 2 x + y."""
    begin = np.stack(np.meshgrid(*2 * [np.arange(n) / n]), axis=-1).reshape(-1, 1, 2)
    x = begin + np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) / n
    x = np.concatenate([x, np.zeros((*x.shape[:2], 1))], axis=2)
    u = np.broadcast_to([0.1, 0.0, 0.0], x.shape)
    return [x, u, 2.0 * x[..., :1] + x[..., 1:2]]


@pytest.mark.parametrize("n", [1, 2, 3, 7, 10])
def test_polygons_in_space_end_at_the_box(n):
    x, u, values = within(squares(n), BOX)
    at = x + u
    assert (at >= BOX[0] - 1e-14).all() and (at <= BOX[1] + 1e-14).all()
    assert sum(map(area, at)) == pytest.approx(0.6 * 0.5, rel=1e-12)
    assert np.allclose(values, 2.0 * x[..., :1] + x[..., 1:2], atol=1e-14)
    assert np.allclose(u, [0.1, 0.0, 0.0], atol=1e-14)


def test_polygons_beside_the_box_are_left_out():
    x, u, values = within(squares(3), (BOX[0] + 3.0, BOX[1] + 3.0))
    assert len(x) == len(u) == len(values) == 0

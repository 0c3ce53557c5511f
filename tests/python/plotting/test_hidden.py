"""Facets in space: in each pixel the nearest is seen."""

import numpy as np
import pytest

from raymortar.plotting.hidden import edges_seen, fans, nearest

SQUARE = np.array([[0.0, 0.0, 0.0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])


def areas(triangles):
    one, other = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    return 0.5 * np.linalg.norm(np.cross(one, other), axis=1)


@pytest.mark.parametrize("corners", [3, 4])
def test_fans_fill_their_polygons(corners):
    polygons = np.array([size * SQUARE[:corners] for size in (1.0, 8.0, 3.0)])
    own = np.array([1.0, 64.0, 9.0]) * (1.0 if corners == 4 else 0.5)
    found = areas(fans(polygons)).reshape(3, -1).sum(axis=1)
    np.testing.assert_allclose(found, own, rtol=1e-14)


def test_points_that_are_repeated_add_no_area():
    polygon = SQUARE[[0, 1, 2, 2, 2]][None]
    found = areas(fans(polygon))
    assert found.sum() == pytest.approx(0.5, rel=1e-14)
    number, _, _ = nearest(9.0 * fans(polygon), (9, 9))
    assert not set(number) - {-1, *np.flatnonzero(found)}


@pytest.mark.parametrize("seed", range(5))
def test_each_pixel_has_the_nearest_triangle(seed):
    """Against all triangles, one after the other, at the middles of pixels."""
    random, (rows, columns) = np.random.default_rng(seed), (23, 31)
    triangles = random.uniform(-5.0, 35.0, size=(40, 3, 3))
    number, shares, depth = nearest(triangles, (rows, columns))
    y, x = np.divmod(np.arange(rows * columns), columns)
    at = np.column_stack([x + 0.5, y + 0.5, np.ones(len(x))])
    best, expected = np.full(len(at), -np.inf), np.full(len(at), -1)
    for k, corners in enumerate(triangles):
        table = np.column_stack([corners[:, :2], np.ones(3)]).T
        share = np.linalg.solve(table, at.T).T
        z = np.where((share >= 0.0).all(axis=1), share @ corners[:, 2], -np.inf)
        expected[z > best], best = k, np.maximum(best, z)
    assert (expected >= 0).any() and (expected < 0).any()
    np.testing.assert_array_equal(number, expected)
    np.testing.assert_allclose(depth, best, rtol=1e-9)
    seen = number >= 0
    places = np.einsum("nk,nki->ni", shares[seen], triangles[number[seen]])
    np.testing.assert_allclose(places[:, :2], at[seen, :2], atol=1e-9)


def test_facets_that_cross_share_their_pixels_where_they_do():
    """Two squares that lean against each other: sorting whole facets shows one of them."""
    rising, falling = SQUARE * 40.0, SQUARE * 40.0
    rising[:, 2] = rising[:, 0]
    falling[:, 2] = 40.0 - falling[:, 0]
    number, _, _ = nearest(fans(np.array([rising, falling])), (40, 40))
    facet = number.reshape(40, 40) // 4
    assert (facet[:, :20] == 1).all() and (facet[:, 20:] == 0).all()


def test_edges_behind_a_facet_are_hidden():
    depth = np.full((20, 20), -np.inf)
    depth[:, 5:15] = 1.0
    line = np.array([[[0.0, 10.0, 0.0], [20.0, 10.0, 0.0]]])
    row, column = np.divmod(edges_seen(line, depth, 1e-3), 20)
    assert (row == 10).all()
    # Beside the facet, and at its rim
    np.testing.assert_array_equal(column, [*range(6), *range(14, 20)])
    line[..., 2] = 1.0 - 1e-4
    assert len(edges_seen(line, depth, 1e-3)) == 20

"""Polygons as pieces of one size."""

import numpy as np
import pytest

from raymortar.plotting.pieces import MOST_PIECES, pieces_of_one_size

SQUARE = np.array([[0.0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])


def areas(triangles):
    """Areas of triangles, (n,)."""
    one, other = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    return 0.5 * np.linalg.norm(np.cross(one, other), axis=1)


@pytest.mark.parametrize("corners", [3, 4])
@pytest.mark.parametrize("sizes", [(1.0,), (8.0, 1.0, 3.0)])
def test_pieces_fill_their_polygons(corners, sizes):
    polygons = np.array([size * SQUARE[:corners] for size in sizes])
    pieces, of, outlines = pieces_of_one_size(polygons)
    own = np.square(sizes) * (1.0 if corners == 4 else 0.5)
    found = np.bincount(of, areas(pieces))
    np.testing.assert_allclose(found, own, rtol=1e-12)
    ends = np.linalg.norm(np.diff(polygons, axis=1, append=polygons[:, :1]), axis=2)
    drawn = np.linalg.norm(np.diff(outlines, axis=1), axis=2)
    assert drawn.sum() == pytest.approx(ends.sum(), rel=1e-12)
    assert len(pieces) <= MOST_PIECES


def test_pieces_have_one_size():
    polygons = np.array([8.0 * SQUARE, SQUARE])
    pieces, of, _ = pieces_of_one_size(polygons)
    large, small = (areas(pieces[of == k]).max() for k in (0, 1))
    assert 0.25 < large / small < 4.0


def test_many_polygons_stay_whole():
    polygons = np.tile(SQUARE, (MOST_PIECES, 1, 1))
    pieces, _, outlines = pieces_of_one_size(polygons)
    assert len(pieces) == len(outlines) == 4 * MOST_PIECES

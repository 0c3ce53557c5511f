"""Tools of straight lines with fillets, and surfaces turned by a point in their solid."""

from __future__ import annotations

import numpy as np
import pytest
from rigid_scenes import press
from test_facet_surfaces import CUBE, FACES, TRIANGLES, force_of

from raymortar import ContactError, SNESSolver, rigid

CUP = [(0.0, 3.0), (0.0, 1.0), (2.0, 1.0), (2.0, 3.0)]  # the solid on the left: in it


def bends(surface):
    """Positions and unit normals out of the solid along the facets, (points, 2) each."""
    t = np.linspace(0.0, 1.0, 11)
    shapes = np.array([(1 - t) * (1 - 2 * t), t * (2 * t - 1), 4 * t * (1 - t)])
    slopes = np.array([4 * t - 3, 4 * t - 1, 4 - 8 * t])
    x, along = (
        np.einsum("kp,mkd->mpd", one, surface.points[surface.facets])
        for one in (shapes, slopes)
    )
    out = np.stack([along[..., 1], -along[..., 0]], axis=-1)
    return x, out / np.linalg.norm(out, axis=2, keepdims=True)


@pytest.mark.quick
def test_fillets_have_their_radius_and_no_kinks():
    radius = 0.4
    x, normals = bends(rigid.Polyline(CUP, radius))
    centres = np.array([[radius, 1.0 + radius], [2.0 - radius, 1.0 + radius]])
    for centre, side in zip(centres, (-1.0, 1.0)):
        arc = (side * (x[..., 0] - centre[0]) > 0.0) & (x[..., 1] < centre[1])
        away = x[arc] - centre
        size = np.linalg.norm(away, axis=1)
        np.testing.assert_allclose(size, radius, rtol=2.4e-6)
        np.testing.assert_allclose(normals[arc], away / size[:, None], atol=6e-5)
    # The ends of facets, one after the other along the way
    np.testing.assert_allclose(x[1:, 0], x[:-1, -1], atol=1e-14)
    np.testing.assert_allclose(normals[1:, 0], normals[:-1, -1], atol=1e-13)


@pytest.mark.mpi
def test_a_nose_of_two_fillets_is_a_circle():
    """They meet in a half circle."""
    r, low = 0.9, 0.95
    corners = [(0.45 - r, 3.0), (0.45 - r, low), (0.45 + r, low), (0.45 + r, 3.0)]
    nose = rigid.Polyline(corners, r)
    exact = force_of("triangle", rigid.Circle((0.45, low + r), r), n=6)
    found = force_of("triangle", nose, n=6)
    np.testing.assert_allclose(found, exact, rtol=2e-5, atol=2e-5 * abs(exact[1]))


def test_a_segment_that_covers_the_slave_is_a_line():
    exact = force_of("triangle", rigid.Line((0.5, 0.95), (0.0, -1.0)))
    wide = rigid.Polyline([(2.0, 0.95), (-1.0, 0.95)], inside=(0.5, 2.0))
    np.testing.assert_allclose(force_of("triangle", wide), exact, atol=1e-12)


def test_a_segment_presses_where_it_is():
    half = rigid.Polyline([(-1.0, 0.95), (0.5, 0.95)], inside=(0.0, 1.5))
    found = press("quadrilateral", half, n=8)
    assert SNESSolver(found.problem).solve()[1]
    points = found.contact.points()
    assert (points["traction"][points["x"][:, 0] > 0.51] == 0.0).all()
    assert found.contact.resultant().force[1] < -0.1


@pytest.mark.parametrize("radius", (0.0, 0.3, (0.3, 0.0)), ids=str)
def test_a_point_inside_turns_a_polyline(radius):
    inner, outer = (
        rigid.Polyline(CUP, radius, inside=x) for x in ((1.0, 2.0), (1.0, 0.5))
    )
    given = rigid.Polyline(CUP, radius)
    back = rigid.Polyline(CUP[::-1], np.flip(radius), inside=(1.0, 2.0))
    assert np.array_equal(inner.facets, given.facets)
    assert np.array_equal(outer.facets[:, [1, 0]], given.facets[:, :2])
    assert sorted(map(tuple, back.points[back.facets[:, 0]].round(12))) == sorted(
        map(tuple, given.points[given.facets[:, 0]].round(12))
    )


def test_closed_polylines_enclose_their_solid_or_are_around_it():
    square = CUP[1:] + [(0.0, 3.0)]
    for points in (square, square[::-1]):
        solid = rigid.Polyline(points, 0.5, closed=True)
        bore = rigid.Polyline(points, 0.5, closed=True, inside=(3.0, 2.0))
        for surface, side in ((solid, 1.0), (bore, -1.0)):
            x, normals = bends(surface)
            out = np.einsum("mpi,mpi->mp", x - (1.0, 2.0), normals)
            assert (side * out > 0.5).all()


@pytest.mark.parametrize("facets", (FACES, TRIANGLES), ids=("quads", "triangles"))
@pytest.mark.parametrize(
    "closed, inside, sign",
    [
        (True, (0.7, 0.2, 0.2), 1.0),
        (True, (1.5, 0.2, 0.2), -1.0),
        (False, (0.7, 0.2, 0.2), 1.0),
        (False, (0.5, 0.5, 1.5), -1.0),
    ],
)
def test_a_point_inside_turns_a_surface(facets, closed, inside, sign):
    """A cube, or one without its bottom, of facets whose orientations disagree."""
    mixed = facets.copy()
    mixed[-1] = mixed[-1, ::-1]
    is_bottom = (CUBE[mixed, 2] == 0.0).all(axis=1)
    chosen = mixed if closed else mixed[~is_bottom]
    found = rigid.Surface(CUBE, chosen, closed=closed, inside=inside)
    x = found.points[found.facets]
    across = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 1])
    out = np.einsum("ni,ni->n", across, x.mean(axis=1) - 0.5)
    assert (sign * out > 0.1).all()


SHAPES = {
    "points of a polyline must be 2 or more": dict(points=[(0.0, 0.0)]),
    "points of a polyline must be 3 or more": dict(points=CUP[:2], closed=True),
    r"in 2D, not an array \(8, 3\)": dict(points=CUBE),
    "points 1 and 2 of a polyline are the same": dict(points=[*CUP[:2], CUP[1]]),
    "radius = 2 does not fit into corner 1": dict(points=CUP, radius=[2.0, 0.1]),
    "one for each of 2 corners": dict(points=CUP, radius=[0.1]),
    "0 or more": dict(points=CUP, radius=-1.0),
    "radius = 'wide'": dict(points=CUP, radius="wide"),
    "is level with": dict(points=CUP[:2], inside=(0.0, 4.0)),
    r"crosses itself at \(1, 0.5\)": dict(
        points=[(0.0, 0.0), (2.0, 1.0), (2.0, 0.0), (0.0, 1.0)], closed=True
    ),
    r"crosses itself at \(0.25, 0\)": dict(
        points=[(0.0, 0.0), (2.0, 0.0), (0.25, 2.0), (0.25, -1.0)], radius=0.1
    ),
    "must be 2 finite numbers": dict(points=CUP[:2], inside=(0.0, 1.0, 2.0)),
}


@pytest.mark.parametrize("message", SHAPES)
def test_polylines_that_cannot_be_are_told(message):
    with pytest.raises(ContactError, match=message):
        rigid.Polyline(**SHAPES[message])


def test_points_that_tell_no_side_are_told():
    with pytest.raises(ContactError, match="hollow=True and inside="):
        rigid.Surface(CUBE, FACES, hollow=True, inside=(0.5, 0.5, 0.5))
    two = np.vstack([CUBE, CUBE + 2.0]), np.vstack([FACES, FACES + len(CUBE)])
    with pytest.raises(ContactError, match="in one piece: this one has 2"):
        rigid.Surface(*two, inside=(0.5, 0.5, 0.5))

"""Rigid tools made of facets, from arrays as Gmsh and STL have them."""

from __future__ import annotations

import gathered
import hosts
import numpy as np
import pytest
from rigid_scenes import press

from raymortar import AugmentedLagrangian, ContactError, Coulomb, SNESSolver, rigid

LAW = {"method": AugmentedLagrangian(40.0), "friction": Coulomb(0.3)}
# Corners of a unit cube, and its faces with normals out of it
CUBE = np.array(
    [[i, j, k] for k in (0, 1) for j in (0, 1) for i in (0, 1)], dtype=float
)
FACES = np.array(
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
)
TRIANGLES = np.vstack([FACES[:, [0, 1, 2]], FACES[:, [0, 2, 3]]])


def circle(n, degree, radius=0.9, centre=(0.45, 1.85)):
    """A ring of intervals, the solid within."""
    count = n * degree
    angle = 2.0 * np.pi * np.arange(count) / count
    points = np.array(centre) + radius * np.column_stack([np.cos(angle), np.sin(angle)])
    first = degree * np.arange(n)
    ends = np.column_stack([first, (first + degree) % count])
    middle = first[:, None] + 1
    return points, ends if degree == 1 else np.hstack([ends, middle])


def ball(n, kind, radius=0.9, centre=(0.5, 0.45, 1.85)):
    """The faces of a cube, divided and blown up to a sphere.

    Parameters
    ----------
    kind
        Points of each facet: 3, 4, 6, 8 or 9.
    """
    fine = n if kind in (3, 4) else 2 * n
    s, t = np.meshgrid(*2 * [np.linspace(0.0, 1.0, fine + 1)], indexing="ij")
    number = np.arange((fine + 1) ** 2).reshape(fine + 1, fine + 1)
    step = fine // n
    a = number[:-1:step, :-1:step].ravel()
    right, up = step * (fine + 1), step
    corners = [a, a + right, a + right + up, a + up]
    middles = [a + right // 2, a + right + up // 2, a + right // 2 + up, a + up // 2]
    centre_of = a + right // 2 + up // 2
    quads = [*corners, *middles, centre_of]
    points, facets = [], []
    for k, face in enumerate(FACES):
        x = CUBE[face] - 0.5
        edge = (x[1] - x[0]), (x[3] - x[0])
        at = x[0] + s[..., None] * edge[0] + t[..., None] * edge[1]
        points.append(at.reshape(-1, 3))
        shift = k * len(points[0])
        if kind in (3, 6):
            order = [[0, 1, 2, 4, 5, 8], [0, 2, 3, 8, 6, 7]]
            for half in order:
                facets.append(np.column_stack([quads[i] for i in half[:kind]]) + shift)
        else:
            facets.append(np.column_stack(quads[:kind]) + shift)
    x = np.vstack(points)
    x = radius * x / np.linalg.norm(x, axis=1)[:, None] + np.array(centre)
    return x, np.vstack(facets)


def force_of(cell, shape, **options):
    found = press(cell, shape, **LAW | options)
    assert SNESSolver(found.problem).solve()[1]
    return found.contact.resultant().force


@pytest.mark.mpi
@pytest.mark.parametrize("facets", (FACES, TRIANGLES))
def test_the_face_of_a_cube_is_a_plane(facets):
    points = 3.0 * CUBE + np.array([-1.0, -1.1, 0.93])
    flat = force_of("hexahedron", rigid.Plane((0.0, 0.0, 0.93), (0.0, 0.0, -1.0)))
    assert force_of("hexahedron", rigid.Surface(points, facets)) == pytest.approx(
        flat, rel=1e-9, abs=1e-10
    )


@pytest.mark.parametrize("degree, gate", ((1, 2e-2), (2, 2e-4)))
def test_fine_rings_are_circles(degree, gate):
    exact = force_of("triangle", rigid.Circle((0.45, 1.85), 0.9), n=6)
    found = force_of("triangle", rigid.Surface(*circle(60, degree)), n=6)
    assert found[1] == pytest.approx(exact[1], rel=gate)


@pytest.mark.parametrize("kind, gate", ((3, 4e-2), (4, 4e-2), (6, 1e-3), (9, 1e-3)))
def test_fine_balls_are_spheres(kind, gate):
    exact = force_of("tetrahedron", rigid.Sphere((0.5, 0.45, 1.85), 0.9), n=4)
    many = 24 if kind in (3, 4) else 16
    found = force_of("tetrahedron", rigid.Surface(*ball(many, kind)), n=4)
    assert found[2] == pytest.approx(exact[2], rel=gate)


def test_quadrilaterals_of_eight_nodes_get_a_ninth():
    nine, eight = (rigid.Surface(*ball(6, kind)) for kind in (9, 8))
    assert eight.facets.shape == nine.facets.shape
    forces = [force_of("tetrahedron", shape, n=2) for shape in (nine, eight)]
    assert forces[0][2] == pytest.approx(forces[1][2], rel=1e-2)


SURFACES = [("triangle", circle(24, 2)), ("hexahedron", ball(5, 6))]


@pytest.mark.parametrize("cell, arrays", SURFACES, ids=("plane", "space"))
def test_the_tangent_is_the_derivative_of_a_free_surface(cell, arrays):
    """Bent facets have curvature; a point on their edges has none."""
    free = ("x", "y", "r") if cell == "triangle" else ("z", "rx", "ry")
    force = (0.0, -2.0) if cell == "triangle" else (0.0, 0.0, -2.0)
    stiffness = {name: 4.0 for name in free if name not in ("y", "z")}
    body = rigid.Body(
        rigid.Surface(*arrays), free=free, force=force, stiffness=stiffness
    )
    found = press(cell, body, n=2, degree=2, **LAW)
    assert SNESSolver(found.problem).solve()[1]
    assert gathered.points(found.contact)["status"].max() > 1
    aways = (0.001, 0.002, 0.004)
    errors = [hosts.tangent_error(found, 1.0, 1e-6, away) for away in aways]
    assert np.nanmin(errors) < 2e-7


def test_inverted_and_open_surfaces_are_told():
    inside_out = TRIANGLES[:, [0, 2, 1]]
    with pytest.raises(ContactError, match="inside out"):
        rigid.Surface(CUBE, inside_out)
    with pytest.raises(ContactError, match="open: 4 edges"):
        rigid.Surface(CUBE, FACES[1:])
    mixed = TRIANGLES.copy()
    mixed[3] = mixed[3, [0, 2, 1]]
    with pytest.raises(ContactError, match="disagree at 3 edges"):
        rigid.Surface(CUBE, mixed)
    for facets in (inside_out, mixed):
        turned = rigid.Surface(CUBE, facets, orient=True)
        assert sorted(map(sorted, turned.facets)) == sorted(map(sorted, TRIANGLES))
        assert volume(turned) == pytest.approx(1.0)
    hollow = rigid.Surface(CUBE, TRIANGLES, hollow=True)
    assert volume(hollow) == pytest.approx(-1.0)
    assert len(rigid.Surface(CUBE, FACES[1:], closed=False).facets) == 5


def volume(surface):
    x = surface.points[surface.facets[:, :3]]
    return np.einsum("ni,ni->", x[:, 0], np.cross(x[:, 1], x[:, 2])) / 6.0


def test_points_of_stl_at_one_place_are_one():
    loose = CUBE[TRIANGLES].reshape(-1, 3)
    facets = np.arange(len(loose)).reshape(-1, 3)
    sliver = np.vstack([facets, [[0, 0, 1]]])
    surface = rigid.Surface(loose, sliver)
    assert len(surface.points) == 8 and len(surface.facets) == 12


@pytest.mark.parametrize(
    "points, facets, message",
    [
        (CUBE[:, :1], FACES, "points must be"),
        (CUBE, FACES.astype(float), "facets must be whole"),
        (CUBE, FACES[:, :2], "k one of"),
        (CUBE, FACES + 1, "facets has point 8"),
        (CUBE, FACES[:0], "facets is empty"),
        (np.where(CUBE == 1.0, np.nan, 0.0), FACES, "not finite"),
        (
            np.full((2, 2), 0.5),
            np.array([[0, 1]]),
            r"no facet has any length: the first of 1, facet 0, is at \(0.5, 0.5\)",
        ),
        (
            CUBE,
            np.array([[0, 0, 1], [2, 2, 2]]),
            r"no facet has any area: the first of 2, facet 0, is at",
        ),
    ],
)
def test_wrong_arrays_are_told(points, facets, message):
    with pytest.raises(ContactError, match=message):
        rigid.Surface(points, facets, closed=False)

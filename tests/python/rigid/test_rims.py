"""The rim of a surface of facets cuts slave facets, as the edge of a meshed master."""

from __future__ import annotations

import hosts
import numpy as np
import punches
import pytest
from gathered import points
from problems import DIMENSION
from rigid_scenes import press

from raymortar import (
    AugmentedLagrangian,
    Coulomb,
    LoadSteps,
    Penalty,
    SNESSolver,
    rigid,
)

# The block rises beside an open face, and is not behind it there
pytestmark = pytest.mark.filterwarnings("error:converged, but contact is lost")

LAWS = {
    "normal": {"method": AugmentedLagrangian(40.0)},
    "friction": {"method": AugmentedLagrangian(40.0), "friction": Coulomb(0.3)},
    "penalty": {"method": Penalty(400.0), "friction": Coulomb(0.3)},
    "deformed": {
        "method": AugmentedLagrangian(40.0),
        "friction": Coulomb(0.3),
        "measure": "current",
    },
}
DEPTH = 0.05
TURN = (0.0, 0.0, 0.4)
CELLS = ["triangle", "quadrilateral", "tetrahedron", "hexahedron"]


def ends(cell, right=0.733):
    """Of a punch whose rim lies inside facets."""
    along = DIMENSION[cell] - 1
    return np.array([[0.27, 0.31], [right, 0.74]])[:, :along]


def down(cell, sideways=0.0):
    way = np.zeros(DIMENSION[cell])
    way[0], way[-1] = sideways, -DEPTH
    return way


def solve(found):
    """Iterations and force of a solve."""
    iterations, converged = SNESSolver(found.problem).solve()[:2]
    assert converged
    return iterations, found.contact.resultant().force


@pytest.mark.parametrize("degree", (1, 2))
@pytest.mark.parametrize("right", np.linspace(0.70, 0.825, 28))
def test_at_any_place_it_is_that_of_a_meshed_punch(right, degree):
    """In 28 places across a facet: forces, and as many iterations. The sides of the
    closed punch, which the slave sees beside the rim, change neither."""
    where = ends("quadrilateral", right), down("quadrilateral")
    options = dict(degree=degree) | LAWS["normal"]
    shape = punches.solid
    n, force = solve(punches.by_tool("quadrilateral", *where, shape, **options))
    m, expected = solve(punches.by_mesh("quadrilateral", *where, **options))
    assert force == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert n <= m + 1


@pytest.mark.mpi(where=lambda cell, law: law == "friction")
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("cell", CELLS)
def test_forces_and_pressures_are_those_of_a_meshed_punch(cell, law):
    where = ends(cell), down(cell, 0.01)
    n, degree = (8, 2) if DIMENSION[cell] == 2 else (4, 1)
    options = dict(n=n, degree=degree) | LAWS[law]
    makers = punches.by_tool, punches.by_mesh
    pair = [make(cell, *where, **options) for make in makers]
    (_, force), (_, expected) = (solve(found) for found in pair)
    assert force == pytest.approx(expected, rel=1e-8, abs=1e-8)
    pressures = [np.sort(points(found.contact)["pressure"]) for found in pair]
    closed = [p[p > 1e-6] for p in pressures]
    assert closed[0] == pytest.approx(closed[1], rel=1e-7, abs=1e-6)


@pytest.mark.parametrize("n", (12, 16))
def test_far_moves_take_few_iterations(n):
    """Most of a facet in one step: the first iteration holds segments, as if the motion
    were lifted."""
    where = ends("quadrilateral"), down("quadrilateral")
    options = dict(n=n) | LAWS["normal"]
    found = punches.by_tool("quadrilateral", *where, punches.solid, **options)
    expected = punches.by_mesh("quadrilateral", *where, **options)
    assert abs(solve(found)[0] - solve(expected)[0]) <= 1


def test_sharp_wedges_still_press_with_both_flanks():
    """The tip is a rim with two faces that count."""
    t = np.tan(np.radians(60.0))
    corners = np.array([0.47, 1.0]) + np.array([[0, 0], [2 * t, 2], [-2 * t, 2]])
    shapes = (
        rigid.Surface(corners, np.array([[0, 1], [1, 2], [2, 0]])),
        rigid.Wedge((0.47, 1.0), (0.0, 1.0), np.radians(60.0)),
    )
    forces = []
    for shape in shapes:
        body = rigid.Body(shape)
        found = press("quadrilateral", body, n=10, **LAWS["normal"])
        body.move((0.0, -0.06))
        forces.append(solve(found)[1][1])
    assert forces[0] == pytest.approx(forces[1], rel=0.05)


@pytest.mark.mpi
@pytest.mark.parametrize(
    "cell, turn",
    [(cell, None) for cell in CELLS] + [(cell, TURN) for cell in CELLS[2:]],
)
def test_the_force_of_a_given_gap_is_that_on_the_area(cell, turn):
    """The block has not moved: penalty times gap times the area below the punch."""
    for right in (0.69, 0.7203, 0.75, 0.81):
        where = ends(cell, right)
        found = punches.by_tool(
            cell, where, down(cell), turn=turn, n=5, method=Penalty(7.0)
        )
        area = np.prod(where[1] - where[0])
        force = found.contact.resultant().force
        expected = np.append(np.zeros(len(force) - 1), -7.0 * DEPTH * area)
        assert force == pytest.approx(expected, rel=1e-11, abs=1e-12)


@pytest.mark.filterwarnings("ignore:axisymmetric=True, but the form")
def test_around_an_axis_it_is_that_of_a_ring():
    """The same between two radii."""
    where = ends("quadrilateral")
    found = punches.by_tool(
        "quadrilateral",
        where,
        down("quadrilateral"),
        n=5,
        method=Penalty(7.0),
        axisymmetric=True,
    )
    area = np.pi * (where[1, 0] ** 2 - where[0, 0] ** 2)
    force = found.contact.resultant().force
    assert force[-1] == pytest.approx(-7.0 * DEPTH * area, rel=1e-11)


def free_punch(cell, shape):
    where = ends(cell)
    tool = punches.face(cell, where) if shape == "face" else punches.solid(where)
    dim = DIMENSION[cell]
    names = ("x", "y", "r") if dim == 2 else ("x", "y", "z", "rx", "ry", "rz")
    stiffness = dict.fromkeys(names[: dim - 1], 5.0) | dict.fromkeys(names[dim:], 0.6)
    centre = np.array([0.55, 1.2]) if dim == 2 else np.array([0.55, 0.5, 1.2])
    force = np.append(np.full(dim - 1, 0.1), -1.0)
    return rigid.Body(tool, centre, free=names, force=force, stiffness=stiffness)


def moved(cell, shape, law):
    """A scene with rims inside facets, away from equilibrium."""
    n, degree = 3, 2 if DIMENSION[cell] == 2 else 1
    if shape == "held":
        found = punches.by_tool(
            cell, ends(cell), down(cell), n=n, degree=degree, **LAWS[law]
        )
        found.contact.advance()
        return found
    body = free_punch(cell, shape)
    found = press(cell, body, n=n, degree=degree, **LAWS[law])
    free = body.freedom
    sink = np.where(free.axis == DIMENSION[cell] - 1, -DEPTH, 0.01)
    free.values = np.where(free.is_turn, 0.03, sink)
    found.contact.update()
    return found


@pytest.mark.mpi(where=lambda cell, shape, law: law == "friction" and shape == "face")
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("shape", ("face", "solid", "held"))
@pytest.mark.parametrize("cell", CELLS)
def test_the_tangent_is_the_derivative(cell, shape, law):
    """Rims move along the slave with it, and with a body that is free."""
    found = moved(cell, shape, law)
    assert points(found.contact)["status"].max() > 0
    aways = (1e-3, 2e-3, 4e-3)
    errors = [hosts.tangent_error(found, 1.0, 1e-6, away) for away in aways]
    assert np.nanmin(errors) < 2e-7


@pytest.mark.mpi
def test_a_free_punch_finds_its_balance_quadratically():
    body = free_punch("quadrilateral", "face")
    found = press("quadrilateral", body, n=8, **LAWS["friction"])
    iterations, force = solve(found)
    assert iterations <= 9
    spring = 5.0 * body.translation[0]
    assert -force[0] + 0.1 - spring == pytest.approx(0.0, abs=1e-8)
    assert force[1] == pytest.approx(-1.0, abs=1e-8)


def test_a_fine_tool_cuts_at_its_rim_alone():
    """A face of 3000 facets: those above the middle cut nothing."""
    where = ends("quadrilateral"), down("quadrilateral")
    x = np.linspace(*where[0][:, 0], 3001)
    at = np.column_stack([x, np.ones_like(x)])
    facets = np.column_stack([np.arange(3000), np.arange(1, 3001)])
    body = rigid.Body(rigid.Surface(at, facets, closed=False))
    fine = press("quadrilateral", body, n=16, **LAWS["normal"])
    body.move(where[1])
    _, force = solve(fine)
    coarse = punches.by_tool("quadrilateral", *where, n=16, **LAWS["normal"])
    assert force == pytest.approx(solve(coarse)[1], rel=1e-6, abs=1e-9)
    assert fine.contact.statistics.segments < 1000


@pytest.mark.parametrize("beside", ("circle", "surface of degree 2"))
def test_other_kinds_beside_it_keep_facets_whole(beside):
    """A slave that meets a surface, and something else far away."""
    where = ends("quadrilateral"), down("quadrilateral")
    arc = np.array([[5.0, 5.0], [6.0, 5.0], [5.5, 4.9]])
    far = (
        rigid.Circle((5.0, 5.0), 0.1)
        if beside == "circle"
        else rigid.Surface(arc, np.array([[0, 1, 2]]), closed=False)
    )
    body = rigid.Body(punches.face("quadrilateral", where[0]))
    found = press("quadrilateral", [body, rigid.Body(far)], n=5, method=Penalty(7.0))
    body.move(where[1])
    found.contact.update()
    assert found.contact.statistics.segments == 5


@pytest.mark.mpi
@pytest.mark.parametrize("cell", CELLS)
def test_a_path_presses_an_open_face_in(cell):
    """Slave facets beside it are above its plane."""
    body = rigid.Body(punches.face(cell, ends(cell)))
    found = press(cell, body, n=4, **LAWS["normal"])
    pressed = np.zeros(DIMENSION[cell])
    pressed[-1] = -DEPTH

    def apply(t):
        body.move(t * pressed)

    path = LoadSteps(SNESSolver(found.problem), apply, 2, max_halvings=0)
    forces = [found.contact.resultant().force[-1] for _ in path]
    assert forces[1] < 1.5 * forces[0] < 0.0

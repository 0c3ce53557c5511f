"""The rim of a surface of facets cuts slave facets, as the edge of a meshed master."""

from __future__ import annotations

import hosts
import numpy as np
import punches
import pytest
from gathered import concatenated, points
from problems import DIMENSION
from rigid_scenes import press

from raymortar import AugmentedLagrangian, Coulomb, Penalty, SNESSolver, rigid

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


@pytest.mark.parametrize("right", np.linspace(0.70, 0.825, 28))
def test_at_any_place_it_is_that_of_a_meshed_punch(right):
    """In 28 places across a facet: forces, and as many iterations."""
    where = ends("quadrilateral", right), down("quadrilateral")
    n, force = solve(punches.by_tool("quadrilateral", *where, **LAWS["normal"]))
    m, expected = solve(punches.by_mesh("quadrilateral", *where, **LAWS["normal"]))
    assert force == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert n <= m + 1  # the body moves before the first iteration, the mesh in it


@pytest.mark.mpi(where=lambda cell, law: law == "friction")
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("cell", CELLS)
def test_forces_and_pressures_are_those_of_a_meshed_punch(cell, law):
    where = ends(cell), down(cell, 0.01)
    n, degree = (8, 2) if DIMENSION[cell] == 2 else (4, 1)
    options = dict(n=n, degree=degree) | LAWS[law]
    pair = [
        make(cell, *where, **options) for make in (punches.by_tool, punches.by_mesh)
    ]
    (_, force), (_, expected) = (solve(found) for found in pair)
    assert force == pytest.approx(expected, rel=1e-8, abs=1e-8)
    pressures = [np.sort(points(found.contact)["pressure"]) for found in pair]
    closed = [p[p < -1e-6] for p in pressures]
    assert closed[0] == pytest.approx(closed[1], rel=1e-7, abs=1e-6)


@pytest.mark.parametrize("cell", ("triangle", "hexahedron"))
def test_a_closed_punch_has_nearly_the_force_of_its_face(cell):
    """Its sides face the slave beside the rim, and touch nothing."""
    where, n = (ends(cell), down(cell)), 8 if cell == "triangle" else 4
    options = dict(n=n) | LAWS["normal"]
    iterations, force = solve(
        punches.by_tool(cell, *where, shape=punches.solid, **options)
    )
    _, expected = solve(punches.by_tool(cell, *where, **options))
    assert force[-1] == pytest.approx(expected[-1], rel=2e-3)
    assert iterations <= 7


@pytest.mark.mpi
@pytest.mark.parametrize("turn", (0.0, 0.4))
@pytest.mark.parametrize("cell", CELLS)
def test_the_force_of_a_given_gap_is_that_on_the_area(cell, turn):
    """The block has not moved: penalty times gap times the area below the punch."""
    if DIMENSION[cell] == 2 and turn:
        pytest.skip("a turned punch has another gap")
    angle = (0.0, 0.0, turn) if turn else None
    for right in (0.69, 0.7203, 0.75, 0.81):
        where = ends(cell, right)
        found = punches.by_tool(
            cell, where, down(cell), turn=angle, n=5, method=Penalty(7.0)
        )
        area = np.prod(where[1] - where[0])
        force = found.contact.resultant().force
        expected = np.append(np.zeros(len(force) - 1), -7.0 * DEPTH * area)
        assert force == pytest.approx(expected, rel=1e-11, abs=1e-12)


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
    turns = names[dim:]
    resistance = {name: 5.0 for name in names[: dim - 1]} | dict.fromkeys(turns, 0.6)
    centre = np.array([0.55, 1.2]) if dim == 2 else np.array([0.55, 0.5, 1.2])
    force = np.append(np.full(dim - 1, 0.1), -1.0)
    return rigid.Body(tool, centre, free=names, force=force, stiffness=resistance)


@pytest.mark.mpi(where=lambda cell, shape, law: law == "friction" and shape == "face")
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("shape", ("face", "solid", "held"))
@pytest.mark.parametrize("cell", CELLS)
def test_the_tangent_is_the_derivative(cell, shape, law):
    """Rims move along the slave with it, and with a body that is free."""
    dim = DIMENSION[cell]
    if shape == "held":
        found = punches.by_tool(
            cell, ends(cell), down(cell), n=3, degree=2, **LAWS[law]
        )
    else:
        body = free_punch(cell, shape)
        found = press(cell, body, n=3, degree=2 if dim == 2 else 1, **LAWS[law])
        body.freedom.values = np.where(
            body.freedom.is_turn,
            0.03,
            np.where(body.freedom.axis == dim - 1, -DEPTH, 0.01),
        )
        found.contact.update()
    assert points(found.contact)["status"].max() > 0
    errors = [
        hosts.tangent_error(found, 1.0, 1e-6, away) for away in (1e-3, 2e-3, 4e-3)
    ]
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
    points = np.column_stack([x, np.ones_like(x)])
    facets = np.column_stack([np.arange(3000), np.arange(1, 3001)])
    body = rigid.Body(rigid.Surface(points, facets, closed=False))
    body.move(where[1])
    fine = press("quadrilateral", body, n=16, **LAWS["normal"])
    _, force = solve(fine)
    coarse = punches.by_tool("quadrilateral", *where, n=16, **LAWS["normal"])
    assert force == pytest.approx(solve(coarse)[1], rel=1e-6, abs=1e-9)
    assert fine.contact.statistics.segments < 1000


def test_other_shapes_beside_it_keep_facets_whole():
    """A slave that meets a surface and a shape of closed form."""
    where = ends("quadrilateral"), down("quadrilateral")
    far = rigid.Body(rigid.Circle((5.0, 5.0), 0.1))
    body = rigid.Body(punches.face("quadrilateral", where[0]))
    body.move(where[1])
    found = press("quadrilateral", [body, far], n=5, method=Penalty(7.0))
    found.contact.update()
    assert found.contact.statistics.segments == 5

"""Rigid tools: analytic shapes in place of a tagged master."""

from __future__ import annotations

from mpi4py import MPI

import gathered
import hosts
import numpy as np
import problems
import pytest
import rigid_scenes
from problems import SOLVERS
from rigid_scenes import press, shape_of, shapes

from raymortar import (
    AugmentedLagrangian,
    Contact,
    Coulomb,
    History,
    LoadSteps,
    NewtonSolver,
    Penalty,
    SNESSolver,
    rigid,
)
from raymortar.rigid.turning import rotation_matrix

LAWS = {
    "normal": {"method": AugmentedLagrangian(40.0)},
    "friction": {"method": AugmentedLagrangian(40.0), "friction": Coulomb(0.3)},
    "penalty": {"method": Penalty(40.0), "friction": Coulomb(0.3)},
    "nodes": {
        "method": AugmentedLagrangian(80.0, condition="nodes"),
        "friction": Coulomb(0.3),
    },
    "deformed": {
        "method": AugmentedLagrangian(40.0),
        "friction": Coulomb(0.3),
        "measure": "current",
    },
}
EVERY_SHAPE = [
    *(("triangle", name) for name in shapes(2)),
    *(("tetrahedron", name) for name in shapes(3)),
]


def moved(found, size=0.02):
    """The tool moves along and turns a little: friction slips."""
    gdim = found.u.function_space.mesh.geometry.dim
    if gdim == 2:
        found.body.move((0.5 * size, -size), 0.3 * size)
    else:
        found.body.move(
            (0.5 * size, 0.2 * size, -size), (0.01, -0.2 * size, 0.2 * size)
        )


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("cell, name", EVERY_SHAPE)
def test_the_tangent_is_the_derivative(cell, name, law):
    found = press(cell, shape_of(cell, name), degree=2, **LAWS[law])
    assert NewtonSolver(found.problem).solve()[1]
    found.contact.advance()
    # Deeper in, whether Newton's method arrives with a torus hangs on rounding
    moved(found, -0.02 if name == "torus" else 0.02)
    assert NewtonSolver(found.problem).solve()[1]
    assert gathered.points(found.contact)["status"].max() > 1
    aways = (0.002, 0.004, 0.007)
    errors = [hosts.tangent_error(found, 1.0, 1e-6, away) for away in aways]
    assert np.nanmin(errors) < 2e-7


@pytest.mark.mpi
@pytest.mark.parametrize("law", ("normal", "friction", "penalty"))
@pytest.mark.parametrize("cell", ("quadrilateral", "hexahedron"))
def test_a_flat_tool_is_a_held_flat_body(cell, law):
    """Against the same problem with a meshed tool whose dofs are prescribed."""
    gdim = problems.DIMENSION[cell]
    normal = np.eye(gdim)[-1]
    found = press(cell, rigid.Body(rigid.Plane(normal, -normal)), n=2, **LAWS[law])
    way = np.array([0.03] * (gdim - 1) + [-0.1])
    found.body.move(way)
    # With friction on the soft penalty full steps cycle
    assert SNESSolver(found.problem).solve()[1]
    meshed = rigid_scenes.press_by_mesh(cell, way, n=2, frame="master", **LAWS[law])
    assert NewtonSolver(meshed.problem).solve()[1]
    force, other = (one.contact.resultant(0).force for one in (found, meshed))
    assert force == pytest.approx(other, rel=1e-9, abs=1e-9 * np.abs(other).max())


@pytest.mark.parametrize("gdim", (2, 3))
def test_an_implicit_sphere_is_the_sphere(gdim):
    cell = "triangle" if gdim == 2 else "tetrahedron"
    centre, radius = np.array([0.5, 2.95, 0.0] if gdim == 2 else [0.5, 0.4, 2.95]), 2.0
    away = lambda x: x - centre[:, None]
    implicit = rigid.Implicit(
        lambda x: np.linalg.norm(away(x), axis=0) - radius,
        lambda x: away(x) / np.linalg.norm(away(x), axis=0),
        lambda x: (
            np.eye(3)[:, :, None]
            - away(x)[:, None] * away(x)[None] / np.linalg.norm(away(x), axis=0) ** 2
        )
        / np.linalg.norm(away(x), axis=0),
    )
    forces = []
    for shape in (rigid.Sphere(centre[:gdim], radius), implicit):
        found = press(cell, shape, **LAWS["friction"])
        assert NewtonSolver(found.problem).solve()[1]
        forces.append(found.contact.resultant(0).force)
    assert forces[0] == pytest.approx(forces[1], rel=1e-10)


@pytest.mark.parametrize("cell, name", EVERY_SHAPE)
def test_what_turns_with_the_scene_changes_nothing(cell, name):
    """Frame indifference: block and tool turned and shifted together."""
    gdim = problems.DIMENSION[cell]
    turn = np.array([0.0, 0.0, 0.8]) if gdim == 2 else np.array([0.5, -0.9, 0.7])
    shift = np.array([3.0, -2.0, 0.0 if gdim == 2 else 1.0])
    here = press(cell, shape_of(cell, name), **LAWS["friction"])
    body = rigid.Body(shape_of(cell, name), (0.0,) * gdim)
    body.move(shift[:gdim], turn[2] if gdim == 2 else turn)
    there = press(cell, body, move=(turn, shift), **LAWS["friction"])
    R = rotation_matrix(turn)[:gdim, :gdim]
    for one in (here, there):
        assert NewtonSolver(one.problem).solve()[1]
    force = here.contact.resultant(0).force
    assert there.contact.resultant(0).force == pytest.approx(R @ force, rel=1e-8)


@pytest.mark.parametrize("method", (AugmentedLagrangian(40.0), Penalty(400.0)))
@pytest.mark.parametrize("cell, axis", (("triangle", None), ("hexahedron", 1)))
def test_a_spinning_wheel_drags(cell, axis, method):
    """Slip everywhere: the tangential force is mu times the normal one."""
    gdim = problems.DIMENSION[cell]
    centre = (0.5, 1.45) if gdim == 2 else (0.5, 0.5, 1.45)
    wheel = (
        rigid.Body(rigid.Circle(centre, 0.5))
        if gdim == 2
        else rigid.Body(rigid.Cylinder(centre, (0.0, 1.0, 0.0), 0.5))
    )
    found = press(cell, wheel, n=6, friction=Coulomb(0.2), method=method)
    assert NewtonSolver(found.problem).solve()[1]
    found.contact.advance()
    # Clockwise, so that the rim at the bottom goes to the left
    wheel.move(rotation=-0.5 if gdim == 2 else (0.0, 0.5, 0.0))
    assert NewtonSolver(found.problem).solve()[1]
    result = found.contact.resultant(0)
    points = gathered.points(found.contact)
    assert (points["status"][points["status"] > 1] == 3).all()
    normal = np.sum(points["weight"] * points["pressure"])
    t = points["traction"]
    n = points["contact_normal"]
    shear = t - np.einsum("qi,qi->q", t, n)[:, None] * n
    dragged = np.einsum("q,qi->i", points["weight"], shear)
    assert dragged[0] < 0.0
    if gdim == 3:
        assert abs(dragged[1]) < 0.05 * abs(dragged[0])
    assert np.linalg.norm(points["weight"][:, None] * shear, axis=1).sum() == (
        pytest.approx(0.2 * normal, rel=2e-2)
    )
    assert result.tangential[0] == pytest.approx(dragged[0], rel=1e-10)


@pytest.mark.mpi
@pytest.mark.parametrize("law", ("friction", "penalty"))
@pytest.mark.parametrize("cell", ("triangle", "tetrahedron"))
def test_forces_balance_and_ranks_agree(cell, law, monkeypatch):
    def solved():
        name = "circle" if cell == "triangle" else "sphere"
        found = press(cell, shape_of(cell, name), n=4, **LAWS[law])
        moved(found)
        assert NewtonSolver(found.problem).solve()[1]
        return found

    found = solved()
    force = found.contact.resultant(0).force
    reaction = found.problem.reactions({"below": found.problem.bcs})["below"]
    assert reaction == pytest.approx(-force, rel=1e-8)
    with monkeypatch.context() as patch:
        for module in (problems, hosts, rigid_scenes.boxes):
            patch.setattr(module, "COMM", MPI.COMM_SELF)
        assert solved().contact.resultant(0).force == pytest.approx(force, rel=1e-10)


def test_of_several_tools_the_nearest_counts():
    left = rigid.Circle((0.2, 1.45), 0.5)
    right = rigid.Circle((0.8, 1.48), 0.5)
    mesh = rigid_scenes.boxes.box("triangle", 8)
    tags = rigid_scenes.boxes.tag_sides(mesh, (1, 1.0), (1, 0.0))
    u = rigid_scenes.boxes.displacement(mesh)
    contact = Contact(u, tags, [(1, left), (1, right)], Penalty(10.0))
    contact.update()
    points = contact.points(0)
    x, hit = points["x"], points["master"] >= 0
    heights = [
        np.sqrt(np.maximum(c.radius**2 - (x[:, 0] - c.centre[0]) ** 2, 0.0))
        for c in (left, right)
    ]
    gaps = np.array([c.centre[1] - h - x[:, 1] for c, h in zip((left, right), heights)])
    inside = gaps.min(axis=0) < 0.0
    assert hit[inside].all()
    both = hit & (np.abs(gaps[0] - gaps[1]) > 1e-9) & (gaps.max(axis=0) < 0.4)
    assert (points["master"][both] == gaps[:, both].argmin(axis=0)).all()
    assert points["gap"][hit] == pytest.approx(
        gaps[points["master"][hit], np.flatnonzero(hit)], abs=1e-12
    )


@pytest.mark.mpi
def test_forces_and_columns_go_by_the_names_of_bodies():
    left = rigid.Body(rigid.Circle((0.2, 1.45), 0.5), name="left wheel")
    right = rigid.Circle((0.8, 1.48), 0.5)
    found = press("triangle", [left, right], n=8, friction=Coulomb(0.3))
    history = History(found.problem)
    LoadSteps(SOLVERS[-1](found.problem), lambda t: None, 1, history=history).run()
    contact = found.contact
    forces = [contact.resultant(1, name).force for name in ("left wheel", "Circle")]
    assert contact.resultant(1, left).force == pytest.approx(forces[0], rel=1e-14)
    assert sum(forces) == pytest.approx(contact.resultant().force, rel=1e-12)
    assert forces[0][1] < forces[1][1] < 0.0
    assert history["force_1_left_wheel_y"][-1] == pytest.approx(forces[0][1])
    assert str(contact.pairs[0]) == "(1, 'left wheel')"


def test_a_tool_behind_the_slave_is_not_met():
    """A ball in the middle of the block, below its top."""
    found = press("triangle", rigid.Circle((0.5, 0.5), 0.2))
    found.contact.update()
    assert found.contact.statistics.hits == 0

"""Rigid tools: analytic shapes in place of a tagged master."""

from __future__ import annotations

import warnings

from mpi4py import MPI

import gathered
import hosts
import numpy as np
import problems
import pytest
import rigid_scenes
from problems import SOLVERS
from rigid_scenes import press, shapes

from raymortar import (
    AugmentedLagrangian,
    Contact,
    ContactError,
    ContactWarning,
    ConvergenceError,
    Coulomb,
    DisplacementControl,
    History,
    LoadSteps,
    NewtonSolver,
    Penalty,
    rigid,
)
from raymortar.rigid.body import rotation_matrix

LAWS = {
    "normal": {"method": AugmentedLagrangian(40.0)},
    "friction": {"method": AugmentedLagrangian(40.0), "friction": Coulomb(0.3)},
    "penalty": {"method": Penalty(40.0), "friction": Coulomb(0.3)},
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


def shape_of(cell, name, depth=0.05):
    return shapes(2 if cell in ("triangle", "quadrilateral") else 3, depth)[name]


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
    moved(found)
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
    assert NewtonSolver(found.problem).solve()[1]
    meshed = rigid_scenes.press_by_mesh(cell, way, n=2, **LAWS[law])
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
    normal = np.sum(points["weight"] * -points["pressure"])
    t = points["traction"]
    n = points["normal"]
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


@pytest.mark.parametrize("solver", SOLVERS)
def test_load_steps_move_a_body(solver):
    """Where it gets to does not hang on halvings, which restore it."""
    found = press("triangle", rigid.Circle((0.5, 1.5), 0.5), n=6, **LAWS["friction"])

    def apply(t):
        found.body.move((0.3 * t, -0.15 * min(2.0 * t, 1.0)))

    path = LoadSteps(solver(found.problem), apply, 4).run()
    assert found.body.translation == pytest.approx((0.3, -0.15, 0.0))
    assert path[-1].factor == 1.0
    assert found.contact.resultant().tangential[0] > 0.0


def dragged():
    """A tool pressed in, and dragged from there: the start and the force of this."""
    found = press("triangle", rigid.Circle((0.5, 1.45), 0.5), **LAWS["friction"])
    found.solver = NewtonSolver(found.problem)
    found.solver.solve()
    found.contact.advance()
    begin = found.contact.state()
    found.body.move((0.05, -0.02))
    found.solver.solve()
    return found, begin, found.contact.resultant().force


def test_states_hold_where_bodies_were_and_not_where_they_are():
    """A body's motion is a load, as a prescribed displacement is."""
    found, begin, force = dragged()
    contact = found.contact
    assert force[0] > 0.01 * abs(force[1])
    contact.advance()
    contact.restore(begin)
    assert found.body.translation == pytest.approx((0.05, -0.02, 0.0))
    found.solver.solve()
    assert contact.resultant().force == pytest.approx(force, rel=1e-7)


def test_what_no_update_has_seen_is_not_accepted():
    found, begin, force = dragged()
    contact = found.contact
    found.body.move()
    contact.restore(begin)
    found.body.move((0.05, -0.02))
    contact.advance()
    found.solver.solve()
    assert contact.resultant().force == pytest.approx(force, rel=1e-7)


@pytest.mark.parametrize("steps", (1, 4))
def test_strategies_leave_bodies_where_the_load_is(steps):
    """A deep step that another way has to rescue."""
    found = press("quadrilateral", rigid.Line((0.5, 1.0), (0.0, -1.0)), n=4)

    def push(t):
        found.body.move((0.0, -0.4 * t))

    path = LoadSteps(SOLVERS[-1](found.problem), push, steps).run()
    assert path[-1].factor == 1.0
    assert found.body.translation[1] == -0.4
    top = gathered.points(found.contact)
    assert top["x"][:, 1] == pytest.approx(0.6, abs=1e-6)


def test_a_turn_without_a_path_is_refused():
    found = press("triangle", rigid.Circle((0.5, 1.45), 0.5), **LAWS["friction"])
    for turn in (1.6, 2.0 * np.pi, 100.0):
        found.body.move(rotation=turn)
        with pytest.raises(ContactError, match="rad since the accepted step"):
            found.contact.update()
    frictionless = press("triangle", rigid.Circle((0.5, 1.45), 0.5))
    frictionless.body.move(rotation=1.6)
    frictionless.contact.update()


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


@pytest.mark.parametrize(
    "make, message",
    (
        (
            lambda: rigid.Sphere((0, 0, 0), 0.0),
            "radius = 0.0 must be a positive number",
        ),
        (lambda: rigid.Plane((0, 0, 0), (0, 0, 0)), "normal is zero"),
        (lambda: rigid.Plane((0, 0), (0, 0, 1)), "vectors of different lengths"),
        (lambda: rigid.Cone((0, 0, 0), (0, 0, 1), 2.0), "less than pi / 2"),
        (lambda: rigid.Torus((0, 0, 0), (0, 0, 1), 1.0, 1.5), "less than major"),
        (lambda: rigid.Circle((0, np.nan), 1.0), "2 or 3 finite numbers"),
        (lambda: rigid.Body("ball"), "shape must be one of rigid"),
        (
            lambda: rigid.Body(rigid.Circle((0, 0), 1.0)).move((1, 0, 0)),
            "translation = (1, 0, 0) must be 2 finite numbers",
        ),
        (
            lambda: rigid.Body(rigid.Sphere((0, 0, 0), 1.0)).move(rotation=0.3),
            "vector along the axis in 3D",
        ),
    ),
)
def test_what_makes_no_shape_is_told(make, message):
    with pytest.raises(ContactError) as caught:
        make()
    assert message in str(caught.value)


@pytest.mark.parametrize(
    "pairs, message",
    (
        ([(1, rigid.Sphere((0, 0, 0), 1.0))], "made for 3D, the mesh is in 2D"),
        ([(rigid.Circle((0, 0), 1.0), 1)], "can be a master only"),
        ([(1, rigid.Circle((0, 3), 1.0)), (1, 2)], "a Contact of its own"),
    ),
)
def test_pairs_that_cannot_be_are_told(pairs, message):
    mesh = rigid_scenes.boxes.box("triangle")
    tags = rigid_scenes.boxes.tag_sides(mesh, (1, 1.0), (1, 0.0))
    with pytest.raises(ContactError) as caught:
        Contact(rigid_scenes.boxes.displacement(mesh), tags, pairs)
    assert message in str(caught.value)


def test_a_path_that_fails_is_told_without_a_master(recwarn):
    """What is advised after a failure knows that there are no facets opposite."""
    found = press(
        "quadrilateral", rigid.Line((0.5, 1.0), (0.0, -1.0)), degree=2, offset=-1e-3
    )
    found.body.move((0.0, -3.0))
    with pytest.raises(ConvergenceError):
        LoadSteps(SOLVERS[-1](found.problem), lambda t: None, 1, max_halvings=1).run()
    assert not [w for w in recwarn if "interference" in str(w.message)]


@pytest.mark.mpi
@pytest.mark.parametrize("cell", ("triangle", "hexahedron"))
def test_a_tool_that_passes_the_surface_is_told(cell):
    gdim = problems.DIMENSION[cell]
    centre = [0.5] * (gdim - 1) + [1.15]
    found = press(cell, rigid.Sphere(centre, 0.2), n=6, method=Penalty(40.0))
    solver = SOLVERS[-1](found.problem)
    way = np.eye(gdim)[-1]
    found.body.move(-0.02 * way)
    solver.solve()
    assert found.contact.resultant().force[-1] < 0.0
    found.contact.advance()
    found.body.move(-0.5 * way)
    with pytest.warns(ContactWarning, match="wrong side of a rigid body .Sphere."):
        solver.solve()
    with pytest.raises(ConvergenceError, match="wrong side of a rigid body"):
        LoadSteps(
            solver, lambda t: found.body.move(-0.5 * way), 1, 0, strategy="halve"
        ).run()


@pytest.mark.parametrize("way", (1.0, -1.0))
@pytest.mark.parametrize("height", (1.02, 1.0 + 1e-9, 0.98))
def test_a_normal_that_points_the_wrong_way_is_told(way, height):
    found = press(
        "triangle", rigid.Line((0.5, height), (0.0, way)), method=Penalty(40.0)
    )
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        SOLVERS[-1](found.problem).solve()
    told = [w for w in caught if "wrong side of a rigid body" in str(w.message)]
    assert bool(told) == (way > 0.0)


def test_control_leads_no_rigid_bodies():
    found = press("triangle", rigid.Circle((0.5, 1.45), 0.5))
    control = DisplacementControl(
        lambda x: np.isclose(x[1], 1.0) & np.isclose(x[0], 1.0), direction=1, by=-0.01
    )
    with pytest.raises(ConvergenceError, match="apply moves a rigid body"):
        LoadSteps(
            SOLVERS[-1](found.problem),
            lambda t: found.body.move((0.0, -0.1 * t)),
            2,
            control=control,
        ).run()


@pytest.mark.mpi(where=lambda cell: cell == "triangle")
@pytest.mark.parametrize("cell", ("triangle", "tetrahedron"))
def test_a_tool_that_goes_through_and_out_again_is_told(cell):
    """A motion in another unit than the mesh; a tool that leaves is no loss."""
    name = "circle" if cell == "triangle" else "sphere"
    found = press(cell, shape_of(cell, name), degree=1)
    solver = NewtonSolver(found.problem)
    assert solver.solve()[1]
    found.contact.advance()
    along = np.eye(3)[1 if cell == "triangle" else 2][: 2 if cell == "triangle" else 3]
    found.body.move(3.0 * along)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert solver.solve()[1]
    assert found.contact.statistics.hits == 0
    found.body.move(-50.0 * along)
    with pytest.warns(ContactWarning, match="has gone through slave tag .* and out"):
        assert solver.solve()[1]


@pytest.mark.mpi
def test_a_residual_sees_tools_that_have_moved():
    """At an unchanged x, as a solver of the user's asks for it."""
    found = press("triangle", shape_of("triangle", "circle"), degree=1)
    problem = found.problem
    assert NewtonSolver(problem).solve()[1]
    x, b = problem.create_vector(), problem.create_vector()
    found.contact.to_vector(x)
    problem.start()
    problem.F(x, b)
    at_rest = b.norm()
    found.body.move((0.0, -0.02))
    problem.F(x, b)
    assert b.norm() > 1e3 * at_rest
    found.body.move()
    problem.F(x, b)
    assert b.norm() == pytest.approx(at_rest)


def test_what_would_change_nothing_is_refused():
    ball = rigid.Body(rigid.Circle((0.0, 0.0), 1.0), free=("y",), stiffness=2.0)
    with pytest.raises(ValueError, match="read-only"):
        ball.force[1] = -5.0
    for name in ("free", "stiffness"):
        with pytest.raises(AttributeError):
            setattr(ball, name, None)
    assert ball.free == ("y",) and ball.stiffness == {"y": 2.0}

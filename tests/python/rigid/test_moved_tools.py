"""Rigid tools that are moved along a path: steps, states, what is told of a bad motion."""

from __future__ import annotations

import warnings

import gathered
import numpy as np
import problems
import pytest
from problems import SOLVERS
from rigid_scenes import press, shape_of

from raymortar import (
    AugmentedLagrangian,
    ContactError,
    ContactWarning,
    ConvergenceError,
    Coulomb,
    LoadSteps,
    NewtonSolver,
    Penalty,
    rigid,
)
from raymortar.paths import DisplacementControl

FRICTION = {"method": AugmentedLagrangian(40.0), "friction": Coulomb(0.3)}


@pytest.mark.parametrize("solver", SOLVERS)
def test_load_steps_move_a_body(solver):
    """Where it gets to does not hang on halvings, which restore it."""
    found = press("triangle", rigid.Circle((0.5, 1.5), 0.5), n=6, **FRICTION)

    def apply(t):
        found.body.move((0.3 * t, -0.15 * min(2.0 * t, 1.0)))

    path = LoadSteps(solver(found.problem), apply, 4).run()
    assert found.body.translation == pytest.approx((0.3, -0.15, 0.0))
    assert path[-1].factor == 1.0
    assert found.contact.resultant().tangential[0] > 0.0


def dragged():
    """A tool pressed in, and dragged from there: the start and the force of this."""
    found = press("triangle", rigid.Circle((0.5, 1.45), 0.5), **FRICTION)
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
    found = press("triangle", rigid.Circle((0.5, 1.45), 0.5), **FRICTION)
    for turn in (1.6, 2.0 * np.pi, 100.0):
        found.body.move(rotation=turn)
        with pytest.raises(ContactError, match="rad since the accepted step"):
            found.contact.update()
    frictionless = press("triangle", rigid.Circle((0.5, 1.45), 0.5))
    frictionless.body.move(rotation=1.6)
    frictionless.contact.update()


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
    with pytest.warns(ContactWarning, match="has gone through slave tag"):
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

"""Free rigid bodies along a path: load steps, states, bodies that leave their slave."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
import rigid_scenes
from rigid_scenes import press, shapes, solved

from raymortar import (
    AugmentedLagrangian,
    ConvergenceError,
    Coulomb,
    History,
    LoadSteps,
    SNESSolver,
    rigid,
)
from raymortar.core.errors import SetUpError

NORMAL = {"method": AugmentedLagrangian(40.0)}
FRICTION = NORMAL | {"friction": Coulomb(0.3)}


def lying():
    """A wheel that its force presses on a block."""
    circle = rigid.Circle((0.5, 1.28), 0.3)
    body = rigid.Body(circle, name="wheel", free=("y",), force=(0.0, -0.5))
    return body, press("triangle", body, n=4, **NORMAL)


def test_load_steps_raise_the_force_and_record_the_body():
    body = rigid.Body(
        shapes(2, -0.3)["circle"], name="wheel", free=("y",), force=(0.0, 0.0)
    )
    found = press("triangle", body, n=6, **FRICTION)
    history = History(found.problem)

    def push(t):
        body.force = (0.0, -3.0 * t)

    solver = SNESSolver(found.problem)
    LoadSteps(solver, push, 3, history=history).run()
    assert history["push_wheel_y"] == pytest.approx([1.0, 2.0, 3.0], rel=1e-8)
    down = history["translation_wheel_y"]
    assert down[-1] == body.translation[1] and (np.diff(down) < 0.0).all()
    # Of the flight nothing but the first half of the first force counts
    steps = np.diff(down, prepend=0.0)
    mean = np.array([0.5, 1.5, 2.5])
    assert history["work_wheel"][-1] == pytest.approx(-mean @ steps, rel=1e-8)


@pytest.mark.mpi
def test_a_body_that_is_pulled_off_its_slave_is_named():
    """It touches at first; where it has left, nothing is ahead of it."""
    circle = rigid.Circle((0.5, 1.25), 0.3)
    body = rigid.Body(circle, name="hook", free=("y",), force=(0.0, 1.0))
    found = press("triangle", body, n=2, **NORMAL)
    message = "rigid hook is pushed along y, and nothing stops it: no slave facet"
    with pytest.raises(ConvergenceError, match=message):
        solved(found)


@pytest.mark.mpi
def test_no_smaller_step_is_tried_for_a_body_that_has_left():
    """A body that flies past its slave has it ahead from where it was."""
    body = rigid.Body(
        rigid.Circle((0.5, 1.28), 0.3), name="hook", free=("y",), force=(0.0, -0.5)
    )
    found = press("triangle", body, n=2, **NORMAL)
    solved(found)
    found.contact.advance()
    place = body.motion()
    solves = []

    def pull(t):
        solves.append(t)
        body.force = (0.0, -0.5 + 2.0 * t)

    with pytest.raises(ConvergenceError, match="factor 1 failed: .*rigid hook is"):
        LoadSteps(SNESSolver(found.problem), pull, 1).run()
    assert set(solves) <= {0.0, 1.0}
    assert body.motion() == pytest.approx(place, abs=1e-14)
    # Where it has flown past the slave, the slave is ahead of the accepted place
    bodies = found.contact.system.free_bodies
    for height, force, has_left in ((0.5, 1.0, True), (-3.0, -1.0, False)):
        body.freedom.values[:] = height
        body.force = (0.0, force)
        found.contact.update()
        assert bodies.any_left() == has_left


@pytest.mark.mpi
def test_a_body_off_its_slave_falls_back_whatever_multipliers_push():
    """A start that is led too far has multipliers, and no point in contact."""
    body, found = lying()
    solved(found)
    height = body.translation[1]
    body.force = (0.0, -0.4)
    body.freedom.values[:] = height + 0.1
    found.problem.start().destroy()
    assert body.translation[1] == pytest.approx(height, abs=0.05)
    solved(found)
    assert found.contact.results.resultant_on(body).force[1] == pytest.approx(0.4)


@pytest.mark.mpi
def test_steps_are_halved_where_a_body_is_moved_past_its_slave():
    body, found = lying()
    solved(found)
    solver, factors = SNESSolver(found.problem), []
    path = LoadSteps(solver, lambda t: body.move((1.6 * t, 0.0)), 1, max_halvings=2)
    with pytest.raises(ConvergenceError, match="after 2 halvings .* wheel is pushed"):
        for step in path:
            factors.append(step.factor)
    assert factors == [0.25]


@pytest.mark.parametrize("extrapolate", (None, True))
def test_a_predicted_start_that_none_can_take_is_dropped(monkeypatch, extrapolate):
    body, found = lying()
    contact, bodies, led = found.contact, found.contact.system.free_bodies, []
    goes, returns, closes = (
        contact.states.extrapolate,
        contact.restore,
        bodies.close_gaps,
    )

    def extrapolated(*given):
        led.append(given)
        goes(*given)

    def restored(state):
        led.clear()
        returns(state)

    def closed():
        if led:
            raise SetUpError("nothing stops it")
        closes()

    monkeypatch.setattr(contact.states, "extrapolate", extrapolated)
    monkeypatch.setattr(contact, "restore", restored)
    monkeypatch.setattr(bodies, "close_gaps", closed)

    def press_on(t):
        body.force = (0.0, -0.5 - t)

    solver = SNESSolver(found.problem)
    path = LoadSteps(solver, press_on, 3, extrapolate=extrapolate)
    assert len(path.run()) == 3 and path.halvings == 0


@pytest.mark.mpi
def test_steps_end_where_friction_is_too_small_and_say_so():
    """A wheel on the spot is driven by twice the moment that friction can have. Iterates
    beyond that fly about: no smaller step is given up for them."""
    mu, load, radius = 0.3, 0.5, 0.45
    wheel = rigid.Body(
        rigid.Circle((0.5, 1.0 + radius), radius), free=("y", "r"), force=(0.0, -load)
    )
    found = press("quadrilateral", wheel, n=4, friction=Coulomb(mu))
    solver = SNESSolver(found.problem)
    solver.solve()
    most = mu * load * radius

    def drive(t):
        wheel.moment = -2.0 * most * t

    path = LoadSteps(solver, drive, 4, max_halvings=3, strategy="halve")
    last = 0.0
    friction = "friction alone resists the load on the rigid Circle along r"
    with pytest.raises(ConvergenceError, match=friction):
        for step in path:
            last = step.factor
    assert 0.75 * most < 2.0 * most * last < most


def test_a_wheel_rolls_its_circumference(monkeypatch):
    """H5: the way is the angle times the radius, and nothing creeps when it stops.

    A surface that is compressed is longer than it looks: rubber's is not.
    """
    monkeypatch.setattr(rigid_scenes, "NU", 0.49)
    wheel = rigid.Body(
        rigid.Circle((0.35, 1.2), 0.2), free=("x", "y"), force=(0.0, -0.25)
    )
    found = press("quadrilateral", wheel, n=24, friction=Coulomb(0.6))

    def roll(t):
        wheel.move(rotation=-0.5 * t)

    solver = SNESSolver(found.problem)
    LoadSteps(solver, lambda t: None, 1).run()
    start = wheel.translation[0]
    LoadSteps(solver, roll, 5, extrapolate=True).run()
    assert wheel.translation[0] - start == pytest.approx(0.5 * 0.2, rel=1e-2)
    stop = wheel.translation[0]
    LoadSteps(solver, lambda t: None, 2).run()
    assert wheel.translation[0] == pytest.approx(stop, abs=1e-6)


@pytest.mark.parametrize("extrapolate", (False, True))
def test_a_wheel_that_is_led_down_a_slope_rolls(monkeypatch, extrapolate):
    """Each step begins off the slope: that is no flight, and slip goes on."""
    monkeypatch.setattr(rigid_scenes, "NU", 0.49)
    slope, radius, way = 0.3, 0.3, 0.2
    along = np.array([np.cos(slope), -np.sin(slope)])
    away = np.array([np.sin(slope), np.cos(slope)])
    place = 0.25 * along + (1.0 + radius) * away
    wheel = rigid.Body(rigid.Circle(place, radius), free=("y", "r"), force=(0.0, -0.25))
    turned = (0.0, 0.0, -slope), np.zeros(3)
    found = press("quadrilateral", wheel, n=12, move=turned, **FRICTION)
    solver = SNESSolver(found.problem)
    LoadSteps(solver, lambda t: None, 1).run()
    start = wheel.rotation[2]

    def lead(t):
        wheel.move((way * along[0] * t, 0.0))

    LoadSteps(solver, lead, 4, extrapolate=extrapolate).run()
    assert wheel.rotation[2] - start == pytest.approx(-way / radius, rel=0.01)


def test_a_body_that_nothing_stops_is_told():
    away = rigid.Body(shapes(2, -0.3)["circle"], free=("y",), force=(0.0, 1.0))
    found = press("triangle", away, **NORMAL)
    with pytest.raises(SetUpError, match="nothing stops it"):
        solved(found)
    # Nothing holds it along x once it touches
    slides = rigid.Body(
        rigid.Line((0.5, 1.1), (0.0, -1.0)), free=("x", "y"), force=(0.1, -1.0)
    )
    found = press("triangle", slides, **NORMAL)
    with pytest.raises(ConvergenceError, match="along x, and nothing stops it"):
        solved(found)


def test_states_of_free_bodies_go_to_files():
    """As checkpoints do: to bytes and back, into the same contact."""
    ball = rigid.Circle((0.5, 1.25), 0.2)
    found = press("triangle", rigid.Body(ball, free=("y",), force=(0.0, -1.0)), n=6)
    solved(found)
    place = found.body.place
    kept = pickle.dumps(found.contact.state())
    found.body.force = (0.0, -2.0)
    solved(found)
    assert found.body.place[1] < place[1]
    found.contact.restore(pickle.loads(kept))
    assert np.array_equal(found.body.place, place)

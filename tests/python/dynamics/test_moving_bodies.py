"""Free rigid bodies with mass: flight, bounce, friction that spins them."""

import warnings
from types import SimpleNamespace

import moving
import numpy as np
import pytest
import ufl
from dolfinx import fem
from problems import COMM, worst

import raymortar
from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from raymortar import (
    ContactError,
    ContactWarning,
    ConvergenceError,
    dynamics,
    rigid,
    tools,
)
from raymortar.dynamics import GeneralizedAlpha, Midpoint, Newmark

SCHEMES = [Newmark(), Midpoint(), GeneralizedAlpha(0.8)]
MASS, MOMENT, GRAVITY = 2.0, 0.3, 10.0


def layer(height=1.5, free=("x", "y", "r"), friction=None, E=400.0, **options):
    """A circle of radius 1/2, its centre at a height, above a layer whose base is held."""
    block = Block((12, 4), (-1.5, -1.0), (1.5, 0.0), tags={"bottom": 3, "top": 1})
    mesh, _, facets = assemble_blocks(COMM, [block], "quadrilateral")
    V = tools.vector_space(mesh, 1)
    scene = SimpleNamespace(
        mesh=mesh, facets=facets, V=V, u=fem.Function(V),
        v=ufl.TestFunction(V), a=ufl.TrialFunction(V), d=2,
    )  # fmt: skip
    scene.energy, residual = moving.elastic(scene, E)
    inertia = {"inertia": MOMENT} if "r" in free else {}
    ball = rigid.Body(
        rigid.Circle((0.0, height), 0.5), name="ball", free=free, mass=MASS, **inertia
    )
    contact = raymortar.Contact(scene.u, facets, [(1, ball)], friction=friction)
    bcs = [tools.prescribe(V, facets.find(3))]
    scene.ball, scene.contact = ball, contact
    scene.problem = raymortar.NonlinearProblem(residual, contact, bcs, **options)
    scene.inertia = dynamics.Inertia(ufl.inner(scene.a, scene.v) * ufl.dx, contact)
    scene.history = raymortar.History(scene.problem)
    return scene


def steps_of(scene, scheme, dt, end, apply=None, **options):
    return dynamics.TimeSteps(
        scene.problem.snes_solver, scene.inertia, apply, end=end, dt=dt, scheme=scheme,
        energy=scene.energy, history=scene.history, **options,
    )  # fmt: skip


@pytest.mark.mpi
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_a_body_in_flight_falls_and_spins(scheme):
    scene = layer(height=20.0)
    scene.ball.force = (0.0, -MASS * GRAVITY)
    scene.ball.velocity = {"x": 1.0, "r": 3.0}
    steps_of(scene, scheme, 0.1, 1.0).run()
    assert worst(scene.ball.translation[:2] - [1.0, -0.5 * GRAVITY]) <= 1e-9
    assert abs(scene.ball.rotation[2] - 3.0) <= 1e-9
    assert abs(scene.ball.velocity["y"] + GRAVITY) <= 1e-9
    kinetic = 0.5 * MASS * (1.0 + GRAVITY**2) + 0.5 * MOMENT * 9.0
    assert abs(scene.history["kinetic"][-1] - kinetic) <= 1e-8 * kinetic
    work = scene.history["external_work"][-1]
    assert abs(work - 0.5 * MASS * GRAVITY**2) <= 1e-8 * kinetic
    place, velocity = np.array([1.0, 15.0]), np.array([1.0, -GRAVITY])
    turn = MASS * (place[0] * velocity[1] - place[1] * velocity[0]) + MOMENT * 3.0
    assert abs(scene.history["moment_of_momentum"][-1] - turn) <= 1e-8 * abs(turn)
    # Loads and springs are the user's again
    assert worst(scene.ball.force - [0.0, -MASS * GRAVITY]) == 0.0
    assert scene.ball.stiffness == {"x": 0.0, "y": 0.0, "r": 0.0}


@pytest.mark.mpi
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_a_step_that_fails_leaves_nothing_on_the_body(scheme):
    fails = [False]

    def update():
        if fails[0]:
            fails[0] = False
            raise ConvergenceError("the user's")

    scene = layer(height=20.0, update=update)
    scene.ball.force = (0.0, -MASS * GRAVITY)
    scene.ball.velocity = {"x": 1.0, "r": 3.0}
    steps = steps_of(scene, scheme, 0.1, 1.0, strategy="halve")
    for step in steps:
        fails[0] = step.number == 2
    assert steps.halvings == 1
    assert worst(scene.ball.translation[:2] - [1.0, -0.5 * GRAVITY]) <= 1e-9
    assert abs(scene.ball.rotation[2] - 3.0) <= 1e-9
    assert worst(scene.ball.force - [0.0, -MASS * GRAVITY]) == 0.0


@pytest.mark.mpi
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_friction_holds_a_body_back_as_it_lands(scheme):
    """Slip of the step in which it lands counts from where the step began."""
    scene = layer(height=0.51, free=("x", "y"), friction=raymortar.Coulomb(0.4))
    scene.ball.velocity = {"x": 1.0, "y": -0.2}
    forces = []
    for step in steps_of(scene, scheme, 0.02, 0.2):
        forces.append(scene.contact.results.resultant_on(scene.ball).force[:2])
        if forces[-1][1] > 1e-9:
            break
    along, up = forces[-1]
    assert up > 1e-9 and abs(along / up + 0.4) <= 0.05


@pytest.mark.mpi
@pytest.mark.parametrize("scheme", SCHEMES[:2], ids=str)
def test_a_bouncing_body_keeps_the_energy(scheme):
    scene = layer(height=0.55, free=("y",), E=2000.0)
    scene.ball.force = (0.0, -MASS * GRAVITY)
    scene.ball.velocity = {"y": -1.0}
    steps_of(scene, scheme, 2e-3, 0.3).run()
    h = scene.history
    total = h["kinetic"] + h["elastic"] - h["external_work"]
    start = 0.5 * MASS
    # What is missing while they touch is the work of contact, on facets of half a radius
    tolerance = 1e-6 if scheme == Newmark() else 1e-2  # of half a step
    assert worst(total - start - h["contact_work"]) <= tolerance * start
    assert worst(h["contact_work"]) <= 0.03 * start
    bounced = np.flatnonzero(np.diff(1.0 * (np.abs(h["force_0_y"]) > 1e-9)) < 0.0)
    assert len(bounced) >= 1
    assert worst(h["contact_work"][bounced + 1]) <= 0.005 * start


@pytest.mark.mpi
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_friction_takes_spin_as_it_gives_momentum(scheme):
    """Forces on the ball change its momentum, and about its centre its spin."""
    scene = layer(height=0.502, friction=raymortar.Coulomb(0.3))
    scene.ball.force = (0.0, -MASS * GRAVITY)
    scene.ball.velocity = {"y": -0.2, "r": 5.0}
    spin, speed, times = [5.0], [0.0], [0.0]
    steps = steps_of(scene, scheme, 2e-3, 0.1)
    for step in steps:
        spin.append(scene.ball.velocity["r"])
        speed.append(scene.ball.velocity["x"])
        times.append(step.time)
    moment, push = scene.history["moment_ball"], scene.history["push_ball_x"]
    spin, speed = np.array(spin), np.array(speed)
    assert spin[-1] < 4.8
    # Over the whole path, by the scheme's mean of forces
    dt = 2e-3
    if scheme == Midpoint():
        sums = [dt * moment.sum(), dt * push.sum()]
    else:
        sums = [dt * (f.sum() - 0.5 * f[-1]) for f in (moment, push)]
    tolerance = 1e-6 if scheme != GeneralizedAlpha(0.8) else 0.05
    change = MOMENT * (spin[-1] - spin[0]), MASS * (speed[-1] - speed[0])
    for total, found in zip(sums, change):
        assert abs(total - found) <= tolerance * abs(found) + 1e-10
    friction = -scene.history["friction_work"][-1]
    assert abs(scene.history["contact_work"][-1] - friction) < abs(friction)


def test_velocity_and_masses_are_checked():
    circle = rigid.Circle((0.0, 1.0), 0.5)
    with pytest.raises(ContactError, match="mass = -1.0 must be a positive"):
        rigid.Body(circle, free=("y",), mass=-1.0)
    with pytest.raises(ContactError, match="one free rotation"):
        rigid.Body(circle, free=("y",), mass=1.0, inertia=1.0)
    with pytest.raises(ContactError, match="free translation"):
        rigid.Body(circle, mass=1.0)
    body = rigid.Body(circle, free=("y",), mass=1.0)
    with pytest.raises(ContactError, match="velocity must be numbers by"):
        body.velocity = {"x": 1.0}
    with pytest.raises(ContactError, match="finite ones, not"):
        body.velocity = {"y": np.nan}


def test_a_velocity_without_mass_is_refused():
    scene = layer(height=20.0)
    scene.ball.masses[:] = 0.0
    steps_of(scene, Newmark(), 0.1, 1.0)
    scene.ball.velocity = {"y": -1.0}
    with pytest.raises(ContactError, match="ball has velocity = .* and no mass"):
        steps_of(scene, Newmark(), 0.1, 1.0)


def test_load_steps_warn_of_a_velocity_that_they_leave_out():
    scene = layer(height=0.5, free=("y",))
    scene.ball.force = (0.0, -1.0)
    solver, velocity = (
        scene.problem.snes_solver,
        r"velocity = \{'y': -1.0\} of the rigid b",
    )
    scene.ball.velocity = {"y": -1.0}
    with pytest.warns(ContactWarning, match=velocity):
        raymortar.LoadSteps(solver, lambda t: None, 1).run()
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message=".*" + velocity)
        steps_of(scene, Newmark(), 0.01, 0.01).run()


def test_a_body_in_space_that_turns_about_two_axes_is_refused():
    scene = moving.bars("hexahedron", n=2, lower=False, heads=1)
    _, residual = moving.elastic(scene)
    ball = rigid.Body(
        rigid.Sphere((0.5, 0.5, -1.0), 0.5), free=("z", "rx", "ry"), mass=1.0
    )
    contact = raymortar.Contact(scene.u, scene.facets, [(moving.SLAVE, ball)])
    held = tools.prescribe(scene.V, scene.facets.find(moving.HEAD))
    problem = raymortar.NonlinearProblem(residual, contact, [held])
    inertia = dynamics.Inertia(ufl.inner(scene.a, scene.v) * ufl.dx, contact)
    with pytest.raises(ContactError, match="may turn about 2 axes"):
        dynamics.TimeSteps(problem.snes_solver, inertia, end=1.0, dt=0.1)

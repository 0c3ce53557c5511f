"""Balls and boxes in space that turn about all axes while they touch a layer."""

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
from raymortar import Checkpoint, ContactError, dynamics, rigid, tools
from raymortar.dynamics import GeneralizedAlpha, Midpoint, Newmark

SCHEMES = [Newmark(), Midpoint(), GeneralizedAlpha(0.8)]
FREE = ("x", "y", "z", "rx", "ry", "rz")
MASS, RADIUS, GRAVITY = 2.0, 0.5, 10.0
MOMENT = 0.4 * MASS * RADIUS**2  # of a solid ball


def layer(inertia=MOMENT, height=RADIUS, friction=None, E=4e3, n=(2, 2), shape=None):
    """A body above a layer whose base is held."""
    block = Block(
        (*n, 1), (-0.4, -0.4, -0.3), (0.4, 0.4, 0.0), tags={"bottom": 3, "top": 1}
    )
    mesh, _, facets = assemble_blocks(COMM, [block], "hexahedron")
    V = tools.vector_space(mesh, 1)
    scene = SimpleNamespace(
        u=fem.Function(V), v=ufl.TestFunction(V), a=ufl.TrialFunction(V), d=3
    )
    scene.energy, residual = moving.elastic(scene, E)
    shape = shape or rigid.Sphere((0.0, 0.0, height), RADIUS)
    scene.ball = rigid.Body(shape, name="ball", free=FREE, mass=MASS, inertia=inertia)
    scene.contact = raymortar.Contact(
        scene.u, facets, [(1, scene.ball)], friction=friction, frame="master"
    )
    held = [tools.prescribe(V, facets.find(3))]
    scene.problem = raymortar.NonlinearProblem(residual, scene.contact, held)
    form = 1e-3 * ufl.inner(scene.a, scene.v) * ufl.dx
    scene.inertia = dynamics.Inertia(form, scene.contact)
    scene.history = raymortar.History(scene.problem)
    return scene


def steps_of(scene, scheme, dt, end, **options):
    return dynamics.TimeSteps(
        scene.problem.snes_solver, scene.inertia, end=end, dt=dt, scheme=scheme,
        energy=scene.energy, history=scene.history, **options,
    )  # fmt: skip


@pytest.mark.mpi
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_a_body_in_flight_tumbles(scheme):
    """Three unlike moments, no forces: moment of momentum and energy stay."""
    scene = layer(inertia=(0.1, 0.2, 0.25), height=3.0)
    spin = {"x": 1.0, "rx": 0.1, "ry": 4.0, "rz": 0.2}
    scene.ball.velocity = spin
    steps_of(scene, scheme, 0.05, 0.5).run()
    kinetic = 0.5 * (MASS + 0.1 * 0.1**2 + 0.2 * 4.0**2 + 0.25 * 0.2**2)
    tolerance = 1e-10 if scheme != GeneralizedAlpha(0.8) else 1e-3
    assert worst(scene.history["kinetic"] - kinetic) <= tolerance * kinetic
    # About the origin: that of the centre too, at a height of 3
    turn = np.array([0.1 * 0.1, 0.2 * 4.0 + 3.0 * MASS, 0.25 * 0.2])
    for axis, expected in zip("xyz", turn):
        found = scene.history[f"moment_of_momentum_{axis}"]
        assert worst(found - expected) <= 1e-10 * worst(turn)
    assert abs(scene.ball.velocity["rx"] - 0.1) >= 1e-3


@pytest.mark.mpi
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_the_tangent_of_a_spinning_body_is_that_of_differences(scheme):
    scene = layer((0.1, 0.2, 0.25), RADIUS - 1e-4, raymortar.Coulomb(0.3))
    scene.ball.velocity = {"rx": 3.0, "ry": -2.0, "rz": 1.0}
    problem, bodies = scene.problem, dynamics.moving_bodies.MovingBodies(
        scene.contact, scheme
    )
    scene.contact.update()
    bodies.set_accelerations(scene.contact)
    bodies.begin(0.1)
    assert 1.8 <= moving.taylor_slope(problem, 7) <= 2.2


@pytest.mark.mpi
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_friction_turns_a_ball_as_its_moment_says(scheme):
    scene = layer(height=RADIUS + 5e-4, friction=raymortar.Coulomb(0.3))
    scene.ball.force = (0.0, 0.0, -MASS * GRAVITY)
    scene.ball.velocity = {"x": 0.6, "y": -0.8, "z": -0.3, "rz": 2.0}
    steps_of(scene, scheme, 2e-3, 0.02).run()
    spin = [scene.ball.velocity[name] for name in FREE[3:]]
    moment = np.stack([scene.history[f"moment_ball_{x}"] for x in "xyz"])
    # By the scheme's mean of moments; touches may be halved
    if scheme != Midpoint():
        moment = 0.5 * (moment + np.pad(moment, ((0, 0), (1, 0)))[:, :-1])
    total = moment @ np.diff(scene.history["time"], prepend=0.0)
    gained = MOMENT * (np.array(spin) - [0.0, 0.0, 2.0])
    assert np.abs(gained[:2]).min() >= 1e-4
    tolerance = 1e-4 if scheme != GeneralizedAlpha(0.8) else 0.05
    assert worst(gained - total) <= tolerance * worst(gained)


def test_a_body_that_tumbles_bounces():
    """Without friction pressures pass the centre of a ball: energy and moment stay."""
    scene = layer((0.02, 0.04, 0.05), RADIUS, E=2e4, n=(6, 6))
    scene.ball.velocity = {"z": -1.0, "rx": 0.5, "ry": 20.0, "rz": 1.0}
    steps_of(scene, Newmark(), 4e-3, 0.12).run()
    h = scene.history
    assert scene.ball.velocity["z"] >= 0.95
    energy = h["kinetic"] + h["elastic"]
    start = 0.5 * (MASS + 0.02 * 0.5**2 + 0.04 * 20.0**2 + 0.05)
    assert abs(energy[-1] / start - 1.0) <= 0.01
    spin = [scene.ball.velocity[name] for name in FREE[3:]]
    R = scene.ball.cpp.accepted_turn
    momentum = R @ np.diag([0.02, 0.04, 0.05]) @ R.T @ spin
    assert worst(momentum - [0.02 * 0.5, 0.04 * 20.0, 0.05]) <= 1e-10


def test_a_run_of_a_spinning_ball_goes_on_from_a_checkpoint(folder):
    def model():
        scene = layer((0.1, 0.2, 0.25), RADIUS - 1e-3, raymortar.Coulomb(0.3))
        scene.ball.force = (0.0, 0.0, -MASS * GRAVITY)
        scene.steps = steps_of(scene, GeneralizedAlpha(0.8), 5e-3, 0.04)
        scene.file = Checkpoint(
            scene.problem, folder / "spin.chk", more=scene.steps.fields,
            history=scene.history,
        )  # fmt: skip
        return scene

    one, other = model(), model()
    one.ball.velocity = {"x": 0.5, "rx": 3.0, "ry": -2.0, "rz": 1.0}
    for step in one.steps:
        if abs(step.time - 0.02) < 1e-9:
            one.file.write(step.time)
    other.steps.resume(other.file.read())
    other.steps.run()
    a, b = (np.array(list(s.ball.velocity.values())) for s in (one, other))
    assert worst(a - b) <= 1e-9 * worst(a)
    assert worst(one.ball.rotation - other.ball.rotation) <= 1e-12
    assert one.history["kinetic"][-1] == pytest.approx(other.history["kinetic"][-1])


def test_a_mass_that_turns_about_all_axes_needs_its_inertia():
    scene = layer(inertia=None)
    with pytest.raises(ContactError, match="about three with its inertia"):
        steps_of(scene, Newmark(), 0.1, 1.0)

"""Schemes of time: order, tangent, and what a flight and its supports conserve."""

import moving
import numpy as np
import pytest
import ufl
from dolfinx import fem
from flying import SCHEMES, after, beam, in_fine_steps, steps_of
from problems import worst

import raymortar
from raymortar import SNESSolver, dynamics, rigid
from raymortar.dynamics import Midpoint
from raymortar.dynamics.motion import InertiaTerm, Motion


@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_away_from_impacts_the_order_is_2(scheme):
    exact = in_fine_steps(scheme)
    errors = [worst(after(scheme, 0.4 / n) - exact) for n in (32, 64)]
    assert 1.85 <= np.log2(errors[0] / errors[1]) <= 2.3


@pytest.mark.mpi
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
@pytest.mark.parametrize("mass", ["nearest", "affine"])
def test_the_tangent_is_that_of_differences(scheme, mass):
    scene = beam(gap=0.0)
    form = ufl.inner(scene.a, scene.v) * ufl.dx
    scene.inertia = dynamics.Inertia(form, scene.contact, mass)
    problem, motion = scene.problem, Motion(scene.inertia, scheme)
    term = InertiaTerm(problem, motion)
    motion.set_velocity([scene.v0])
    motion.begin(0.1)
    with term.acting():
        assert 1.8 <= moving.taylor_slope(problem, 3) <= 2.2


@pytest.mark.filterwarnings("ignore:converged, but contact is lost")
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
@pytest.mark.parametrize("dt", [1e-4, 1e-6])
def test_a_flight_is_solved_from_where_it_ends(scheme, dt):
    """Nothing but rounding of inertia is left, in a body without other forces."""
    scene = beam(held=False, E=1.0)
    scene.u.interpolate(lambda x: np.vstack([0.0 * x[0] + 1.3, 0.0 * x[0] + 3.7]))
    motion = Motion(scene.inertia, scheme)
    motion.set_velocity([scene.v0])
    motion.begin(dt)
    rng = np.random.default_rng(2)
    with InertiaTerm(scene.problem, motion).acting():
        solver = SNESSolver(scene.problem)
        solver.solve()
        for _ in range(5):
            scene.u.x.array[:] *= 1.0 + 4e-16 * rng.choice(
                (-1, 1), len(scene.u.x.array)
            )
            assert solver.solve()[0] <= 3


@pytest.mark.mpi
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_a_free_flight_is_uniform(scheme):
    scene = beam(held=False)
    history = raymortar.History(scene.problem)
    steps_of(scene, scheme, 0.1, 1.0, history=history).run()
    moved = scene.u.x.array.reshape(-1, 2)
    assert worst(moved - [0.3, -0.2]) <= 1e-12
    assert worst(np.diff(history["momentum_x"])) <= 1e-13
    assert worst(np.diff(history["moment_of_momentum"])) <= 1e-13


@pytest.mark.mpi
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
@pytest.mark.parametrize("mass", ["nearest", "affine"])
def test_weight_gives_its_momentum_from_the_first_step_on(scheme, mass):
    """That of contact nodes, too, which have no mass."""
    scene = beam(held=False, weight=2.0)
    form = ufl.inner(scene.a, scene.v) * ufl.dx
    scene.inertia = dynamics.Inertia(form, scene.contact, mass)
    history = raymortar.History(scene.problem)
    steps_of(scene, scheme, 0.05, 0.2, history=history, velocity=None).run()
    expected = -2.0 * 0.4 * history["time"]
    # The middle of a step is what midpoint records
    assert worst(history["momentum_y"] - expected) <= 1e-9


@pytest.mark.mpi
def test_the_midpoint_rule_keeps_moments_in_large_rotation():
    scene = beam(held=False)

    def spin(x):
        return np.vstack([-3.0 * (x[1] - 5.5), 3.0 * (x[0] - 0.2)])

    scene.v0.interpolate(spin)
    history = raymortar.History(scene.problem)
    steps_of(scene, Midpoint(), 0.05, 2.0, history=history).run()
    turns = history["moment_of_momentum"]
    assert worst(turns / turns[0] - 1.0) <= 1e-9
    assert worst(np.diff(history["momentum_x"])) <= 1e-12 * turns[0]


@pytest.mark.mpi
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_supports_do_the_work_that_the_body_gains(scheme):
    scene = moving.bars(n=6, lower=False, gap=1.0)
    energy, residual = moving.elastic(scene, 50.0)
    floor = rigid.Plane((0.0, 0.0), (0.0, 1.0))
    contact = raymortar.Contact(scene.u, scene.facets, [(moving.SLAVE, floor)])
    up = fem.Constant(scene.mesh, 0.0)
    head = scene.facets.find(moving.HEAD)
    bcs = [raymortar.tools.prescribe(scene.V, head, up, 1)]
    bcs.append(raymortar.tools.prescribe(scene.V, head, 0.0, 0))
    problem = raymortar.NonlinearProblem(residual, contact, bcs)
    inertia = dynamics.Inertia(ufl.inner(scene.a, scene.v) * ufl.dx, contact)
    history = raymortar.History(problem, reactions={"head": bcs})

    def lift(t):
        up.value = 0.1 * (1.0 - np.cos(4.0 * t))

    dynamics.TimeSteps(
        problem.snes_solver, inertia, lift, end=0.6, dt=0.005, scheme=scheme,
        energy=energy, history=history,
    ).run()  # fmt: skip
    gained = history["kinetic"] + history["elastic"]
    assert worst(gained - history["external_work"]) <= 0.01 * gained.max()
    assert gained.max() > 0.0
    # A force of the support changes the momentum
    change = np.diff(history["momentum_y"]) / np.diff(history["time"])
    force = history["reaction_head_y"]
    mean = force[1:] if scheme == Midpoint() else 0.5 * (force[1:] + force[:-1])
    assert worst(change - mean) <= 0.03 * worst(force)


@pytest.mark.mpi
@pytest.mark.parametrize("cfl", [1.0, 0.25])
def test_midpoint_energies_of_a_flight_do_not_swing(cfl):
    """Values without mass count where they are in balance with the others."""
    scene = moving.bars(n=8, lower=False, gap=1.0, width=0.5, heads=4)
    strain = ufl.sym(ufl.grad(scene.u))
    energy = (0.5 * ufl.inner(strain, strain) + 0.3 * ufl.tr(strain) ** 2) * ufl.dx
    floor = rigid.Plane((0.0, 0.0), (0.0, 1.0))
    contact = raymortar.Contact(scene.u, scene.facets, [(moving.SLAVE, floor)])
    residual = ufl.derivative(energy, scene.u, scene.v)
    problem = raymortar.NonlinearProblem(residual, contact)
    inertia = dynamics.Inertia(ufl.inner(scene.a, scene.v) * ufl.dx, contact)
    found = moving.run(
        scene, problem, inertia, energy=energy, end=10 * cfl / 8, dt=cfl / 8,
        scheme=Midpoint(), velocity=moving.moving(scene, lambda z: 0.05 * np.cos(9 * z)),
    )  # fmt: skip
    assert np.ptp(found.energy) <= 1e-11 * found.energy[0]
    assert worst(found.history["external_work"]) <= 1e-11 * found.energy[0]
    assert np.ptp(found.history["elastic"]) >= 0.1 * found.energy[0]

"""Time steps: order, tangent, conservation, halving, restart, sizes, messages."""

from functools import cache
from types import SimpleNamespace

import moving
import numpy as np
import pytest
import strips
import ufl
from dolfinx import fem
from problems import worst

import raymortar
from raymortar import (
    Checkpoint,
    ContactError,
    ConvergenceError,
    SNESSolver,
    dynamics,
    rigid,
)
from raymortar.dynamics import Adaptive, GeneralizedAlpha, Midpoint, Newmark
from raymortar.dynamics.motion import InertiaTerm, Motion

SCHEMES = [Newmark(), Midpoint(), GeneralizedAlpha(0.8)]


def beam(
    gap=5.0,
    n=6,
    held=True,
    speed=(0.3, -0.2),
    friction=None,
    E=20.0,
    weight=0.0,
    **options,
):
    """A soft strip above a plane, with a velocity that bends it if its head is held."""
    scene = moving.bars(n=n, lower=False, gap=gap, width=0.4)
    floor = rigid.Plane((0.0, 0.0), (0.0, 1.0))
    contact = raymortar.Contact(
        scene.u, scene.facets, [(moving.SLAVE, floor)], friction=friction, **options
    )
    residual = strips.neo_hookean(scene.u, E)
    residual += fem.Constant(scene.mesh, weight) * scene.v[1] * ufl.dx
    bcs = []
    if held:
        bcs.append(raymortar.tools.prescribe(scene.V, scene.facets.find(moving.HEAD)))
    scene.problem = raymortar.NonlinearProblem(residual, contact, bcs)
    scene.contact = contact
    form = ufl.inner(scene.a, scene.v) * ufl.dx
    scene.inertia = dynamics.Inertia(form, contact)
    scene.v0 = fem.Function(scene.V)
    top = gap + 1.0

    def bend(x):
        share = (top - x[1]) if held else 1.0 + 0.0 * x[1]
        return np.vstack([speed[0] * share, speed[1] * share])

    scene.v0.interpolate(bend)
    return scene


def steps_of(scene, scheme, dt, end, solver=None, **options):
    given = {"velocity": scene.v0} | options
    return dynamics.TimeSteps(
        solver or scene.problem.snes_solver, scene.inertia, end=end, dt=dt,
        scheme=scheme, **given,
    )  # fmt: skip


def after(scheme, dt, end=0.4, **options):
    """Displacement after some time in flight."""
    scene = beam(**options)
    steps_of(scene, scheme, dt, end).run()
    return scene.u.x.array.copy()


@cache
def in_fine_steps(scheme):
    return after(scheme, 0.4 / 256)


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


class Fails(SNESSolver):
    """Refuses steps that are larger than a size."""

    def __init__(self, problem, most):
        super().__init__(problem)
        self.most, self.steps = most, None

    def solve(self, u=None):
        found = super().solve(u)
        if self.steps.motion.dt > self.most:
            raise ConvergenceError("too large a step for this test")
        return found


def falling(scheme, dt, most=None, end=0.6, **options):
    """A block that falls on a plane with friction, under a load that grows."""
    scene = beam(gap=0.02, held=False, friction=raymortar.Coulomb(0.3))
    solver = SNESSolver(scene.problem) if most is None else Fails(scene.problem, most)
    steps = steps_of(scene, scheme, dt, end, solver, strategy="halve", **options)
    solver.steps = steps
    steps.run()
    return SimpleNamespace(
        u=scene.u.x.array.copy(), v=steps.velocity.x.array.copy(), steps=steps,
        force=scene.contact.resultant().force,
    )  # fmt: skip


@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_a_halved_step_begins_where_the_last_one_ended(scheme):
    halved = falling(scheme, 0.02, most=0.011)
    plain = falling(scheme, 0.01)
    assert halved.steps.halvings == 30
    assert worst(halved.u - plain.u) <= 1e-9 * worst(plain.u)
    assert worst(halved.v - plain.v) <= 1e-7 * worst(plain.v)


@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_energies_go_on_without_a_history(scheme):
    scene = beam(held=False)
    steps = steps_of(
        scene, scheme, 0.1, 0.4, energy=fem.Constant(scene.mesh, 0.0) * ufl.dx
    )
    steps.resume(0.2)
    energies = [step.energy for step in steps]
    assert len(energies) == 2
    assert energies[-1].kinetic == pytest.approx(0.2 * (0.3**2 + 0.2**2), rel=1e-9)


@pytest.mark.mpi
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_a_run_goes_on_from_a_checkpoint(scheme, folder):
    def model():
        scene = beam(gap=0.02, held=False, friction=raymortar.Coulomb(0.3))
        scene.history = raymortar.History(scene.problem)
        return scene

    def checkpoint(scene, steps):
        return Checkpoint(
            scene.problem,
            folder / "motion.chk",
            more=steps.fields,
            history=scene.history,
        )

    one = model()
    steps = steps_of(one, scheme, 0.02, 0.6, history=one.history)
    saved = checkpoint(one, steps)
    for step in steps:
        if abs(step.time - 0.3) < 1e-9:
            saved.write(step.time)
    other = model()
    steps = steps_of(other, scheme, 0.02, 0.6, history=other.history, velocity=None)
    steps.resume(checkpoint(other, steps).read())
    assert len(steps.run()) == 15
    a, b = (np.array(s.history.rows)[:, 3:] for s in (one, other))
    assert a.shape == b.shape
    size = np.nanmax(np.abs(a), axis=0)
    assert np.nanmax(np.abs(a - b) / (size + 1e-3)) <= 1e-8
    assert worst(one.u.x.array - other.u.x.array) <= 1e-10 * worst(one.u.x.array)


def test_adaptive_steps_follow_the_error():
    exact, sizes = in_fine_steps(Newmark()), []
    errors = []
    for tolerance in (1e-3, 1e-4):
        scene = beam()
        steps = steps_of(
            scene, Newmark(), 0.1, 0.4, adapt=Adaptive(error=tolerance, largest=4.0)
        )
        sizes.append([step.dt for step in steps])
        errors.append(worst(scene.u.x.array - exact))
        assert abs(sum(sizes[-1]) - 0.4) <= 1e-12
    assert len(sizes[1]) > len(sizes[0])
    assert errors[1] < errors[0]


def test_a_first_touch_may_be_found():
    def touched(touch):
        scene = beam(gap=0.05, held=False, speed=(0.0, -1.0))
        found = []
        steps = steps_of(scene, Newmark(), 0.032, 0.1, touch=touch)
        for step in steps:
            found.append((step.dt, scene.contact.statistics.active_points > 0))
        return next(dt for dt, touches in found if touches), sum(dt for dt, _ in found)

    assert touched(0)[0] > 0.02
    dt, end = touched(3)
    assert dt <= 0.1 / 4 / 8 * (1.0 + 1e-12)
    assert abs(end - 0.1) <= 1e-12


@pytest.mark.parametrize("touch, most", [(0, 0.05), (3, 2e-3)])
def test_touches_and_partings_that_are_halved_keep_the_energy(touch, most):
    """Of touches alone the energy would grow: partings give what touches take."""
    found = moving.dropped(
        Newmark(), "nearest", n=4, cfl=0.8, end=1.9, touch=touch,
    )  # fmt: skip
    apart = found.force == 0.0
    assert not apart[len(apart) // 2] and apart[-1]
    assert worst(found.energy[apart] / found.energy[0] - 1.0) <= most
    assert (touch == 0) == (worst(found.energy / found.energy[0] - 1.0) >= 2e-3)


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


def test_a_checkpoint_of_another_motion_is_named(folder):
    """Of statics, and of another scheme."""
    scene, path = beam(held=False), folder / "lacks.chk"
    Checkpoint(scene.problem, path).write(0.2)
    steps = steps_of(scene, Newmark(), 0.1, 0.4)
    with pytest.raises(ContactError, match="has no motion: velocity, motion: accel"):
        steps.resume(Checkpoint(scene.problem, path).read())
    steps.run()
    Checkpoint(scene.problem, path).write(0.2)
    other = beam(held=False)
    steps = steps_of(other, GeneralizedAlpha(), 0.1, 0.4)
    with pytest.raises(ContactError, match="has no motion: static forces: it is not"):
        steps.resume(Checkpoint(other.problem, path).read())


def test_a_checkpoint_may_be_read_before_time_steps_are_made(folder):
    """Without naming what belongs to the motion."""
    one, found = beam(gap=0.02, held=False), []
    steps = steps_of(one, Midpoint(), 0.02, 0.6)
    for step in steps:
        if abs(step.time - 0.3) < 1e-9:
            Checkpoint(one.problem, folder / "early.chk").write(step.time)
    other = beam(gap=0.02, held=False)
    time = Checkpoint(other.problem, folder / "early.chk").read()
    steps = steps_of(other, Midpoint(), 0.02, 0.6, velocity=None)
    steps.resume(time)
    steps.run()
    assert worst(one.u.x.array - other.u.x.array) <= 1e-12 * worst(one.u.x.array)


def test_what_a_step_tells(capsys):
    scene = beam(gap=0.02, held=False)
    steps = steps_of(scene, None, 0.02, 0.06, progress=True, energy=energy_of(scene))
    done = steps.run()
    assert [step.number for step in done] == [1, 2, 3]
    assert abs(done[-1].time - 0.06) <= 1e-15 and abs(done[0].dt - 0.02) <= 1e-15
    assert done[0].energy.elastic is not None
    assert done[0].energy.total == done[0].energy.kinetic + done[0].energy.elastic
    assert "time 0.02" in capsys.readouterr().err
    assert "TimeSteps from" in repr(steps)
    assert steps_of(beam(), None, 0.02, 0.02).run()[0].energy is None


def energy_of(scene):
    strain = ufl.sym(ufl.grad(scene.u))
    return ufl.inner(strain, strain) * ufl.dx


@pytest.mark.parametrize(
    "options, text",
    [
        ({"dt": 0.0}, "dt"),
        ({"end": -1.0}, "after start"),
        ({"energy": 3.0}, "energy must be a UFL functional"),
        ({"scheme": "newmark"}, "scheme must be one of Newmark"),
        ({"adapt": 2}, "adapt must be an Adaptive"),
        ({"touch": -1}, "touch"),
        ({"velocity": 3}, "velocity must be a Function"),
        ({"velocity": np.nan}, "velocity has values that are not finite"),
    ],
)
def test_wrong_arguments_are_refused(options, text):
    scene = beam()
    given = {"end": 1.0, "dt": 0.1, "scheme": None} | options
    if given.get("velocity") is np.nan:
        scene.v0.x.array[0], given["velocity"] = np.nan, scene.v0
    with pytest.raises(ContactError, match=text):
        steps_of(scene, **given)


@pytest.mark.parametrize(
    "make, text",
    [
        (lambda: Newmark(beta=0.1), "stable"),
        (lambda: Newmark(beta="a"), "number"),
        (lambda: GeneralizedAlpha(1.5), "rho_inf"),
        (lambda: Adaptive(error=-1.0), "error"),
        (lambda: Adaptive(largest=0.5), "largest"),
        (lambda: Adaptive(easy=0), "easy"),
    ],
)
def test_wrong_schemes_are_refused(make, text):
    with pytest.raises(ContactError, match=text):
        make()

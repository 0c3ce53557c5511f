"""A run of time steps: halving, restart, sizes, touches, messages."""

from types import SimpleNamespace

import moving
import numpy as np
import pytest
import ufl
from dolfinx import fem
from flying import SCHEMES, beam, in_fine_steps, steps_of
from problems import worst

import raymortar
from raymortar import Checkpoint, ContactError, ConvergenceError, SNESSolver
from raymortar.dynamics import Adaptive, GeneralizedAlpha, Midpoint, Newmark


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

"""Penalties, laws at nodes, friction, ties and several meshes in motion."""

import moving
import numpy as np
import pytest
import ufl
from dolfinx import fem
from problems import COMM, worst

import raymortar
from raymortar import (
    AugmentedLagrangian,
    Contact,
    Coulomb,
    Penalty,
    Tie,
    dynamics,
    tools,
)
from raymortar.core import compat
from raymortar.dynamics import Midpoint, Newmark


def meet(make, scheme=None, n=20, time=2.5, **options):
    """Two bars that meet at v and -v under a contact of one's own."""
    scene = moving.bars(n=n, **options)
    energy, residual = moving.elastic(scene)
    contact = make(scene.u, scene.facets, [(moving.SLAVE, moving.MASTER)])
    problem = raymortar.NonlinearProblem(residual, contact)
    inertia = dynamics.Inertia(ufl.inner(scene.a, scene.v) * ufl.dx, contact)
    found = moving.run(
        scene, problem, inertia, energy=energy, end=time, dt=1.0 / n,
        scheme=scheme or Newmark(), velocity=moving.by_bar(scene, 0.01),
    )  # fmt: skip
    found.stress = found.force / (0.01 * scene.area)
    found.whole = found.energy / (1e-4 * scene.area)
    return found


@pytest.mark.mpi
@pytest.mark.parametrize(
    "options",
    [
        {"method": AugmentedLagrangian(condition="nodes")},
        {"method": AugmentedLagrangian(), "friction": Coulomb(0.3)},
        {"method": Penalty(500.0)},
        {"method": Penalty(500.0), "friction": Coulomb(0.3)},
    ],
    ids=["nodes", "friction", "penalty", "penalty with friction"],
)
def test_bars_keep_their_energy_under_every_law(options):
    found = meet(lambda *given: Contact(*given, **options))
    pressed = (found.time > 0.6) & (found.time < 1.4)
    assert abs(found.stress[pressed].mean() - 1.0) <= 0.01
    assert abs(found.whole[-1] - 1.0) <= 5e-3
    assert worst(found.momentum) <= 1e-12
    if "stored_normal" in found.history.columns:
        stored = found.history["stored_normal"] / (1e-4 * found.scene.area)
        assert worst(found.whole + stored - 1.0) <= 5e-3


@pytest.mark.mpi
@pytest.mark.parametrize("scheme", [Newmark(), Midpoint()], ids=str)
def test_a_wave_passes_a_tie(scheme):
    """Bars that are tied and meet: they stay one, and vibrate."""
    found = meet(Tie, scheme, time=3.0)
    # At the end of a step of the midpoint rule massless nodes are where their last two
    # middles lead, not where their stresses are in balance
    assert worst(found.whole - 1.0) <= (5e-3 if scheme == Newmark() else 2e-2)
    assert worst(found.momentum) <= 1e-12
    # Compressed until the waves are back, then in tension
    early = (found.time > 0.6) & (found.time < 1.4)
    late = (found.time > 2.6) & (found.time < 2.9)
    assert abs(found.stress[early].mean() - 1.0) <= 0.02
    assert found.stress[late].mean() <= -0.8


def apart(energies=False):
    """Two bars on meshes of their own that meet; their history and steps."""
    one, other = (
        moving.bars(n=12, lower=False, width=0.2, gap=gap) for gap in (0.0, -1.0)
    )
    functions = [one.u, other.u]
    energy, forms = zip(*map(moving.elastic, (one, other)))
    mass = [ufl.inner(s.a, s.v) * ufl.dx for s in (one, other)]
    head = 10 + moving.HEAD
    tags = compat.meshtags(
        other.mesh, 1, other.facets.indices, other.facets.values + np.int32(10)
    )
    contact = Contact(functions, [one.facets, tags], [(moving.SLAVE, head)])
    problem = raymortar.NonlinearProblem(list(forms), contact, u=functions)
    inertia = dynamics.Inertia(mass, contact)
    down, up = (moving.moving(s, lambda z, v=v: v + 0.0 * z)
                for s, v in ((one, -0.01), (other, 0.01)))  # fmt: skip
    given = list(energy) if energies else None
    history = raymortar.History(problem, energy=given)
    steps = dynamics.TimeSteps(
        problem.snes_solver, inertia, end=2.5, dt=1.0 / 24, scheme=Newmark(),
        velocity=[down, up], history=history, energy=given,
    ).run()  # fmt: skip
    return history, steps


@pytest.mark.mpi
def test_energies_of_bodies_on_meshes_of_their_own():
    """As on one mesh, in each step; a list of functionals, one for each mesh."""
    history, steps = apart(energies=True)
    scene = moving.bars(n=12, width=0.2)
    energy, residual = moving.elastic(scene)
    contact = Contact(scene.u, scene.facets, [(moving.SLAVE, moving.MASTER)])
    problem = raymortar.NonlinearProblem(residual, contact)
    inertia = dynamics.Inertia(ufl.inner(scene.a, scene.v) * ufl.dx, contact)
    known = moving.run(
        scene, problem, inertia, end=2.5, dt=1.0 / 24, scheme=Newmark(), energy=energy,
        velocity=moving.by_bar(scene, 0.01),
    )  # fmt: skip
    whole = known.energy[0]
    for name in ("kinetic", "elastic", "contact_work", "external_work"):
        assert worst(history[name] - known.history[name]) <= 1e-9 * whole
    assert worst(history["energy"] - history["elastic"]) <= 1e-14 * whole
    assert history["elastic"].max() >= 0.5 * whole
    for step, other in zip(steps, known.done):
        assert step.energy.total == pytest.approx(other.energy.total, rel=1e-9)
    with pytest.raises(raymortar.ContactError, match="or a list of one for each mesh"):
        raymortar.History(problem, energy=[energy, 3])


@pytest.mark.mpi
def test_bodies_on_meshes_of_their_own_meet():
    history, _ = apart()
    stress = history["force_0_y"] / (0.2 * 0.01)
    pressed = (history["time"] > 0.6) & (history["time"] < 1.4)
    assert abs(stress[pressed].mean() - 1.0) <= 0.02
    assert worst(history["momentum_y"]) <= 1e-12
    # Each has the other's velocity
    assert abs(history["impulse_0_y"][-1] / (0.2 * 0.02) - 1.0) <= 0.03


@pytest.mark.mpi
def test_inertia_applies_to_accelerations_of_a_scheme_of_ones_own():
    scene = moving.bars(n=4)
    contact = Contact(scene.u, scene.facets, [(moving.SLAVE, moving.MASTER)])
    inertia = dynamics.Inertia(3.0 * ufl.inner(scene.a, scene.v) * ufl.dx, contact)
    a = fem.Function(scene.V)
    a.x.array[:] = 2.0
    volume = tools.integral(fem.Constant(scene.mesh, 1.0) * ufl.dx, scene.mesh)
    force = COMM.allreduce(inertia.apply(a).reshape(-1, 2).sum(axis=0))
    assert worst(force / (6.0 * volume) - 1.0) <= 1e-13
    with pytest.raises(raymortar.ContactError, match="a must be a Function"):
        inertia.apply(np.zeros(3))


@pytest.mark.parametrize(
    "method",
    [
        AugmentedLagrangian(),
        AugmentedLagrangian(condition="nodes"),
        AugmentedLagrangian(condition="nodes", multiplier="dual"),
        Penalty(),
    ],
    ids=["points", "nodes", "dual", "penalty"],
)
@pytest.mark.parametrize("scheme", [Newmark(), Midpoint()], ids=str)
def test_a_block_swings_on_its_elastic_slip(method, scheme):
    """A stiff block under pressure p on a plane: a mass rho h on a spring mu p / e for
    each area, which steps of these schemes turn by 2 atan(omega dt / 2)."""
    rho, h, p, mu, e, count = 2.0, 0.2, 3.0, 0.4, 0.05, 40
    scene = moving.bars(n=2, length=h, width=1.0, heads=4, lower=False)
    energy, residual = moving.elastic(scene, E=1e6)
    ds = ufl.Measure("ds", subdomain_data=scene.facets)
    residual += p * scene.v[1] * ds(moving.HEAD)
    floor = raymortar.rigid.Plane((0.0, 0.0), (0.0, 1.0))
    law = Coulomb(mu, elastic_slip=e)
    contact = Contact(scene.u, scene.facets, [(moving.SLAVE, floor)], method, law)
    problem = raymortar.NonlinearProblem(residual, contact)
    problem.solve()
    contact.advance()
    omega = np.sqrt(mu * p / (rho * h * e))
    start = fem.Function(scene.V)
    speed = 0.3 * e * omega
    start.interpolate(lambda x: np.array([speed + 0.0 * x[0], 0.0 * x[0]]))
    form = rho * ufl.inner(scene.a, scene.v) * ufl.dx
    dt = 2.0 * np.pi / omega / count
    found = moving.run(
        scene, problem, dynamics.Inertia(form, contact), energy=energy, end=count * dt,
        dt=dt, scheme=scheme, velocity=start,
    )  # fmt: skip
    turned = 2.0 * np.arctan(0.5 * omega * dt) * np.arange(1, count + 1)
    velocity = found.history["momentum_x"] / (rho * h)
    assert worst(velocity / speed - np.cos(turned)) <= 1e-3
    if scheme == Newmark():  # contact belongs to the ends of steps
        force = found.history["force_0_x"] / (mu * p * 0.3)
        assert worst(np.abs(force) - np.abs(np.sin(turned))) <= 1e-3
        whole = 0.5 * rho * h * velocity**2 + found.history["stored_tangential"]
        assert worst(whole / (0.5 * rho * h * speed**2) - 1.0) <= 1e-3

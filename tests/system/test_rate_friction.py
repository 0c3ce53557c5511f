"""Friction laws of pressure and slip rate, given as NumPy functions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
import states
from dolfinx import fem
from friction_states import FrictionCase, frictional_pairs, in_regime, set_both
from problems import COMM, worst
from sheared_blocks import HOLDING, METHODS, SHEAR, SLIP, Blocks, pressure
from slave_functions import bumps, function_of
from states import name_of
from tangents import FIRST_STEPS, is_first_order, is_second_order, quiet_slopes

import raymortar
from meshes.scenes import two_blocks
from raymortar import Contact, ContactError, Coulomb, Friction, LoadSteps
from raymortar.core import compat


def stribeck(mu, rate=0.05, fall=0.3):
    """From mu at rest to (1 - fall) mu; the share of the pressure falls with it."""

    def share(v):
        return mu * (1.0 - fall + fall * np.exp(-v / rate))

    def bound(p, v):
        return share(v) * p / (1.0 + 0.1 * p)

    def derivatives(p, v):
        by_share = p / (1.0 + 0.1 * p)
        by_v = -mu * fall / rate * np.exp(-v / rate)
        return share(v) / (1.0 + 0.1 * p) ** 2, by_v * by_share

    return Friction(bound, derivatives)


def placed(law):
    """A law times a share that differs from place to place."""

    def share(x):
        return 1.0 + 0.2 * np.sin(3.0 * x[0] + 2.0 * x[-1])

    def derivatives(p, v, x):
        return tuple(share(x) * slope for slope in law.derivatives(p, v))

    return Friction(lambda p, v, x: share(x) * law.bound(p, v), derivatives)


@dataclass(frozen=True)
class RateCase(FrictionCase):
    """Contact with such a law, an offset and a gamma that differ from point to point."""

    def contact(self, scene, friction, tangent="fixed", **options):
        if isinstance(friction, Coulomb):
            friction = placed(stribeck(0.8 * friction.mu))
        contact = super().contact(scene, friction, tangent, offset=bumps, **options)
        contact.set_gamma(
            function_of(
                scene.mesh,
                lambda x: states.GAMMA * (1.0 + 0.05 * np.cos(2.0 * x[0])),
                1,
            )
        )
        contact.dt = 0.5
        return contact


def cases():
    for cell in states.CELLS:
        for degrees, method, measure in (
            ((1, 1), "augmented", "reference"),
            ((2, 2), "augmented", "current"),
            ((1, 2), "elastic", "reference"),
            ((1, 1), "rate", "current"),
        ):
            case = RateCase(cell, *degrees, method, measure)
            quick = [pytest.mark.quick] if cell == "quadrilateral" else []
            yield pytest.param(case, id=name_of(case), marks=quick)


@pytest.mark.mpi(where=lambda case, **_: case.cell == "quadrilateral")
@pytest.mark.parametrize("case", list(cases()))
def test_tangent_with_pressure_and_slip_rate(case, record_property):
    scene = case.scene("overhang")

    def prepare(contact, seed):
        set_both(contact, scene, seed)
        return in_regime(contact, case.regime)

    # Multipliers are drawn by row, so states differ with the numbering of dofs: at the
    # widest step, the third order of some of them takes 0.055 off the slope
    full, fixed = quiet_slopes(
        frictional_pairs(case, scene), prepare, first_steps=FIRST_STEPS[1:]
    )
    record_property("slope", full.tolist())
    assert is_second_order(full), full
    assert is_first_order(fixed), fixed


@pytest.mark.mpi(where=lambda cell, **_: cell in ("triangle", "hexahedron"))
@pytest.mark.parametrize("method", HOLDING)
def test_sliding_block_has_the_traction_of_its_rate(cell, method, record_property):
    """Homogeneous shear, slides of several sizes and times."""
    law = stribeck(0.4, fall=0.15)
    blocks = Blocks(cell, METHODS[method](), law)
    blocks.press()
    p, slide, k = np.array([-pressure(blocks.dim)]), 0.0, 0.0
    # Slides beyond what the block could take in stick, under the bound at rest
    for step, dt in ((0.02, 1.0), (0.04, 0.2), (0.04, 2.0)):
        blocks.contact.dt = dt
        # The springs follow the change of the traction, and that their slip
        new = k
        for _ in range(60):
            slip = step + blocks.spring(new) - blocks.spring(k)
            new = float(law.bound(p, np.array([slip / dt]))[0] / SHEAR)
        slide, k = slide + step, new
        error = blocks.step(k, slide + blocks.spring(k))
        record_property("displacement", error)
        assert blocks.statuses() == {SLIP}
        assert abs(blocks.ratio() * p[0] / (SHEAR * k) - 1.0) <= 1e-8
        assert error <= 1e-8
        blocks.contact.advance()


@pytest.mark.mpi
def test_law_of_pressure_alone_is_coulombs():
    found = []
    for law in (
        Coulomb(0.5),
        Friction(lambda p, v: 0.5 * p, lambda p, v: (0.5 + 0.0 * p, 0.0 * v)),
    ):
        blocks = Blocks("quadrilateral", METHODS["augmented"](), law)
        blocks.press()
        blocks.step(0.5 * -pressure(2) / SHEAR, 0.02)
        found.append(blocks.problem.u.x.array.copy())
    np.testing.assert_allclose(*found, atol=1e-12)


@pytest.mark.mpi
def test_load_steps_set_the_time():
    blocks = Blocks("quadrilateral", METHODS["augmented"](), stribeck(0.4))
    blocks.press()
    times = []

    def apply(t):
        times.append(blocks.contact.dt)
        if len(times) == 3:
            blocks.contact.dt = 7.0
        blocks.drive(0.0)

    solver = raymortar.SNESSolver(blocks.problem.problem)
    LoadSteps(solver, apply, steps=4, path=(0.0, 2.0), progress=False).run()
    assert times == [0.5] * 4  # what `apply` sets is that of one step
    assert blocks.contact.dt == 0.5


# Input errors


@pytest.fixture(scope="module")
def small():
    return two_blocks(COMM, 2, "triangle")


def make(small, law):
    u = fem.Function(compat.vector_space(small.mesh, 1))
    pair = (small.tags["slave"], small.tags["master"])
    contact = Contact(
        u, small.facet_tags, [pair], raymortar.Penalty(10.0), law, offset=-0.1
    )
    contact.update()
    return contact


def flat(p, v):
    return 0.0 * p, 0.0 * v


@pytest.mark.mpi
@pytest.mark.parametrize(
    "law, pattern",
    [
        (lambda: Friction(0.3, flat), "Friction.bound must be a callable"),
        (lambda: Friction(np.maximum, 0.3), "Friction.derivatives must be a callable"),
        (lambda: Friction(lambda p, v: 0.3, flat), "Friction.bound returns values"),
        (
            lambda: Friction(np.maximum, lambda p, v: (p, 1.0)),
            "Friction.derivatives returns values",
        ),
        (
            lambda: Friction(np.maximum, lambda p, v: (p,)),
            "Friction.derivatives must return",
        ),
        (lambda: Friction(lambda p, v: -p, flat), "a bound that is negative"),
        (lambda: Friction(lambda p, v: p * np.nan, flat), "not finite"),
    ],
)
def test_impossible_laws_are_refused(small, law, pattern):
    with pytest.raises(ContactError, match=pattern):
        make(small, law())


@pytest.mark.mpi
@pytest.mark.parametrize("dt", [0.0, -1.0, np.nan, "1", True])
def test_impossible_times_are_refused(small, dt):
    contact = make(small, Friction(np.maximum, flat))
    with pytest.raises(ContactError, match="dt = .* must be a positive number"):
        contact.dt = dt
    assert contact.dt == 1.0


@pytest.mark.mpi
def test_bound_is_that_of_closed_points(small):
    contact = make(small, Friction(lambda p, v: 0.25 * p, lambda p, v: (p, v)))
    u = contact.u.x.array.reshape(-1, 2)
    contact.advance()
    u[states.upper_dofs(small, contact.u.function_space), 0] += 0.2
    contact.update()
    points = contact.points()
    closed = points["status"] == SLIP
    t = np.linalg.norm(points["traction"][closed], axis=1)
    p = points["pressure"][closed]
    assert COMM.allreduce(int(closed.sum())) > 0
    assert worst(p - 1.0) <= 1e-12
    assert worst(t - np.hypot(1.0, 0.25)) <= 1e-12

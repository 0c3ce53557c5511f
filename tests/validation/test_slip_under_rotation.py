"""Slip and rotation in one step (O3): a rigid slider on a disc that turns.

Everything is prescribed. The slip is that of the disc's own frame, turned with the
bodies: a step that slips by s does the work of s whatever the turn.
"""

from __future__ import annotations

import gathered
import numpy as np
import pytest
import states
from friction_states import METHODS, NONE, SLIP, FrictionCase, tangential
from problems import worst
from rotations import turn

from raymortar import Coulomb, Stick

CENTRE = 0.3  # of the disc, in every coordinate
DEPTH, SLIDE, MU = 0.01, 0.05, 0.3
ANGLES = [5.0, 30.0, 90.0, 170.0]


class Slider:
    """The upper block on the lower one, pressed in and accepted."""

    def __init__(self, case, friction, depth=DEPTH):
        self.depth = depth
        self.case, self.scene = case, case.scene("single", flat=True)
        self.contact = case.contact(self.scene, friction)
        self.X = states.dof_positions(self.contact.u.function_space)
        self.along = np.array([0.8, 0.6, 0.0] if case.dim == 3 else [1.0, 0.0])
        self.move(np.eye(case.dim), 0.0)
        self.contact.advance()

    def move(self, Q, slide):
        """Turn both about the disc's centre, the slider ahead, and pair."""
        x = self.X.copy()
        upper = states.upper_dofs(self.scene, self.contact.u.function_space)
        x[upper] += slide * self.along
        x[upper, -1] -= self.depth
        x = (x - CENTRE) @ Q.T + CENTRE
        self.contact.u.x.array[:] = (x - self.X).ravel()
        self.contact.update()

    def set_traction(self, t):
        """Of the multiplier, where there is one."""
        if self.contact.multiplier is not None:
            lam = self.contact.multiplier.x.array
            lam[:] = np.tile(t, lam.size // self.case.dim)
            self.contact.update()

    def rotation(self, angle):
        return turn(self.case.dim, np.deg2rad(angle), np.random.default_rng(11))


@pytest.mark.mpi(where=lambda angle, **_: angle == 90.0)
@pytest.mark.quick
@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("method", METHODS)
def test_slip_and_its_work_are_those_of_the_slide(cell, method, angle):
    slider = Slider(FrictionCase(cell, 1, 1, method), Coulomb(MU))
    contact, Q = slider.contact, slider.rotation(angle)
    pressure = -states.GAMMA * DEPTH
    normal, along = Q @ -np.eye(slider.case.dim)[-1], Q @ slider.along
    traction = pressure * normal + MU * pressure * along
    slider.set_traction(traction)
    slider.move(Q, SLIDE)
    p = gathered.points(contact)
    assert set(p["status"]) <= {NONE, SLIP}
    assert worst(tangential(p, p["slip"]) - SLIDE * along) <= 1e-12 * SLIDE
    assert worst(p["traction"] - traction) <= 1e-12 * abs(pressure)
    # Springs start without a traction, and keep a part of the slip
    kept = MU * DEPTH if method == "elastic" else 0.0
    work = -MU * pressure * (SLIDE - kept) * p["weight"].sum()
    assert contact.friction_work() == pytest.approx(work, rel=1e-12)


@pytest.mark.mpi(where=lambda angle, **_: angle == 90.0)
@pytest.mark.parametrize("angle", ANGLES)
def test_condition_holds_with_the_slip_turned(cell, angle):
    """Blocks just touch. The multiplier opposes the slip of the present surface."""
    slider = Slider(FrictionCase(cell, 1, 1, "augmented"), Coulomb(MU), depth=0.0)
    contact, Q = slider.contact, slider.rotation(angle)
    slider.move(Q, SLIDE)
    along, n_u = Q @ slider.along, gathered.size_u(contact)
    slider.set_traction(Q[:, -1] - MU * along)
    assert worst(states.assembled(contact)[n_u:]) <= 1e-13
    slider.set_traction(Q[:, -1] + MU * along)
    assert worst(states.assembled(contact)[n_u:]) >= 1e-3


@pytest.mark.mpi(where=lambda angle, **_: angle == 90.0)
@pytest.mark.parametrize("angle", ANGLES)
def test_springs_hold_the_slide_through_the_turn(cell, angle):
    """Springs are stretched by the slide on the turned surface, step after step."""
    slider = Slider(FrictionCase(cell, 2, 2, "elastic"), Stick())
    contact, Q = slider.contact, np.eye(slider.case.dim)
    for step in (1, 2, 3):
        Q = slider.rotation(angle) @ Q
        slider.move(Q, step * SLIDE)
        p = gathered.points(contact)
        hit = p["status"] != NONE
        expected = -states.GAMMA * step * SLIDE * (Q @ slider.along)
        error = worst((tangential(p, p["traction"]) - expected)[hit])
        assert error <= 1e-11 * states.GAMMA * SLIDE
        contact.advance()

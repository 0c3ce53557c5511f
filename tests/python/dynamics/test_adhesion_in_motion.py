"""Bars that adhere while they move: their energies, and what tears them apart."""

from __future__ import annotations

import moving
import numpy as np
import pytest
import ufl
from problems import worst

import raymortar
from raymortar import Cohesive, dynamics
from raymortar.dynamics import GeneralizedAlpha, Midpoint, Newmark

pytestmark = pytest.mark.mpi

SCHEMES = [Newmark(), Midpoint(), GeneralizedAlpha(0.8)]
SPEED, TOUGHNESS = 0.01, 1.2e-5
# Tractions of the waves are 0.01
TEARS, HOLDS = 0.006, 0.05


def leaving(scheme, strength, steps=1.0, unit=1.0, n=8):
    """Two bars that move away from each other, whose ends adhere; their energies over
    the first one."""
    scene = moving.bars(n=n)
    energy, residual = moving.elastic(scene, unit)
    contact = raymortar.Contact(
        scene.u, scene.facets, [(moving.SLAVE, moving.MASTER)],
        adhesion=Cohesive(unit * strength, unit * TOUGHNESS),
    )  # fmt: skip
    problem = raymortar.NonlinearProblem(residual, contact)
    mass = unit * ufl.inner(scene.a, scene.v) * ufl.dx
    found = moving.run(
        scene, problem, dynamics.Inertia(mass, contact), energy=energy, scheme=scheme,
        end=1.8, dt=1.0 / (steps * n), velocity=moving.by_bar(scene, -SPEED),
    )  # fmt: skip
    assert worst(found.momentum) <= 1e-12 * unit
    first, history = unit * SPEED**2 * scene.area, found.history
    assert found.done[-1].energy.adhesion == history["adhesion"][-1]
    names = (
        *("kinetic", "elastic", "adhesion", "contact_work", "external_work"),
        *("adhesion_work", "stored_adhesion"),
    )
    return {name: history[name] / first for name in names}


def balance(found):
    """Energy of bodies and bonds less what works on them, over the first one, less 1."""
    gained = found["kinetic"] + found["elastic"] + found["adhesion"]
    return gained - found["contact_work"] - found["external_work"] - 1.0


@pytest.mark.parametrize("unit", [1.0, 2e11])
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_torn_bonds_take_the_toughness_from_the_motion(scheme, unit):
    found = leaving(scheme, TEARS, unit=unit)
    taken = TOUGHNESS / SPEED**2
    for name in ("adhesion_work", "adhesion"):
        np.testing.assert_allclose(found[name][-1], taken, 1e-9)
    assert found["stored_adhesion"].max() > 0.0 == found["stored_adhesion"][-1]
    assert np.all(np.diff(found["adhesion_work"]) >= 0.0)


@pytest.mark.parametrize("scheme", [Newmark(), Midpoint()], ids=str)
def test_nothing_else_works_on_bars_that_are_torn_apart(scheme):
    """Newmark's energies balance in every step; an error of the steps, by the change of
    stiffness in one, is of second order."""
    errors = []
    for steps in (1.0, 2.0, 4.0):
        found = leaving(scheme, TEARS, steps)
        if scheme == Newmark():
            assert worst(balance(found)) <= 1e-9
        errors.append(max(worst(balance(found)), worst(found["external_work"])))
        assert worst(found["contact_work"]) <= 1e-12
    assert errors[0] <= 0.05
    assert errors[1] <= errors[0] / 3.0 and errors[2] <= errors[1] / 3.0, errors


@pytest.mark.parametrize("scheme", [Newmark(), Midpoint()], ids=str)
def test_bonds_that_hold_give_all_energy_back(scheme):
    """Bars and bonds are linear: nothing outside works on them, to rounding."""
    found = leaving(scheme, HOLDS)
    assert worst(balance(found)) <= 1e-9
    assert worst(found["external_work"]) <= 1e-9
    assert 1e-5 < found["adhesion"].max()
    np.testing.assert_allclose(found["adhesion_work"], 0.0, atol=1e-15)

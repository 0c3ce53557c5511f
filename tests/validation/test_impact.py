"""Impacts of bars against closed forms, in each scheme and with each mass.

Ripple is the standard deviation of the contact stress over its closed form, from a
quarter to three quarters of the time in contact.
"""

import moving
import numpy as np
import pytest
from problems import worst

from raymortar.dynamics import GeneralizedAlpha, Midpoint, Newmark

SCHEMES = [Newmark(), Midpoint(), GeneralizedAlpha(0.8), GeneralizedAlpha(0.0)]
KEEPING = SCHEMES[:2]
RIPPLE = {"nearest": 0.01, "affine": 0.065}


def in_contact(found):
    """Stress in the middle half of the time in contact, 0 to 2."""
    return found.stress[(found.time >= 0.5) & (found.time <= 1.5)]


@pytest.mark.parametrize("cfl", [1.0, 0.25, 0.0625])
@pytest.mark.parametrize("mass", ["nearest", "affine"])
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_two_bars_exchange_their_velocities(scheme, mass, cfl):
    found = moving.two_bars(scheme, mass, cfl, time=2.5)
    stress = in_contact(found)
    assert abs(stress.mean() - 1.0) <= 0.01
    assert stress.std() <= RIPPLE[mass]
    assert worst(found.momentum) <= 1e-12
    if scheme in KEEPING:
        assert abs(found.energy[-1] - 1.0) <= 1e-3
    # What the schemes damp is theirs: nothing grows
    assert found.energy.max() <= 1.0 + 1e-3
    assert abs(found.impulse[-1] - 1.0) <= (0.025 if cfl == 1.0 else 0.01)


def test_consistent_mass_multiplies_the_energy():
    found = moving.two_bars(Newmark(), "consistent", 1.0, time=2.5)
    assert found.energy[-1] >= 3.0


@pytest.mark.parametrize("cell", ["triangle", "tetrahedron", "hexahedron"])
def test_bars_of_other_cells_exchange_their_velocities(cell):
    found = moving.two_bars(
        Newmark(), "nearest", 1.0, time=2.5, n=20, cell=cell, heads=1
    )
    assert abs(in_contact(found).mean() - 1.0) <= 0.01
    assert abs(found.energy[-1] - 1.0) <= 5e-3
    assert worst(found.momentum) <= 1e-12


def test_bars_of_degree_2_exchange_their_velocities():
    found = moving.two_bars(Newmark(), "nearest", 0.5, time=2.5, n=20, degree=2)
    assert abs(in_contact(found).mean() - 1.0) <= 0.01
    assert abs(found.energy[-1] - 1.0) <= 5e-3


def test_steel_bars_in_si_units():
    # E, rho, speed 10: stress 4.060172e8 for 3.866831e-4
    E, rho, v = 2.1e11, 7850.0, 10.0
    found = moving.two_bars(Newmark(), "nearest", 1.0, E, rho, v, time=2.5)
    c = np.sqrt(E / rho)
    force = found.force[(found.time >= 0.5) & (found.time <= 1.5)]
    assert abs(c - 5172.194) <= 1e-3
    assert abs(force.mean() / found.scene.area / 4.060172e8 - 1.0) <= 0.01
    loaded = found.time[found.stress > 0.5]
    step = found.time[1] - found.time[0]
    assert abs((loaded[-1] - loaded[0] + step) / c / 3.866831e-4 - 1.0) <= 0.02


@pytest.mark.parametrize("mass", ["nearest", "affine"])
@pytest.mark.parametrize("scheme", SCHEMES[:3], ids=str)
def test_a_bar_dropped_on_a_plane(scheme, mass):
    # Doyen, Ern and Piperno 2011: pressure 300 for 2/3, impulse 200, energy 500
    found = moving.dropped(scheme, mass)
    area = found.scene.area
    pressed = (found.time >= 0.65) & (found.time <= 1.0)
    assert abs(found.force[pressed].mean() / area / 300.0 - 1.0) <= 0.01
    assert abs(found.impulse[-1] / area / 200.0 - 1.0) <= 0.02
    assert abs(found.momentum[-1] / area / 100.0 - 1.0) <= 0.03
    assert abs(found.energy[-1] / area / 500.0 - 1.0) <= 2e-3
    assert found.energy.max() / area <= 500.0 * (1.0 + 1e-3)


def test_a_compressed_rod_on_a_wall_has_period_3():
    # E = rho = L = 1, u(0, x) = (1 - x) / 2, far end held: pressure 1/2 from 1 to 2
    found = moving.held_rod(Newmark(), "nearest", n=50, cfl=0.25, end=6.0)
    stress = found.force / found.scene.area
    first = (found.time > 1.25) & (found.time < 1.75)
    again = (found.time > 4.25) & (found.time < 4.75)
    apart = (found.time > 2.25) & (found.time < 3.75)
    assert abs(stress[first].mean() - 0.5) <= 0.005
    assert abs(stress[again].mean() - 0.5) <= 0.01
    assert worst(stress[apart]) <= 0.02
    energy = found.energy / found.scene.area
    # The end's stress is not in balance at first: its node without mass comes to rest at
    # once, and the energy of one element of 50 goes
    assert abs(energy[0] / 0.125 - 1.0 + 1.0 / 50.0) <= 2e-3
    assert np.ptp(energy) <= 1e-3 * 0.125


@pytest.mark.parametrize("scheme", KEEPING, ids=str)
def test_a_rod_that_starts_in_balance_loses_nothing(scheme):
    """Without stress in its last cell, whose node has no mass."""
    n, cfl = 20, 0.5
    found = moving.held_rod(scheme, "nearest", n=n, cfl=cfl, balanced=True)
    change = found.energy / (0.125 * (1.0 - 1.0 / n) * found.scene.area) - 1.0
    assert abs(change[0]) <= 1e-12
    # One touch and one parting, each up to a quarter of c dt / h squared times h / L
    assert worst(change) <= 0.5 * cfl**2 / n
    stress = found.force[(found.time > 1.25) & (found.time < 1.75)] / found.scene.area
    assert abs(stress.mean() - 0.5) <= 0.01

"""Round bodies of straight facets with smooth=True, against closed forms (R8)."""

import sys
import warnings
from pathlib import Path

import numpy as np
import press_fits
import pytest
import states
from friction_states import FrictionCase, check_regime, frictional_pairs, set_both
from problems import COMM, SOLVERS
from states import Case
from tangents import Pair, is_second_order, quiet_slopes

from raymortar import ContactWarning

pytest.importorskip("matplotlib")
sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from models import hertz_cylinder  # noqa: E402

E, NU, INTERFERENCE = 2.1e5, 0.3, 0.05


def pressure_error(around, degree=1, scale=1.0, cell="quadrilateral", **options):
    """Relative error of the press fit's pressure, root mean square."""
    scene = press_fits.scene_of(around, around + around // 4, cell, geometry_degree=1)
    case = press_fits.press_fit(scene, scale * E, NU, INTERFERENCE, degree, **options)
    with warnings.catch_warnings():
        # Of straight facets
        warnings.simplefilter("ignore", ContactWarning)
        case.solve(SOLVERS[-1])
    moduli = scale * E / (1.0 - NU**2), NU / (1.0 - NU)
    exact = press_fits.pressure(INTERFERENCE, *np.repeat(moduli, 2))
    return press_fits.rms_error(case.contact, exact)


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("around", (8, 16, 32))
def test_press_fit_of_degree_1(around, record_property):
    """On a straight volume; straight contact surfaces err by 80 to 177 %."""
    error = pressure_error(around, smooth=True)
    record_property("error", error)
    assert error < 0.01


def test_press_fit_of_straight_facets():
    """What is wrong without: the closed form is that of round bodies."""
    assert pressure_error(8) > 1.0


def test_press_fit_in_other_units_and_by_a_function():
    def onto_the_seat(x):
        return np.vstack([x[:2] * press_fits.SHAFT / np.hypot(*x[:2]), x[2]])

    assert pressure_error(8, scale=1e6, smooth=True) < 0.01
    assert pressure_error(8, smooth=onto_the_seat) < 0.01


def test_press_fit_of_degree_2():
    """Straight cells behind the surface leave an error of first order."""
    errors = [pressure_error(n, 2, smooth=True) for n in (8, 16, 32)]
    assert errors[0] < 0.04 and errors[1] < 0.5 * errors[0] and errors[2] < 0.01
    assert pressure_error(8, 2) > 4.0


@pytest.mark.mpi(where=lambda degree: degree == 1)
@pytest.mark.parametrize("degree", (1, 2))
def test_hertz_with_8_facets_across(degree, monkeypatch):
    """On straight facets the peak of degree 2 is 90 % off."""
    build = hertz_cylinder.cylinder_on_block
    monkeypatch.setattr(
        hertz_cylinder,
        "cylinder_on_block",
        lambda *args, **options: build(*args, **{**options, "geometry_degree": 1}),
    )
    case = hertz_cylinder.SMALL
    result = hertz_cylinder.solve(
        COMM, case, 8, degree, master_ratio=hertz_cylinder.MASTER_RATIO, smooth=True
    )
    found = hertz_cylinder.measure(result, case)
    assert found.peak == pytest.approx(found.p0, rel=0.02)


def test_nodal_pressures_of_the_first_demo():
    """Within 2 % of the peak but for the facets at the edge of contact."""
    case = hertz_cylinder.SMALL
    result = hertz_cylinder.solve(
        COMM, case, master_ratio=hertz_cylinder.MASTER_RATIO, smooth=True
    )
    found = hertz_cylinder.measure(result, case)
    nodes = result.contact.zones[0].multiplier_nodes
    V = result.contact.multiplier.function_space
    x = V.tabulate_dof_coordinates()[nodes, 0]
    p = -result.contact.multiplier.x.array[nodes]
    hertz = found.p0 * np.sqrt(np.maximum(1.0 - (x / found.a) ** 2, 0.0))
    assert np.abs(p - hertz).max() < 0.02 * found.p0


@pytest.mark.mpi(where=lambda cell, method: method == "normal")
@pytest.mark.parametrize("method", ("normal", "penalty"))
def test_the_tangent_is_the_derivative(cell, method):
    """Arcs on both sides, moving segments, a free edge of the master."""
    case = Case(cell, 1, 1, method, "current")
    scene = case.scene("overhang")
    degree = 2 if case.dim == 3 else None

    def make(seed):
        return Pair(
            *(
                states.make_contact(
                    scene, case, quadrature_degree=degree, tangent=t, smooth=True
                )
                for t in ("fixed", "full")
            )
        )

    def prepare(contact, seed):
        states.set_state(contact, scene, "active", seed)
        return states.in_regime(contact, "active")

    full, _ = quiet_slopes(make, prepare)
    assert is_second_order(full), full


@pytest.mark.parametrize("regime", ("slip", "stick"))
def test_the_tangent_with_friction(cell, regime):
    case = FrictionCase(cell, 1, 1, "augmented", "reference", "coulomb", regime)
    scene = case.scene("overhang")

    def prepare(contact, seed):
        set_both(contact, scene, seed)
        check_regime(contact, regime)
        return True

    full, _ = quiet_slopes(frictional_pairs(case, scene, smooth=True), prepare)
    assert is_second_order(full), full

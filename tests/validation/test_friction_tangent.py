"""Friction at random states: tangent (T1), slip under rotations (F1), balances."""

from __future__ import annotations

import itertools

import gathered
import numpy as np
import pytest
import states
from balances import moments, nodal_forces, nodal_positions
from friction_states import (
    METHODS,
    NONE,
    SLIP,
    STICK,
    FrictionCase,
    check_regime,
    law_for,
    set_both,
    set_history,
    tangential,
)
from rotations import turn
from tangents import COLUMN_TOLERANCE, DECADES, check_columns, slopes, taylor_remainders

from raymortar import Coulomb, Stick, Tresca

# Of displacement, of geometry
DEGREES = {
    "triangle": (1, 2),
    "quadrilateral": (2, 2),
    "tetrahedron": (1, 1),
    "hexahedron": (1, 1),
}
# Below the last of them rounding shows within four decades
FIRST_STEPS = (10.0**-2.5, 1e-3)


# Of each method the regime that is also run on several ranks
ON_RANKS = {"augmented": "mixed", "elastic": "slip", "rate": "stick"}


def sampled(case, **_):
    """Whether a case is one of a few for several ranks."""
    return (
        case.cell in ("triangle", "hexahedron")
        and (case.law, case.measure) == ("coulomb", "current")
        and case.regime == ON_RANKS[case.method]
    )


def cases(degrees=None):
    laws = [("coulomb", "stick"), ("coulomb", "slip"), ("coulomb", "mixed")]
    laws += [("tresca", "stick"), ("tresca", "slip"), ("tresca", "mixed")]
    laws += [("stick", "stick")]
    for cell, method, measure, (law, regime) in itertools.product(
        states.CELLS, METHODS, states.MEASURES, laws
    ):
        case = FrictionCase(
            cell, *(degrees or DEGREES[cell]), method, measure, law, regime
        )
        quick = law == "coulomb" and measure == "current" and regime != "stick"
        yield pytest.param(
            case,
            id=f"{cell}-{method}-{measure}-{law}-{regime}",
            marks=[pytest.mark.quick] if quick else [],
        )


def quiet_contact(case, scene, **options):
    """Contact, tangent and Taylor remainders where no point changes branch."""
    for seed in range(300):
        friction = law_for(case, scene, seed, **options)
        if friction is None:
            continue
        contact = case.contact(scene, friction, **options)
        set_both(contact, scene, seed)
        form = states.mass_form(contact.u.function_space)
        K = states.tangent(contact, form)
        check_regime(contact, case.regime)
        U, R = states.unknowns(contact), states.assembled(contact)
        direction = np.random.default_rng(seed).normal(size=U.size)
        for first in FIRST_STEPS:
            steps = first * 10.0 ** -np.arange(0.0, DECADES + 0.1, 0.5)
            states.residual_at(contact, U)
            remainders = taylor_remainders(contact, K, U, R, direction, steps)
            states.residual_at(contact, U)
            if remainders is not None:
                return contact, form, steps, remainders
    raise AssertionError("no random state without a kink nearby")


@pytest.mark.mpi(where=sampled)
@pytest.mark.parametrize("case", list(cases()))
def test_taylor_remainder_is_quadratic(case, record_property):
    scene = case.scene("single")
    contact, _, steps, remainders = quiet_contact(case, scene)
    found = slopes(steps, remainders)
    record_property("slope", found.tolist())
    assert np.all(np.abs(found - 2.0) <= 0.05), found
    if case.dim == 3 and case.method == "augmented" and case.regime == "slip":
        p = gathered.points(contact)
        w, t = (tangential(p, p[k]) for k in ("slip", "traction"))
        cosine = np.einsum("qi,qi->q", w, t)
        cosine /= np.linalg.norm(w, axis=1) * np.linalg.norm(t, axis=1)
        assert np.median(np.abs(cosine)) < 0.99  # traction and slip not parallel


@pytest.mark.mpi(
    where=lambda cell, tangent, **_: cell == "triangle" or tangent == "full"
)
@pytest.mark.parametrize("tangent", ("fixed", "full"))
@pytest.mark.parametrize("offset", (0.0, -0.02))
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("cell", DEGREES)
def test_remainder_in_the_frame_of_the_master(cell, method, offset, tangent):
    """With the couple over an offset, and without."""
    case = FrictionCase(cell, *DEGREES[cell], method, "current")
    scene = case.scene("single")
    options = dict(frame="master", offset=offset, tangent=tangent)
    *_, steps, remainders = quiet_contact(case, scene, **options)
    found = slopes(steps, remainders)
    assert np.all(np.abs(found - 2.0) <= 0.05), found


@pytest.mark.mpi(where=lambda case, **_: sampled(case) and case.dim == 2)
@pytest.mark.parametrize("case", list(cases()))
def test_columns_are_central_differences(case, record_property):
    contact, form, _, _ = quiet_contact(case, case.scene("single"))
    worst = check_columns(contact, form)
    record_property("column_error", worst)
    assert worst <= COLUMN_TOLERANCE


# Rigid rotations (F1)


def rotate(contact, Q, shift=0.0):
    """Turn both bodies by Q, and the multiplier with them."""
    u = contact.u.x.array.reshape(-1, len(Q))
    X = states.dof_positions(contact.u.function_space)
    u[:] = (X + u) @ Q.T + shift - X
    if contact.multiplier is not None:
        lam = contact.multiplier.x.array.reshape(-1, len(Q))
        lam[:] = lam @ Q.T


@pytest.mark.mpi(where=lambda angle, gap, **_: angle > 90.0 and gap < 0.0)
@pytest.mark.parametrize("gap", [0.1, -0.01])
@pytest.mark.parametrize("angle", [30.0, 120.0])
@pytest.mark.parametrize("method", METHODS)
def test_rigid_rotation_is_no_slip(cell, method, angle, gap, record_property):
    case = FrictionCase(cell, 2, 2, method, law="stick")
    scene, rng = case.scene("overhang"), np.random.default_rng(int(angle))
    contact = case.contact(scene, Stick())
    V = contact.u.function_space
    u = states.smooth_field(rng, states.dof_positions(V), 0.05)
    u[states.upper_dofs(scene, V), -1] += gap
    contact.u.x.array[:] = u.ravel()
    states.set_multiplier(contact, rng)
    contact.update()
    before = gathered.points(contact)
    hit = before["status"] != NONE
    assert np.abs(before["gap"][hit] - gap).max() < 0.5 * abs(gap)
    contact.advance()
    Q = turn(case.dim, np.deg2rad(angle), rng)
    rotate(contact, Q, shift=0.3)
    contact.update()
    p = gathered.points(contact)
    np.testing.assert_array_equal(p["status"], before["status"])
    slip = np.abs(p["slip"][hit]).max()
    record_property("slip", slip)
    assert slip <= 1e-13 * 2.0  # times the size of the blocks
    # What the correction g (n - n_0) is for
    drift = abs(gap) * np.linalg.norm(before["normal"] @ Q.T - before["normal"])
    assert drift > 1e-3


@pytest.mark.mpi
@pytest.mark.parametrize("measure", states.MEASURES)
def test_spring_traction_turns_with_the_surface(cell, measure, record_property):
    """Tilting and drilling: 120 degrees about a random axis, in one step."""
    case = FrictionCase(cell, 2, 2, "elastic", measure)
    scene, rng = case.scene("overhang"), np.random.default_rng(5)
    contact = case.contact(scene, Tresca(0.5))
    set_history(contact, scene, 3)
    states.set_state(contact, scene, "active", 3)
    contact.update()
    assert {STICK, SLIP} <= set(gathered.points(contact)["status"]) | {STICK}
    contact.advance()
    contact.update()
    before = gathered.points(contact)
    Q = turn(case.dim, np.deg2rad(120.0), rng)
    rotate(contact, Q)
    contact.update()
    after = gathered.points(contact)
    error = np.abs(after["traction"] - before["traction"] @ Q.T).max()
    record_property("spring", error)
    assert np.abs(tangential(before, before["traction"])).max() > 0.1
    assert error <= 1e-12


# Balances (F2, F3)


@pytest.mark.mpi(where=lambda law, **_: isinstance(law, Coulomb))
@pytest.mark.parametrize("law", [Coulomb(0.3), Tresca(0.2), Stick()])
@pytest.mark.parametrize("method", METHODS)
def test_forces_and_moments_are_in_balance(cell, method, law, record_property):
    case = FrictionCase(cell, 2, 2, method, "current")
    scene = case.scene("overhang")
    for seed, regime in enumerate(["active", "mixed"]):
        contact = case.contact(scene, law, offset=-0.05 * seed)
        set_history(contact, scene, seed)
        states.set_state(contact, scene, regime, seed, noise=0.01)
        x, r = nodal_positions(contact), nodal_forces(contact)
        force_error = np.abs(r.sum(axis=0)).max() / np.abs(r).sum()
        p = gathered.points(contact)
        # Gaps that a multiplier closes in the mean have no couple in the residual
        hit = (p["status"] != NONE) & (contact.multiplier is not None)
        arm = (p["gap"] == p["distance"])[:, None] * p["gap"][:, None] * p["normal"]
        couple = p["weight"][:, None] * moments(arm, p["traction"])
        defect = moments(x, r).sum(axis=0) - couple[hit].sum(axis=0)
        moment_error = np.abs(defect).max() / np.abs(moments(x, r)).sum()
        record_property("balance", max(force_error, moment_error))
        assert max(force_error, moment_error) <= 1e-12

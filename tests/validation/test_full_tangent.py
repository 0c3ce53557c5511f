"""tangent="full" is the derivative of the residual that is paired anew (T1).

Perturbations move the segments: every residual is of points made at its own state.
"""

from __future__ import annotations

import gathered
import numpy as np
import pytest
import states
from friction_states import FrictionCase, check_regime, frictional_pairs, set_both
from problems import fix
from states import Case, name_of
from tangents import (
    all_hit_their_own,
    contact_pairs,
    is_first_order,
    is_second_order,
    quiet_slopes,
)

# Kinds of motion of a vertex that the flat patches have in place of the facets
FLAT = 3


def has_flat_vertices(contact):
    """Whether a vertex has kept its flat place, as its true break was not found."""
    motion = contact.zones[0].cpp.segments()["motion"]
    return not gathered.everywhere(np.all(motion < FLAT))


def cases():
    for cell in states.CELLS:
        for degrees, method, measure in (
            ((1, 1), "normal", "reference"),
            ((1, 1), "penalty", "current"),
            ((2, 1), "vector", "reference"),
            ((1, 2), "normal", "current"),
            ((2, 2), "vector", "current"),
            ((2, 2), "penalty", "reference"),
        ):
            case = Case(cell, *degrees, method, measure)
            quick = [pytest.mark.quick] if measure == "current" else []
            yield pytest.param(case, id=name_of(case), marks=quick)


@pytest.mark.mpi(
    where=lambda case, **_: case.cell == "triangle" and case.measure == "current"
)
@pytest.mark.parametrize("case", list(cases()))
def test_repaired_residual_has_the_full_tangent(case, record_property):
    """The slave overhangs a free edge of the master, where the integrand jumps."""
    scene = case.scene("overhang")
    degree = 2 if case.dim == 3 else None

    make = contact_pairs(scene, case, quadrature_degree=degree)

    def prepare(contact, seed):
        states.set_state(contact, scene, "active", seed)
        return states.in_regime(contact, "active")

    full, fixed = quiet_slopes(make, prepare)
    record_property("slope", full.tolist())
    assert is_second_order(full), full
    assert is_first_order(fixed), fixed


# Facets with mid nodes out of place have vertices without a true break, and points
# between a chord and the true edge, which hit another master than their segment's
BENT = {
    "other": (0.03, lambda contact: not all_hit_their_own(contact)),
    "flat": (0.08, has_flat_vertices),
}


def bent_cases():
    for degrees, method, measure in (
        ((1, 2), "normal", "reference"),
        ((2, 1), "vector", "current"),
        ((2, 2), "vector", "reference"),
        ((2, 2), "penalty", "current"),
    ):
        case = Case("tetrahedron", *degrees, method, measure)
        for kind in BENT:
            # With displacements of degree 1 mid nodes follow the corners: of all states
            # in SEEDS none has a vertex at its flat place
            if kind == "flat" and degrees == (1, 2):
                continue
            yield pytest.param(case, kind, id=f"{name_of(case)}-{kind}")
    case = Case("hexahedron", 2, 2, "vector", "current")
    yield pytest.param(case, "flat", id=f"{name_of(case)}-flat")


@pytest.mark.mpi(where=lambda case, **_: case.method == "penalty")
@pytest.mark.parametrize("case, kind", list(bent_cases()))
def test_full_tangent_where_edges_bend(case, kind):
    scene = case.scene("many")
    size, wanted = BENT[kind]
    noise = size * 0.6  # of a slave facet

    make = contact_pairs(scene, case, quadrature_degree=2)

    def prepare(contact, seed):
        states.set_state(contact, scene, "active", seed, noise=noise)
        return states.in_regime(contact, "active")

    # Covered throughout: what the fixed tangent leaves out may be too small to see
    full, _ = quiet_slopes(make, prepare, wanted)
    assert is_second_order(full), full


@pytest.mark.mpi
def test_lifting_where_points_hit_another_master():
    case = Case("tetrahedron", 2, 2, "vector", "current")
    scene = case.scene("many")
    contact = states.make_contact(scene, case, quadrature_degree=2, tangent="full")
    states.set_state(contact, scene, "active", 3, noise=0.02)
    assert not all_hit_their_own(contact)
    V = contact.u.function_space
    # One component: rows of the master stay free, next to columns that do not
    bcs = [fix(V, scene, "master", component=0, value=0.07)]
    K = states.tangent(contact, states.mass_form(V))
    fixed, increment = states.constraints(contact, bcs)
    b = contact.create_vector()
    contact.apply_lifting(b, bcs, contact.u.x.array, -1.0)
    b.assemble()
    expected = np.where(fixed, 0.0, K @ increment)
    np.testing.assert_allclose(
        gathered.vector(contact, b), expected, atol=1e-13 * np.abs(expected).max()
    )


def friction_cases():
    for cell in states.CELLS:
        for degrees, method, measure, law, regime in (
            ((1, 1), "augmented", "reference", "coulomb", "slip"),
            ((2, 2), "augmented", "current", "coulomb", "stick"),
            ((1, 2), "elastic", "reference", "coulomb", "slip"),
            ((2, 2), "elastic", "current", "tresca", "slip"),
            ((1, 1), "rate", "current", "stick", "stick"),
        ):
            case = FrictionCase(cell, *degrees, method, measure, law, regime)
            yield pytest.param(case, id=f"{name_of(case)}-{law}-{regime}")


@pytest.mark.mpi(
    where=lambda case, **_: case.cell == "quadrilateral" and case.measure == "current"
)
@pytest.mark.parametrize("case", list(friction_cases()))
def test_repaired_residual_with_friction(case, record_property):
    scene = case.scene("overhang")

    def prepare(contact, seed):
        set_both(contact, scene, seed)
        check_regime(contact, case.regime)
        return True

    full, fixed = quiet_slopes(frictional_pairs(case, scene), prepare)
    record_property("slope", full.tolist())
    assert is_second_order(full), full
    assert is_first_order(fixed), fixed


@pytest.mark.mpi
@pytest.mark.parametrize("method", ["normal", "penalty"])
def test_lifting_is_the_constrained_columns(cell, method):
    case = Case(cell, 1, 1, method, "current")
    scene = case.scene("overhang")
    contact = states.make_contact(scene, case, tangent="full")
    states.set_state(contact, scene, "active", 2)
    V = contact.u.function_space
    bcs = [
        fix(V, scene, "upper_left", value=lambda x: 0.1 + 0.05 * x),
        fix(V, scene, "lower_right", component=0, value=-0.07),
    ]
    K = states.tangent(contact, states.mass_form(V))
    fixed, increment = states.constraints(contact, bcs)
    b = contact.create_vector()
    contact.apply_lifting(b, bcs, contact.u.x.array, -1.0)
    b.assemble()
    expected = np.where(fixed, 0.0, K @ increment)
    size = np.abs(expected).max()
    assert size > 0.0
    lifted = gathered.vector(contact, b)
    np.testing.assert_allclose(lifted, expected, atol=1e-13 * size)

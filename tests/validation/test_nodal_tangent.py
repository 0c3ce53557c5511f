"""The law at nodes: its tangent is the derivative of the residual that is paired anew,
through means over facets, ranks and segments that move (T1)."""

from __future__ import annotations

import numpy as np
import pytest
import states
from friction_states import FrictionCase, check_regime, frictional_pairs, set_both
from states import Case, name_of
from tangents import contact_pairs, is_first_order, is_second_order, quiet_slopes

# Larger ones see the curvature of the cone
FIRST_STEPS = 10.0 ** np.array([-3.5, -4.0])


def cases():
    for cell in states.CELLS:
        for degrees, method, measure in (
            ((1, 1), "normal", "reference"),
            ((2, 1), "vector", "reference"),
            ((1, 2), "normal", "current"),
            ((2, 2), "vector", "current"),
        ):
            case = Case(cell, *degrees, method, measure)
            quick = [pytest.mark.quick] if measure == "current" else []
            yield pytest.param(case, id=name_of(case), marks=quick)


@pytest.mark.mpi(
    where=lambda case, **_: case.cell in ("triangle", "hexahedron")
    and case.measure == "current"
)
@pytest.mark.parametrize("case", list(cases()))
def test_full_tangent_at_nodes(case, record_property):
    scene = case.scene("overhang")
    degree = 2 if case.dim == 3 else None

    make = contact_pairs(scene, case, quadrature_degree=degree, condition="nodes")

    def prepare(contact, seed):
        states.set_state(contact, scene, "active", seed)
        return states.in_regime(contact, "active")

    full, fixed = quiet_slopes(make, prepare)
    record_property("slope", full.tolist())
    assert is_second_order(full), full
    assert is_first_order(fixed), fixed


def friction_cases():
    for cell in states.CELLS:
        for degrees, measure, law, regime in (
            ((1, 1), "reference", "coulomb", "slip"),
            ((2, 2), "current", "coulomb", "mixed"),
            ((1, 2), "current", "tresca", "slip"),
            ((2, 1), "reference", "coulomb", "stick"),
        ):
            case = FrictionCase(cell, *degrees, "nodes", measure, law, regime)
            yield pytest.param(case, id=f"{name_of(case)}-{law}-{regime}")


@pytest.mark.mpi(
    where=lambda case, **_: case.cell in ("quadrilateral", "tetrahedron")
    and case.regime == "mixed"
)
@pytest.mark.parametrize("case", list(friction_cases()))
def test_full_tangent_at_nodes_with_friction(case, record_property):
    scene = case.scene("overhang")

    def prepare(contact, seed):
        set_both(contact, scene, seed)
        check_regime(contact, case.regime)
        return True

    full, fixed = quiet_slopes(
        frictional_pairs(case, scene), prepare, first_steps=FIRST_STEPS
    )
    record_property("slope", full.tolist())
    assert is_second_order(full), full
    assert is_first_order(fixed), fixed


@pytest.mark.mpi(where=lambda cell, **_: cell == "triangle")
@pytest.mark.parametrize("offset", (0.0, -0.02))
@pytest.mark.parametrize("cell", states.CELLS)
def test_full_tangent_at_nodes_in_the_frame_of_the_master(cell, offset):
    """Its normal turns between the points of a mean."""
    case = FrictionCase(cell, 2, 2, "nodes", "current", "coulomb", "mixed")
    scene = case.scene("overhang")

    def prepare(contact, seed):
        set_both(contact, scene, seed)
        return True

    full, fixed = quiet_slopes(
        frictional_pairs(case, scene, frame="master", offset=offset),
        prepare,
        first_steps=FIRST_STEPS,
    )
    assert is_second_order(full), full
    assert is_first_order(fixed), fixed

"""Dual multipliers: their tangent is the derivative of the residual that is paired anew,
and the rows of each slave node have one multiplier alone."""

from __future__ import annotations

import numpy as np
import pytest
import states
from friction_states import FrictionCase, check_regime, frictional_pairs, set_both
from states import Case, name_of
from tangents import contact_pairs, is_first_order, is_second_order, quiet_slopes
from test_nodal_tangent import FIRST_STEPS


def cases():
    for cell in states.CELLS:
        for degrees, measure in (((1, 1), "reference"), ((2, 2), "current")):
            case = Case(cell, *degrees, "dual", measure)
            quick = [pytest.mark.quick] if measure == "reference" else []
            yield pytest.param(case, id=name_of(case), marks=quick)


@pytest.mark.mpi(where=lambda case, **_: case.cell in ("triangle", "hexahedron"))
@pytest.mark.parametrize("case", list(cases()))
def test_full_tangent_of_dual_multipliers(case, record_property):
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


@pytest.mark.parametrize(
    "cell, regime", [("triangle", "slip"), ("tetrahedron", "mixed")]
)
def test_full_tangent_with_friction(cell, regime, record_property):
    case = FrictionCase(cell, 1, 1, "dual", "reference", "coulomb", regime)
    scene = case.scene("overhang")

    def prepare(contact, seed):
        set_both(contact, scene, seed)
        check_regime(contact, regime)
        return True

    full, fixed = quiet_slopes(
        frictional_pairs(case, scene), prepare, first_steps=FIRST_STEPS
    )
    record_property("slope", full.tolist())
    assert is_second_order(full), full
    assert is_first_order(fixed), fixed

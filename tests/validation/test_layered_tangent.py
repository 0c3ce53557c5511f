"""A slave facet looks past a corner of its master onto a further layer: the segment
there begins where the nearer one ends, and the tangent knows how both move (T1)."""

from __future__ import annotations

import pytest
import states
from ledges import ledge
from states import Case, name_of
from tangents import contact_pairs, is_first_order, is_second_order, quiet_slopes

from raymortar import Search

# The floor is further away than the bodies' own reach
SEARCH = Search(reach=1.0, depth=0.3)


def cases():
    for cell in states.CELLS[:2]:
        for degrees, method, measure, condition in (
            ((1, 1), "normal", "reference", "points"),
            ((2, 1), "vector", "current", "points"),
            ((2, 2), "vector", "current", "points"),
            ((1, 2), "vector", "reference", "nodes"),
            ((1, 1), "dual", "reference", "nodes"),
            ((2, 2), "dual", "current", "nodes"),
        ):
            case = Case(cell, *degrees, method, measure)
            yield pytest.param(case, condition, id=f"{name_of(case)}-{condition}")


@pytest.mark.mpi(where=lambda case, condition: case.degree == 1)
@pytest.mark.parametrize("case, condition", list(cases()))
def test_what_is_seen_past_a_corner_moves_with_it(case, condition, record_property):
    scene = ledge(case.cell, case.geometry_degree)
    make = contact_pairs(scene, case, search=SEARCH, condition=condition)

    def prepare(contact, seed):
        states.set_state(contact, scene, "mixed", seed)
        return True

    full, fixed = quiet_slopes(make, prepare)
    record_property("slope", full.tolist())
    assert is_second_order(full), full
    assert is_first_order(fixed), fixed

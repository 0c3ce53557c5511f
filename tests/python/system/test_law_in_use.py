"""The law and the coefficient of a contact's share of a system, and who may change
them."""

from __future__ import annotations

import pytest
from problems import build, fix, stack

from raymortar import (
    AugmentedLagrangian,
    Contact,
    ContactError,
    Coulomb,
    NonlinearProblem,
    Penalty,
)

pytestmark = pytest.mark.mpi


def sides(V, scene):
    return [fix(V, scene, "bottom"), fix(V, scene, "top", None, [0.0, -0.01])]


def pressed(method, friction=None):
    """Two blocks, and the assembly of their contact."""
    case = build(stack("triangle", (2, 3)), method=method, friction=friction, bcs=sides)
    return case, case.contact.assembly


def test_a_chosen_law_may_change_until_a_step_depends_on_it():
    case, part = pressed(AugmentedLagrangian(condition=None), Coulomb(0.3))
    assert part.method.condition == "nodes" and part.why is not None
    assert part.change_law("points", "vector", "a test asks for it")
    assert (part.method.condition, part.why) == ("points", "a test asks for it")
    assert part.change_law("nodes", "dual", "it asks again")
    case.solve()
    case.contact.advance()
    assert not part.change_law("points", "vector", "too late")
    assert part.method.condition == "nodes"


@pytest.mark.parametrize("method", [AugmentedLagrangian(), Penalty()])
def test_a_law_that_was_given_stays(method):
    _, part = pressed(method)
    assert not part.change_law("nodes", None, "a test asks for it")
    assert part.method == method


def test_a_coefficient_may_be_lent():
    """For some steps another one is in use; the contact's own is kept."""
    _, part = pressed(AugmentedLagrangian())
    own = part.automatic_gamma
    assert part.gamma == own and part.own_gamma == own
    part.set_gamma(0.1 * own, own=own)
    assert (part.gamma, part.own_gamma) == (0.1 * own, own)
    assert part.gamma_scale == pytest.approx(0.1 * own, rel=1e-12)
    part.set_gamma(own)
    assert part.gamma == part.own_gamma == own


def test_conditions_are_looked_into_once():
    """Of the last two sets; others are found anew."""
    case, part = pressed(AugmentedLagrangian())
    bcs = case.problem.bcs
    first = part.prescribed(bcs)
    assert part.prescribed(bcs) is first and part.prescribed(list(bcs)) is first
    none = part.prescribed([])
    assert not none.any() and first.sum() > 0
    assert part.prescribed(bcs) is first
    part.set_gamma(1.0)
    assert part.prescribed(bcs) is not first
    assert (part.prescribed(bcs) == first).all()


def test_a_contact_of_one_problem_is_not_in_another_with_others():
    case, _ = pressed(Penalty(10.0))
    tags = case.scene.tags
    other = Contact(
        case.u, case.scene.facet_tags, [(tags["slave"], tags["master"])], Penalty(10.0)
    )
    with pytest.raises(ContactError, match="belongs to a problem alone"):
        NonlinearProblem(case.problem.forms[0], [case.contact, other])

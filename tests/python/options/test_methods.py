"""What options are made of: choice of the law, unknowns of a multiplier, descriptions."""

from __future__ import annotations

from dataclasses import replace

import pytest

from raymortar import AugmentedLagrangian, ContactError, Coulomb, Penalty, Search, Stick
from raymortar.core.options.descriptions import shown
from raymortar.core.options.methods import ContactOptions

OPEN = AugmentedLagrangian(condition=None)
PLAIN = ContactOptions(
    method=AugmentedLagrangian(), friction=None, quadrature_degree=None,
    measure="reference", search=Search(), tangent="full", offset=None,
    axisymmetric=False, smooth=False, frame="automatic",
)  # fmt: skip


@pytest.mark.parametrize(
    "method, degree, is_narrow, condition, multiplier, why",
    [
        (AugmentedLagrangian(), 1, False, "points", None, None),
        (OPEN, 1, False, "nodes", "dual", "degree 1"),
        (OPEN, 1, True, "points", None, "a master is smaller"),
        (OPEN, 2, False, "points", None, "degree 2"),
        (replace(OPEN, multiplier="vector"), 1, False, "nodes", "vector", "degree 1"),
        (replace(OPEN, multiplier="dual"), 2, True, "nodes", "dual", "is dual"),
    ],
)
def test_a_condition_that_is_open_is_chosen_by_degree_and_masters(
    method, degree, is_narrow, condition, multiplier, why
):
    found, because = method.chosen(degree, is_narrow)
    assert (found.condition, found.multiplier) == (condition, multiplier)
    assert because is None if why is None else why in because


def test_ties_and_penalties_have_no_law_to_choose():
    tied, why = replace(PLAIN, method=OPEN).with_law(1, True, False)
    assert (tied.method.condition, why) == ("points", None)
    options = replace(PLAIN, method=Penalty())
    assert options.with_law(1, False, False) == (options, None)
    assert not options.leaves_law_open


@pytest.mark.parametrize(
    "method, friction, p, dim, is_tie, degree, components",
    [
        (AugmentedLagrangian(), None, 1, 2, False, 1, 1),
        (AugmentedLagrangian(), None, 2, 2, False, 2, 1),
        (AugmentedLagrangian(), None, 2, 3, False, 1, 1),
        (AugmentedLagrangian(degree=1), None, 2, 2, False, 1, 1),
        (AugmentedLagrangian(), Coulomb(0.3), 1, 3, False, 1, 3),
        (AugmentedLagrangian(), None, 1, 2, True, 1, 2),
        (AugmentedLagrangian(multiplier="vector"), None, 1, 3, False, 1, 3),
        (Penalty(), Coulomb(0.3), 2, 2, False, 2, 0),
    ],
)
def test_degree_and_components_of_the_multiplier(
    method, friction, p, dim, is_tie, degree, components
):
    options = replace(PLAIN, method=method, friction=friction)
    assert options.multiplier_kind(p, dim, is_tie) == (degree, components)


@pytest.mark.parametrize("p, dim", [(1, 2), (2, 3)])
def test_a_degree_above_the_stable_one_is_refused(p, dim):
    options = replace(PLAIN, method=AugmentedLagrangian(degree=2))
    with pytest.raises(ContactError, match="degree 2 is not stable: at most 1"):
        options.multiplier_kind(p, dim, False)


@pytest.mark.parametrize(
    "method, friction, springs, slip",
    [
        (AugmentedLagrangian(), None, False, False),
        (AugmentedLagrangian(), Stick(), True, False),
        (Penalty(), Coulomb(0.3), True, False),
        (Penalty(tangential="rate"), Coulomb(0.3), False, False),
        (Penalty(), Coulomb(0.3, elastic_slip=1e-3), True, True),
        (Penalty(), Coulomb(0.3, elastic_slip=0.0), True, False),
    ],
)
def test_what_friction_hands_on(method, friction, springs, slip):
    options = replace(PLAIN, method=method, friction=friction)
    assert (options.has_springs, options.has_elastic_slip) == (springs, slip)


def law(p, v):
    return 0.3 * p


@pytest.mark.parametrize(
    "value, text",
    [
        (AugmentedLagrangian(), "AugmentedLagrangian()"),
        (AugmentedLagrangian(2.0, degree=1), "AugmentedLagrangian(gamma=2, degree=1)"),
        (Coulomb(0.1 + 0.2), "Coulomb(mu=0.3)"),
        (Coulomb(law, elastic_slip=1e-3), "Coulomb(mu=law, elastic_slip=0.001)"),
        (Search(reach=0.5), "Search(reach=0.5)"),
        ("current", "'current'"),
        (None, "None"),
    ],
)
def test_options_are_shown_as_a_user_writes_them(value, text):
    assert shown(value) == text

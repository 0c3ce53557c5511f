"""Soft start: a law at points on bodies that bend, and where there is none."""

import warnings

import numpy as np
import pytest
from arriving import stacked
from pathing import take
from slender import belt, bent, leaves

import raymortar
from raymortar.paths import soft_start
from raymortar.paths.soft_start import SoftStart

NODES = {"method": raymortar.AugmentedLagrangian(condition="nodes")}


def test_a_slender_strip_takes_few_tangents_and_has_the_same_answer(monkeypatch):
    """135 tangents, all steps by a small gamma, without the start."""
    found = []
    for bends in (soft_start.BENDS, 0.0):
        monkeypatch.setattr(soft_start, "BENDS", bends)
        path = bent(100, 0.3)
        gamma = path.problem.contact.contacts[0].gamma
        taken = take(path)
        assert taken.arrived and taken.halvings == 0
        assert path.problem.contact.contacts[0].gamma == gamma
        found.append((path.result()[1], taken))
    (soft, few), (plain, many) = found
    assert soft == pytest.approx(plain, rel=1e-9)
    assert few.ways == {"soft start": 1, "full": 3}
    assert few.tangents <= 45 and many.tangents > 2 * few.tangents
    # Rough solves count
    assert few.tangents == sum(step.tangents for step in few.steps)


@pytest.mark.quick
@pytest.mark.mpi
def test_it_is_for_bodies_that_bend_and_laws_at_points():
    assert not SoftStart(stacked(3).problem)
    assert not SoftStart(belt(24, **NODES).problem)
    problem = bent(100, 0.3, cells=(30, 1)).problem
    start = SoftStart(problem)
    assert start
    # The coefficient of a law at nodes
    ((_, softer),) = start._softer
    law = bent(100, 0.3, cells=(30, 1), **NODES).problem.contact.contacts[0]
    assert softer == pytest.approx(law.gamma, rel=1e-6)


@pytest.mark.quick
def test_gamma_and_tolerances_are_back_after_a_start_that_fails():
    path = bent(100, 0.3, cells=(30, 1))
    problem, solver = path.problem, raymortar.SNESSolver(path.problem)
    contact, start = problem.contact.contacts[0], SoftStart(problem)
    before, solver.max_it = (contact.gamma, solver.tolerances), 1
    path.apply(0.5)
    with warnings.catch_warnings():
        warnings.simplefilter("error", raymortar.ContactWarning)
        with pytest.raises(raymortar.ConvergenceError):
            start.solve(solver)
    assert (contact.gamma, solver.tolerances) == before


@pytest.mark.mpi
def test_a_coefficient_far_too_large_is_soft_until_the_path_ends(monkeypatch):
    """313 tangents, and viscous forces, where it is not."""
    found, seen = [], []
    for stays in (soft_start.STAYS, 0.0):
        monkeypatch.setattr(soft_start, "STAYS", stays)
        path = leaves(2)
        contact = path.problem.contact.contacts[0]
        gamma = contact.gamma
        taken = take(path, each=lambda step: seen.append(contact.gamma_scale))
        assert taken.arrived and taken.halvings == 0
        assert contact.gamma is gamma
        found.append((path.result(), taken.tangents))
    assert seen[0] < 2e-3 * seen[1]
    (soft, few), (plain, many) = found
    assert soft == pytest.approx(plain, rel=1e-5)
    assert few <= 80 < 0.5 * many


@pytest.mark.parametrize("cells, most", [(40, 85), (67, 75)])
def test_a_coarse_belt_with_a_law_at_points_arrives(cells, most):
    """1955 tangents and 5 halvings with 40 cells and the automatic coefficient."""
    path = belt(cells, steps=(2, 6))
    taken = take(path)
    assert taken.arrived and taken.halvings == 0 and taken.tangents <= most
    # exp(mu pi) less what the thickness and bending take
    assert path.result()[0] == pytest.approx(np.exp(0.3 * np.pi), rel=0.006)


@pytest.mark.quick
def test_a_coefficient_that_was_given_stays():
    """Also where it is the automatic one."""
    problem = belt(24).problem
    contact = problem.contact.contacts[0]
    assert SoftStart(problem).stays
    contact.set_gamma(1.0 * contact.gamma)
    start = SoftStart(problem)
    assert start and not start.stays

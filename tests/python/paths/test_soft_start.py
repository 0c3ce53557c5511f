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


@pytest.mark.usefixtures("not_ahead")
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
@pytest.mark.mpi
@pytest.mark.parametrize(
    "path, proposed",
    [
        (lambda: bent(100, 0.3, cells=(30, 1)), ["slave tag 1 bends"]),
        (lambda: bent(100, 0.3, cells=(30, 1), **NODES), []),
        (lambda: stacked(3), []),
    ],
)
def test_a_path_that_fails_proposes_the_law_at_nodes_where_bodies_bend(path, proposed):
    path = path()
    solver = raymortar.SNESSolver(path.problem)
    solver.max_it = 1
    load = raymortar.LoadSteps(
        solver, path.apply, 1, strategy="halve", max_halvings=0, progress=False
    )
    with pytest.raises(raymortar.ConvergenceError) as failure:
        load.run()
    text = str(failure.value)
    assert all(words in text for words in proposed)
    assert ("AugmentedLagrangian(condition='nodes')" in text) == bool(proposed)


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


@pytest.mark.usefixtures("not_ahead")
@pytest.mark.mpi
def test_leaves_have_the_answer_of_the_automatic_coefficient_in_few_tangents():
    """313 tangents, and viscous forces, without softened tangents."""
    path = leaves(2)
    contact = path.problem.contact.contacts[0]
    gamma = contact.gamma
    taken = take(path)
    assert taken.arrived and taken.ways == {"soft start": 1} and taken.tangents <= 80
    assert contact.gamma is gamma
    assert path.result() == pytest.approx(0.99716533588, rel=1e-9)


@pytest.mark.usefixtures("not_ahead")
@pytest.mark.mpi
def test_a_coefficient_with_which_solves_fail_gives_way_for_good(tmp_path):
    """Results, a lone solve, the next path and a checkpoint have the same one."""
    path = leaves(3, share=0.5, steps=2)
    problem, contact = path.problem, path.problem.contact.contacts[0]
    stiff, pressures = contact.assembly.gamma_scale, []
    taken = take(path, each=lambda step: pressures.append(peak(contact)))
    assert taken.arrived and taken.halvings == 0 and taken.tangents <= 120
    assert contact.assembly.gamma_scale < 2e-3 * stiff
    assert peak(contact) == pytest.approx(pressures[-1], rel=1e-12)
    solver = raymortar.SNESSolver(problem)
    assert solver.solve()[0] <= 1
    file = problem.comm.bcast(tmp_path) / "leaves.chk"
    raymortar.Checkpoint(problem, file).write(1.0)
    other = leaves(3, share=0.5, steps=2)
    other.apply(1.0)
    assert raymortar.Checkpoint(other.problem, file).read() == 1.0
    (new,) = other.problem.contact.contacts
    assert new.assembly.gamma_scale == pytest.approx(
        contact.assembly.gamma_scale, rel=1e-12
    )
    assert new.assembly.gamma_is_soft
    assert raymortar.SNESSolver(other.problem).solve()[0] <= 1
    assert other.result() == pytest.approx(path.result(), rel=1e-9)


def peak(contact):
    """Largest pressure."""
    return contact.statistics.max_pressure


@pytest.mark.parametrize("cells, most", [(40, 150), (100, 165)])
def test_a_coarse_belt_with_a_law_at_points_arrives(cells, most):
    """1955 and 1061 tangents, 5 and 2 halvings, before."""
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
    start = SoftStart(problem)
    gamma = contact.gamma
    start.undo(start.stay())
    assert start and start.may_stay and contact.gamma is gamma
    contact.set_gamma(1.0 * contact.gamma)
    for start in (start, SoftStart(problem)):
        assert start and not start.may_stay and not start.stay()
    assert start and contact.gamma == gamma


@pytest.mark.quick
def test_a_soft_coefficient_has_no_softer_one():
    problem = belt(24).problem
    start = SoftStart(problem)
    start.stay()
    assert not start and not SoftStart(problem)
    assert problem.contact.parts[0].gamma_is_soft
    problem.contact.contacts[0].set_gamma(1e9)
    assert not problem.contact.parts[0].gamma_is_soft

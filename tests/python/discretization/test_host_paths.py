"""Paths, states and reactions of a displacement beside other unknowns."""

from __future__ import annotations

import hosts
import numpy as np
import pytest
from host_solutions import METHODS, PUSHES, alone, differences, elastic, solve, solved
from hosts import WAYS
from problems import SOLVERS, worst

import raymortar
from raymortar import ContactError, LoadSteps


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_the_unit_of_a_further_field_counts_for_nothing(unit, solver):
    plain, iterations = solved("mixed", "vector", solver)
    found = hosts.taylor_hood("mixed", unit=unit, **METHODS["vector"])
    assert solve(found, solver) == iterations
    u, p = found.parts()
    expected = plain.parts()
    assert worst(u - expected[0]) < 1e-9 * worst(u)
    assert worst(unit * p - expected[1]) < 1e-9 * worst(expected[1])


@pytest.mark.mpi
def test_a_field_that_is_not_solved_is_no_solution():
    """The forces are in balance at once; the field takes its iterations."""
    found = elastic("blocked")
    iterations = solve(found, pushes=[(0.0, 0.2)])
    assert iterations[0] >= 4
    assert worst(found.parts()[1] - 1.0) < 1e-10


def test_what_is_out_of_balance_is_named():
    found = elastic("blocked")
    solver = SOLVERS[0](found.problem)
    if hasattr(solver, "snes"):
        solver.snes.setTolerances(max_it=1)
    else:
        solver.max_it = 1
    with pytest.raises(raymortar.ConvergenceError, match="the unknown c by"):
        solver.solve()


@pytest.mark.mpi
@pytest.mark.parametrize("way", WAYS)
def test_all_unknowns_go_back_to_a_state(way):
    found = hosts.taylor_hood(way, **METHODS["vector"])
    solve(found, pushes=PUSHES[:1])
    state, before = found.contact.state(), found.parts()
    first = solve(found, pushes=PUSHES[1:])
    after = found.parts()
    found.contact.restore(state)
    for a, b in zip(before, found.parts()):
        assert worst(a - b) == 0.0
    assert solve(found, pushes=PUSHES[1:]) == first
    assert max(differences(after, found.parts())) < 1e-9


def test_a_state_of_other_unknowns_is_refused():
    found, plain = elastic("mixed"), alone()
    with pytest.raises(ContactError, match="unknown 0 of shape"):
        found.contact.restore(plain.contact.state())


@pytest.mark.mpi
@pytest.mark.parametrize("extrapolate", [False, True])
@pytest.mark.parametrize("way", WAYS)
def test_load_steps_with_a_history(way, extrapolate):
    found = hosts.taylor_hood(way)
    history = raymortar.History(found.problem)
    steps = LoadSteps(
        SOLVERS[0](found.problem),
        lambda t: found.push(0.0, -0.06 * t),
        steps=3,
        history=history,
        extrapolate=extrapolate,
        progress=False,
    ).run()
    assert [step.factor for step in steps] == pytest.approx([1 / 3, 2 / 3, 1.0])
    force = history.vectors("force_0")[:, 1]
    assert (np.diff(force) > 0.0).all()
    other = hosts.taylor_hood(way)
    solve(other, pushes=[(0.0, -0.06)])
    assert max(differences(other.parts(), found.parts())) < 1e-8


@pytest.mark.mpi
def test_a_step_that_fails_starts_again_from_all_unknowns():
    """Too large a step fails; halved ones end where small ones do."""
    found = hosts.taylor_hood("mixed")
    solver = SOLVERS[0](found.problem)
    path = LoadSteps(
        solver,
        lambda t: found.push(0.0, -0.2 * t),
        steps=1,
        strategy="halve",
        progress=False,
    )
    path.run()
    assert path.halvings > 0
    other = hosts.taylor_hood("mixed")
    LoadSteps(
        SOLVERS[0](other.problem),
        lambda t: other.push(0.0, -0.2 * t),
        steps=10,
        progress=False,
    ).run()
    assert max(differences(other.parts(), found.parts())) < 1e-7


@pytest.mark.mpi
@pytest.mark.parametrize("way", WAYS)
def test_reactions_balance_contact(way):
    found, _ = solved(way, "vector")
    bcs = found.problem.bcs
    reactions = found.problem.reactions({"below": bcs[:2], "above": bcs[2:]})
    force = found.contact.resultant(0).force
    assert reactions["above"] == pytest.approx(-force, rel=1e-8)
    assert reactions["below"] == pytest.approx(force, rel=1e-8)


@pytest.mark.mpi
@pytest.mark.parametrize("way", WAYS)
def test_viscous_forces_hold_a_loose_body(way):
    """The upper block stands on the lower one, held sideways only."""
    found = hosts.taylor_hood(way)
    conditions = [bc for i, bc in enumerate(found.problem.bcs) if i != 3]
    found.problem.bcs[:] = conditions
    steps = LoadSteps(
        SOLVERS[0](found.problem),
        lambda t: None,
        steps=1,
        stabilize=True,
        progress=False,
    ).run()
    assert len(steps) == 1
    assert worst(found.parts()[0]) < 1e-9

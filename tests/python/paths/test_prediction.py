"""Steps that start where the last one leads."""

import numpy as np
import pytest
from load_paths import top_moves
from problems import worst

from raymortar import ContactError, LoadSteps
from raymortar.paths import soft_start
from raymortar.paths.prediction import Prediction
from raymortar.paths.strategy import FULL, SMALL_GAMMA
from raymortar.viscous.budget import LONGEST


def recorded(monkeypatch):
    """Answers of `Prediction.leads_on`, as they come."""
    found, leads_on = [], Prediction.leads_on

    def noted(self, *given):
        found.append(leads_on(self, *given))
        return found[-1]

    monkeypatch.setattr(Prediction, "leads_on", noted)
    return found


@pytest.mark.mpi
def test_a_path_that_goes_on_is_solved_in_fewer_iterations(monkeypatch, uncorrected):
    asked, found = recorded(monkeypatch), {}
    for extrapolate in (False, None):
        problem, steps = top_moves("quadrilateral", steps=8, extrapolate=extrapolate)
        path = steps.run()
        assert all(step.strategy == FULL for step in path)
        found[extrapolate] = sum(s.tangents for s in path), problem.u.x.array.copy()
    assert asked == 7 * [True]
    assert found[None][0] <= found[False][0] - 4
    assert worst(found[None][1] - found[False][1]) <= 1e-9


@pytest.mark.mpi
def test_a_path_that_turns_round_is_noticed(monkeypatch):
    """Down in four steps, and up again in four: the fifth begins where it is."""
    asked = recorded(monkeypatch)
    problem, there = top_moves("quadrilateral", steps=4)
    down = there.apply
    path = LoadSteps(there.solver, lambda t: down(1.0 - abs(1.0 - t)), 8, path=(0, 2))
    path.progress = False
    path.run()
    assert asked == 3 * [True] + [False] + 3 * [True]
    assert worst(problem.u.x.array) <= 1e-9


def test_starts_that_fail_are_left_out_for_longer_and_longer(monkeypatch):
    problem, steps = top_moves("triangle", steps=8)
    prediction = Prediction(steps._path)
    monkeypatch.setattr(Prediction, "_imbalance", lambda self: next(sizes))
    now = problem.problem.contact.state()
    asked = []
    for _ in range(40):
        sizes = iter((2.0, 1.0))  # here, and where the last step leads
        asked.append(prediction.leads_on(now, now, 1.0))
        if asked[-1]:
            prediction.note(works=False)
    rests = np.diff(np.flatnonzero(asked)) - 1
    assert list(rests[:5]) == [1, 2, 4, LONGEST, LONGEST]
    prediction.note(works=True)
    sizes = iter((2.0, 1.0))
    assert prediction.leads_on(now, now, 1.0)


def test_a_step_after_one_of_another_way_starts_where_that_one_led(monkeypatch):
    """The plain solver breaks in the first step; a small gamma solves it."""
    asked, solve, tries = recorded(monkeypatch), soft_start.iterations_of, []

    def breaks_once(solver):
        tries.append(solver)
        if len(tries) == 1:
            raise ContactError("cells are inverted")
        return solve(solver)

    monkeypatch.setattr(soft_start, "iterations_of", breaks_once)
    _, steps = top_moves("quadrilateral", steps=4)
    ways = [step.strategy for step in steps.run()]
    assert ways == [SMALL_GAMMA, FULL, FULL, FULL] and asked == 3 * [True]

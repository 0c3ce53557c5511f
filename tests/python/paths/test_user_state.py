"""A user's own state on a path: accepted with a step, taken back with a failed one."""

from __future__ import annotations

import numpy as np
import pytest
from load_paths import sticking, top_moves
from point_laws import pressed
from problems import COMM, SOLVERS, worst

from raymortar import ContactError, ConvergenceError, LoadSteps, SNESSolver

pytestmark = [pytest.mark.mpi, pytest.mark.quick]


class Calls:
    """Notes what is called, and checks that it is called at accepted states."""

    def __init__(self, contact):
        self.contact, self.names = contact, []

    def accept(self):
        assert np.array_equal(self.contact.states.u_old, self.contact.u.x.array)
        self.names.append("accept")

    def reject(self):
        assert np.array_equal(self.contact.states.u_old, self.contact.u.x.array)
        self.names.append("reject")


def noted(problem, steps):
    """The same path with hooks."""
    calls = Calls(problem.contact)
    steps.on_accept, steps.on_reject = calls.accept, calls.reject
    return calls


@pytest.mark.parametrize("solver", SOLVERS)
def test_steps_that_work_are_accepted_alone(solver):
    problem, steps = top_moves("quadrilateral", solver, steps=3)
    calls = noted(problem, steps)
    for k, _ in enumerate(steps, 1):
        assert calls.names == k * ["accept"]


@pytest.mark.usefixtures("not_ahead")
def test_each_other_way_begins_at_the_accepted_state():
    problem, steps = sticking("quadrilateral")
    calls = noted(problem, steps)
    ways = [step.strategy for step in steps]
    assert set(ways) != {"full"} or steps.halvings
    assert calls.names.count("accept") == len(ways)
    assert "reject" in calls.names


def test_halved_steps_and_the_last_failure_are_rejected():
    problem, law, apply = pressed(COMM, True)
    calls = Calls(problem.contact)

    def fails():
        if worst(problem.u.x.array) > 0.03:
            raise ConvergenceError("too large a strain")

    law.fails = fails
    hooks = {"on_accept": calls.accept, "on_reject": calls.reject}
    path = LoadSteps(SNESSolver(problem), apply, 1, max_halvings=2, **hooks)
    with pytest.raises(ConvergenceError, match="after 2 halvings"):
        path.run()
    assert calls.names == ["reject", "reject", "accept", "reject"]


def test_hooks_have_to_be_functions():
    problem, steps = top_moves("quadrilateral")
    for name in ("on_accept", "on_reject"):
        with pytest.raises(ContactError, match=f"{name} must be a function without"):
            LoadSteps(steps.solver, lambda t: None, **{name: 3})


@pytest.mark.usefixtures("not_ahead")
@pytest.mark.parametrize("name", ["on_accept", "on_reject"])
def test_an_error_of_one_rank_is_raised_on_all(name):
    problem, steps = (
        top_moves("quadrilateral") if name == "on_accept" else sticking("quadrilateral")
    )

    def fails():
        if COMM.rank == COMM.size - 1:
            raise ValueError("no more room")

    setattr(steps, name, fails)
    with pytest.raises(ValueError, match="no more room"):
        steps.run()

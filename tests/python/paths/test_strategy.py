"""What load steps try before they halve a step."""

import io

import numpy as np
import pytest
from load_paths import cycling, sticking, top_moves
from problems import SOLVERS, worst

from raymortar import ContactError, ConvergenceError, SNESSolver
from raymortar.convergence.convergence import is_hopeless, is_in_trouble
from raymortar.errors import SetUpError
from raymortar.paths.strategies import (
    CAPPED,
    FULL,
    OVERLAP,
    SMALL_GAMMA,
    VISCOUS,
    CappedSolver,
)

CYCLE = [2.371e-2, 1.1e-2]
FALLING = [10.0**-k for k in range(9)]


# What residuals show


@pytest.mark.quick
@pytest.mark.parametrize(
    "norms, trouble, hopeless",
    [
        (FALLING, False, False),
        ([1.0, 2.0, 1.0, 2.0, 1e-2, 1e-5], False, False),  # it finds its way
        ([0.5**k for k in range(20)], False, False),  # slow, but it gets there
        ([1e-8, 1.0, 2.0, 0.1], False, False),  # a first touch
        (3 * CYCLE, True, True),
        ([1.0] + 3 * [0.3, 0.1, 0.25], True, True),
        (3 * [5.2, 5.5, 1.2, 3.6, 0.9], True, True),
        ([1.0, 0.2, 1.02, 0.198, 1.01, 0.2], True, False),
        (3 * [2.371e-2, 2.369e-2, 2.370e-2], True, True),
        ([1.0, 0.1, 1e2, 1e3, 2e6], True, False),
        ([1.0, 0.1, np.nan], True, False),
        ([1.0, 0.1] + [0.2, 0.7, 0.4, 0.3, 0.9, 0.15, 0.22, 0.6], True, False),
        ([1.0], False, False),
        (8 * [0.0], False, False),
    ],
)
def test_trouble_is_told_from_what_converges(norms, trouble, hopeless):
    assert is_in_trouble(norms) == trouble
    assert is_hopeless(norms) == hopeless


@pytest.mark.mpi(where=lambda cell_2d, **_: cell_2d == "triangle")
@pytest.mark.parametrize("solver", SOLVERS)
def test_a_lone_solve_ends_where_residuals_repeat(cell_2d, solver):
    """Residuals are in the ratio 2 to 1: those of u^3 - 2 u + 2 at 0 and 1."""
    with pytest.raises(ConvergenceError, match="repeats every 2 residuals"):
        found = cycling(cell_2d, solver)
        found.solve()
    norms = np.array(found.problem.history)
    assert len(norms) == 6
    np.testing.assert_allclose(norms[::2] / norms[1::2], 2.0, rtol=1e-12)


# Paths


@pytest.mark.mpi(where=lambda solver: solver is SOLVERS[0])
@pytest.mark.parametrize("solver", SOLVERS)
def test_a_path_arrives_that_halving_does_not_save(solver):
    options = {"gamma": 5e4, "max_halvings": 3}
    _, before = sticking("quadrilateral", solver, strategy="halve", **options)
    with pytest.raises(ConvergenceError):
        before.run()
    problem, after = sticking("quadrilateral", solver, **options)
    gamma = problem.contact.gamma
    path = after.run()
    assert path[-1].factor == 1.0
    assert any(step.strategy != FULL for step in path)
    assert problem.contact.gamma is gamma
    easy, steps = sticking("quadrilateral", solver, gamma=1.0)
    steps.run()
    forces = [p.contact.resultant(0).force for p in (problem, easy)]
    assert worst(forces[0] - forces[1]) <= 0.05 * worst(forces[1])


@pytest.mark.mpi(where=lambda solver: solver is SOLVERS[0])
@pytest.mark.parametrize("solver", SOLVERS)
def test_nothing_is_done_where_nothing_is_wrong(solver):
    paths = []
    for strategy in ("auto", "halve", None):
        problem, steps = top_moves("quadrilateral", solver, strategy=strategy)
        path = steps.run()
        assert all(step.strategy == FULL for step in path)
        paths.append(([step.iterations for step in path], problem.u.x.array.copy()))
    for counts, u in paths[1:]:
        assert counts == paths[0][0]
        # Parts of other ranks are added as they arrive, in any order
        np.testing.assert_allclose(u, paths[0][1], rtol=0.0, atol=1e-13)


# The order


class Failing:
    """Lets the first solves of a step fail, as if they cycled."""

    def __init__(self, monkeypatch, problem):
        self.norms, self.left = 3 * CYCLE, 0
        for solver in (*SOLVERS, CappedSolver):
            monkeypatch.setattr(solver, "solve", self.wrap(solver.solve))
        self.problem = problem

    def wrap(self, solve):
        def wrapped(solver):
            if self.left:
                self.left -= 1
                self.problem.problem.convergence.norms[:] = self.norms
                raise ConvergenceError("it cycles")
            return solve(solver)

        return wrapped


@pytest.mark.mpi(where=lambda failures, **_: failures == 2)
@pytest.mark.parametrize(
    "failures, strategy",
    [
        (1, FULL),  # from the last accepted state, not from where it leads
        (2, CAPPED),
        (3, SMALL_GAMMA),
        (4, VISCOUS),
    ],
)
def test_strategies_are_tried_in_their_order(failures, strategy, monkeypatch):
    problem, steps = top_moves("triangle", SOLVERS[0])
    failing, path = Failing(monkeypatch, problem), iter(steps)
    assert next(path).strategy == FULL
    failing.left = failures
    assert next(path).strategy == strategy
    # What solved the last step is first, and the solver as given again after that
    kept = strategy if strategy in (CAPPED, SMALL_GAMMA) else FULL
    assert next(path).strategy == kept
    assert next(path).strategy == FULL
    assert steps.halvings == 0
    list(path)
    assert worst(problem.u.x.array) > 0.0


@pytest.mark.mpi
def test_the_step_is_halved_where_nothing_helps(monkeypatch):
    problem, steps = top_moves("triangle", SOLVERS[0])
    failing, path = Failing(monkeypatch, problem), iter(steps)
    next(path)
    before = problem.u.x.array.copy()
    # Viscous forces are tried in five sizes
    failing.left = 4 + 5
    step = next(path)
    assert (step.factor, step.strategy, step.halvings) == (0.375, FULL, 1)
    assert worst(problem.u.x.array - before) > 0.0


@pytest.mark.mpi
def test_slow_solves_are_halved_at_once(monkeypatch):
    """More iterations would have done: another way is not asked for."""
    problem, steps = top_moves("triangle", SOLVERS[0])
    failing, path = Failing(monkeypatch, problem), iter(steps)
    next(path)
    # From where the last step leads, and from where it ended
    failing.norms, failing.left = FALLING[:4], 2
    assert next(path).halvings == 1


@pytest.mark.mpi
def test_faults_of_the_set_up_are_raised_at_once(monkeypatch):
    problem, steps = top_moves("triangle")
    calls = []

    def faulty(solver):
        calls.append(solver)
        raise SetUpError("the mesh was moved")

    monkeypatch.setattr(type(problem.solver), "solve", faulty)
    with pytest.raises(SetUpError):
        steps.run()
    assert len(calls) == 1


# Settings


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
def test_capped_steps_do_not_pass_surfaces(solver, monkeypatch):
    """The answer is that of full steps, the overlap on the way next to none."""
    found, shares, share = [], [], CappedSolver._share

    def noted(self, x, trial):
        shares.append(share(self, x, trial))
        return shares[-1]

    monkeypatch.setattr(CappedSolver, "_share", noted)
    for capped in (False, True):
        problem, steps = top_moves("triangle", solver, share=0.05, gap=0.02)
        steps.apply(1.0)
        way = CappedSolver(problem.solver) if capped else problem.solver
        assert way.solve()[1]
        found.append(problem.u.x.array.copy())
    assert min(shares) < 1.0 and shares[-1] == 1.0 and 0.0 < OVERLAP < 0.1
    assert worst(found[1] - found[0]) <= 1e-9


@pytest.mark.mpi
def test_the_log_says_what_was_used(monkeypatch):
    log = io.StringIO()
    problem, steps = top_moves("triangle", SOLVERS[0], progress=log)
    failing, path = Failing(monkeypatch, problem), iter(steps)
    next(path)
    failing.left = 2
    next(path)
    if problem.problem.comm.rank == 0:
        # Those of what is tried on the way aside
        lines = [text for text in log.getvalue().splitlines() if "Newton" in text]
        assert lines[1].endswith(CAPPED) and CAPPED not in lines[0]


@pytest.mark.mpi
@pytest.mark.parametrize("strategy", ["full", 3, True])
def test_strategies_that_are_none_are_refused(strategy):
    with pytest.raises(ContactError, match="strategy must be one of"):
        top_moves("triangle", strategy=strategy)

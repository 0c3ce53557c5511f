"""What load steps try before they halve a step."""

import io
import sys
from pathlib import Path as Place

import numpy as np
import pytest
from dolfinx import fem
from load_paths import cycling, sticking, top_moves
from pathing import Path, take
from problems import SOLVERS, build, fix, worst

import raymortar
from raymortar import ContactError, ConvergenceError, SNESSolver
from raymortar.core.errors import SetUpError
from raymortar.diagnose.trouble import is_hopeless, is_in_trouble
from raymortar.paths.soft_start import with_line_search
from raymortar.paths.strategy import FULL, SMALL_GAMMA, VISCOUS
from raymortar.paths.ways import FadingForces, SmallGamma
from raymortar.solvers import iterative

sys.path.append(str(Place(__file__).parents[3] / "benchmarks" / "robustness"))

from bodies_2d import snap_fit  # noqa: E402

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


@pytest.mark.quick
def test_a_jump_ends_a_hasty_solve_alone():
    problem = cycling("triangle", raymortar.SNESSolver).problem
    convergence = problem.convergence
    for norms, jumped in [
        ([1.0, 99.0], False),
        ([1.0, 101.0], True),
        ([300.0, 0.3, 31.0], True),
        ([300.0, 0.3, 29.0], False),
        ([1.0], False),
    ]:
        convergence.norms[:] = norms
        convergence.hasty = False
        assert not convergence.jumped
        convergence.hasty = True
        assert convergence.jumped == jumped
    convergence.hasty = False


def test_a_hook_that_springs_over_a_tooth_takes_few_tangents():
    """427 where jumps are waited for, and first solves with a tenth of gamma are exact."""
    pytest.importorskip("gmsh")
    scene = snap_fit()
    top = fem.Constant(scene.mesh, np.zeros(2))

    def held(V, scene):
        return [fix(V, scene, "bottom"), fix(V, scene, "top", None, top)]

    search = raymortar.Search(reach=1.0, depth=1.0)
    options = {"E": 1000.0, "search": search, "bcs": held}
    problem = build(scene, 1, "neo-hookean", **options).problem

    def push(t):
        top.value[0] = 3.2 * t

    taken = take(Path(problem, push, 32, solver=raymortar.NewtonSolver))
    assert taken.arrived and taken.halvings == 0
    assert taken.tangents <= 340 and taken.iterations <= 8 * 32


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


@pytest.mark.usefixtures("not_ahead")
@pytest.mark.mpi(
    where=lambda cell, solver: cell == "quadrilateral" and solver is SOLVERS[0]
)
@pytest.mark.parametrize("cell", ["quadrilateral", "triangle"])
@pytest.mark.parametrize("solver", SOLVERS)
def test_a_path_arrives_that_halving_does_not_save(cell, solver):
    _, before = sticking(cell, solver, strategy="halve", max_halvings=3)
    with pytest.raises(ConvergenceError):
        before.run()
    problem, after = sticking(cell, solver)
    gamma = problem.contact.gamma
    path = after.run()
    assert path[-1].factor == 1.0
    assert any(step.strategy != FULL for step in path)
    assert problem.contact.gamma is gamma
    easy, steps = sticking(cell, solver, gamma=1.0)
    steps.run()
    forces = [p.contact.resultant(0).force for p in (problem, easy)]
    assert worst(forces[0] - forces[1]) <= 0.05 * worst(forces[1])


@pytest.mark.mpi(where=lambda solver: solver is SOLVERS[0])
@pytest.mark.parametrize("solver", SOLVERS)
def test_nothing_is_done_where_nothing_is_wrong(solver, uncorrected):
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
        self.norms, self.left, self.gammas = 3 * CYCLE, 0, []
        for solver in SOLVERS:
            monkeypatch.setattr(solver, "solve", self.wrap(solver.solve))
        self.problem = problem

    def wrap(self, solve):
        def wrapped(solver):
            self.gammas.append(self.problem.contact.gamma)
            if self.left:
                self.left -= 1
                self.problem.problem.convergence.norms[:] = self.norms
                raise ConvergenceError("it cycles")
            return solve(solver)

        return wrapped


@pytest.mark.mpi
@pytest.mark.parametrize("failures, strategy", [(1, SMALL_GAMMA), (2, VISCOUS)])
def test_strategies_are_tried_in_their_order(failures, strategy, monkeypatch):
    problem, steps = top_moves("triangle", SOLVERS[0], extrapolate=False)
    failing, path = Failing(monkeypatch, problem), iter(steps)
    assert next(path).strategy == FULL
    failing.left, gamma = failures, problem.contact.gamma
    assert next(path).strategy == strategy
    assert problem.contact.gamma == gamma
    assert failing.gammas.count(0.1 * gamma) == 1
    assert next(path).strategy == FULL
    assert steps.halvings == 0
    list(path)
    assert worst(problem.u.x.array) > 0.0
    assert problem.contact.gamma == gamma


@pytest.mark.mpi
@pytest.mark.parametrize("failures, tenths", [(3, 2), (4, 2), (5, 2), (6, 3)])
def test_solves_under_viscous_forces_go_by_a_small_gamma(failures, tenths, monkeypatch):
    """Where it does not help, it is left out for the next failure."""
    problem, steps = top_moves("triangle", SOLVERS[0], extrapolate=False)
    failing, path = Failing(monkeypatch, problem), iter(steps)
    next(path)
    # As given, by a small gamma, under viscous forces; from the fourth on by turns
    failing.left, gamma = failures, problem.contact.gamma
    assert next(path).strategy == VISCOUS
    assert failing.gammas.count(0.1 * gamma) == tenths
    assert problem.contact.gamma == gamma and steps.halvings == 0


@pytest.mark.mpi
def test_each_way_is_judged_at_the_accepted_state(monkeypatch):
    """One that throws bodies out of reach does not end the tries."""
    problem, steps = top_moves("triangle", SOLVERS[0], extrapolate=False)
    failing, path, far = Failing(monkeypatch, problem), iter(steps), []
    next(path)
    u, accepted = problem.u.x.array, problem.u.x.array.copy()
    is_of_use = FadingForces.is_of_use

    def throws(self, first):
        u[:] += 100.0

    def noted(self):
        far.append(worst(u - accepted))
        return is_of_use(self)

    monkeypatch.setattr(SmallGamma, "solve", throws)
    monkeypatch.setattr(FadingForces, "is_of_use", noted)
    failing.left = 1
    assert next(path).strategy == VISCOUS
    assert far == [0.0]


@pytest.mark.mpi
def test_what_solved_two_steps_goes_first(monkeypatch):
    problem, steps = top_moves("triangle", SOLVERS[0], steps=6, extrapolate=False)
    failing, path, taken = Failing(monkeypatch, problem), iter(steps), []
    next(path)
    for failures in (1, 1, 0, 0, 0):
        failing.left = failures
        step = next(path)
        taken.append((step.strategy, step.solves))
    # Each failed try before it begins no solve here. Then it goes first for two steps,
    # and in the third the plain solver works again
    assert taken == 4 * [(SMALL_GAMMA, 2)] + [(FULL, 1)]
    assert steps.halvings == 0


@pytest.mark.mpi
def test_a_way_that_fails_at_once_gives_way_to_the_others(monkeypatch):
    problem, steps = top_moves("triangle", SOLVERS[0], extrapolate=False)
    failing, path, taken = Failing(monkeypatch, problem), iter(steps), []
    next(path)
    for failures in (1, 1, 1):
        failing.left = failures
        taken.append(next(path).strategy)
    assert taken == [SMALL_GAMMA, SMALL_GAMMA, FULL]


@pytest.mark.mpi
def test_steps_count_all_of_their_tangents():
    problem, steps = top_moves("quadrilateral", SOLVERS[0])
    path = steps.run()
    found = problem.problem if hasattr(problem, "problem") else problem
    assert sum(step.tangents for step in path) == found.tangents > 0
    assert sum(step.solves for step in path) == found.solves == len(path)
    assert [step.tangents for step in path] == [step.iterations for step in path]


@pytest.mark.mpi
def test_the_step_is_halved_where_nothing_helps(monkeypatch):
    problem, steps = top_moves("triangle", SOLVERS[0])
    failing, path = Failing(monkeypatch, problem), iter(steps)
    next(path)
    before = problem.u.x.array.copy()
    # From where the step leads, plainly and by a small gamma; viscous forces in five
    # sizes, of which the first and the third go by a small gamma as well
    failing.left = 3 + 5 + 2
    step = next(path)
    assert (step.factor, step.strategy, step.halvings) == (0.375, FULL, 1)
    assert worst(problem.u.x.array - before) > 0.0


@pytest.mark.mpi
def test_slow_solves_are_halved_at_once(monkeypatch):
    """More iterations would have done: another way is not asked for."""
    problem, steps = top_moves("triangle", SOLVERS[0], extrapolate=False)
    failing, path = Failing(monkeypatch, problem), iter(steps)
    next(path)
    failing.norms, failing.left = FALLING[:4], 1
    assert next(path).halvings == 1


@pytest.mark.mpi
def test_other_ways_are_tried_where_the_smallest_step_is_slow_too(monkeypatch):
    options = {"extrapolate": False, "max_halvings": 1}
    problem, steps = top_moves("triangle", SOLVERS[0], **options)
    failing, path = Failing(monkeypatch, problem), iter(steps)
    next(path)
    slow = 10.0 ** -np.linspace(0.0, 6.0, problem.solver.max_it + 1)
    failing.norms, failing.left = list(slow), 2
    step = next(path)
    assert (step.strategy, step.halvings) == (SMALL_GAMMA, 1)


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
def test_a_line_search_keeps_what_the_solver_was_given(solver):
    options = {**iterative(), "ksp_rtol": 1e-9}
    problem, _ = top_moves("triangle", lambda p: solver(p, options))
    problem.solver.tolerances = 1e-7, 1e-3
    other = with_line_search(problem.solver)
    assert isinstance(other, SNESSolver) and other.A.handle == problem.solver.A.handle
    assert other.krylov_solver.getTolerances()[0] == 1e-9
    assert other.tolerances == (1e-7, 1e-3)
    assert other.max_it == 2 * problem.solver.max_it


@pytest.mark.mpi
def test_a_line_search_takes_no_rounding_error_for_a_tolerance():
    """That of all bodies, when the solver was made, may be above a soft body's."""
    problem, _ = top_moves("triangle", SNESSolver)
    problem.problem.convergence._floors *= 1e3
    other = with_line_search(problem.solver)
    assert other.force_tolerance is None


@pytest.mark.mpi
def test_a_solver_with_a_line_search_of_its_own_keeps_it():
    searching = {"snes_linesearch_type": "bt"}
    problem, _ = top_moves("triangle", lambda p: SNESSolver(p, searching))
    assert with_line_search(problem.solver) is None


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
        assert lines[1].endswith(SMALL_GAMMA) and SMALL_GAMMA not in lines[0]


@pytest.mark.mpi
@pytest.mark.parametrize("strategy", ["full", 3, True])
def test_strategies_that_are_none_are_refused(strategy):
    with pytest.raises(ContactError, match="strategy must be one of"):
        top_moves("triangle", strategy=strategy)

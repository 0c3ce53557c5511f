"""Iterates that are corrected again by the tangent that led to them."""

from contextlib import nullcontext

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import pytest
import ufl
from arriving import loose_stack
from dolfinx import fem
from load_paths import blocks, top_moves
from pathing import take
from problems import SOLVERS, fix, residual, tolerate, worst
from squeezing import squeezed

import raymortar
from raymortar.core import compat
from raymortar.paths.prediction import Lessons
from raymortar.paths.strategy import FULL
from raymortar.paths.ways import SmallGamma
from raymortar.solvers import correcting as module
from raymortar.solvers.correcting import correcting


def solved(solver, options=None, step=0.2):
    """A problem whose top has been pressed down, and its iterations."""
    problem, steps = top_moves("quadrilateral", solver)
    if options is not None:
        problem.solver = solver(problem.problem, options)
    steps.apply(step)
    return problem, problem.solver


def found(problem, solver):
    """Iterations, history and displacement of a solve."""
    iterations, _ = solver.solve()
    return iterations, list(problem.problem.history), problem.u.x.array.copy()


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
def test_the_same_solution_takes_fewer_tangents(solver):
    plain = found(*solved(solver))
    problem, own = solved(solver)
    with correcting(own):
        corrected = found(problem, own)
    assert corrected[0] == problem.problem.tangents < plain[0] - 1
    assert worst(corrected[2] - plain[2]) <= 1e-9 * worst(plain[2])
    # Each iterate is in the history once
    assert len(corrected[1]) == corrected[0] + 1
    assert own.on_iterate is None


@pytest.mark.mpi
@pytest.mark.parametrize("solver", SOLVERS)
def test_one_that_leaves_too_much_is_taken_back(solver, monkeypatch):
    plain = found(*solved(solver))
    monkeypatch.setattr(module, "LEAVES", 0.0)
    asked, corrects = [], module.Corrections._corrects

    def noted(*given):
        asked.append(corrects(*given))
        return asked[-1]

    monkeypatch.setattr(module.Corrections, "_corrects", noted)
    problem, own = solved(solver)
    with correcting(own):
        iterations, history, u = found(problem, own)
    assert asked and not any(asked)
    assert iterations == plain[0]
    np.testing.assert_allclose(history[:-1], plain[1][:-1], rtol=1e-9)
    np.testing.assert_allclose(u, plain[2], rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("solver", SOLVERS)
def test_an_error_in_a_correction_is_raised(solver):
    _, own = solved(solver)

    def fails(x, b):
        raise ZeroDivisionError("of the correction")

    own.on_iterate = fails
    with pytest.raises(ZeroDivisionError, match="of the correction"):
        own.solve()


def test_corrections_update_the_tangent():
    """Each step is that by Broyden's tangent, written out."""
    random = np.random.default_rng(1)
    A = np.eye(4) + 0.2 * random.standard_normal((4, 4))
    B, steps = A.copy(), []
    for _ in range(4):
        r = random.standard_normal(4)
        if steps:
            last = steps[-1].array
            B += np.outer(r, last) / (last @ last)
        step = PETSc.Vec().createWithArray(np.linalg.solve(A, -r), comm=MPI.COMM_SELF)
        module.update(step, steps)
        steps.append(step)
        np.testing.assert_allclose(step.array, np.linalg.solve(B, -r), rtol=1e-9)


def test_updated_tangents_save_residuals(monkeypatch):
    counts, corrects = [0, 0], module.Corrections._corrects
    for one, update in enumerate((module.update, lambda step, before: None)):

        def counted(*given, one=one):
            counts[one] += 1
            return corrects(*given)

        monkeypatch.setattr(module, "update", update)
        monkeypatch.setattr(module.Corrections, "_corrects", counted)
        problem, own = solved(SOLVERS[0])
        with correcting(own):
            own.solve()
    assert 0 < counts[0] < counts[1]


def test_a_line_search_in_place_of_full_steps_is_corrected():
    """Its residuals between two iterates do not count."""
    problem, own = solved(raymortar.NewtonSolver, step=1.0)
    plain, search = [
        raymortar.SNESSolver(problem.problem, {"snes_linesearch_type": "l2"})
        for _ in range(2)
    ]
    begin = problem.problem.contact.state()
    without, _ = plain.solve()
    problem.problem.contact.restore(begin)
    with correcting(own, search):
        assert own.on_iterate is None
        corrected, _ = search.solve()
    assert corrected < without


@pytest.mark.parametrize("error", [raymortar.ConvergenceError, raymortar.ContactError])
def test_a_correction_that_fails_is_taken_back(error, monkeypatch):
    problem, own = solved(SOLVERS[0])
    residual, calls = problem.problem.F, []

    def F(x, b):
        calls.append(problem.problem.tangents)
        if calls.count(calls[-1]) > 1:
            raise error("no return mapping")
        residual(x, b)

    monkeypatch.setattr(problem.problem, "F", F)
    with correcting(own):
        iterations, _ = own.solve()
    plain = found(*solved(SOLVERS[0]))
    assert iterations == plain[0]
    assert worst(problem.u.x.array - plain[2]) <= 1e-12


def test_solvers_that_shorten_steps_or_do_not_factorise_are_left_alone():
    problem, damped = solved(raymortar.NewtonSolver)
    damped.relaxation_parameter = 0.9
    searching = {"snes_linesearch_type": "bt"}
    _, search = solved(raymortar.SNESSolver, searching)
    _, multigrid = solved(raymortar.SNESSolver, raymortar.solvers.iterative())
    for solver in (damped, search, multigrid):
        with correcting(solver):
            assert solver.on_iterate is None


@pytest.mark.parametrize("solver", SOLVERS)
def test_paths_correct_unless_iterations_are_limited(solver):
    counts = []
    for limit in (None, 24):
        problem, steps = top_moves("quadrilateral", solver)
        if limit is not None:
            tolerate(problem.solver, max_it=limit)
        counts.append(sum(step.tangents for step in steps.run()))
    assert counts[0] <= counts[1] - 4


@pytest.mark.parametrize("solver", SOLVERS)
def test_corrections_end_at_rounding(solver):
    """Below it no residual meets a tolerance: a solve ends where it falls no more."""
    counts = []
    for corrects in (False, True):
        problem, own = solved(solver)
        tolerate(own, rtol=1e-16)
        with correcting(own) if corrects else nullcontext():
            own.solve()
        counts.append(problem.problem.tangents)
    assert counts[1] < counts[0] - 1


def test_a_users_own_callback_stays():
    problem, steps = top_moves("quadrilateral", raymortar.NewtonSolver)
    seen = []
    problem.solver.on_iterate = lambda x, b: seen.append(b.norm())
    found = steps.run()
    assert len(seen) == sum(step.tangents + 1 for step in found)


def fall():
    """Tangents of blocks that fall on each other under viscous forces."""
    path = loose_stack(steps=1)
    take(path)
    return path.problem.tangents


def small_gamma():
    """Tangents of a solve by a small gamma, then by gamma itself."""
    problem, own = solved(raymortar.NewtonSolver)
    SmallGamma(own, Lessons(FULL)).solve()
    return problem.problem.tangents


@pytest.mark.parametrize("way", [fall, small_gamma])
def test_other_ways_correct(way, monkeypatch, unlanded):
    corrected = way()
    monkeypatch.setattr(module, "has_own_factors", lambda ksp: False)
    assert corrected < way()


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_field_is_solved_by_newtons_method_alone(solver):
    """Corrections would end at a T of 1e64: norms are those of forces."""
    scene = blocks("quadrilateral")
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    T = fem.Function(compat.scalar_space(scene.mesh, 1))
    q, load = ufl.TestFunction(T.function_space), fem.Constant(scene.mesh, 0.0)
    source = ufl.exp(T) - ufl.exp(5.0 * load)
    heat = 0.1 * ufl.inner(ufl.grad(T), ufl.grad(q)) + source * q
    forms = [residual(scene, u, "neo-hookean", 2000.0)[0], heat * ufl.dx]
    pairs = [(scene.tags["slave"], scene.tags["master"])]
    contact = raymortar.Contact(u, scene.facet_tags, pairs)
    bcs = squeezed(u.function_space, scene)[:-1]
    down = fem.Constant(scene.mesh, 0.0)
    bcs.append(fix(u.function_space, scene, "top", 1, down))
    both = raymortar.NonlinearProblem(forms, contact, bcs, u=[u, T])

    def apply(t):
        load.value, down.value = t, -0.1 * t

    raymortar.LoadSteps(solver(both), apply, 1).run()
    assert worst(T.x.array - 5.0) <= 1e-9

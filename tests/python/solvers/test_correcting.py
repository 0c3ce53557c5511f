"""Iterates that are corrected again by the tangent that led to them."""

import numpy as np
import pytest
import ufl
from dolfinx import fem
from load_paths import blocks, top_moves
from problems import SOLVERS, fix, residual, tolerate, worst
from squeezing import squeezed

import raymortar
from raymortar.core import compat
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


def test_a_correction_that_is_no_number_is_taken_back(monkeypatch):
    problem, own = solved(SOLVERS[0])
    residual, calls = problem.problem.F, []

    def F(x, b):
        calls.append(problem.problem.tangents)
        if calls.count(calls[-1]) > 1:
            raise raymortar.ConvergenceError("no return mapping")
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

"""Coefficients that a user's function sets for each iterate, against forms alone."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from point_laws import pressed
from problems import COMM, SOLVERS, worst

from raymortar import (
    ContactError,
    ConvergenceError,
    Coulomb,
    LoadSteps,
    NonlinearProblem,
    Penalty,
    SNESSolver,
)
from raymortar.paths.soft_start import solve_by_small_gamma, with_line_search

pytestmark = [pytest.mark.mpi, pytest.mark.quick]


def both(**options):
    """The problem by points and in UFL, each with its law and its loads."""
    return pressed(COMM, True, **options), pressed(COMM, False, **options)


def solved(case, solve):
    problem, _, apply = case
    apply(0.5)
    return solve(problem)


WAYS = {
    "Newton": lambda p: SOLVERS[0](p).solve()[0],
    "SNES": lambda p: SNESSolver(p).solve()[0],
    "bt": lambda p: SNESSolver(p, {"snes_linesearch_type": "bt"}).solve()[0],
    "line search": lambda p: with_line_search(SNESSolver(p)).solve()[0],
    "small gamma": lambda p: solve_by_small_gamma(SNESSolver(p)),
    "problem": lambda p: p.solve() and 0,
}


@pytest.mark.parametrize("way", WAYS)
def test_every_solver_solves_as_with_a_form_alone(way):
    points, form = both()
    iterations = solved(points, WAYS[way])
    assert iterations == solved(form, WAYS[way])
    problem, law, _ = points
    assert worst(problem.u.x.array - form[0].u.x.array) <= 1e-11
    assert law.is_up_to_date()


@pytest.mark.parametrize("solver", SOLVERS)
def test_it_is_called_once_for_each_iterate(solver):
    """Once more for the stiffness, when the problem is made."""
    problem, law, apply = pressed(COMM, True)
    assert len(law.calls) == 1
    apply(0.5)
    iterations, _ = solver(problem).solve()
    assert len(law.calls) == 1 + iterations + 1
    for one, other in zip(law.calls[1:], law.calls[2:]):
        assert worst(one - other) > 0.0
    calls = len(law.calls)
    problem.reactions({"top": problem.bcs[1]})
    assert len(law.calls) == calls


def test_a_path_takes_it_along():
    """With friction and extrapolated states."""
    options = {"friction": Coulomb(0.3)}
    points, form = both(**options)
    found = []
    for problem, _, apply in (points, form):
        path = LoadSteps(SNESSolver(problem), apply, 2)
        iterations = [step.iterations for step in path]
        path = LoadSteps(
            SNESSolver(problem), apply, 3, path=(1.0, 1.3), extrapolate=True
        )
        iterations += [step.iterations for step in path]
        found.append(iterations)
    assert found[0] == found[1]
    assert worst(points[0].u.x.array - form[0].u.x.array) <= 1e-11


def test_viscous_forces_take_it_along():
    points, form = both(method=Penalty(1e4))
    for problem, _, apply in (points, form):
        LoadSteps(SNESSolver(problem), apply, 1, stabilize=True).run()
    assert worst(points[0].u.x.array - form[0].u.x.array) <= 1e-11
    assert points[1].is_up_to_date()


def test_what_it_changes_is_never_taken_for_linear():
    """The derivative of a form that is linear in u shows no coefficient that follows
    u."""
    problem, law, _ = pressed(COMM, True)
    F, J, update = law.forms()
    v = ufl.TestFunction(problem.u.function_space)
    F += 1e3 * ufl.inner(problem.u, v) * ufl.dx
    for J in (J, None):
        made = NonlinearProblem(F, problem.contact, problem.bcs, J, update=update)
        assert not made.volume.is_linear and made.volume.kept is None
    known = NonlinearProblem(F, problem.contact, problem.bcs)
    assert known.volume.is_linear


def test_a_change_between_solves_is_seen_at_the_same_displacement():
    problem, law, apply = pressed(COMM, True)
    solver = SNESSolver(problem)
    apply(0.5)
    solver.solve()
    first = problem.u.x.array.copy()
    law.stiffening *= 10.0
    assert solver.solve()[0] > 0
    assert worst(problem.u.x.array - first) > 1e-4
    assert law.is_up_to_date()
    # By hand, as DOLFINx's own solvers call a problem
    law.stiffening /= 10.0
    x, b = problem.create_vector(), problem.create_vector()
    problem.contact.to_vector(x)
    problem.F(x, b)
    assert law.is_up_to_date()
    assert problem.history[-1] > 1e-3


def test_reactions_after_going_back_are_of_that_state():
    problem, law, apply = pressed(COMM, True)
    solver, top = SNESSolver(problem), {"top": problem.bcs[1]}
    apply(0.5)
    solver.solve()
    state, force = problem.contact.state(), problem.reactions(top)["top"]
    apply(1.0)
    solver.solve()
    assert np.linalg.norm(problem.reactions(top)["top"] - force) > 1.0
    problem.contact.restore(state)
    np.testing.assert_allclose(problem.reactions(top)["top"], force, rtol=1e-12)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("kind", [ConvergenceError, ValueError, ZeroDivisionError])
def test_an_error_on_one_rank_is_raised_on_all(solver, kind):
    problem, law, apply = pressed(COMM, True)
    made = solver(problem)

    def fails():
        if COMM.rank == COMM.size - 1 and len(law.calls) > 2:
            raise kind("no root")

    law.fails = fails
    apply(0.5)
    raised = kind if COMM.size == 1 or kind is not ZeroDivisionError else RuntimeError
    with pytest.raises(raised, match="no root"):
        made.solve()
    law.fails = lambda: None
    made.solve()
    assert law.is_up_to_date()


def test_an_error_in_a_tangent_leaves_snes_as_it_was(monkeypatch):
    problem, _, apply = pressed(COMM, True)
    made, tangent, left = SNESSolver(problem), problem.J, [1]

    def fails(x, A):
        tangent(x, A)
        if left and left.pop():
            raise ConvergenceError("no stiffness")

    monkeypatch.setattr(problem, "J", fails)
    apply(0.5)
    with pytest.raises(ConvergenceError, match="no stiffness"):
        made.solve()
    made.x.set(0.0)  # PETSc refuses to write to vectors that a callback still reads
    assert made.solve()[1]


def test_a_step_is_halved_where_a_point_has_no_stress():
    problem, law, apply = pressed(COMM, True)
    before = [problem.u.x.array.copy()]

    def fails():
        if worst(problem.u.x.array - before[0]) > 0.06:
            raise ConvergenceError("too large a strain in one step")

    def accept():
        before[0] = problem.u.x.array.copy()

    law.fails = fails
    path = LoadSteps(SNESSolver(problem), apply, 1, on_accept=accept)
    steps = path.run()
    assert path.halvings == 1
    assert [step.factor for step in steps] == [0.5, 1.0]


def test_update_has_to_be_a_function():
    problem, law, _ = pressed(COMM, True)
    F, J, _ = law.forms()
    with pytest.raises(ContactError, match="update must be a function, not 3"):
        NonlinearProblem(F, problem.contact, problem.bcs, J, update=3)

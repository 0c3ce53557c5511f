"""`NonlinearProblem` as DOLFINx's own of 0.10 and later: solve, solver, A, b, x."""

from __future__ import annotations

import gc
import weakref

from petsc4py import PETSc

import numpy as np
import pytest
from interacting import LOWER, UPPER, difference, three
from pressed import GAMMA, Pressed, beside_another_unknown
from problems import worst

from raymortar import Coulomb, LoadSteps, NonlinearProblem, SNESSolver

pytestmark = pytest.mark.mpi


@pytest.mark.quick
def test_solve_gives_the_function_and_what_its_solver_gives():
    one, other = Pressed(), Pressed()
    assert one.problem.solve() is one.u is one.problem.u
    iterations, _ = SNESSolver(other.problem).solve()
    assert one.problem.solver.getIterationNumber() == iterations
    assert one.problem.solver.getConvergedReason() > 0
    assert difference(one.u, other.u) <= 1e-12
    assert difference(one.contact.multiplier, other.contact.multiplier) <= 1e-10


def test_objects_are_those_of_the_coupled_system():
    pressed = Pressed()
    problem, contact = pressed.problem, pressed.contact
    problem.solve()
    assert isinstance(problem.solver, PETSc.SNES)
    assert problem.A.handle == problem.solver.getJacobian()[0].handle
    assert problem.b.handle == problem.solver.getFunction()[0].handle
    x = problem.x.array.copy()
    assert len(x) == contact.layout.size
    # To a rounding: a multiplier is kept as gamma times its unknown, and divided again
    np.testing.assert_array_max_ulp(x, problem.start().array, maxulp=1)
    # What the unknowns hold: displacement, and multiplier over gamma
    n = contact.layout.n_u
    assert np.array_equal(x[:n], pressed.u.x.array[:n])
    assert worst(x[n:]) * GAMMA == pytest.approx(worst(contact.multiplier.x.array))
    assert problem.b.norm() <= 1e-6


def test_solves_go_on_from_the_last_one():
    pressed, at_once = Pressed(), Pressed()
    for share in (0.05, 0.1):
        pressed.press(share)
        pressed.problem.solve()
        pressed.contact.advance()
    at_once.problem.solve()
    assert difference(pressed.u, at_once.u) <= 1e-8


def test_several_contacts_and_several_solvers():
    # Friction holds the block in the middle sideways
    blocks = three()
    problem = NonlinearProblem(
        blocks.F,
        [blocks.contact(pair, friction=Coulomb(0.3)) for pair in (LOWER, UPPER)],
        blocks.bcs,
    )
    blocks.move(0.5)
    assert problem.solve() is blocks.u
    found = blocks.u.x.array.copy()
    SNESSolver(problem).solve()
    assert worst(blocks.u.x.array - found) <= 1e-9 * worst(found)


def test_several_unknowns_are_returned_as_a_list():
    pressed, problem = beside_another_unknown()
    (_, w), found = problem.u, problem.solve()
    assert found == problem.u and found[0] is pressed.u and found[1] is w
    assert worst(w.x.array) == pytest.approx(0.1, rel=0.05)


# Load steps, and life times


def test_load_steps_take_the_solver_of_the_problem():
    one, other = Pressed(), Pressed()
    steps = LoadSteps(one.problem.snes_solver, lambda t: one.press(0.2 * t), steps=3)
    others = LoadSteps(
        SNESSolver(other.problem), lambda t: other.press(0.2 * t), steps=3
    )
    found = [[(s.factor, s.iterations) for s in path.run()] for path in (steps, others)]
    assert found[0] == found[1]
    assert difference(one.u, other.u) <= 1e-12


def test_load_steps_keep_a_problem_that_nothing_else_keeps():
    pressed = Pressed()
    steps = LoadSteps(
        pressed.problem.snes_solver, lambda t: pressed.press(0.2 * t), steps=1
    )
    del pressed.problem
    assert [step.factor for step in steps.run()] == [1.0]


def test_a_problem_goes_with_its_last_name():
    """No cycle holds it and its matrix until Python looks for cycles."""
    pressed = Pressed()
    pressed.problem.solve()
    kept = weakref.ref(pressed.problem)
    gc.disable()
    try:
        del pressed.problem
        assert kept() is None
    finally:
        gc.enable()

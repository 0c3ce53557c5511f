"""Kept factors on paths whose load factor is led, whose tangents have a spring."""

import itertools

import numpy as np
import pytest
from clicking import clicking
from problems import COMM, SOLVERS, worst

from raymortar import (
    AugmentedLagrangian,
    Coulomb,
    LoadSteps,
    Penalty,
    SNESSolver,
    solvers,
)
from raymortar.paths import ArcLength, DisplacementControl
from raymortar.solvers.one_tangent import correct, linearise

alone = pytest.mark.skipif(COMM.size > 1, reason="factors are kept on one rank")

CONTROLS = {
    "displacement": lambda one: DisplacementControl(one.top, 0, by=0.36),
    "arc": lambda one: ArcLength(0.02),
}
METHODS = {
    "augmented": {"method": AugmentedLagrangian()},
    "friction": {"method": AugmentedLagrangian(), "friction": Coulomb(0.2)},
    "penalty": {"method": Penalty(1e3)},
}


def context(solver):
    return solver.krylov_solver.getPythonContext()


def path(one, control, options, solver=SNESSolver, steps=12):
    """Solver, load factors and unknowns after each of some steps."""
    found = solver(one.problem, options)
    if control == "arc":  # which measures from an equilibrium
        found.solve()
        one.problem.contact.advance()
    # All steps are easy: sizes do not depend on iterations
    led = LoadSteps(found, one.apply, steps, control=CONTROLS[control](one), easy=100)
    states = [
        (step.factor, one.problem.start().array.copy())
        for step in itertools.islice(led, steps)
    ]
    return found, *zip(*states)


def assert_same_path(one_of, control, solver=SNESSolver):
    """Both ways go the same path; gives what has solved by kept factors, and the load
    factors."""
    _, wanted, exact = path(one_of(), control, solvers.direct(), solver)
    kept, factors, states = path(one_of(), control, solvers.kept_factors(), solver)
    assert factors == pytest.approx(wanted, abs=1e-10 * max(map(abs, wanted)))
    size = max(worst(state) for state in exact)
    for state, other in zip(states, exact):
        assert worst(state - other) <= 1e-10 * size
    return context(kept), np.array(factors)


def passes_a_limit_point(factors):
    """Whether the load factor rises and falls."""
    top = np.argmax(factors)
    return top > 0 and min(factors[top:]) < 0.5 * factors[top]


@pytest.mark.mpi(where=lambda control, **_: control == "displacement")
@pytest.mark.parametrize(
    "control, kind",
    [*(("displacement", kind) for kind in METHODS), ("arc", "augmented")],
)
def test_the_path_is_that_of_the_direct_solver(control, kind):
    found, factors = assert_same_path(lambda: clicking(**METHODS[kind]), control)
    assert passes_a_limit_point(factors)
    # The spring at what leads is no entry of contact: the direct solver takes over
    assert found.exceptions > 0 and found.factorisations == (COMM.size == 1)


@alone
@pytest.mark.parametrize("solver", SOLVERS)
def test_either_solver_and_in_3d(solver):
    found, factors = assert_same_path(
        lambda: clicking("hexahedron", (10, 8)), "displacement", solver
    )
    assert passes_a_limit_point(factors)
    assert found.exceptions > 0


@alone
def test_many_springs_get_the_direct_solver():
    problem = clicking().problem
    solver = SNESSolver(problem, solvers.kept_factors())
    x, b = problem.start(), problem.create_vector()
    problem.F(x, b)
    free = np.flatnonzero(~problem.constrained)
    linearise(solver, x, {int(k): 1.0 for k in free})
    dx = b.duplicate()
    with solver.options:
        correct(solver, b, dx)
    assert (context(solver).systems, context(solver).exceptions) == (0, 1)

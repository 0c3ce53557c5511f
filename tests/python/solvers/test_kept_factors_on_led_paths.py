"""Kept factors on paths whose load factor is led, whose tangents have a spring."""

import itertools

import numpy as np
import pytest
from clicking import clicking
from problems import COMM, SOLVERS, build, fix, stack, worst

from raymortar import (
    ArcLength,
    AugmentedLagrangian,
    Coulomb,
    DisplacementControl,
    LoadSteps,
    Penalty,
    SNESSolver,
    solvers,
)

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
    # On several ranks the direct solver has them all
    assert (found.systems == 0) == (COMM.size > 1)
    assert (found.exceptions == 0) == (COMM.size == 1)
    assert found.factorisations == (COMM.size == 1)


@alone
@pytest.mark.parametrize("solver", SOLVERS)
def test_either_solver_and_in_3d(solver):
    found, factors = assert_same_path(
        lambda: clicking("hexahedron", (10, 8)), "displacement", solver
    )
    assert passes_a_limit_point(factors)
    assert found.exceptions == 0


@alone
@pytest.mark.parametrize("solver", SOLVERS)
def test_springs_off_the_surfaces_are_followed(solver):
    """At one place, at another, at both, at none."""
    problem = build(
        stack("quadrilateral", (2, 3)),
        bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", value=-0.02)],
    ).problem
    one = solver(problem, solvers.kept_factors())
    x, b = problem.start(), problem.create_vector()
    problem.F(x, b)
    free = np.flatnonzero(~problem.constrained)
    near = np.concatenate(
        [zone.facets.slave_surface.dofs for zone in problem.contact.zones]
    )
    V = problem.u.function_space
    inside = [
        k for k in free if not 0.9 < V.tabulate_dof_coordinates()[k // 2, 1] < 1.1
    ]
    first, second = int(inside[0]), int(inside[-1])
    assert first // 2 not in near and second // 2 not in near
    for springs in ({first: 1e3}, {second: 1e5}, {first: 10.0, second: 1e4}, {}):
        one.linearise(x, springs)
        found = []
        for options in (solvers.direct(), solvers.kept_factors()):
            other = one if options["ksp_type"] == "python" else solver(problem, options)
            other.linearise(x, springs)
            dx = b.duplicate()
            with other.options:
                other.correct(b, dx)
            found.append(dx.array.copy())
        assert worst(found[1] - found[0]) <= 1e-12 * worst(found[0])
    assert (context(one).systems, context(one).exceptions) == (4, 0)


@alone
def test_many_springs_get_the_direct_solver():
    problem = clicking().problem
    solver = SNESSolver(problem, solvers.kept_factors())
    x, b = problem.start(), problem.create_vector()
    problem.F(x, b)
    free = np.flatnonzero(~problem.constrained)
    solver.linearise(x, {int(k): 1.0 for k in free})
    dx = b.duplicate()
    with solver.options:
        solver.correct(b, dx)
    assert (context(solver).systems, context(solver).exceptions) == (0, 1)

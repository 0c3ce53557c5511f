"""Tolerances of Newton's linear systems: no Newton iteration more, less to solve."""

import numpy as np
import pytest
from dolfinx import fem
from problems import COMM, build, fix, stack

from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    Coulomb,
    LoadSteps,
    Penalty,
    SNESSolver,
    solvers,
)
from raymortar.solvers.automatic import INEXACT
from raymortar.solvers.snes import SHARE, Forcing


def test_the_first_system_has_the_largest_tolerance():
    forcing = Forcing(1e-3, 1e-8)
    assert forcing.tolerance(0, 1e8) == 1e-3
    # Of the next solve too, whatever the last one ended with
    assert forcing.tolerance(1, 1e5) < 1e-3
    assert forcing.tolerance(0, 1e8) == 1e-3


def test_a_tenth_of_what_newton_leaves():
    forcing = Forcing(1e-3, 1e-12)
    forcing.tolerance(0, 1e12)
    assert forcing.tolerance(1, 5e11) == 1e-3  # not more than that of the first
    assert forcing.tolerance(2, 5e8) == pytest.approx(SHARE * 1e-6)


def test_no_more_than_ends_the_solve():
    forcing = Forcing(1e-3, 1e-12)
    forcing.tolerance(0, 1e8)
    # Newton's method would leave 1e-8 of it; 1e-4 is enough
    assert forcing.tolerance(1, 1e4) == pytest.approx(SHARE * 1e-4)
    # And never more than the linear solver is asked for
    forcing = Forcing(1e-3, 1e-8)
    forcing.tolerance(0, 1e16)
    assert forcing.tolerance(1, 1e11) == 1e-8


@pytest.mark.parametrize("excess", [2e8, np.nan, np.inf, 0.0])
def test_residuals_that_do_not_fall_say_nothing(excess):
    forcing = Forcing(1e-3, 1e-8)
    forcing.tolerance(0, 1e8)
    assert forcing.tolerance(1, excess) == 1e-3


@pytest.mark.mpi
@pytest.mark.parametrize("atol", [None, 1e-9])
def test_excess_is_below_1_where_a_solve_ends(atol):
    problem = build(stack("hexahedron", (2, 3)), bcs=pressed).problem
    problem.F(problem.start(), problem.create_vector())
    rtol = 1e-9
    assert problem.convergence.excess(rtol, None) == pytest.approx(1.0 / rtol)
    given = {"snes_rtol": rtol} | ({} if atol is None else {"snes_atol": atol})
    SNESSolver(problem, given).solve()
    assert 0.0 < problem.convergence.excess(rtol, atol) <= 1.0
    # With both the forces' and the displacements' tolerance reached by wide margins
    assert problem.convergence.excess(1e-3 * rtol, atol) < 1e3


def pressed(V, scene):
    return [fix(V, scene, "bottom"), fix(V, scene, "top", value=(0.0, 0.0, -0.05))]


def path_of(method, options):
    """Newton and Krylov iterations of a block that is pressed on another, and dragged
    until it slips."""
    scene = two_blocks(
        COMM,
        3,
        "tetrahedron",
        lower_divisions=(3, 3, 2),
        upper_divisions=(2, 2, 2),
        lower_size=(1.0, 1.0, 0.5),
        upper_size=(0.8, 0.8, 0.5),
    )
    top = fem.Constant(scene.mesh, np.zeros(3))
    problem = build(
        scene,
        2,
        "neo-hookean",
        bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", value=top)],
        E=10.0,
        method=method(),
        friction=Coulomb(0.3),
    ).problem
    solver, krylov = SNESSolver(problem, options), []
    solver.snes.setMonitor(
        lambda snes, i, norm: krylov.append(snes.ksp.getIterationNumber() if i else 0)
    )

    def press(factor):
        top.value[:] = 0.0, 0.0, -0.02 * factor

    def drag(factor):
        top.value[:] = 0.02 * factor, 0.0, -0.02

    steps = LoadSteps(solver, press, 1).run() + LoadSteps(solver, drag, 1).run()
    return sum(step.iterations for step in steps), sum(krylov)


@pytest.mark.mpi
@pytest.mark.parametrize("method", [AugmentedLagrangian, Penalty])
def test_paths_take_the_newton_iterations_of_exact_systems(method):
    newton, exact = path_of(method, solvers.with_fallback())
    same, inexact = path_of(method, {**solvers.with_fallback(), **INEXACT})
    assert same <= newton
    assert inexact < 0.7 * exact

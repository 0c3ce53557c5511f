"""Tolerances of Newton's linear systems: no Newton iteration more, less to solve."""

import numpy as np
import pytest
from dolfinx import fem
from problems import COMM, build, fix

from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    Coulomb,
    LoadSteps,
    Penalty,
    SNESSolver,
    solvers,
)
from raymortar.solvers.automatic import inexact


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
    options = {**solvers.with_fallback(), **inexact()}
    same, fewer = path_of(method, options)
    assert same <= newton
    assert fewer < 0.7 * exact

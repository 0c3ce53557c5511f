"""Blocks of the large compression A3 whose top moves in load steps."""

from __future__ import annotations

import numpy as np
from dolfinx import fem

from petsc4py import PETSc
from problems import COMM, DIMENSION, SOLVERS, build, fix, homogeneous, squeezed, worst

from raymortar import LoadSteps
from raymortar.scenes import two_blocks


def divisions(cell):
    """Cells per direction of the lower and of the upper block."""
    return (5, 4) if DIMENSION[cell] == 2 else (3, 2)


def blocks(cell, **options):
    """Two blocks."""
    return two_blocks(COMM, DIMENSION[cell], cell, *divisions(cell), **options)


def top_moves(cell, solver=SOLVERS[0], steps=4, share=0.2, **options):
    """LoadSteps over A3 with a top that may be moved."""
    dim = DIMENSION[cell]
    scene = blocks(cell)
    down = fem.Constant(scene.mesh, PETSc.ScalarType(0.0))

    def conditions(V, scene):
        fixed = squeezed(V, scene)[:-1]
        return [*fixed, fix(V, scene, "top", dim - 1, down)]

    problem = build(scene, material="neo-hookean", bcs=conditions)
    problem.solver = solver(problem.problem)

    def apply(t):
        down.value = -share * 2.0 * t

    return problem, LoadSteps(problem.solver, apply, steps, **options)


def exact(problem):
    F = homogeneous(problem.dim)
    return worst(problem.gradient() + np.eye(problem.dim) - F) <= 1e-8

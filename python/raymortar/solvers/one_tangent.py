"""Systems that are solved with one tangent, whose solutions a path combines."""

from __future__ import annotations

from collections.abc import Mapping

from petsc4py import PETSc

from ..core.solvers.petsc_objects import raising, take_tangent
from ..core.solvers.solver import CoupledSolver

# Relative tolerance of such systems
CLOSE = 1e-8


def linearise(
    solver: CoupledSolver, x: PETSc.Vec, springs: Mapping[int, float]
) -> None:
    """Take the tangent at x, and springs by row of this rank, for `correct`.
    Collective."""
    A = solver.A
    take_tangent(solver.problem, x, A, solver.krylov_solver)
    for row, stiffness in springs.items():
        A.setValue(row, row, stiffness, addv=PETSc.InsertMode.ADD_VALUES)
    A.assemble()
    if solver.scale is not None:
        solver.weigh_rows()
        A.diagonalScale(solver.scale)
    solver.krylov_solver.setOperators(A)


def correct(solver: CoupledSolver, b: PETSc.Vec, dx: PETSc.Vec) -> None:
    """Solve tangent dx = b to `CLOSE`, within ``with solver.options:``. Collective."""
    ksp, right = solver.krylov_solver, b.copy()
    if solver.scale is not None:
        right.pointwiseMult(b, solver.scale)
    before = ksp.getTolerances()[0]
    ksp.setTolerances(rtol=min(before, CLOSE))
    with raising(solver.raised):
        ksp.solve(right, dx)
    ksp.setTolerances(rtol=before)
    right.destroy()

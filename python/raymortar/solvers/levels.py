"""Multigrid whose levels are those of the bodies without contact."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from petsc4py import PETSc

import numpy as np
from dolfinx.fem.petsc import assemble_matrix

from .. import compat
from ..compat import Mask
from .interpolation import LinearInterpolation
from .petsc_options import PetscOptions
from .rigid_motions import nullspace_of

if TYPE_CHECKING:
    from ..problem import CoupledProblem

# Degree of the polynomial that takes, on several ranks, as many iterations as SOR
CHEBYSHEV_STEPS = 3


class BodiesLevels:
    """Interpolations between levels, finest first, and products with them. Collective.

    Aggregates of a tangent with contact would reach across the interface, and an
    aggregate cannot slide on itself. So aggregates are made from the volume's tangent
    alone, in degree 1, and serve any contact. Between a higher degree and degree 1
    there is interpolation.

    Parameters
    ----------
    problem
        Gives its form at the present displacement, and its conditions.
    prefix
        Prefix of the options of PETSc's GAMG, which makes the aggregates.

    Attributes
    ----------
    fixed
        Dofs that were prescribed, (n,), of this rank.
    interpolations
        From each level to the next finer one.
    """

    def __init__(self, problem: CoupledProblem, prefix: str) -> None:
        V, self.fixed = problem.contact.u.function_space, problem.constrained
        K = assemble_matrix(problem.a, bcs=problem.bcs)
        K.assemble()
        self._step: LinearInterpolation | None = None
        fixed = self.fixed
        if compat.element_info(V).degree > 1:
            self._step = LinearInterpolation(V, fixed)
            finest, K = K, self._step.product(K)
            finest.destroy()
            V, fixed = self._step.W, self._step.fixed
        name = "pc_gamg_aggressive_coarsening"
        # Above degree 1, levels of that degree are small already: finer ones pay
        with PetscOptions(prefix, {name: int(self._step is None)}):
            self._aggregated = _aggregate(K, V, fixed, prefix)
        K.destroy()

    @property
    def interpolations(self) -> list[PETSc.Mat]:
        """From each level to the next finer one, finest first."""
        first = [] if self._step is None else [self._step.matrix]
        return first + self._aggregated

    def operators(self, S: PETSc.Mat) -> list[PETSc.Mat]:
        """S and its products with the interpolations, finest first. Collective."""
        found = [S]
        for P in self.interpolations:
            if len(found) == 1 and self._step is not None:
                found.append(self._step.product(S))
            else:
                found.append(_product(found[-1], P))
        return found

    def destroy(self) -> None:
        """Free the matrices. Collective."""
        for P in self.interpolations:
            P.destroy()


def _aggregate(K: PETSc.Mat, V: Any, fixed: Mask, prefix: str) -> list[PETSc.Mat]:
    """Interpolations of smoothed aggregation, finest first. Collective."""
    near = nullspace_of(V, fixed)
    K.setNearNullSpace(near)
    ksp = PETSc.KSP().create(K.comm)
    ksp.setOptionsPrefix(prefix)
    ksp.setOperators(K)
    ksp.getPC().setType("gamg")
    ksp.setFromOptions()
    ksp.setUp()
    pc = ksp.getPC()
    found = [pc.getMGInterpolation(k) for k in range(pc.getMGLevels() - 1, 0, -1)]
    ksp.destroy()
    near.destroy()
    return found


def _product(S: PETSc.Mat, P: PETSc.Mat) -> PETSc.Mat:
    """P^T S P, with a diagonal where it is zero: aggregates of few dofs cannot have all
    rigid motions."""
    T = S.PtAP(P)
    diagonal = T.getDiagonal()
    size = diagonal.norm(PETSc.NormType.NORM_INFINITY)
    empty = diagonal.array_r == 0.0
    if T.comm.tompi4py().allreduce(int(np.count_nonzero(empty))):
        diagonal.array[empty] = size
        T.setDiagonal(diagonal)
    diagonal.destroy()
    return T


def set_levels(
    ksp: PETSc.KSP, levels: BodiesLevels, S: PETSc.Mat, stiff: bool = False
) -> list[PETSc.Mat]:
    """Make the preconditioner of S multigrid on these levels, before its options are
    read. Collective.

    Parameters
    ----------
    ksp
        Solver of S.
    levels
        The levels.
    S
        Matrix of the finest level.
    stiff
        Whether S has springs much stiffer than the surfaces that they join. On each
        coarser level they are stiffer still, relative to what one node of it has: one
        visit does not reduce the error there, but a W-cycle's two do (measured:
        docs/parallel.md).

    Returns
    -------
    Operators of the coarser levels, to be freed after use.
    """
    operators = levels.operators(S)
    n = len(operators)
    pc = ksp.getPC()
    pc.setType("mg")
    pc.setMGLevels(n)
    if stiff:
        pc.setMGCycleType(PETSc.PC.MGCycleType.W)
    for k, P in enumerate(levels.interpolations):
        pc.setMGInterpolation(n - 1 - k, P)
    for k, A in enumerate(operators[:-1]):
        smoother = pc.getMGSmoother(n - 1 - k)
        smoother.setOperators(A)
        _relax(smoother)
    pc.getMGCoarseSolve().setOperators(operators[-1])
    return operators[1:]


def _relax(smoother: PETSc.KSP) -> None:
    """Choose the relaxation of a level: SOR on one rank. Across ranks PETSc's SOR is
    Jacobi's, and diverges on thin parts; Chebyshev's polynomial of the nodes' blocks
    does not depend on the ranks, and costs a tenth more (measured: docs/parallel.md).
    """
    alone = smoother.comm.size == 1
    smoother.setType("richardson" if alone else "chebyshev")
    smoother.setTolerances(max_it=1 if alone else CHEBYSHEV_STEPS)
    smoother.getPC().setType("sor" if alone else "pbjacobi")

"""GMRES with the factors of an earlier tangent."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from ..core.compat import Array
from ..core.discretization.ranks import destroy
from ..core.errors import ContactError, is_whole_number
from .inner import InnerSolvers, inner_solver, is_symmetric, kept_inside, nested
from .linear import SYMMETRIC_OR_NOT

# Iterations of GMRES that take the time of a factorisation, about, at the sizes that
# have lagged factors by default (docs/measured/solving.md)
A_FACTORISATION = 32

# Tolerance of a system, with which Newton's method takes no more iterations
RTOL = 1e-8

# Ratio of diagonals beyond which a row has another stiffness, and the share of such rows
# above which factors are of no use: a small preconditioned residual then says little
OTHER, MOST_OTHERS = 10.0, 0.5

# Most systems that are factorised, after failures of GMRES in a row, before it is tried
# again
MOST_WAIT = 16


def lagged_factors(package: str = "mumps", **options: Any) -> dict[str, Any]:
    """PETSc options of GMRES whose preconditioner is an earlier tangent's factors.

    Parameters
    ----------
    package
        Direct solver that factorises: ``"mumps"``, or another one of PETSc.
    options
        Options to add or to replace, such as ``ksp_rtol=1e-8``.

    Returns
    -------
    Options for `NewtonSolver` or `SNESSolver`. The prefixes of GMRES
    and of the factors add ``lagged_`` and ``direct_`` to that of the solver.
    ``lagged_most``, a whole number, limits the sum of iterations, after which the
    tangent is factorised again.

    Raises
    ------
    ContactError
        If the package is no name, or ``lagged_most`` no whole number from 0 on.
    """
    if not isinstance(package, str):
        raise ContactError(f"package must be the name of a solver, not {package!r}")
    most = options.get("lagged_most", A_FACTORISATION)
    if not (is_whole_number(most) and most >= 0):
        raise ContactError(f"lagged_most = {most!r} must be a whole number from 0 on")
    direct = SYMMETRIC_OR_NOT | {"pc_factor_mat_solver_type": package}
    gmres = {"ksp_type": "gmres", "ksp_gmres_restart": 100}
    inner = nested(LaggedFactorsSolver, lagged=gmres, direct=direct)
    return inner | {"ksp_rtol": RTOL, "lagged_most": A_FACTORISATION} | options


class LaggedFactorsSolver(InnerSolvers):
    """Solves with the factors of an earlier tangent while this is quicker than to
    factorise. A PETSc python KSP.

    From one iterate to the next the tangent changes little but for points that close,
    open or slip, and GMRES needs about as many iterations as there are of these. The
    tangent is factorised again, and the system solved with these factors, where GMRES
    does not converge, where all iterations with the same factors have taken as long as a
    factorisation, where the tangent before was used for several systems, and where most
    rows have another stiffness, as after a change of the material's constants. A second
    system of a tangent that was factorised needs no GMRES.

    Attributes
    ----------
    systems, factorisations
        How many systems were solved, and how many of these tangents were factorised.
    krylov, direct
        GMRES, and what factorises. Both have the same preconditioner.
    """

    def __init__(self) -> None:
        super().__init__()
        self.systems = self.factorisations = 0
        # Iterations with the present factors, and how many there may be
        self._taken = self._most = 0
        self._has_factors = self._has_new_pattern = False
        # Whether all tangents so far were symmetric, and the user has given no type
        self._symmetric = True
        # The last tangent, how many systems it was used for, and the one whose factors
        # there are
        self._tangent, self._uses, self._factorised = (0, 0), 0, (0, 0)
        # Diagonal of the tangent that was factorised, on this rank
        self._diagonal = np.zeros(0)
        # Systems to factorise before GMRES is tried again, and how often it has failed
        # in a row
        self._wait = self._failures = 0

    @kept_inside
    def solve(self, ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """Solve A x = b. Collective."""
        if self.direct is None:
            self._make(ksp)
        self.systems += 1
        solver = self.krylov
        worth = self._is_worth_factors(ksp)
        if self._tangent == self._factorised:
            solver = self.direct
            solver.getPC().setReusePreconditioner(True)
            self._solve_by(solver, ksp, b, x)
        elif worth or not self._lagged(ksp, b, x):
            solver = self.direct
            self._factorise(ksp, b, x)
        # Monitors are the outer solver's. Direct solvers have no history
        norms = solver.getConvergenceHistory()
        for iteration, norm in enumerate(norms if len(norms) else [b.norm()]):
            ksp.monitor(iteration, norm)

    def _is_worth_factors(self, ksp: PETSc.KSP) -> bool:
        """Whether most rows of a new tangent are stiffer or softer than in the factors,
        or the one before was used for several systems, as on paths whose load factor is
        led. Collective."""
        A, _ = ksp.getOperators()
        before, self._tangent = self._tangent, (A.handle, A.stateGet())
        if self._tangent == before:
            self._uses += 1
            return False
        several, self._uses = self._uses > 1, 1
        if several or not self.factorisations:
            return several
        a, b = _diagonal(A), self._diagonal
        others = (a > OTHER * b) | (b > OTHER * a)
        counts = np.array([np.count_nonzero(others), len(others)])
        A.comm.tompi4py().Allreduce(MPI.IN_PLACE, counts)
        return bool(counts[0] > MOST_OTHERS * counts[1])

    def may_try(self) -> bool:
        """Whether to try the factors that there are. Each call counts as a system."""
        if not self._has_factors or self._taken >= self._most:
            return False
        self._wait -= 1
        return self._wait < 0

    def learn(self, converged: bool) -> None:
        """Note whether GMRES has converged. A single failure comes from a new active
        set. After more in a row, some systems are factorised before it is tried
        again."""
        self._failures = 0 if converged else self._failures + 1
        self._wait = min(2**self._failures // 4, MOST_WAIT)

    def _lagged(self, ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec) -> bool:
        """Solve with the factors that there are; whether this was possible."""
        if not self.may_try():
            return False
        self.direct.getPC().setReusePreconditioner(True)
        converged = self._solve_by(self.krylov, ksp, b, x)
        self._taken += self.krylov.getIterationNumber()
        self.learn(converged)
        return converged

    def _factorise(self, ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """Factorise the tangent and solve with it."""
        if self._has_new_pattern:
            self.direct.reset()
            self._has_new_pattern = False
        self.direct.getPC().setReusePreconditioner(False)
        self._use_symmetry(ksp.getOperators()[0])
        self._has_factors = self._solve_by(self.direct, ksp, b, x)
        self._factorised = self._tangent if self._has_factors else (0, 0)
        self.factorisations += 1
        self._diagonal, self._taken = _diagonal(ksp.getOperators()[0]), 0

    def factors(self, ksp: PETSc.KSP) -> PETSc.Mat:
        """Factors of the last tangent, which is factorised if it was not. Collective."""
        if self._tangent != self._factorised:
            A, _ = ksp.getOperators()
            b, x = A.createVecs()
            b.set(0.0)
            self._factorise(ksp, b, x)
            destroy(b, x)
        return self.direct.getPC().getFactorMatrix()

    def _use_symmetry(self, A: PETSc.Mat) -> None:
        """Factorise by L D L^T, in half of the operations, as long as all tangents are
        symmetric: those of ties, and of flat rigid tools without friction. Collective.
        """
        pc = self.direct.getPC()
        if not self._symmetric or pc.getFactorSolverType() != "mumps":
            return
        self._symmetric = is_symmetric(A)
        kind = "cholesky" if self._symmetric else "lu"
        if pc.getType() != kind:
            pc.setType(kind)
            pc.setFromOptions()

    def _make(self, ksp: PETSc.KSP) -> None:
        """Make the inner solvers. Collective."""
        table = PETSc.Options(ksp.getOptionsPrefix() or "")
        self._most = table.getInt("lagged_most", A_FACTORISATION)
        self._symmetric = not table.hasName("direct_pc_type")
        self.direct = inner_solver(ksp, "direct_")
        if self._symmetric:
            self.direct.getPC().setType("lu")
        self.direct.setFromOptions()
        self.krylov = inner_solver(ksp, "lagged_")
        self.krylov.setPC(self.direct.getPC())
        self.krylov.setFromOptions()
        self.krylov.setTolerances(max_it=self._most)
        self.krylov.setConvergenceHistory(reset=True)

    def reset(self, ksp: PETSc.KSP) -> None:
        """Make the next factors from scratch, as the next tangent may have another
        pattern. The present ones still serve GMRES. Collective."""
        self._has_new_pattern = True


def _diagonal(A: PETSc.Mat) -> Array:
    """Sizes of the diagonal's entries on this rank."""
    diagonal = A.getDiagonal()
    sizes = np.abs(diagonal.array)
    diagonal.destroy()
    return sizes

"""A direct solver that keeps the factors of linear bodies."""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

import numpy as np
from scipy import sparse

from ..core.discretization.joined import unrolled
from ..core.discretization.ranks import destroy
from ..core.solvers.petsc_objects import DIRECT
from .compliance import Compliance, Coupling, SurfaceSystem, supports
from .inner import InnerSolvers, kept_inside, nested
from .levels import sides
from .linear import SYMMETRIC_OR_NOT

# Largest residual of a system over its right-hand side, unless the residual is rounding
# error of the solution; and the largest number of solves, each for the residual left
EXACT, MOST_SOLVES = 1e-12, 3
EPS = float(np.finfo(float).eps)

# A stiffness that lasts for fewer systems than this is not worth its factors. Where
# one has not lasted, the next one is factorised only once it has
LASTING = 4

# After so many systems that were not solved exactly, a stiffness is given up
MOST_INEXACT = 2

# Operations of a factorisation that take the time of one number in the factors, in a
# solve and for a column, and that of one number in a product with columns (measured)
SOLVE, COLUMN, PRODUCT = 45.0, 2.0, 8.0
# Iterations of GMRES on the surfaces
ITERATIONS = 12

# Factorisations of the tangent that all columns may cost at first, those that they may
# cost more after each system, and most bytes of them
FIRST, MORE, MOST_BYTES = 2.0, 0.5, 2e9


def kept_factors(most: float | None = None) -> dict[str, Any]:
    """PETSc options of a direct solver that keeps the factors of linear bodies.

    It solves what it can solve on one rank where the volume's tangent is kept
    (``problem.is_linear``). MUMPS solves the other systems.

    Parameters
    ----------
    most
        Share of the operations of MUMPS up to which kept factors are used. None: any.

    Returns
    -------
    Options for `NewtonSolver` or `SNESSolver`. The prefixes of the factors of the
    bodies and of the tangents add ``kept_`` and ``direct_`` to that of the solver.
    """
    # The kind of factors follows the symmetry of the stiffness; right-hand sides at once
    kept = SYMMETRIC_OR_NOT | {"mat_mumps_icntl_27": 128}
    given = {} if most is None else {"kept_most": most}
    return nested(KeptFactorsSolver, kept=kept, direct=DIRECT) | given


class KeptFactorsSolver(InnerSolvers):
    """Solves with factors of the bodies' stiffness. A PETSc python KSP.

    See `SurfaceSystem`. A direct solver takes over where the forms are not linear, on
    several ranks, where the stiffness changes too often, and where contact touches so
    much that kept factors do not pay.

    Attributes
    ----------
    systems, exceptions
        How many systems were solved with kept factors, and how many otherwise. On paths
        whose load factor is led tangents have a spring: where it is off the surfaces of
        contact the direct solver takes over.
    factorisations
        How often the stiffness was factorised.
    direct
        Solver of the exceptions, from the first one on.
    """

    def __init__(self) -> None:
        super().__init__()
        self.systems = self.exceptions = self.factorisations = 0
        # The last tangent's system, None: not solved so; and the state of its matrix
        self._system: Any = None
        self._of: Any = None
        self._size = 0.0
        # From `_factorise` on: factors
        self._compliance: Any = None
        self._volume: Any = None
        # Systems of this stiffness, those before it is factorised, those not solved
        self._revision = self._age = self._patience = self._inexact = 0

    @kept_inside
    def solve(self, ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """Solve A x = b. Collective."""
        A, _ = ksp.getOperators()
        if self._of != (A.handle, A.stateGet()):
            self._take(ksp, A)
        if self._system is not None and self._is_solved(A, b, x):
            self.systems += 1
            ksp.setConvergedReason(PETSc.KSP.ConvergedReason.CONVERGED_ITS)
            ksp.setIterationNumber(1)
            return
        self.exceptions += 1
        self._solve_directly(ksp, b, x)

    def _take(self, ksp: PETSc.KSP, A: PETSc.Mat) -> None:
        """Take a new tangent: its system is None where kept factors do not solve it."""
        self._system, self._of = None, (A.handle, A.stateGet())
        if not self._may_keep(ksp):
            return
        prefix = ksp.getOptionsPrefix() or ""
        if not self._compliance:
            self._factorise(f"{prefix}kept_")
        if not self._compliance.usable:
            return
        coupling = self._coupling(A)
        if self._pays(coupling, PETSc.Options(prefix).getReal("kept_most", np.inf)):
            self._system = SurfaceSystem(coupling, self._compliance)
            self._size = A.norm(PETSc.NormType.INFINITY)

    def _may_keep(self, ksp: PETSc.KSP) -> bool:
        """Whether there is a stiffness that is kept and lasts."""
        if not self.problem.is_linear or ksp.comm.size > 1:
            return False
        kept = self.problem.kept
        if kept is not self._volume or kept.revision != self._revision:
            lasted = self._volume is None or self._age >= LASTING
            self._patience = 0 if lasted else LASTING
            self._volume, self._revision = kept, kept.revision
            self._age = self._inexact = 0
            self._destroy("_compliance", "_near")
        self._age += 1
        return self._age > self._patience and self._inexact < MOST_INEXACT

    def _is_solved(self, A: PETSc.Mat, b: PETSc.Vec, x: PETSc.Vec) -> bool:
        """Solve with iterative refinement; give the tangent up if that is not exact."""
        n, rest, product = self.contact.layout.n, b.copy(), b.duplicate()
        scale = 1.0 if self.row_scale is None else self.row_scale.array_r
        x.set(0.0)
        for _ in range(MOST_SOLVES):
            right = rest.array_r / scale
            x.array[:] += np.concatenate(self._system.solve(right[:n], right[n:]))
            A.mult(x, product)
            rest.waxpy(-1.0, product, b)
            # At limit points the solution is large, and so is its rounding error
            left, rounding = rest.norm(), EPS * self._size * x.norm()
            if not left > rounding:
                break
        exact = bool(left <= max(EXACT * b.norm(), rounding))
        destroy(rest, product)
        if not exact:
            self._inexact += 1
            self._system = None
        return exact

    def _factorise(self, prefix: str) -> None:
        """Factorise the bodies' stiffness, with springs where they are loose."""
        contact, layout = self.contact, self.contact.layout
        nodes = np.unique(np.concatenate([side.dofs for side in sides(contact)]))
        dofs = unrolled(nodes, contact.u.function_space.dofmap.index_map_bs)
        springs = supports(contact, nodes, self.problem.constrained)
        if self.direct is not None:
            self.direct.reset()  # its factors are larger
        unknowns = PETSc.IS().createStride(layout.n, 0, 1, comm=PETSc.COMM_SELF)
        K = self._tangent.createSubMatrix(unknowns, unknowns)
        if K.handle == self._tangent.handle:
            # Of all rows PETSc hands out the matrix itself, which must not get springs
            K.destroy()
            K = self._tangent.copy()
        unknowns.destroy()
        rows = layout.u_rows.ravel()[dofs]
        self._compliance = Compliance(K, rows, np.searchsorted(dofs, springs), prefix)
        near = np.concatenate([rows, np.arange(layout.n, layout.size)])
        near = near.astype(PETSc.IntType)
        # Rows that the tangent may add entries to, and their stiffness
        self._near = PETSc.IS().createGeneral(near, comm=PETSc.COMM_SELF)
        self._stiffness = self._near_part(self._tangent)
        self.factorisations += 1

    @property
    def _tangent(self) -> PETSc.Mat:
        """The tangent of the bodies without contact."""
        return self.problem.kept.tangent

    def _near_part(self, A: PETSc.Mat) -> Any:
        """Take the entries of a matrix that the tangent may add to, as a SciPy matrix."""
        part = A.createSubMatrix(self._near, self._near)
        offsets, columns, values = part.getValuesCSR()
        part.destroy()
        return sparse.csr_matrix((values, columns, offsets), 2 * (len(offsets) - 1,))

    def _coupling(self, A: PETSc.Mat) -> Coupling:
        """Find what contact adds to the stiffness."""
        layout, scale = self.contact.layout, 1.0
        if self.row_scale is not None:
            scale = self.row_scale.array_r[self._near.getIndices()][:, None]
        # Of entries that nothing is added to the difference is exactly zero
        stiffness = self._stiffness.multiply(scale)
        added = (self._near_part(A) - stiffness).multiply(1.0 / scale).tocsr()
        last = sum(len(body.freedom) for body in layout.own_bodies)
        return Coupling(added, self._compliance.size, last)

    def _pays(self, coupling: Coupling, most: float) -> bool:
        """Whether a system takes at most a share of the operations of MUMPS, whether
        columns cost no more than earlier systems may have saved, and whether they
        fit."""
        one = self._compliance
        springs = len(one.springs[0])
        v = len(coupling.touched) + springs
        y = len(coupling.coupled) + springs
        iterations = ITERATIONS if len(coupling.coupled) else 0
        size = y if iterations else v + y
        each = (
            2 * size**3 / 3 + PRODUCT * iterations * v**2 + 3 * SOLVE * one.entries
        )
        columns = COLUMN * one.entries * (one.missing(coupling.touched) + one.known)
        budget = (FIRST + MORE * self._age) * most * one.flops
        fits = 8 * v * one.size <= MOST_BYTES
        return bool(fits and each <= most * one.flops and columns <= budget)

    def _forget(self) -> None:
        """Forget tangent and factors."""
        self._system = self._of = self._stiffness = None
        self._destroy("_compliance", "_near")

    def reset(self, ksp: PETSc.KSP) -> None:
        """Forget the tangent: the next one may have another pattern. Collective."""
        self._system = self._of = None
        super().reset(ksp)

    def destroy(self, ksp: PETSc.KSP) -> None:
        """Free all, as PETSc asks at the end. Collective."""
        self._forget()
        super().destroy(ksp)

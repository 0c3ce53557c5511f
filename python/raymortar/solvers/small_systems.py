"""Small systems on one rank: factors, and GMRES on arrays."""

from __future__ import annotations

from collections.abc import Callable

from petsc4py import PETSc

import numpy as np

from ..compat import Array

# Most iterations of GMRES, and its relative tolerance
MOST_ITERATIONS = 40
TOLERANCE = 1e-15


def dense_matrix(S: Array) -> PETSc.Mat:
    """An array as a matrix on this rank."""
    A = PETSc.Mat().createDense(
        S.shape, array=np.asfortranarray(S), comm=PETSc.COMM_SELF
    )
    A.assemble()
    return A


class LU:
    """Factors of a matrix on this rank, which is taken over.

    A singular matrix gives values that are not finite.
    """

    def __init__(self, A: PETSc.Mat, solver: str) -> None:
        self._A = A
        self._x, self._b = A.createVecs()
        self._ksp = PETSc.KSP().create(A.comm)
        self._ksp.setType("preonly")
        self._ksp.setOperators(A)
        pc = self._ksp.getPC()
        pc.setType("lu")
        pc.setFactorSolverType(solver)
        self._is_singular = False
        try:
            if A.getSize()[0]:
                self._ksp.setUp()
        except PETSc.Error:  # of LAPACK at a zero pivot
            self._is_singular = True

    def solve(self, b: Array) -> Array:
        """A^-1 b of one right-hand side, (n,), or several, (n, m)."""
        if b.ndim == 2:
            found, some = np.zeros_like(b), np.flatnonzero(b.any(axis=0))
            for k in some:
                found[:, k] = self.solve(b[:, k])
            return found
        if self._is_singular:
            return np.full_like(b, np.nan)
        self._b.array[:] = b
        if len(b):
            self._ksp.solve(self._b, self._x)
        return self._x.array.copy()

    def destroy(self) -> None:
        """Free what belongs to it."""
        for thing in (self._ksp, self._A, self._x, self._b):
            thing.destroy()


def gmres(operator: Callable[[Array], Array], b: Array) -> Array | None:
    """Solve by GMRES from zero; None if it takes too many iterations, or if a value is
    not finite."""
    size = np.linalg.norm(b)
    if not np.isfinite(size):
        return None
    if size == 0.0:
        return np.zeros_like(b)
    basis = np.empty((MOST_ITERATIONS + 1, len(b)))
    basis[0] = b / size
    H = np.zeros((MOST_ITERATIONS + 1, MOST_ITERATIONS))
    for k in range(MOST_ITERATIONS):
        w, known = operator(basis[k]), basis[: k + 1]
        for _ in range(2):  # once leaves rounding errors
            part = known @ w
            w = w - part @ known
            H[: k + 1, k] += part
        H[k + 1, k] = np.linalg.norm(w)
        if not np.isfinite(H[k + 1, k]):
            return None
        right = np.zeros(k + 2)
        right[0] = size
        y = np.linalg.lstsq(H[: k + 2, : k + 1], right, rcond=None)[0]
        if np.linalg.norm(H[: k + 2, : k + 1] @ y - right) <= TOLERANCE * size:
            return y @ known
        basis[k + 1] = w / max(H[k + 1, k], 1e-300)
    return None

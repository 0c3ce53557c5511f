"""Solves the coupled tangent by factors of the bodies' stiffness. On one rank."""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

import numpy as np

from ..compat import Array
from .compliance import Compliance
from .coupling import Coupling, dense, times
from .small_systems import LU, dense_matrix, gmres


class SurfaceSystem:
    """The displacements that contact touches, from which all else follows.

    The tangent is [[K + G, B], [C, D]]: the bodies' stiffness K, and what contact adds.
    Factors are those of K + E k E^T, with springs k that hold loose bodies. They are
    taken off again like multipliers: B gets the columns -E k, C the rows E^T, and D
    the diagonal -1. With v the displacements that contact or a spring touches, W the
    entries of the factored matrix's inverse between these, and right-hand sides f and
    g, the system is

        v + W (G v + B y) = (K^-1 f)_v,    C v + D y = g,

    and then u = K^-1 (f - G v - B y). Multipliers where contact is open have entries
    in D alone, and are eliminated before.

    With multipliers, G has no more than the change of normals: GMRES solves the system
    with the one that lacks G, whose Schur complement D - C W B is factorised. With
    penalties, G is the stiffness of contact, and the whole system is factorised.

    Parameters
    ----------
    coupling
        What contact adds.
    compliance
        Factors, and entries of the inverse.
    """

    def __init__(self, coupling: Coupling, compliance: Compliance) -> None:
        self._compliance = compliance
        at, k = compliance.springs
        v, y, d = coupling.touched, coupling.coupled, coupling.alone
        self._at = v = np.union1d(v, at)
        self._y, self._d = y - compliance.size, d - compliance.size
        self._springs = np.searchsorted(v, at), k
        self._G, self._B = coupling.block(v, v), coupling.block(v, y)
        self._C, D = coupling.block(y, v), dense(coupling.block(y, y))
        self._open: Any = None
        self._to_open: Any = None
        self._from_open: Any = None
        if len(d):
            self._open = LU(coupling.block(d, d), "mumps")
            self._to_open, self._from_open = coupling.block(d, y), coupling.block(y, d)
            D -= times(self._from_open, self._open.solve(dense(self._to_open)))
        self._D = _with_diagonal(D, -np.ones(len(at)))
        self._W = compliance.between(v)
        self._WB = np.hstack(
            [self._product(self._B), -self._W[:, self._springs[0]] * k]
        )
        # Rows of multipliers have other units than those of springs
        S = self._D - self._rows(self._WB)
        self._scale = 1.0 / np.maximum(np.abs(S).max(axis=1, initial=0.0), 1e-300)
        self._schur = LU(dense_matrix(self._scale[:, None] * S), "petsc")
        self._whole: LU | None = None
        if not len(y):
            self._factorise()

    def _product(self, A: PETSc.Mat) -> Array:
        """W A of a sparse matrix."""
        transposed = A.transpose(PETSc.Mat())
        # PETSc takes columns: those of W need no copy
        W = self._W if self._compliance.symmetric else self._W.T
        found = times(transposed, W).T
        transposed.destroy()
        return found

    def _rows(self, v: Array) -> Array:
        """C v, of one or several."""
        return np.concatenate([times(self._C, v), v[self._springs[0]]])

    def solve(self, f: Array, g: Array) -> tuple[Array, Array]:
        """Solve for right-hand sides of the host's rows and of those that follow."""
        right = g[self._y]
        if self._open is not None:
            at_open = self._open.solve(g[self._d])
            right = right - times(self._from_open, at_open)
        right = np.concatenate([right, np.zeros(len(self._springs[0]))])
        v, y = self._reduced(self._compliance.displacements(f, self._at), right)
        others, y_of_contact = np.empty(len(g)), y[: len(self._y)]
        others[self._y] = y_of_contact
        if self._open is not None:
            to_open = self._open.solve(times(self._to_open, y_of_contact))
            others[self._d] = at_open - to_open
        forces = times(self._G, v) + times(self._B, y_of_contact)
        at, k = self._springs
        forces[at] -= k * y[len(self._y) :]
        left = f.copy()
        left[self._compliance.rows[self._at]] -= forces
        return self._compliance.solve(left), others

    def _reduced(self, free: Array, right: Array) -> tuple[Array, Array]:
        """v and y from the right-hand sides of their equations."""
        if self._whole is None:
            v, y = self._without_G(free, right)

            def operator(v: Array) -> Array:
                return v + self._without_G(self._W @ times(self._G, v), 0.0)[0]

            found = gmres(operator, v)
            if found is not None:
                return self._without_G(free - self._W @ times(self._G, found), right)
            self._factorise()
        assert self._whole is not None
        x = self._whole.solve(np.concatenate([free, self._scale * right]))
        return x[: len(free)], x[len(free) :]

    def _without_G(self, free: Array, right: Array | float) -> tuple[Array, Array]:
        """The same if G were zero."""
        y = self._schur.solve(self._scale * (right - self._rows(free)))
        return free - self._WB @ y, y

    def _factorise(self) -> None:
        """Factors of the whole system."""
        n, m = len(self._at), len(self._D)
        S = np.empty((n + m, n + m), order="F")
        S[:n, :n] = self._product(self._G)
        S[np.arange(n), np.arange(n)] += 1.0
        S[:n, n:] = self._WB
        S[n : n + len(self._y), :n] = dense(self._C)
        S[n + len(self._y) :, :n] = 0.0
        S[n + len(self._y) + np.arange(m - len(self._y)), self._springs[0]] = 1.0
        S[n:, n:] = self._D
        S[n:] *= self._scale[:, None]
        self._whole = LU(dense_matrix(S), "petsc")

    def destroy(self) -> None:
        """Free what belongs to it."""
        of_open = self._open, self._to_open, self._from_open
        for one in (*of_open, self._schur, self._whole, self._G, self._B, self._C):
            if one is not None:
                one.destroy()


def _with_diagonal(D: Array, more: Array) -> Array:
    """A square array with further rows and columns, of a diagonal."""
    n, m = len(D), len(D) + len(more)
    found = np.zeros((m, m))
    found[:n, :n] = D
    found[np.arange(n, m), np.arange(n, m)] = more
    return found

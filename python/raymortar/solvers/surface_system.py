"""Solves the coupled tangent by factors of the bodies' stiffness. On one rank."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import sparse
from scipy.linalg import lapack
from scipy.sparse.linalg import splu

from ..compat import Array
from .compliance import Compliance, Places

Solve = Callable[[Array], Array]

# Most iterations of GMRES, and its relative tolerance
MOST_ITERATIONS, TOLERANCE = 40, 1e-15


class Coupling:
    """Entries that contact adds, in the rows and columns of its surfaces and of all
    unknowns that follow the host's.

    Parameters
    ----------
    added
        The tangent less the stiffness, in these rows and columns, a sparse matrix.
    n, last
        How many of them are of the surfaces, which come first, and of free rigid
        bodies, which come last.

    Attributes
    ----------
    touched
        Places of the surfaces that have entries.
    coupled, alone
        Places of the other unknowns, but for multipliers that have no entries with
        surfaces and rigid bodies, and places of these: contact is open there.
    """

    def __init__(self, added: Any, n: int, last: int = 0) -> None:
        self._added, size = added, added.shape[0]
        rows, columns = added.nonzero()
        places = np.arange(size)
        moves = (places < n) | (places >= size - last)
        used = np.zeros(size, dtype=bool)
        used[rows] = used[columns] = True
        self.touched = np.flatnonzero(used[:n])
        row_moves, column_moves = moves[rows], moves[columns]
        coupled = places >= max(n, size - last)
        coupled[columns[row_moves & ~column_moves]] = True
        coupled[rows[column_moves & ~row_moves]] = True
        self.coupled = np.flatnonzero(coupled)
        self.alone = n + np.flatnonzero(~coupled[n:])

    def block(self, rows: Places, columns: Places) -> Any:
        """Take the entries in some rows and columns, as a sparse matrix."""
        return self._added[rows][:, columns]


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
        y, d = coupling.coupled, coupling.alone
        self._at = v = np.union1d(coupling.touched, at)
        self._y, self._d = y - compliance.size, d - compliance.size
        places = np.searchsorted(v, at), np.arange(len(at))
        E = sparse.csr_matrix((np.ones(len(at)), places), (len(v), len(at)))
        Ek = sparse.csr_matrix((k, places), E.shape)
        self._G = coupling.block(v, v)
        self._B = sparse.hstack([coupling.block(v, y), -Ek], "csr")
        self._C = sparse.vstack([coupling.block(y, v), E.T], "csr")
        self._D = -np.eye(len(y) + len(at))
        self._D[: len(y), : len(y)] = coupling.block(y, y).toarray()
        self._open: Solve | None = None
        if len(d):
            self._open = _factors(coupling.block(d, d))
            self._to_open, self._from_open = coupling.block(d, y), coupling.block(y, d)
            some = np.unique(self._to_open.nonzero()[1])
            in_open = self._open(self._to_open[:, some].toarray())
            self._D[: len(y), some] -= self._from_open @ in_open
        self._W = compliance.between(v)
        self._WB = self._W @ self._B
        # Rows of multipliers have other units than those of springs
        S = self._D - self._C @ self._WB
        self._scale = 1.0 / np.maximum(np.abs(S).max(axis=1, initial=0.0), 1e-300)
        self._schur = _factors(self._scale[:, None] * S)
        # Solves the whole system, once it has been factorised
        self._whole: Solve | None = None if len(y) else self._factorised()

    def solve(self, f: Array, g: Array) -> tuple[Array, Array]:
        """Solve for right-hand sides of the host's rows and of those that follow."""
        right, n = np.zeros(len(self._D)), len(self._y)
        right[:n] = g[self._y]
        if self._open is not None:
            at_open = self._open(g[self._d])
            right[:n] -= self._from_open @ at_open
        v, y = self._reduced(self._compliance.displacements(f, self._at), right)
        others = np.empty(len(g))
        others[self._y] = y[:n]
        if self._open is not None:
            others[self._d] = at_open - self._open(self._to_open @ y[:n])
        left = f.copy()
        left[self._compliance.rows[self._at]] -= self._G @ v + self._B @ y
        return self._compliance.solve(left), others

    def _reduced(self, free: Array, right: Array) -> tuple[Array, Array]:
        """Find v and y from the right-hand sides of their equations."""
        if self._whole is None:
            v, _ = self._without_G(free, right)

            def operator(v: Array) -> Array:
                return v + self._without_G(self._W @ (self._G @ v), 0.0)[0]

            found = _gmres(operator, v)
            if found is not None:
                return self._without_G(free - self._W @ (self._G @ found), right)
            self._whole = self._factorised()
        x = self._whole(np.concatenate([free, self._scale * right]))
        return x[: len(free)], x[len(free) :]

    def _without_G(self, free: Array, right: Array | float) -> tuple[Array, Array]:
        """Find the same as if G were zero."""
        y = self._schur(self._scale * (right - self._C @ free))
        return free - self._WB @ y, y

    def _factorised(self) -> Solve:
        """Factorise the whole system."""
        n, m = len(self._at), len(self._D)
        S = np.empty((n + m, n + m), order="F")
        S[:n, :n] = self._W @ self._G
        S[np.arange(n), np.arange(n)] += 1.0
        S[:n, n:] = self._WB
        S[n:, :n] = self._C.toarray()
        S[n:, n:] = self._D
        S[n:] *= self._scale[:, None]
        return _factors(S)


def _factors(A: Any) -> Solve:
    """Factorise a sparse matrix or an array: the result solves for one right-hand side
    or several, and gives NaN where the matrix is singular."""
    if sparse.issparse(A):
        try:
            return splu(A.tocsc()).solve
        except RuntimeError:
            return _nothing
    if not len(A):
        return np.copy
    factors, pivots, singular = lapack.dgetrf(A, overwrite_a=True)
    if singular:
        return _nothing
    return lambda b: lapack.dgetrs(factors, pivots, b)[0]


def _nothing(b: Array) -> Array:
    """Give NaN in place of a solution."""
    return np.full_like(b, np.nan)


def _gmres(operator: Callable[[Array], Array], b: Array) -> Array | None:
    """Solve by GMRES from zero; None if it takes too many iterations, or if a value is
    not finite."""
    # SciPy's has a tolerance that its versions name differently
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

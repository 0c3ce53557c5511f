"""Bodies' stiffness in factors, and systems with contact that these solve. One rank."""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature
from typing import Any

from petsc4py import PETSc

import numpy as np
from scipy import sparse
from scipy.linalg import lapack
from scipy.sparse.linalg import LinearOperator, gmres, splu

from ..core.compat import Array, Indices, Mask
from ..core.discretization.joined import Places, unrolled
from ..core.discretization.ranks import destroy
from ..core.discretization.surfaces import find_bodies
from ..core.errors import ContactError
from .inner import is_symmetric
from .levels import NOTHING, rigid_motions

Solve = Callable[[Array], Array]

# Columns that are solved for at once
AT_ONCE = 128
# Share of forces that is rounding error
ROUNDING = 1e-15
# Most iterations of GMRES, its relative tolerance, whose name differs between versions
# of SciPy, and the residual of a solution
MOST_ITERATIONS, TOLERANCE, EXACT = 40, 1e-15, 1e-12
_RTOL = "rtol" if "rtol" in signature(gmres).parameters else "tol"


class Compliance:
    """Factors of K with springs, and columns of the inverse at dofs on surfaces.

    K is the stiffness of all unknowns of the forms. It is taken over, and gets springs at
    some places among the rows on the surfaces of contact, as stiff as the diagonal.
    `flops` are the operations of a factorisation that knows no symmetry, `entries` the
    numbers in the factors. Columns are found when they are first asked for, and kept.
    """

    def __init__(
        self, K: PETSc.Mat, rows: Places, springs: Places, prefix: str
    ) -> None:
        self._K, self.rows = K, rows
        diagonal = K.getDiagonal()
        self.springs = springs, diagonal.array[rows[springs]]
        diagonal.array[rows[springs]] *= 2.0
        K.setDiagonal(diagonal)
        self._b, self._x = diagonal, diagonal.duplicate()
        self._ksp = PETSc.KSP().create(K.comm)
        self._ksp.setOptionsPrefix(prefix)
        self._ksp.setOperators(K)
        symmetric, pc = is_symmetric(K), self._ksp.getPC()
        pc.setType("cholesky" if symmetric else "lu")
        self._ksp.setFromOptions()
        self._ksp.setUp()
        if pc.getFactorSolverType() != "mumps":
            raise ContactError(
                f"kept factors come from mumps, not from {pc.getFactorSolverType()}: "
                "leave kept_pc_factor_mat_solver_type out"
            )
        self._factors = pc.getFactorMatrix()
        self.usable = self._factors.getMumpsInfog(1) >= 0
        self.flops = self._factors.getMumpsRinfog(3) * (2.0 if symmetric else 1.0)
        entries = self._factors.getMumpsInfog(29)
        self.entries = entries if entries >= 0 else -1_000_000 * entries
        self._columns: dict[int, Array] = {}  # by place of the row

    @property
    def size(self) -> int:
        """Number of rows on the surfaces."""
        return len(self.rows)

    @property
    def known(self) -> int:
        """Number of columns that are known."""
        return len(self._columns)

    def missing(self, at: Places) -> int:
        """Count the columns of some places that are not known."""
        return sum(place not in self._columns for place in at)

    def solve(self, forces: Array) -> Array:
        """Find displacements by forces on all unknowns of the forms, (n,)."""
        self._b.array[:] = forces
        self._ksp.solve(self._b, self._x)
        return self._x.array.copy()

    def displacements(self, forces: Array, at: Places) -> Array:
        """Find the same at some places of the surfaces."""
        known, rest = self.rows[list(self._columns)], forces.copy()
        rest[known] = 0.0
        if np.linalg.norm(rest) > ROUNDING * np.linalg.norm(forces):
            return self.solve(forces)[self.rows[at]]
        columns = np.reshape([c[at] for c in self._columns.values()], (-1, len(at)))
        return forces[known] @ columns

    def between(self, at: Places) -> Array:
        """Find displacements at places by unit forces at the same places, (n, n)."""
        new = np.array([place for place in at if place not in self._columns], dtype=int)
        n, comm = self._x.local_size, self._K.comm
        for begin in range(0, len(new), AT_ONCE):
            some = new[begin : begin + AT_ONCE]
            offsets = np.arange(len(some) + 1, dtype=PETSc.IntType)
            csr = offsets, self.rows[some].astype(PETSc.IntType), np.ones(len(some))
            # MUMPS passes over what a sparse right-hand side does not reach
            unit = PETSc.Mat().createAIJ((len(some), n), csr=csr, comm=comm)
            unit.assemble()
            forces = PETSc.Mat().createTranspose(unit)
            found = PETSc.Mat().createDense((n, len(some)), comm=comm)
            found.setUp()
            found.assemble()
            self._factors.matSolve(forces, found)
            columns = np.ascontiguousarray(found.getDenseArray()[self.rows].T)
            self._columns.update(zip(some.tolist(), columns))
            destroy(forces, unit, found)
        return np.reshape([self._columns[k][at] for k in at.tolist()], 2 * (len(at),)).T

    def destroy(self) -> None:
        """Free what belongs to it."""
        destroy(self._factors, self._ksp, self._K, self._x, self._b)


def supports(contact: Any, surface: Indices, fixed: Mask) -> Places:
    """Find dofs of u, unrolled, whose springs hold all bodies. For one rank.

    They are at some nodes of each body that the conditions alone do not hold, among
    those on the surfaces of contact, and far from each other.
    """
    V = contact.u.function_space
    dim = V.mesh.geometry.dim
    x = V.tabulate_dof_coordinates()[:, :dim]
    motions = np.column_stack(rigid_motions(V))
    of_body, dofs = find_bodies(V), np.empty(0, dtype=np.int64)
    for body in range(of_body.count):
        held = unrolled(np.flatnonzero(of_body.dofs == body), dim)
        if _rank(motions[held[fixed[held]]]) < motions.shape[1]:
            candidates = surface[of_body.dofs[surface] == body]
            dofs = np.append(dofs, unrolled(_far_apart(candidates, x, dim + 1), dim))
    return dofs[~fixed[dofs]]


def _rank(motions: Array) -> int:
    """Count the rigid motions that dofs prevent."""
    if not len(motions):
        return 0
    # Translations and rotations alike
    lengths = np.maximum(np.abs(motions).max(axis=0), 1e-300)
    sizes = np.linalg.svd(motions / lengths, compute_uv=False)
    return int((sizes > NOTHING * sizes.max()).sum())


def _far_apart(nodes: Indices, x: Array, count: int) -> Indices:
    """Choose some of the nodes, each as far as can be from those before it."""
    if len(nodes) <= count:
        return nodes
    points, chosen = x[nodes], list[int]()
    distance = np.linalg.norm(points - points.mean(axis=0), axis=1)
    for _ in range(count):
        chosen.append(int(distance.argmax()))
        distance = np.linalg.norm(points[:, None] - points[chosen], axis=2).min(axis=1)
    return nodes[chosen]


class Coupling:
    """Entries that contact adds, in the rows and columns of its surfaces and of all
    unknowns that follow those of the forms.

    `added` is the tangent less the stiffness there, a sparse matrix whose first n rows
    are of surfaces and whose last ones are of free rigid bodies. `touched` are places of
    surfaces that have entries, `coupled` and `alone` those of other unknowns: multipliers
    without entries with surfaces and rigid bodies are alone, as contact is open there.
    """

    def __init__(self, added: Any, n: int, last: int = 0) -> None:
        self._added, size = added, added.shape[0]
        rows, columns = added.nonzero()
        places = np.arange(size)
        moves = (places < n) | (places >= size - last)
        used = np.zeros(size, dtype=bool)
        used[rows] = used[columns] = True
        self.touched = np.flatnonzero(used[:n])
        coupled = places >= max(n, size - last)
        coupled[columns[moves[rows] & ~moves[columns]]] = True
        coupled[rows[moves[columns] & ~moves[rows]]] = True
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
    """

    def __init__(self, coupling: Coupling, compliance: Compliance) -> None:
        self._compliance = compliance
        at, k = compliance.springs
        y, d = coupling.coupled, coupling.alone
        self._at = v = np.union1d(coupling.touched, at)
        self._y, self._d = y - compliance.size, d - compliance.size
        places = np.searchsorted(v, at), np.arange(len(at))
        E = sparse.csr_matrix((np.ones(len(at)), places), (len(v), len(at)))
        self._G = coupling.block(v, v)
        minus_Ek = sparse.csr_matrix((-k, places), E.shape)
        self._B = sparse.hstack([coupling.block(v, y), minus_Ek], "csr")
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
        """Solve for right-hand sides of the rows of the forms and of those that follow."""
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
            found = _gmres(
                lambda v: v + self._without_G(self._W @ (self._G @ v), 0.0)[0], v
            )
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
    singular = False
    if sparse.issparse(A):
        try:
            return splu(A.tocsc()).solve
        except RuntimeError:
            singular = True
    elif not len(A):
        return np.copy
    else:
        factors, pivots, singular = lapack.dgetrf(A, overwrite_a=True)
    if singular:
        return lambda b: np.full_like(b, np.nan)
    return lambda b: lapack.dgetrs(factors, pivots, b)[0]


def _gmres(operator: Callable[[Array], Array], b: Array) -> Array | None:
    """Solve by GMRES from zero; None if it takes too many iterations, or if a value is
    not finite."""
    if not np.isfinite(b).all():
        return None
    A = LinearOperator(2 * (len(b),), operator)
    limits = {"restart": MOST_ITERATIONS, "maxiter": 1, "atol": 0.0, _RTOL: TOLERANCE}
    x, _ = gmres(A, b, **limits)
    is_solved = np.linalg.norm(operator(x) - b) <= EXACT * np.linalg.norm(b)
    return np.asarray(x) if is_solved else None

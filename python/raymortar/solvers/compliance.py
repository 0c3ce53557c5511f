"""Factors of the bodies' stiffness, columns of its inverse, and springs that hold loose
bodies. On one rank."""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

import numpy as np
import numpy.typing as npt

from ..compat import Array, Indices, Mask
from ..errors import ContactError
from ..host.bodies import find_bodies
from .levels import NOTHING, rigid_motions

Places = npt.NDArray[np.int64]

# Columns that are solved for at once
AT_ONCE = 128
# Share of forces that is rounding error
ROUNDING = 1e-15


class Compliance:
    """Factors of K with springs, and columns of the inverse at dofs on surfaces.

    Columns are found when they are first asked for, and kept.

    Parameters
    ----------
    K
        Stiffness of all unknowns of the host. Taken over; gets the springs.
    rows
        Rows on the surfaces of contact.
    springs
        Places among these that get a spring, as stiff as the diagonal.
    prefix
        Prefix of the solver's options.

    Attributes
    ----------
    springs
        Places, and stiffness.
    symmetric
        Whether K is symmetric, but for rounding.
    usable
        Whether there are factors.
    flops, entries
        Operations of a factorisation that knows no symmetry, and numbers in the
        factors.
    """

    def __init__(
        self, K: PETSc.Mat, rows: Places, springs: Places, prefix: str
    ) -> None:
        self._K, self.rows, self.size = K, rows, len(rows)
        diagonal = K.getDiagonal()
        self.springs = springs, diagonal.array[rows[springs]]
        diagonal.array[rows[springs]] *= 2.0
        K.setDiagonal(diagonal)
        self._b = diagonal
        self._x = diagonal.duplicate()
        self._ksp = PETSc.KSP().create(K.comm)
        self._ksp.setOptionsPrefix(prefix)
        self._ksp.setOperators(K)
        self.symmetric = is_symmetric(K)
        self._ksp.getPC().setType("cholesky" if self.symmetric else "lu")
        self._ksp.setFromOptions()
        self._ksp.setUp()
        pc = self._ksp.getPC()
        if pc.getFactorSolverType() != "mumps":
            raise ContactError(
                f"kept factors are those of mumps, not of {pc.getFactorSolverType()}: "
                "leave kept_pc_factor_mat_solver_type out"
            )
        self._factors = pc.getFactorMatrix()
        self.usable = self._factors.getMumpsInfog(1) >= 0
        self.flops = self._factors.getMumpsRinfog(3) * (2.0 if self.symmetric else 1.0)
        entries = self._factors.getMumpsInfog(29)
        self.entries = entries if entries >= 0 else -1_000_000 * entries
        # Place of the column of each row, -1 where it is not known
        self._column = np.full(self.size, -1)
        self._columns = np.empty((0, self.size))
        self._known = np.empty(0, dtype=np.int64)

    def solve(self, forces: Array) -> Array:
        """Displacements by forces on all unknowns of the host, (n,)."""
        self._b.array[:] = forces
        self._ksp.solve(self._b, self._x)
        return self._x.array.copy()

    def displacements(self, forces: Array, at: Places) -> Array:
        """The same at some places of the surfaces."""
        rest, known = forces.copy(), self.rows[self._known]
        rest[known] = 0.0
        if np.linalg.norm(rest) > ROUNDING * np.linalg.norm(forces):
            return self.solve(forces)[self.rows[at]]
        return forces[known] @ self._columns[: len(known), at]

    def follow(self, rows: Places) -> None:
        """Take further rows, off the surfaces, after the others."""
        n, new = self._x.local_size, np.arange(self.size, self.size + len(rows))
        units = np.zeros((len(rows), n))
        units[np.arange(len(rows)), rows] = 1.0
        columns = np.array([self.solve(unit) for unit in units])
        of_rows = columns
        if not self.symmetric:
            of_rows = np.array([self._solve_transpose(unit) for unit in units])
        wider = np.empty((len(self._columns), self.size + len(rows)))
        wider[:, : self.size] = self._columns
        known = self.rows[self._known]
        wider[: len(known), self.size :] = of_rows[:, known].T
        self._columns = wider
        self.rows = np.concatenate([self.rows, rows])
        self.size = len(self.rows)
        self._column = np.concatenate([self._column, np.full(len(rows), -1)])
        self._append(new, columns[:, self.rows])

    def _solve_transpose(self, forces: Array) -> Array:
        """Solve with the transposed matrix."""
        self._b.array[:] = forces
        self._ksp.solveTranspose(self._b, self._x)
        return self._x.array.copy()

    @property
    def known(self) -> int:
        """How many columns are known."""
        return len(self._known)

    def missing(self, at: Places) -> int:
        """How many columns of some places are not known."""
        return int((self._column[at] < 0).sum())

    def between(self, at: Places) -> Array:
        """Displacements at places by unit forces at the same places, (n, n)."""
        new = at[self._column[at] < 0]
        for begin in range(0, len(new), AT_ONCE):
            self._find(new[begin : begin + AT_ONCE])
        return self._columns[np.ix_(self._column[at], at)].T

    def _find(self, at: Places) -> None:
        """Solve for columns."""
        m, n = len(at), self._x.local_size
        offsets = np.arange(m + 1, dtype=PETSc.IntType)
        csr = offsets, self.rows[at].astype(PETSc.IntType), np.ones(m)
        # MUMPS passes over what a sparse right-hand side does not reach
        unit = PETSc.Mat().createAIJ((m, n), csr=csr, comm=self._K.comm)
        unit.assemble()
        forces = PETSc.Mat().createTranspose(unit)
        found = PETSc.Mat().createDense((n, m), comm=self._K.comm)
        found.setUp()
        found.assemble()
        self._factors.matSolve(forces, found)
        self._append(at, found.getDenseArray()[self.rows].T)
        for matrix in (forces, unit, found):
            matrix.destroy()

    def _append(self, at: Places, columns: Array) -> None:
        begin, end = len(self._known), len(self._known) + len(at)
        if end > len(self._columns):
            more = np.empty((max(end, 2 * len(self._columns)), self.size))
            more[:begin] = self._columns[:begin]
            self._columns = more
        self._columns[begin:end] = columns
        self._column[at] = np.arange(begin, end)
        self._known = np.concatenate([self._known, at])

    def destroy(self) -> None:
        """Free what belongs to it."""
        for thing in (self._factors, self._ksp, self._K, self._x, self._b):
            thing.destroy()


def is_symmetric(K: PETSc.Mat) -> bool:
    """Whether a matrix is symmetric, but for rounding of the diagonals of a row and a
    column: bodies and fields may have other units."""
    diagonal = K.getDiagonal()
    size = np.abs(diagonal.array)
    diagonal.array[:] = 1.0 / np.sqrt(np.where(size > 0.0, size, 1.0))
    scaled = K.copy()
    scaled.diagonalScale(diagonal, diagonal)
    found: bool = scaled.isSymmetric(1e-12)
    scaled.destroy()
    diagonal.destroy()
    return found


def supports(contact: Any, surface: Indices, fixed: Mask) -> Places:
    """Dofs of u whose springs hold all bodies, unrolled. For one rank.

    Some nodes of each body that the conditions alone do not hold, on the surfaces of
    contact and far from each other.

    Parameters
    ----------
    contact
        Contact, or several.
    surface
        Block dofs on the surfaces of contact.
    fixed
        Whether a dof of u is prescribed, (n_u,), unrolled.
    """
    V = contact.u.function_space
    dim = V.mesh.geometry.dim
    x = V.tabulate_dof_coordinates()[:, :dim]
    motions = np.column_stack(rigid_motions(V))
    of_body, found = find_bodies(V), []
    for body in range(of_body.count):
        nodes = np.flatnonzero(of_body.dofs == body)
        held = unrolled(nodes, dim)
        held = held[fixed[held]]
        if _rank(motions[held]) == motions.shape[1]:
            continue
        candidates = surface[of_body.dofs[surface] == body]
        found.append(unrolled(_far_apart(candidates, x, dim + 1), dim))
    dofs = np.concatenate([np.empty(0, dtype=np.int64), *found])
    return dofs[~fixed[dofs]]


def unrolled(nodes: Indices, dim: int) -> Places:
    """Dofs of the components of some block dofs."""
    return (dim * nodes.astype(np.int64)[:, None] + np.arange(dim)).ravel()


def _rank(motions: Array) -> int:
    """Number of rigid motions that dofs prevent."""
    if not len(motions):
        return 0
    # Translations and rotations alike
    lengths = np.maximum(np.abs(motions).max(axis=0), 1e-300)
    sizes = np.linalg.svd(motions / lengths, compute_uv=False)
    return int((sizes > NOTHING * sizes.max()).sum())


def _far_apart(nodes: Indices, x: Array, count: int) -> Indices:
    """Some of the nodes, each as far as can be from those before it."""
    if len(nodes) <= count:
        return nodes
    points = x[nodes]
    distance = np.linalg.norm(points - points.mean(axis=0), axis=1)
    chosen = []
    for _ in range(count):
        chosen.append(int(distance.argmax()))
        to_last = np.linalg.norm(points - points[chosen[-1]], axis=1)
        distance = to_last if len(chosen) == 1 else np.minimum(distance, to_last)
    return nodes[chosen]

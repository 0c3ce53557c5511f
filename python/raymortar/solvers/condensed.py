"""Preconditioner of condensed systems: multigrid for bodies that follow each other."""

from __future__ import annotations

from contextlib import ExitStack
from typing import Any

from petsc4py import PETSc

import numpy as np

from ..condensed.condensation import ELIMINATED, Eliminated, scale
from ..core.compat import Array, Mask
from ..core.discretization.joined import Places
from ..core.discretization.ranks import destroy
from ..core.errors import ContactError
from ..core.gamma.probing import product
from ..entries import block_diagonal, without_zeros
from .inner import finished

_OTHER = PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN

# Share of a multiplier that its row leaves to forces, below which the row determines the
# displacement: 0 in closed contact, 1 in open contact, between them across the slip
DETERMINED = 0.5


class CondensedPreconditioner:
    """Multigrid for tangents of `CondensedProblem`. A PETSc python PC.

    In closed contact each row of the law determines one displacement of the slave. The
    other displacements have the stiffness S of bodies that are tied there, or slide:
    master and slave move together in its rows and columns [theory (4.33)]. S is as
    symmetric as the stiffness of the bodies alone, and the same preconditioners suit it.

    Attributes
    ----------
    bodies
        KSP of S, with prefix ``displacement_`` after that of the outer one; by default
        one cycle of BoomerAMG, or of GAMG where PETSc has no hypre. S has the rows of
        the tangent, of which those of determined displacements are empty.
    law
        KSP of the rows of the law, with prefix ``law_``; by default MUMPS. None where
        contact is open.
    """

    def __init__(self) -> None:
        self.bodies: Any = None  # PETSc.KSP from `setUp` on, as `law`
        self.law: Any = None
        # Tests of S, and its displacements
        self._tests: Any = None
        self._displacements: Any = None
        # Rows of the law as combinations of the tangent's, their answers, and the hats
        # that they determine
        self._rows: Any = None
        self._answers: Any = None
        self._hats: Any = None

    def setUp(self, pc: PETSc.PC) -> None:
        """Take the tangent anew. Collective."""
        _, A = pc.getOperators()
        eliminated = A.getAttr(ELIMINATED)
        if eliminated is None:
            raise ContactError(
                "this iterative solver is for the matrices of a CondensedProblem: of "
                'others solvers.iterative("bodies") is'
            )
        self.reset(pc)
        with ExitStack() as temporary:
            determined = self._split(A, eliminated, temporary)
        product_of_all = self._tests.matMatMult(A, self._displacements)
        diagonal = product_of_all.getDiagonal()
        diagonal.array[determined] = diagonal.norm(PETSc.NormType.NORM_INFINITY)
        product_of_all.setDiagonal(diagonal)
        diagonal.destroy()
        S = without_zeros(product_of_all)  # a third is room for other partners
        product_of_all.destroy()
        S.setBlockSize(A.getBlockSize())
        has_hypre = PETSc.Sys.hasExternalPackage("hypre")
        self.bodies = finished(pc, "displacement_", S, "hypre" if has_hypre else "gamg")
        if self._rows.getSize()[0]:
            self._answers = self._rows.matMult(A)
            on_slave = self._answers.matMult(self._hats)
            self.law = finished(pc, "law_", on_slave, "lu")

    def _split(self, A: PETSc.Mat, of: Eliminated, temporary: ExitStack) -> Mask:
        """Make the matrices that split rows and displacements; which of the owned ones
        the law determines. Collective."""

        def mine(matrix: PETSc.Mat) -> PETSc.Mat:
            temporary.callback(matrix.destroy)
            return matrix

        def of_nodes(blocks: Array) -> PETSc.Mat:
            return mine(block_diagonal([blocks], A.comm))

        nodal = mine(of.law.transpose(PETSc.Mat()))
        # The rows of nodes where no law is evaluated are their own
        active = of.active.ravel().astype(float)
        combine, plain = mine(of.tests.copy()), mine(nodal.copy())
        scale(combine, active, None)
        scale(plain, 1.0 - active, None)
        combine.axpy(1.0, plain, _OTHER)
        frames = NodeFrames(of.shares, _translated(A, of, combine))
        by_law = frames.determined.ravel().astype(float)
        axes = of_nodes(frames.axes)
        beside = 1.0 - product(of.law, np.ones(len(by_law)))

        # Forces on other rows, without those by multipliers that forces tell
        tests = mine(of.spread.matMult(of_nodes(frames.forces))).matMult(nodal)
        tests.scale(-1.0)
        _add_diagonal(tests, beside)
        # Rows of a slave node combine those of nodes beside it: not in free directions
        others = mine(combine.copy())
        scale(others, None, beside)
        own = mine(of_nodes(frames.rows).matMult(nodal))
        free = mine(axes.matMult(mine(others.matMult(tests))))
        free.aypx(-1.0, own, _OTHER)
        scale(free, 1.0 - by_law, None)
        tests.axpy(1.0, mine(of.law.matMult(free)), _OTHER)

        # Hats in the directions of a node, of which those that are determined follow
        hats = mine(mine(axes.matMult(combine)).transpose(PETSc.Mat()))
        at_nodes = mine(hats.copy())
        scale(at_nodes, 1.0 - beside, 1.0 - by_law)
        displacements = at_nodes.matMult(nodal)
        _add_diagonal(displacements, beside)
        scale(hats, None, by_law)
        follow = mine(axes.matMult(mine(of.spread.transpose(PETSc.Mat()))))
        displacements.axpy(1.0, mine(hats.matMult(follow)), _OTHER)

        first, last = own.getOwnershipRange()
        at = (np.flatnonzero(by_law) + first).astype(PETSc.IntType)
        determined = mine(PETSc.IS().createGeneral(at, comm=A.comm))
        begin, end = A.getOwnershipRange()
        all_rows = mine(PETSc.IS().createStride(end - begin, begin, 1, comm=A.comm))
        self._rows = own.createSubMatrix(determined, all_rows)
        self._hats = hats.createSubMatrix(all_rows, determined)
        self._tests, self._displacements = tests, displacements
        return product(of.law, by_law) > 0.0

    def apply(self, pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Solve for the bodies, then for what the law determines. Collective."""
        right, found = x.duplicate(), x.duplicate()
        self._tests.mult(x, right)
        self.bodies.solve(right, found)
        self._displacements.mult(found, y)
        if self.law is not None:
            rest, lacking = self.law.getOperators()[0].createVecs()
            self._rows.mult(x, rest)
            self._answers.mult(y, lacking)
            rest.axpy(-1.0, lacking)
            self.law.solve(rest, lacking)
            self._hats.multAdd(lacking, y, y)
            destroy(rest, lacking)
        destroy(right, found)

    def reset(self, pc: PETSc.PC) -> None:
        """Forget the tangent, as the next one may have another pattern. Collective."""
        for name, thing in vars(self).items():
            destroy(thing)
            setattr(self, name, None)

    def destroy(self, pc: PETSc.PC) -> None:
        """Free all, as PETSc asks at the end. Collective."""
        self.reset(pc)


def _translated(A: PETSc.Mat, of: Eliminated, combine: PETSc.Mat) -> Array:
    """Derivatives of the rows of slave nodes by translations of the slave surface,
    (nodes, m, m). Collective."""
    n, m, _ = of.shares.shape
    found = np.empty((n, m, m))
    for i in range(m):
        unit = np.tile(np.eye(m)[i], n)
        moved = product(A, product(combine, unit, transposed=True))
        found[:, :, i] = product(of.law, moved, transposed=True).reshape(n, m)
    return found * of.active[:, None, :]


def _add_diagonal(matrix: PETSc.Mat, values: Array) -> None:
    """Add to the diagonal of a matrix, where it may have no entries."""
    diagonal = PETSc.Mat().createAIJ(matrix.getSizes(), nnz=(1, 0), comm=matrix.comm)
    found = diagonal.createVecLeft()
    found.array[:] = values
    diagonal.setDiagonal(found)
    diagonal.assemble()
    matrix.axpy(1.0, diagonal, _OTHER)
    destroy(found, diagonal)


class NodeFrames:
    """Splits the rows of slave nodes into those that determine displacements, and forces.

    Attributes
    ----------
    axes
        Orthonormal directions of the displacement, (nodes, m, m): row i is near the axis
        i, so that multigrid may take component by component.
    determined
        Which of these the law determines, (nodes, m).
    rows
        Combinations of the node's rows for each direction, (nodes, m, m): of the law,
        such that a translation answers with 1, or forces along it.
    forces
        Combinations that give the part of the multiplier which rows of forces tell.
    """

    def __init__(self, shares: Array, answers: Array) -> None:
        """Take each node's derivatives of its rows, (nodes, m, m): by the forces on it,
        and by a translation of the slave surface."""
        n, m, _ = shares.shape
        self.axes, self.rows, self.forces = (np.empty((n, m, m)) for _ in range(3))
        self.determined = np.zeros((n, m), dtype=bool)
        left, sizes, right = np.linalg.svd(shares)
        count = (sizes < DETERMINED).sum(axis=1)
        for k in range(m + 1):
            at = np.flatnonzero(count == k)
            self._take(at, m - k, (left[at], sizes[at], right[at]), answers[at])

    def _take(
        self, at: Places, f: int, shares: tuple[Array, Array, Array], answers: Array
    ) -> None:
        """Take nodes with f rows of forces, by the singular values of their shares."""
        left, sizes, right = shares
        rows = _t(left)
        law = rows[:, f:]
        forces = _t(right[:, :f]) @ (rows[:, :f] / sizes[:, :f, None])
        by_law = np.linalg.svd(law @ answers)[2]
        k = law.shape[1]
        order = np.argsort(-(by_law[:, :k] ** 2).sum(axis=1), axis=1, kind="stable")
        axes = np.empty_like(left)
        for part in (slice(k), slice(k, None)):
            own, place = by_law[:, part], order[:, part]
            near = np.take_along_axis(_t(own), place[:, :, None], axis=1)
            # The orthogonal matrix that is nearest to it
            first, _, second = np.linalg.svd(near)
            turned = first @ second @ own
            np.put_along_axis(axes, place[:, :, None], turned, axis=1)
        found = axes @ forces
        if k:
            mine = np.take_along_axis(axes, order[:, :k, None], axis=1)
            scaled = np.linalg.solve(law @ answers @ _t(mine), law)
            np.put_along_axis(found, order[:, :k, None], scaled, axis=1)
            self.determined[at[:, None], order[:, :k]] = True
        self.axes[at], self.rows[at], self.forces[at] = axes, found, forces


def _t(matrices: Array) -> Array:
    return matrices.transpose(0, 2, 1)

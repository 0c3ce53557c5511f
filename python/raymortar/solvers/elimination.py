"""Preconditioner that eliminates the multipliers."""

from __future__ import annotations

import weakref
from typing import Any

from petsc4py import PETSc

import numpy as np

from ..errors import ContactError
from .blocks import block_diagonal, index_sets, node_blocks, with_blocks
from .rigid_motions import near_nullspace
from .springs import lumped_mass, surface_stiffness

# Stiffness of the springs that stand for closed contact, over that of the volume at its
# surface. With softer springs GMRES needs more iterations, with stiffer ones multigrid
# does (measured: docs/parallel.md)
SPRINGS = 10.0


class KnowsProblem:
    """A Python context of PETSc's that `attach` tells about the problem.

    Attributes
    ----------
    contact, row_scale
        The problem's contact, and the factors of the rows of its matrices.
    """

    def __init__(self) -> None:
        self.contact: Any = None
        self.row_scale: PETSc.Vec | None = None
        # Weak: C would keep the problem alive in a cycle
        self._problem: Any = None

    @property
    def problem(self) -> Any:
        """What is solved."""
        return self._problem()

    def know(self, problem: Any, row_scale: PETSc.Vec | None) -> None:
        """Take what `attach` tells."""
        self._problem, self.contact = weakref.ref(problem), problem.contact
        self.row_scale = row_scale


def attach(ksp: PETSc.KSP, problem: Any, row_scale: PETSc.Vec | None = None) -> None:
    """Give the problem, and the factors of its rows, to a solver whose options have
    been read.

    Raises
    ------
    ContactError
        If the solver is iterative, and there are unknowns beside the displacement, or a
        free rigid body.
    """
    for thing in (ksp, ksp.getPC()):
        if thing.getType() == "python":
            context = thing.getPythonContext()
            if isinstance(context, KnowsProblem):
                context.know(problem, row_scale)


class ContactPreconditioner(KnowsProblem):
    """Eliminates the multipliers; multigrid for the displacement. A PETSc python PC.

    The tangent is [[K, B], [C, D]]. With penalties alone it is K, and S = K below. With
    a multiplier, D is zero where contact is closed. The preconditioner takes E in place
    of D: the diagonal blocks of its nodes, less a multiple of the lumped mass matrix of
    the slave surface. Then S = K - B E^-1 C is the stiffness with springs in closed
    contact. It couples the bodies and has no zeros on its diagonal. If the springs are
    about as stiff as the volume's surface (the modulus over the mesh size), multigrid
    solves S as well as K. The error of E costs a number of iterations that does not
    depend on the mesh size.

    Attributes
    ----------
    solver
        KSP of S, with prefix ``displacement_`` after that of the outer one.
    """

    # Stiffness of the springs, in those of the volume at its surface
    springs = SPRINGS
    # Whether rows of free bodies may be among those of the tangent
    takes_bodies = False

    def __init__(self) -> None:
        super().__init__()
        self.solver: Any = None  # PETSc.KSP from `setUp` on
        self._near: PETSc.NullSpace | None = None
        # Factor of the lumped mass of each contact, from the first elimination on
        self._springs: list[float] | None = None
        # Index sets of both unknowns, and what the elimination needs
        self._u: Any = None
        self._lam: Any = None
        self._B: Any = None
        self._C: Any = None
        self._inverse: Any = None

    def know(self, problem: Any, row_scale: PETSc.Vec | None) -> None:
        """Take what `attach` tells, before the first use."""
        if not problem.contact.host.is_plain:
            raise ContactError(
                "the iterative solver is for a displacement alone: with further "
                "unknowns leave the direct one, which is the default"
            )
        if problem.contact.layout.bodies and not self.takes_bodies:
            names = ", ".join(body.name for body in problem.contact.layout.bodies)
            raise ContactError(
                f"this iterative solver takes no rigid body that is free ({names}): "
                'solvers.iterative("bodies") does, and the direct one'
            )
        super().know(problem, row_scale)

    def setUp(self, pc: PETSc.PC) -> None:
        """Take the blocks of the tangent anew. Collective."""
        A, _ = pc.getOperators()
        # A new solver each time: GAMG cannot change the sizes of its levels
        self.reset(pc)
        prefix = f"{pc.getOptionsPrefix() or ''}displacement_"
        self._renew(prefix)
        S = A if self._takes_all else self._eliminate(A)
        self.solver = PETSc.KSP().create(pc.comm)
        self.solver.setType("preonly")
        self.solver.setOptionsPrefix(prefix)
        self.solver.setOperators(S)
        self._prepare(S)
        self.solver.setFromOptions()
        self.solver.setUp()
        S.destroy()  # the solver has it

    def _renew(self, prefix: str) -> None:
        """Make what needs no S, while there is none in memory. Collective."""

    def _prepare(self, S: PETSc.Mat) -> None:
        """Tell multigrid what it needs to know. Collective."""
        if self._near is None:
            self._near = near_nullspace(self.contact)
        # S may be the tangent itself, with one of the user's
        if not S.getNearNullSpace():
            S.setNearNullSpace(self._near)

    @property
    def _with_multiplier(self) -> list[Any]:
        """The contacts that have one, in the order of its rows."""
        contacts = self.contact.contacts
        return [contact for contact in contacts if contact.multiplier is not None]

    @property
    def _takes_all(self) -> bool:
        """Whether the tangent has rows of displacements alone."""
        return not self._with_multiplier and not self.contact.layout.bodies

    def _eliminate(self, A: PETSc.Mat) -> PETSc.Mat:
        """S, and keep the blocks that the elimination needs."""
        if self._springs is None:
            # The multiplier is divided by gamma, and so its equation is multiplied
            self._springs = [
                contact.gamma_scale**2 / (self.springs * surface_stiffness(contact))
                for contact in self._with_multiplier
            ]
            self._u, self._lam = index_sets(self.contact.layout)
        if not self._with_multiplier:
            return self._unscaled(A.createSubMatrix(self._u, self._u), self._u)
        K, self._B, self._C, D = (
            self._unscaled(A.createSubMatrix(rows, columns), rows)
            for rows in (self._u, self._lam)
            for columns in (self._u, self._lam)
        )
        self._inverse = self._inverse_blocks(D)
        EC = self._inverse.matMult(self._C)
        BEC = self._B.matMult(EC)
        bs = K.getBlockSize()
        # In place of K, which is as large as the tangent
        K.axpy(-1.0, BEC, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        for matrix in (D, EC, BEC):
            matrix.destroy()
        return with_blocks(K, bs)

    def _unscaled(self, block: PETSc.Mat, rows: PETSc.IS) -> PETSc.Mat:
        """A block with the rows as assembled, without factors: springs belong to
        these."""
        if self.row_scale is not None:
            factors = self.row_scale.getSubVector(rows)
            inverse = factors.copy()
            inverse.reciprocal()
            block.diagonalScale(inverse)
            inverse.destroy()
            self.row_scale.restoreSubVector(rows, factors)
        return block

    def _inverse_blocks(self, D: PETSc.Mat) -> PETSc.Mat:
        """E^-1 from the nodes' blocks of D and the lumped masses."""
        assert self._springs is not None
        begin, first, parts = D.getOwnershipRange()[0], 0, []
        csr = D.getValuesCSR()
        for contact, springs in zip(self._with_multiplier, self._springs):
            c, mass = contact.layout.components, springs * lumped_mass(contact)
            blocks = node_blocks(csr, first, len(mass), c, begin)
            blocks -= mass[:, None, None] * np.eye(c)
            parts.append((begin + first, np.linalg.inv(blocks)))
            first += c * len(mass)
        E = PETSc.Mat().createAIJ(
            ((first, None), (first, None)), csr=block_diagonal(parts), comm=D.comm
        )
        E.assemble()
        return E

    def apply(self, pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """y = P^-1 x: eliminate, solve, substitute; 0 for free bodies. Collective."""
        if self._takes_all:
            self.solver.solve(x, y)
            return
        y.set(0.0)
        right = self._unscaled_part(x, self._u)
        u = right.duplicate()
        if self._with_multiplier:
            self._substitute(self._unscaled_part(x, self._lam), right, u, y)
        else:
            self.solver.solve(right, u)
        y.array[: self.contact.layout.n] = u.array_r
        right.destroy()
        u.destroy()

    def _unscaled_part(self, x: PETSc.Vec, rows: PETSc.IS) -> PETSc.Vec:
        """Copy of some rows of a residual, as they were assembled."""
        of_x = x.getSubVector(rows)
        part = of_x.copy()
        x.restoreSubVector(rows, of_x)
        if self.row_scale is not None:
            factors = self.row_scale.getSubVector(rows)
            part.pointwiseDivide(part, factors)
            self.row_scale.restoreSubVector(rows, factors)
        return part

    def _substitute(
        self, rest: PETSc.Vec, right: PETSc.Vec, u: PETSc.Vec, y: PETSc.Vec
    ) -> None:
        """Displacement into u, and multipliers into y. Collective."""
        lam = rest.duplicate()
        self._inverse.mult(rest, lam)
        self._B.mult(lam, u)
        right.axpy(-1.0, u)
        self.solver.solve(right, u)
        self._C.mult(u, lam)
        rest.axpy(-1.0, lam)
        self._inverse.mult(rest, lam)
        n = self.contact.layout.n
        y.array[n : n + lam.local_size] = lam.array_r
        rest.destroy()
        lam.destroy()

    def reset(self, pc: PETSc.PC) -> None:
        """Forget the operators: the next ones may have another pattern. Collective."""
        self._destroy("solver", "_B", "_C", "_inverse")

    def destroy(self, pc: PETSc.PC) -> None:
        """The end, called by PETSc. Collective."""
        self.reset(pc)
        self._destroy("_near", "_u", "_lam")

    def _destroy(self, *names: str) -> None:
        """Free PETSc objects at once: what Python drops is kept for a while."""
        for name in names:
            thing = getattr(self, name)
            if thing is not None:
                thing.destroy()
            setattr(self, name, None)

"""A preconditioner that eliminates the multipliers."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from .. import _cpp
from ..core import compat
from ..core.compat import Array
from ..core.discretization.facets import shape_functions
from ..core.discretization.joined import Places, unrolled
from ..core.discretization.ranks import destroy, marked_everywhere
from ..core.errors import ContactError
from ..core.gamma.stiffness import owned_nodes_on
from ..entries import block_diagonal, node_blocks
from .inner import RESTART, KnowsProblem, finished, inner_solver, kept_inside
from .levels import BodiesLevels, set_levels, sides

# New levels are made when a solve with new blocks needs WORN times the cycles of the
# first one, and SPARE more: the bodies have changed then
WORN, SPARE = 1.5, 5

# Blocks of a former tangent serve until they have taken, in all, as many cycles more than
# the first solve with them as new ones cost: 17 to 29, of which the most counts, as fewer
# sets of blocks need less memory (measured: docs/measured/linear_solvers.md)
PRICE = 30

# Share of its residual that a solve may leave. GMRES measures residuals through the
# blocks. Blocks of a body that touched nothing magnify its rigid motions so much that all
# else looks small beside them: a wrong answer then counts as exact
LEFT = 0.1

# Layers of cells at the surfaces whose nodes are near contact (measured:
# docs/measured/linear_solvers.md)
LAYERS = 1


class BodiesPreconditioner(KnowsProblem):
    """Solves near contact directly, and everywhere by multigrid. A PETSc python PC.

    The tangent is [[K, B], [C, D]]. With penalties alone it is K, and S = K below. With
    a multiplier, D is zero where contact is closed.

    1. A direct solver finds the displacement near contact, all multipliers, and the
       motions of free rigid bodies. The rest of the error is smooth.
    2. Multipliers are eliminated with E in place of D: the diagonal blocks of its nodes,
       less a multiple of the lumped mass matrix of the slave surface. Multigrid then
       solves S = K - B E^-1 C, the stiffness with springs in closed contact. It couples
       the bodies and has no zeros on its diagonal. The springs are as stiff as the
       volume's surface (the modulus over the mesh size), so that multigrid solves S as
       well as K. The error of E costs a number of iterations that does not depend on
       the mesh size.

    The levels belong to the bodies without contact. They are kept until a solve takes
    many more cycles than the first one, or until other dofs are prescribed. So are the
    blocks, the operators of the levels and the factors near contact. Another gamma ends
    these, too, and so does a solve that leaves the residual as it was. Products with the
    tangent are always with the present one.

    Attributes
    ----------
    solver
        KSP of S, with prefix ``displacement_`` after that of the outer one.
    levels
        `levels.BodiesLevels`, from the first set-up on.
    was_new
        Whether the last solve was the first one with the present blocks.
    """

    def __init__(self) -> None:
        super().__init__()
        self.solver: Any = None  # PETSc.KSP from `setUp` on
        self.levels: Any = None
        self.was_new = self._is_second = False
        # Factor of the lumped mass of each contact, from the first elimination on
        self._factors: list[float] = []
        # Owned rows near contact
        self._near_rows: Places | None = None
        self._coarse: list[PETSc.Mat] = []
        # Cycles of the present solve, of the first one with the present blocks, and of the
        # first one with the present levels; 0: there was none
        self._cycles = self._fresh = self._first = 0
        # Cycles that solves with the present blocks have taken more than the first one,
        # and may take
        self._excess: float = 0
        self._most = PRICE
        # Factors of the rows, and of the multipliers, of the tangent that gave the blocks;
        # those of its rows over those of the present one
        self._scale_then: Array = np.empty(0)
        self._ratios: Array = np.empty(0)
        self._gamma_then: list[float] = []

    def know(
        self,
        problem: Any,
        row_scale: PETSc.Vec | None,
        raised: list[Exception] | None = None,
    ) -> None:
        """Take what `attach` gives, before the first use."""
        if not problem.contact.unknowns.is_plain:
            raise ContactError(
                "the iterative solver is for a displacement alone: with further "
                "unknowns leave the direct one, which is the default"
            )
        super().know(problem, row_scale, raised)

    @kept_inside
    def setUp(self, pc: PETSc.PC) -> None:
        """Take the blocks of the tangent, unless those of a former one serve, or SNES asks
        for them by its lag. Collective."""
        has_blocks = self.solver is not None
        if has_blocks and (_cpp.is_reused(pc.handle) or self._serves()):
            return
        self.forget()
        A, _ = pc.getOperators()
        table = PETSc.Options(pc.getOptionsPrefix() or "")
        self._most = table.getInt("bodies_most", PRICE)
        self.solver = inner_solver(pc, "displacement_")
        self.solver.setType("preonly")
        self._renew_levels(A, self.solver.getOptionsPrefix())
        S = self._eliminate(A)
        self.solver.setOperators(S)
        # Springs in place of multipliers are as stiff as the surface of the volume,
        # penalties ten times as stiff
        stiff = any(one.multiplier is None for one in self.contact.contacts)
        self._coarse = set_levels(self.solver, self.levels, S, stiff)
        self.solver.setFromOptions()
        self.solver.setUp()
        self._right, self._solution = S.createVecs()
        S.destroy()  # the solver has it
        self._set_near(pc)
        self._scale_then, self._gamma_then = self._row_factors().copy(), self._gammas()
        self._ratios = np.ones(len(self._scale_then))
        self._fresh = self._excess = 0

    def preSolve(
        self, pc: PETSc.PC, ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec
    ) -> None:
        """Count the cycles of a solve, whose rows may have other factors by now."""
        self._cycles, self._ratios = 0, self._scale_then / self._row_factors()

    def postSolve(
        self, pc: PETSc.PC, ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec
    ) -> None:
        """Note the cycles that a solve has taken. If it left too much of the residual,
        repeat it with new blocks, or report that it failed. Collective."""
        self.was_new, cycles = self._fresh == 0, max(self._cycles, 1)
        self._fresh = self._fresh or cycles
        self._first = self._first or cycles
        self._excess += max(cycles - self._fresh, 0)
        if self._has_solved(pc, ksp, b, x):
            return
        if self.was_new or self._is_second:
            ksp.setConvergedReason(PETSc.KSP.ConvergedReason.DIVERGED_BREAKDOWN)
            self._excess = np.inf
        else:
            self._solve_anew(pc, ksp, b, x)

    def _has_solved(
        self, pc: PETSc.PC, ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec
    ) -> bool:
        """Whether a solve that reports convergence left little of the residual; True if
        it reports a failure itself. Collective."""
        if ksp.getConvergedReason() <= 0:
            return True
        rest, (A, _) = b.duplicate(), pc.getOperators()
        A.mult(x, rest)
        rest.axpy(-1.0, b)
        left, size = rest.norm(), b.norm()
        rest.destroy()
        return bool(left <= max(LEFT, ksp.getTolerances()[0]) * size)

    def _solve_anew(
        self, pc: PETSc.PC, ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec
    ) -> None:
        """Solve with blocks of the present tangent. Collective."""
        self.forget()
        again = PETSc.KSP().create(ksp.comm)
        again.setType(ksp.getType())
        again.setTolerances(*ksp.getTolerances())
        again.setNormType(ksp.getNormType())
        again.setGMRESRestart(RESTART)
        again.setOperators(*ksp.getOperators())
        again.setPC(pc)
        self.setUp(pc)
        self._is_second = True
        try:
            again.solve(b, x)
        finally:
            self._is_second = False
        ksp.setConvergedReason(again.getConvergedReason())
        ksp.setIterationNumber(ksp.getIterationNumber() + again.getIterationNumber())
        again.destroy()

    def _serves(self) -> bool:
        """Whether the blocks at hand suit the present tangent. Collective."""
        same = np.array_equal(self.levels.fixed, self.problem.constrained)
        changed = not same or self._gamma_then != self._gammas()
        # New ones for the last iteration alone would cost more than they save
        most = self._most * (2 if self.problem.convergence.is_last else 1)
        worn = self._excess > most
        return not self.contact.layout.comm.allreduce(int(worn or changed))

    def _gammas(self) -> list[float]:
        """Factors of the unknowns of the multipliers."""
        return [contact.assembly.gamma_scale for contact in self._with_multiplier]

    def _row_factors(self) -> Array:
        """Factors of the owned rows of the tangent."""
        if self.row_scale is None:
            return np.ones(self.contact.layout.size)
        factors: Array = self.row_scale.array_r
        return factors

    def _set_near(self, pc: PETSc.PC) -> None:
        """Factorise the tangent near contact. Collective."""
        A, _ = pc.getOperators()
        if self._near_rows is None:
            self._near_rows = _rows_near_contact(self.contact)
        at = (self._near_rows + A.getOwnershipRange()[0]).astype(PETSc.IntType)
        rows = PETSc.IS().createGeneral(at, comm=A.comm)
        self._near_contact = finished(pc, "near_", A.createSubMatrix(rows, rows))

    def _renew_levels(self, A: PETSc.Mat, prefix: str) -> None:
        """Make levels where there are none that serve, while no S is in memory.
        Collective."""
        worn = self._fresh > WORN * self._first + SPARE
        if self.levels is not None:
            same = np.array_equal(self.levels.fixed, self.problem.constrained)
            if self.contact.layout.comm.allreduce(int(worn or not same)):
                self._destroy("levels")
        if self.levels is None:
            prefix = f"{prefix}levels_"
            self.levels = BodiesLevels(self.problem, prefix, A, self.row_scale)
            self._first = 0

    @property
    def _with_multiplier(self) -> list[Any]:
        """The contacts that have one, in the order of its rows."""
        return [one for one in self.contact.contacts if one.multiplier is not None]

    def _rows(self, first: int, last: int, block: int = 1) -> PETSc.IS:
        """Owned rows of the tangent, with a block size."""
        begin, comm = self.contact.layout.begin, self.contact.layout.comm
        rows = PETSc.IS().createStride(last - first, begin + first, 1, comm)
        rows.setBlockSize(block)
        return rows

    def _eliminate(self, A: PETSc.Mat) -> PETSc.Mat:
        """Make S, and keep the blocks that the elimination needs."""
        layout, contacts = self.contact.layout, self._with_multiplier
        if not contacts and not layout.bodies:
            return A.copy()  # the tangent itself will change
        u = self._rows(0, layout.n, self.contact.u.function_space.dofmap.index_map_bs)
        K = A.createSubMatrix(u, u)
        if not contacts:
            return K
        if not self._factors:
            # The multiplier is divided by gamma, and so its equation is multiplied
            self._factors = [
                contact.assembly.gamma_scale**2 / surface_stiffness(contact)
                for contact in contacts
            ]
        of_bodies = sum(len(body.freedom) for body in layout.own_bodies)
        lam = self._rows(layout.n, layout.size - of_bodies)
        self._B, self._C = A.createSubMatrix(u, lam), A.createSubMatrix(lam, u)
        self._inverse = self._inverse_blocks(A.createSubMatrix(lam, lam))
        EC = self._inverse.matMult(self._C)
        BEC = self._B.matMult(EC)
        # In place of K, which is as large as the tangent
        K.axpy(-1.0, BEC, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        destroy(EC, BEC)
        return K

    def _inverse_blocks(self, D: PETSc.Mat) -> PETSc.Mat:
        """Make E^-1 of the nodes' blocks of D, which is destroyed, and the masses."""
        # The factors of the rows, springs included
        scale, first, parts = self._row_factors()[self.contact.layout.n :], 0, []
        for contact, factor in zip(self._with_multiplier, self._factors):
            c, mass = contact.layout.components, factor * lumped_mass(contact)
            at = first + np.arange(c * len(mass)).reshape(-1, c)
            springs = (scale[at] * mass[:, None])[:, :, None] * np.eye(c)
            parts.append(np.linalg.inv(node_blocks(D, at) - springs))
            first += at.size
        inverse = block_diagonal(parts, D.comm)
        D.destroy()
        return inverse

    @kept_inside
    def apply(self, pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Solve near contact first, then everywhere. Collective."""
        A, _ = pc.getOperators()
        part, _ = self._near_contact.getOperators()
        self._cycles += 1
        rest, further = x.duplicate(), x.duplicate()
        near, right = part.createVecs()
        near_rows = self._near_rows
        right.array[:] = self._ratios[near_rows] * x.array_r[near_rows]
        self._near_contact.solve(right, near)
        y.set(0.0)
        y.array[self._near_rows] = near.array_r
        A.mult(y, rest)
        rest.aypx(-1.0, x)
        rest.array[:] *= self._ratios
        self._cycle(rest, further)
        y.axpy(1.0, further)
        destroy(rest, further, near, right)

    def _cycle(self, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Eliminate, solve and substitute; 0 for free bodies. Collective."""
        n, right, u = self.contact.layout.n, self._right, self._solution
        right.array[:] = x.array_r[:n]
        y.set(0.0)
        if not self._with_multiplier:
            self.solver.solve(right, u)
        else:
            lam, rest = self._inverse.createVecs()
            rest.array[:] = x.array_r[n : n + rest.local_size]
            self._inverse.mult(rest, lam)
            self._B.mult(lam, u)
            right.axpy(-1.0, u)
            self.solver.solve(right, u)
            self._C.mult(u, lam)
            rest.axpy(-1.0, lam)
            self._inverse.mult(rest, lam)
            y.array[n : n + lam.local_size] = lam.array_r
            destroy(rest, lam)
        y.array[:n] = u.array_r

    def reset(self, pc: PETSc.PC) -> None:
        """Keep all: the next tangent may have another pattern, which the blocks serve as
        well."""

    def forget(self) -> None:
        """Free the blocks, so that the next set-up takes new ones. Collective."""
        self._destroy("solver", "_B", "_C", "_inverse", "_right", "_solution")
        self._destroy("_near_contact")
        destroy(*self._coarse)
        self._coarse = []

    def destroy(self, pc: PETSc.PC) -> None:
        """Free all, as PETSc asks at the end. Collective."""
        self.forget()
        self._destroy("levels")


# Its name until the next release
ContactPreconditioner = BodiesPreconditioner


def lumped_mass(contact: Any) -> Array:
    """int N_a dG at the owned unknowns of the multiplier, (nodes,). Collective."""
    W = contact.multiplier.function_space
    mass = compat.create_la_vector(W.dofmap.index_map, 1)
    degree = compat.element_info(W).degree
    for zone in contact.zones:
        points = zone.cpp.points()
        shape = zone.facets.slave_surface.shape
        N, _ = shape_functions(shape, degree, points["xi"])
        if (
            contact.system.axisymmetric
        ):  # of degree 2 they have no mean at a node on the axis
            N = np.abs(N)
        dofs = zone.multiplier_table[points["slave"]]
        np.add.at(mass.array, dofs, points["weight"][:, None] * N)
    compat.scatter_reverse_add(mass)
    return mass.array[contact.layout.owned_multipliers]


def surface_stiffness(contact: Any) -> float:
    """Diagonal of the volume's stiffness per area of the slave surface. Collective."""
    V, comm = contact.u.function_space, contact.layout.comm
    bs = V.dofmap.index_map_bs
    slave = owned_nodes_on(V, [zone.facets.slave_surface for zone in contact.zones])
    diagonal = contact.system.stiffness_diagonal.reshape(-1, bs)[slave].sum() / bs
    sums = np.array([diagonal, lumped_mass(contact).sum()])
    comm.Allreduce(MPI.IN_PLACE, sums)
    return float(sums[0] / sums[1])


def _rows_near_contact(contact: Any) -> Places:
    """Owned rows near contact: the displacement on its surfaces and in some layers of
    cells behind them, all multipliers and free bodies. Collective."""
    V, layout = contact.u.function_space, contact.layout
    near = marked_everywhere(V, np.concatenate([one.dofs for one in sides(contact)]))
    table = compat.dofmap_array(V)
    for _ in range(LAYERS):
        near[table[near[table].any(axis=1)]] = True
        near = marked_everywhere(V, np.flatnonzero(near))
    nodes = np.flatnonzero(near[: V.dofmap.index_map.size_local])
    u = unrolled(nodes, V.dofmap.index_map_bs)
    return np.concatenate([u, np.arange(layout.n, layout.size)])

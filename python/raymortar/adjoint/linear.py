"""The linear system of an adjoint at a state, and derivatives of contact's residual."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from petsc4py import PETSc

import numpy as np

from .. import _cpp
from ..core.compat import Array
from ..core.discretization.ranks import destroy
from ..core.errors import SetUpError, raise_everywhere, together
from ..core.interface.zone_data import on_sides

# Residual over the forces in balance from which on a state has not converged
NOT_CONVERGED = 1e-4


class Linearised:
    """A problem at its present state, where its residual is zero. Collective.

    Attributes
    ----------
    problem
        The problem, with multipliers among its unknowns.
    weights
        Factors of contact's residual by which `by_parameter` multiplies its derivatives.
    springs
        Of each zone, weights of what friction springs hold at the end of the step, rows
        as those of `ZoneData.spring_points`: derivatives of contact are less theirs.
    """

    def __init__(self, problem: Any) -> None:
        self.problem, self.system = problem, problem.contact.system
        for part in problem.contact.parts:
            part.present.require_results()
        before = list(problem.history)
        self._x = problem.start()
        problem.history[:] = before
        problem.form(self._x)
        # The first iterate of a step leaves the motion of segments out of the tangent
        self.system.update()
        problem.form(self._x)
        self.weights = problem.create_vector()
        self.springs: list[Array] = [np.empty(0) for _ in problem.contact.zones]
        self._A: PETSc.Mat | None = None
        self._M: PETSc.Mat | None = None
        self._ksp: PETSc.KSP | None = None
        self._found: dict[Any, Array] = {}

    def require_converged(self) -> None:
        """Raise where the state does not solve the problem. Collective."""
        before, b = list(self.problem.history), self.problem.create_vector()
        self.problem.F(self._x, b)
        b.destroy()
        self.problem.history[:] = before
        convergence = self.problem.convergence
        last = convergence.now
        forces = np.linalg.norm(last.forces[: last.count])
        message = None
        if not last.norm <= max(NOT_CONVERGED * forces, convergence.floor):
            message = (
                f"the residual at the present state is {last.norm:.3g}, of forces of "
                f"{forces:.3g}: solve the problem first, and call gradient before "
                "contact.advance()"
            )
        raise_everywhere(self.problem.comm, message, SetUpError)

    def destroy(self) -> None:
        """Free PETSc's objects. Collective."""
        destroy(*filter(None, (self._x, self.weights, self._ksp, self._A, self._M)))

    # The transposed system

    def solve(self, right: PETSc.Vec) -> PETSc.Vec:
        """Solve A^T lam = right [theory (8.3)]; lam is zero where conditions prescribe
        unknowns. Collective."""
        problem = self.problem
        if self._ksp is None:
            self._A = problem.create_matrix()
            problem.J(self._x, self._A)
            self._ksp = direct_solver(self._A)
        found = problem.create_vector()
        self._ksp.solveTranspose(right, found)
        found.array[: self.system.layout.n][problem.prescribed] = 0.0
        return found

    # Derivatives of contact

    def weigh(self, weights: PETSc.Vec) -> None:
        """Set the factors of contact's residual."""
        weights.copy(self.weights)
        self._found.clear()

    def by_unknowns(self, weights: PETSc.Vec | None = None) -> PETSc.Vec:
        """Derivative of contact's weighed residual by all unknowns, prescribed ones too.
        Collective."""
        M = self._matrix()
        self.system.constrained(())
        self.system.add_tangent(M, ())
        y = self._product(M, weights)
        self.system.constrained(self.problem.bcs)
        if weights is None:
            self.take_springs(y, self.problem.contact.zones, "unknowns")
        return y

    def by_parameter(
        self, zones: Sequence[Any], kind: str, **of_tool: Any
    ) -> PETSc.Vec:
        """Derivative of the weighed residual of some zones by a parameter, as a vector
        over the displacements, see ``adjoint/parameter.h``. Collective."""
        M = self._matrix()
        for zone in zones:
            _cpp.add_by_parameter(zone.cpp, M.handle, kind, **of_tool)
        y = self._product(M, None)
        self.take_springs(y, zones, kind, **of_tool)
        return y

    def take_springs(
        self, y: PETSc.Vec, zones: Sequence[Any], kind: str, **of_tool: Any
    ) -> None:
        """Take the derivative of what springs hold at the end of the step from a vector
        [theory (8.13)]. Collective."""
        with together(self.problem.comm):
            for zone, weights in zip(self.problem.contact.zones, self.springs):
                if any(zone is one for one in zones):
                    _cpp.add_springs_by_parameter(
                        zone.cpp, y.handle, weights, kind, **of_tool
                    )
        y.assemble()

    def springs_back(self) -> list[Array]:
        """Weights of what springs held at the start of the step, as `springs`
        [theory (8.10)]. Collective."""
        w, found = self.displacements(self.weights), []
        for zone, weights in zip(self.problem.contact.zones, self.springs):
            slave, master = on_sides(zone, w)
            found.append(_cpp.springs_back(zone.cpp, slave, master, weights))
        return found

    def by_fields(self, contact: Any, kind: str) -> Array:
        """Derivatives by fields on a contact's slave: components over the
        displacement's local dofs. Collective."""
        if (contact, kind) not in self._found:
            y = self.by_parameter(contact.zones, kind)
            self._found[contact, kind] = self.displacements(y)
            y.destroy()
        return self._found[contact, kind]

    def _matrix(self) -> PETSc.Mat:
        """Zero matrix with room for all rows and columns. Collective."""
        if self._M is None:
            self._M = self.problem.create_matrix()
            self._M.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
        else:
            self._M.zeroEntries()
        return self._M

    def _product(self, M: PETSc.Mat, weights: PETSc.Vec | None) -> PETSc.Vec:
        """Multiply a matrix from the left by weights, or by those of all. Collective."""
        M.assemble()
        y = self.problem.create_vector()
        M.multTranspose(self.weights if weights is None else weights, y)
        return y

    def displacements(self, y: PETSc.Vec) -> Array:
        """Entries of a vector in the rows of all local dofs of u, unrolled. Collective."""
        rows = self.system.layout.u_rows.ravel().astype(PETSc.IntType)
        where = PETSc.IS().createGeneral(rows, comm=PETSc.COMM_SELF)
        values = PETSc.Vec().createSeq(len(rows), comm=PETSc.COMM_SELF)
        scatter = PETSc.Scatter().create(y, where, values, None)
        scatter.scatter(y, values)
        found: Array = values.array_r.copy()
        destroy(scatter, where, values)
        return found

    def of_displacement(self, values: Array, k: int) -> Array:
        """The part of an array over the local dofs of u that the k-th displacement has."""
        return values[self.system.unknowns.u_places(k)]

    def owned_sums(self, y: PETSc.Vec) -> Array:
        """Sum of a vector over the displacement's nodes, by component. Collective."""
        d = self.system.u.function_space.mesh.geometry.dim
        own = y.array_r[: self.system.layout.n][self.system.unknowns.u_owned]
        found: Array = self.problem.comm.allreduce(own.reshape(-1, d).sum(axis=0))
        return found


def direct_solver(A: PETSc.Mat) -> PETSc.KSP:
    """Make a direct solver of a matrix. Collective."""
    ksp = PETSc.KSP().create(A.comm)
    ksp.setOperators(A)
    ksp.setType(PETSc.KSP.Type.PREONLY)
    pc = ksp.getPC()
    pc.setType(PETSc.PC.Type.LU)
    pc.setFactorSolverType("mumps")
    pc.setFactorSetUpSolverType()
    pc.getFactorMatrix().setMumpsIcntl(14, 60)
    return ksp

"""Viscous forces on bodies: those that fade, and those that hold a motion."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh

from ..core import compat
from ..core.compat import Array
from ..core.problem import CoupledProblem
from ..core.system.volume import Forms
from ..core.terms import Term
from ..diagnose.holding import largest_motions
from ..diagnose.rigid_motions import places, rigid_motions, rigid_part

# Cells that move alike are told apart by their place along a line that is askew to
# most bodies, which counts as this share of their motion
APART, ALONG = 1e-3, np.array((1.0, 0.618, 0.382))


class Viscosity(Term):
    """Forces s k (u - u_0) per volume, in which u - u_0 is the velocity. Collective.

    In each body k is the trace of the stiffness over that of the mass (for a density of
    1). So s is a share of the stiffness, whatever the units, the size or the material
    [theory (5.12)]. Forces that hold a motion act in one cell of the body, along the way
    that this cell goes.
    """

    spoken = "viscous forces"

    def __init__(self, problem: CoupledProblem) -> None:
        self._problem, self._contact = problem, problem.contact
        self._part = part = problem.contact.unknowns.only
        V, dim = part.u.function_space, part.u.function_space.dofmap.index_map_bs
        self._start = fem.Function(V)
        self._scale = fem.Constant(V.mesh, PETSc.ScalarType(0.0))
        self._k = fem.Function(compat.space(V.mesh, "DG", 0, (dim, dim)))
        J = problem.form_of_u[1]
        v, du = (compat.part_of(one, part.component) for one in J.arguments())
        k = self._scale * self._k
        of_turn = _circumference(V.mesh) if problem.contact.system.axisymmetric else 1.0
        force = ufl.inner(k * (part.u - self._start), v) * of_turn * ufl.dx
        tangent = ufl.inner(k * du, v) * of_turn * ufl.dx
        self._force = compat.form(force)
        tangent = compat.form(tangent)
        count, at = len(problem.contact.unknowns.functions), part.at
        forms = [None] * count
        table = [[None] * count for _ in forms]
        forms[at], table[at][at] = self._force, tangent
        self._forms = Forms(problem.contact, forms, table)
        whole = problem.contact.unknowns.functions[part.at]
        self._r = compat.create_la_vector(*compat.unknowns_of(whole))
        ones = fem.Function(V)
        ones.x.array[:] = 1.0
        mass = compat.form(ufl.inner(ones, v) * of_turn * ufl.dx)
        cells, owned = compat.dofmap_array(V), V.mesh.topology.index_map(dim).size_local
        cells = cells[:owned]
        self._cells = compat.dofmap_array(self._k.function_space)[:owned, 0]
        self._middles = V.tabulate_dof_coordinates()[cells, :dim].mean(axis=1)
        self._of_cell = problem.contact.system.bodies.dofs[cells[:, 0]]
        k = self._stiffness(mass)[self._of_cell, None, None]
        # Of forces that fade, and of those that hold a motion, (cells, d, d)
        self._fading, self._holding = k * np.eye(dim), 0.0 * k * np.eye(dim)

    def _stiffness(self, mass: Any) -> Array:
        """Find k of every body, given the form of the mass."""
        groups = self._problem.convergence.groups
        diagonals = self._contact.system.stiffness_diagonal, self._of_displacement(mass)
        sums = groups.sum(*map(groups.on_rows, diagonals))[:, : groups.bodies]
        return np.asarray(np.abs(sums[0]) / sums[1])

    def _of_displacement(self, form: Any) -> Array:
        """Assemble a linear form at the owned dofs of the displacement."""
        self._r.array[:] = 0.0
        compat.assemble_residual(self._r.array, form)
        compat.scatter_reverse_add(self._r)
        return np.asarray(self._r.array[self._part.dofs[: self._part.size_owned]])

    def begin(self) -> None:
        """Take the present displacement as u_0."""
        self._start.x.array[:] = self._contact.u.x.array

    def motions(self) -> Array:
        """Find the largest component of u - u_0 in each body. Length. Collective."""
        return largest_motions(self._contact, self._start.x.array)

    def hold(self, body: int, change: Array) -> None:
        """Hold the cell of a body that goes furthest in the rigid part of its motion,
        given the change of the owned dofs of the displacement. Collective."""
        contact, comm, x = self._contact, self._problem.comm, self._middles
        place = places(contact, x)
        motion = rigid_part(self._problem, body, change)[0]
        way = (motion @ rigid_motions(place)).reshape(x.shape)
        size = np.linalg.norm(way, axis=1) * (self._of_cell == body)
        size *= 1.0 + APART * (place @ ALONG[: x.shape[1]])
        mine = float(size.max(initial=-1.0)), comm.rank
        if comm.allreduce(mine, op=MPI.MAXLOC)[1] == comm.rank:
            at = size.argmax()
            d = way[at] / np.linalg.norm(way[at])
            self._holding[at] += self._fading[at, 0, 0] * np.outer(d, d)

    def release(self) -> None:
        """Hold no motion any more."""
        self._holding[:] = 0.0

    def held(self) -> Array:
        """Return what holds motions, for `hold_as`."""
        return self._holding.copy()

    def hold_as(self, held: Array) -> None:
        """Hold motions as they were held before."""
        self._holding[:] = held

    def acting(self, scale: float, holds: bool = False) -> AbstractContextManager[None]:
        """Add forces with s as given, in all cells or those that hold a motion, to those
        of the problem."""
        self._scale.value, self.leads_far = scale, not holds
        k = self._holding if holds else self._fading
        self._k.x.array.reshape(-1, *k.shape[1:])[self._cells] = k
        return self._problem.extended_by(self)

    def residual(self, bcs: Sequence[Any], lacking: Any) -> Array:
        """Forces at the owned unknowns of the forms, (n,)."""
        return self._forms.residual(bcs, lacking.increment)

    def forces(self, bcs: Sequence[Any]) -> Array:
        """Forces after a solve, (n,)."""
        return self._forms.residual()

    def add_tangent(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        """Add their derivative."""
        self._forms.add_tangent(A, bcs)

    def change(self) -> Array:
        """Return u - u_0 at the owned dofs of the displacement. Length."""
        change = self._contact.u.x.array - self._start.x.array
        return np.asarray(change[: self._contact.layout.n_u])

    def measure(self) -> tuple[float, float]:
        """Find the work since u_0 and the largest share of a body's forces. Collective.

        Call it after a solve. Prescribed dofs have no share.
        """
        problem, convergence = self._problem, self._problem.convergence
        groups = convergence.groups
        force = self._of_displacement(self._force)
        work = problem.comm.allreduce(float(force @ self.change()))
        free = self._on_free_rows(force)
        viscous = np.sqrt(groups.sum(free**2))[: groups.bodies]
        # A body in flight has no other forces
        forces = np.maximum(convergence.now.forces[: groups.bodies], viscous)
        return work, float((viscous / np.maximum(forces, convergence.floor)).max())

    def _on_free_rows(self, force: Array) -> Array:
        """Place forces at the owned dofs of the displacement at their rows, without
        those that are prescribed."""
        problem = self._problem
        free = np.where(problem.constrained, 0.0, force)
        return problem.convergence.groups.on_rows(free)

    def drive(self) -> float:
        """Find the largest share of a body's forces that drives its motion, by sums of
        components: a force in one cell counts as much as one that many nodes share.
        Collective. Call it after a solve."""
        problem, groups = self._problem, self._problem.convergence.groups
        all_forces = problem.volume.forces(problem.bcs)[self._contact.unknowns.u_owned]
        rows = self._of_displacement(self._force), all_forces
        viscous, of_body = (
            groups.sum(np.abs(self._on_free_rows(one)))[: groups.bodies] for one in rows
        )
        size = np.maximum(of_body, viscous)
        return float((viscous[size > 0.0] / size[size > 0.0]).max(initial=0.0))


def _circumference(mesh: Mesh) -> Any:
    """2 pi r of the undeformed mesh, for forms of solids of revolution. Length."""
    return 2.0 * np.pi * ufl.SpatialCoordinate(mesh)[0]

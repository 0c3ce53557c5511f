"""Viscous forces in the volume, which hold bodies that nothing else holds."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem

from .. import compat
from ..compat import Array
from ..convergence.balance import largest_by
from ..host.axisymmetry import weight
from ..system.volume import Volume

if TYPE_CHECKING:
    from ..problem import CoupledProblem


class Viscosity:
    """Forces s k (u - u_0) per volume. The change u - u_0 stands for the velocity.
    Collective.

    In each body k is the trace of the stiffness over that of the mass (for a density of
    1). So s is a share of the stiffness, whatever the units, the size or the material
    [theory (5.12)].

    Parameters
    ----------
    problem
        Within `acting`, its forms include the forces.

    Attributes
    ----------
    scale
        The factor s.
    """

    def __init__(self, problem: CoupledProblem) -> None:
        self.problem, host = problem, problem.contact.host
        u = host.only.u
        V = u.function_space
        self.comm: MPI.Comm = problem.comm
        self._start = fem.Function(V)
        self._scale = fem.Constant(V.mesh, PETSc.ScalarType(0.0))
        self._k = fem.Function(compat.space(V.mesh, "DG", 0))
        self._displacement = host.only
        F, J = problem.form_of_u
        part = host.only.component
        v, du = (compat.part_of(argument, part) for argument in J.arguments())
        k = self._scale * self._k
        self._weight = weight(V.mesh) if problem.contact.axisymmetric else 1.0
        force = k * ufl.inner(u - self._start, v) * self._weight * ufl.dx
        self._force = compat.form(force)
        tangent = J + k * ufl.inner(du, v) * self._weight * ufl.dx
        forms = compat.form(F + force), compat.form(tangent)
        self._volume = Volume(problem.contact, *problem.volume.with_form_of_u(*forms))
        whole = host.functions[host.only.at]
        self._r = compat.create_la_vector(*compat.unknowns_of(whole))
        self._set_stiffness(v)

    def _set_stiffness(self, v: Any) -> None:
        """Set k in every cell."""
        V = self._start.function_space
        ones = fem.Function(V)
        ones.x.array[:] = 1.0
        mass = self._of_displacement(
            compat.form(ufl.inner(ones, v) * self._weight * ufl.dx)
        )
        bodies, bs = self.problem.contact.bodies, V.dofmap.index_map_bs
        diagonal = self.problem.contact.stiffness_diagonal
        n = len(diagonal)
        of_row = np.repeat(bodies.dofs, bs)[:n]
        sums = np.array(
            [np.bincount(of_row, values, bodies.count) for values in (diagonal, mass)],
            dtype=float,
        )
        self.comm.Allreduce(MPI.IN_PLACE, sums)
        of_cell = bodies.dofs[compat.dofmap_array(V)[:, 0]]
        cells = compat.dofmap_array(self._k.function_space)[:, 0]
        self._k.x.array[cells] = (np.abs(sums[0]) / sums[1])[of_cell[: len(cells)]]

    def _of_displacement(self, form: Any) -> Array:
        """A linear form of the displacement's test function, at its owned dofs."""
        self._r.array[:] = 0.0
        compat.assemble_residual(self._r.array, form)
        compat.scatter_reverse_add(self._r)
        owned = self._displacement.dofs[: self._displacement.size_owned]
        found: Array = self._r.array[owned]
        return found

    @property
    def scale(self) -> float:
        """The factor s."""
        return float(self._scale.value)

    @scale.setter
    def scale(self, value: float) -> None:
        self._scale.value = value

    def begin(self) -> None:
        """Take the present displacement as u_0."""
        self._start.x.array[:] = self.problem.contact.u.x.array

    def motions(self) -> Array:
        """Largest component of u - u_0 in each body, (bodies,). Length. Collective."""
        contact = self.problem.contact
        change = np.abs(contact.u.x.array - self._start.x.array)
        by_node = change.reshape(-1, contact.u.function_space.dofmap.index_map_bs)
        bodies = contact.bodies
        most = largest_by(bodies.dofs, by_node, bodies.count).max(axis=1)
        self.comm.Allreduce(MPI.IN_PLACE, most, op=MPI.MAX)
        return most

    @contextmanager
    def acting(self) -> Iterator[None]:
        """Within it, the problem has these forces."""
        kept, self.problem.volume = self.problem.volume, self._volume
        try:
            yield
        finally:
            self.problem.volume = kept

    def measure(self) -> tuple[float, float]:
        """Work of the forces since u_0, and their share of all forces, in the body
        where it is largest. Call it after a solve. Collective."""
        n = self.problem.contact.layout.n_u
        force = self._of_displacement(self._force)
        u = self.problem.contact.u.x.array
        work = float(force @ (u[:n] - self._start.x.array[:n]))
        return float(self.comm.allreduce(work)), self._share(force)

    def _share(self, force: Array) -> float:
        """Largest share of a body. Prescribed dofs are left out."""
        convergence = self.problem.convergence
        groups = convergence.groups
        free = groups.on_rows(np.where(self.problem.constrained, 0.0, force))
        of_bodies = np.sqrt(groups.sum(free**2))[: groups.bodies]
        # A body in flight has no other forces
        forces = np.maximum(convergence.now.forces[: groups.bodies], of_bodies)
        return float((of_bodies / np.maximum(forces, convergence.floor)).max())

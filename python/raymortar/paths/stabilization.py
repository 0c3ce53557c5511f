"""Viscous forces, which fade until each load step ends without them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem

from .. import compat
from ..compat import Array, Mask
from ..diagnose.failure import FAILURES
from ..diagnose.lost_contact import has_no_springs, largest_motions
from ..discretization.bodies import bodies_of_facets
from ..discretization.checks import weight
from ..errors import ConvergenceError, SetUpError
from ..interface.stiffness import mean_facet_size
from ..problem import CoupledProblem
from ..system.volume import Volume

# First size of the forces, as a share of the diagonal of the stiffness
SHARE = 1e-4

# Factors on the forces from one solve to the next: usual, and after a failure
FADES, SLOWLY = 0.1, 0.5

# Share of all forces below which a step may end
REST = 1e-6

# Share of all forces below which a solve without viscous forces is tried
NEARLY = 1e-2

# Largest number of solves of one step
MOST = 200

# Largest motion of loose bodies in one solve, in sizes of slave facets. Contact is
# found up to a distance or depth of two facets. Held bodies may also close gaps
FARTHEST = 1.0

# Largest number of solves of one motion. Forces grow after each that fails or moves too
# far
ATTEMPTS = 5

# Largest motion in the last solve, without viscous forces, as a share of the limit: a
# body that moves further is held by nothing
SETTLED = 0.1


class Viscosity:
    """Forces s k (u - u_0) per volume, in which u - u_0 is the velocity. Collective.

    In each body k is the trace of the stiffness over that of the mass (for a density of
    1). So s is a share of the stiffness, whatever the units, the size or the material
    [theory (5.12)].
    """

    def __init__(self, problem: CoupledProblem) -> None:
        self._problem, self._contact = problem, problem.contact
        self._part = part = problem.contact.unknowns.only
        V = part.u.function_space
        self._start = fem.Function(V)
        self._scale = fem.Constant(V.mesh, PETSc.ScalarType(0.0))
        self._k = fem.Function(compat.space(V.mesh, "DG", 0))
        F, J = problem.form_of_u
        v, du = (compat.part_of(one, part.component) for one in J.arguments())
        k = self._scale * self._k
        of_turn = weight(V.mesh) if problem.contact.axisymmetric else 1.0
        force = k * ufl.inner(part.u - self._start, v) * of_turn * ufl.dx
        tangent = J + k * ufl.inner(du, v) * of_turn * ufl.dx
        self._force = compat.form(force)
        forms = compat.form(F + force), compat.form(tangent)
        self._volume = Volume(problem.contact, *problem.volume.with_form_of_u(*forms))
        whole = problem.contact.unknowns.functions[part.at]
        self._r = compat.create_la_vector(*compat.unknowns_of(whole))
        ones = fem.Function(V)
        ones.x.array[:] = 1.0
        self._set_stiffness(compat.form(ufl.inner(ones, v) * of_turn * ufl.dx))

    def _set_stiffness(self, mass: Any) -> None:
        """Set k in every cell, given the form of the mass."""
        groups, bodies = self._problem.convergence.groups, self._contact.bodies
        diagonals = self._contact.stiffness_diagonal, self._of_displacement(mass)
        sums = groups.sum(*map(groups.on_rows, diagonals))[:, : groups.bodies]
        k = np.abs(sums[0]) / sums[1]
        of_cell = bodies.dofs[compat.dofmap_array(self._start.function_space)[:, 0]]
        cells = compat.dofmap_array(self._k.function_space)[:, 0]
        self._k.x.array[cells] = k[of_cell[: len(cells)]]

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

    @contextmanager
    def acting(self, scale: float) -> Iterator[None]:
        """Add the forces, with s as given, to those of the problem."""
        self._scale.value = scale
        kept, self._problem.volume = self._problem.volume, self._volume
        try:
            yield
        finally:
            self._problem.volume = kept

    def measure(self) -> tuple[float, float]:
        """Find the work since u_0 and the largest share of a body's forces. Collective.

        Call it after a solve. Prescribed dofs have no share.
        """
        problem, convergence = self._problem, self._problem.convergence
        groups = convergence.groups
        force = self._of_displacement(self._force)
        change = self._contact.u.x.array - self._start.x.array
        work = problem.comm.allreduce(float(force @ change[: len(force)]))
        free = groups.on_rows(np.where(problem.constrained, 0.0, force))
        viscous = np.sqrt(groups.sum(free**2))[: groups.bodies]
        # A body in flight has no other forces
        forces = np.maximum(convergence.now.forces[: groups.bodies], viscous)
        return work, float((viscous / np.maximum(forces, convergence.floor)).max())


def loose_bodies(problem: CoupledProblem) -> Mask:
    """Whether neither conditions nor springs hold each body, (bodies,). Collective."""
    groups = problem.convergence.groups
    held = groups.sum(groups.on_rows(problem.constrained.astype(np.float64)))
    return np.asarray((held[: groups.bodies] == 0.0) & has_no_springs(problem))


class Stabilization:
    """Solve steps in several solves under fading viscous forces. Collective.

    Bodies that only contact holds find their place: no solve moves them further than
    contact is found, and the forces fade as they move less. The step ends when a solve
    without the forces moves hardly anything, or when the forces are negligible.

    `most` is the largest number of solves of one step, `MOST` by default, and `work` the
    work of the viscous forces so far. Energy. `share` is the largest share of all forces
    of a body at the end of the last step.
    """

    def __init__(self, solver: Any, factor: float, most: int | None = None) -> None:
        problem = solver.problem
        self._factor, self._most = factor, most
        self._viscosity = Viscosity(problem)
        self._contact = contact = problem.contact
        self.work = self.share = 0.0
        self._loose, self._caught = loose_bodies(problem), False
        self._limit = np.inf
        if self._loose.any():
            self._limit = FARTHEST * mean_facet_size(contact.layout, contact.zones)
        # Whether slave or masters of each zone are on each body
        self._meets = np.zeros((len(contact.zones), contact.bodies.count))
        for meets, zone in zip(self._meets, contact.zones):
            for surface in (zone.facets.slave_surface, zone.facets.master_surface):
                meets[bodies_of_facets(contact.bodies, surface)] = 1.0
        problem.comm.Allreduce(MPI.IN_PLACE, self._meets, op=MPI.MAX)

    def is_of_use(self) -> bool:
        """Whether supports hold all bodies or contact is in reach. Collective.

        A body in free flight needs the user's own word.
        """
        return not self._loose.any() or bool(self._contact.statistics.hits)

    def solve(
        self, solve: Callable[[], int], plain: Callable[[], int] | None = None
    ) -> int:
        """Solve one step, each time by `solve`; return all iterations. Collective.

        `plain` solves the step where contact has held all loose bodies at its start.
        """
        self._viscosity.begin()
        if plain is not None and self._caught:
            last = self._without(plain, 1.0)
            if last is not None:
                return last
        scale, iterations, work = SHARE * self._factor, 0, 0.0
        most = self._most or MOST
        for _ in range(most):
            asked = scale
            more, scale = self._under(scale, solve)
            iterations += more
            done, share = self._viscosity.measure()
            work += done
            last = self._without(solve, SETTLED) if share <= NEARLY else None
            if last is not None or share <= REST:
                self._caught = last is not None and bool(self._loose.any())
                self.work += work
                self.share = share if last is None else 0.0
                return iterations + (last or 0)
            if self._loose.any() and not self._contact.statistics.active_points:
                self._contact.advance()  # a flight is no slip
            # Forces that let motions keep to their limit. Where weaker ones have just
            # failed, they fade slowly
            least = FADES if scale <= asked else SLOWLY
            _, loose = self._motions()
            scale *= max(least, min(1.0, loose / (0.8 * self._limit)))
        raise ConvergenceError(
            f"viscous forces have not faded after {most} solves: they are "
            f"{share:.3g} of all forces of a body that nothing holds"
        )

    def _under(self, scale: float, solve: Callable[[], int]) -> tuple[int, float]:
        """Solve once under viscous forces; return iterations and their last scale."""
        before = self._contact.state()
        self._viscosity.begin()
        for attempt in range(ATTEMPTS):
            try:
                with self._viscosity.acting(scale):
                    iterations = solve()
            except FAILURES as failure:
                if isinstance(failure, SetUpError):
                    raise
                self._contact.restore(before)
                if attempt == ATTEMPTS - 1:
                    raise
                scale /= FADES
                continue
            motions, loose = self._motions()
            self._require_approach(motions)
            if loose <= self._limit:
                return iterations, scale
            scale *= 2.0 * loose / self._limit
            self._contact.restore(before)
        raise ConvergenceError(
            "a body that contact alone holds moves by more than the size of its "
            f"facets, {self._limit:.3g}, in one solve"
        )

    def _motions(self) -> tuple[Array, float]:
        """Find the motions of all bodies and the largest of loose ones. Collective."""
        motions = self._viscosity.motions()
        return motions, float(motions[self._loose].max(initial=0.0))

    def _require_approach(self, motions: Array) -> None:
        """Refuse motions of held bodies that may have passed loose ones. Collective.

        They move by more than the gap before the step and the limit.
        """
        for zone, meets in zip(self._contact.zones, self._meets > 0.0):
            held = float(motions[meets & ~self._loose].max(initial=0.0))
            reach = zone.distance("reach").min(initial=np.inf)
            gap = max(zone.opposite.gap.min(initial=reach), 0.0)
            gap = self._contact.layout.comm.allreduce(gap, op=MPI.MIN)
            if self._loose[meets].any() and held > self._limit + gap:
                raise ConvergenceError(
                    f"a held body moves by {held:.3g} in this step, with a gap of "
                    f"{gap:.3g} to what nothing holds: it may have passed it"
                )

    def _without(self, solve: Callable[[], int], most: float) -> int | None:
        """Solve without viscous forces; return None if it fails or loose bodies move by
        more than a share of their limit."""
        before = self._contact.state()
        self._viscosity.begin()
        try:
            iterations = solve()
            if self._motions()[1] <= most * self._limit:
                return iterations
        except FAILURES as failure:
            if isinstance(failure, SetUpError):
                raise
        self._contact.restore(before)
        return None

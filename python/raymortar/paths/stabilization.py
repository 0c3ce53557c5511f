"""Viscous forces, which fade until each load step ends without them."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cached_property
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem

from .. import compat
from ..compat import Array, Mask
from ..diagnose.failure import FAILURES
from ..diagnose.lost_contact import (
    has_no_springs,
    largest_motions,
    motion_in_words,
    touched,
)
from ..discretization.bodies import bodies_of_facets
from ..discretization.checks import weight
from ..discretization.ranks import ends_of
from ..errors import ContactWarning, ConvergenceError, SetUpError
from ..interface.stiffness import mean_facet_size
from ..interface.zone_data import ZoneData
from ..problem import CoupledProblem
from ..system.volume import Volume
from .prediction import Backoff

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

# Largest number of tangents of one step under forces that the user has not asked for.
# Steps that arrive need up to 446 (docs/measured/robustness_paths.md)
MOST_TANGENTS = 800

# Largest motion of loose bodies in one solve, in sizes of slave facets. Contact is
# found up to a distance or depth of two facets. Held bodies may also close gaps
FARTHEST = 1.0

# Largest number of solves of one motion. Forces grow after each that fails or moves too
# far
ATTEMPTS = 5

# Share of all forces up to which a motion counts as driven by nothing but noise, where
# it does not fall with the viscous forces
IDLE = 1e-3

# Motion in a step that they then allow, as a share of the limit
DRIFT = 0.02

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
        given = problem.volume
        self._volume = Volume(
            problem.contact, *given.with_form_of_u(*forms), updated=given.updated
        )
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
        free = groups.on_rows(np.where(problem.constrained, 0.0, force))
        viscous = np.sqrt(groups.sum(free**2))[: groups.bodies]
        # A body in flight has no other forces
        forces = np.maximum(convergence.now.forces[: groups.bodies], viscous)
        return work, float((viscous / np.maximum(forces, convergence.floor)).max())


class Stabilization:
    """Solve steps in several solves under fading viscous forces. Collective.

    Bodies that only contact holds find their place: no solve moves them further than
    contact is found, and the forces fade as they move less. The step ends when a solve
    without the forces moves hardly anything, when the forces are negligible, or when
    they hold a motion that nothing else resists and that nothing drives. In the next
    steps they then hold it as they did at the end of this one.

    `most` is the largest number of solves of one step, `MOST` where the user asks for
    the forces, which None tells; else a step takes at most `MOST_TANGENTS` besides.
    `work` is the work of the viscous forces so far. Energy. `share` is the largest share
    of all forces of a body at the end of the last step. `gave_up` tells why the last step
    was given up, if it took too many tangents.
    """

    def __init__(self, solver: Any, factor: float, most: int | None = None) -> None:
        self._problem = problem = solver.problem
        assert problem.contact.unknowns.only  # or it raises
        self._factor, self._most, self.is_asked_for = factor, most, most is None
        self._contact = contact = problem.contact
        self.work = self.share = 0.0
        groups = problem.convergence.groups
        held = groups.on_rows(problem.constrained)
        self._loose = groups.sum(held)[: groups.bodies] == 0.0
        self._limit = np.inf
        if self._loose.any():
            self._limit = FARTHEST * mean_facet_size(contact.zones)
        self._begun = problem.tangents  # before the present step
        self.gave_up: str | None = None
        # Scale of the forces that hold a motion which nothing else resists
        self._holding: float | None = None
        self._without_it, self._said = Backoff(), False

    @cached_property
    def _viscosity(self) -> Viscosity:
        return Viscosity(self._problem)

    @cached_property
    def _meets(self) -> Mask:
        """Whether slave or masters of each zone are on each body, (zones, bodies)."""
        contact = self._contact
        found = np.zeros((len(contact.zones), contact.bodies.count))
        for meets, zone in zip(found, contact.zones):
            for surface in (zone.facets.slave_surface, zone.facets.master_surface):
                meets[bodies_of_facets(contact.bodies, surface)] = 1.0
        self._problem.comm.Allreduce(MPI.IN_PLACE, found, op=MPI.MAX)
        return found > 0.0

    def is_of_use(self) -> bool:
        """Whether supports hold all bodies or contact is in reach. Collective.

        A body in free flight needs the user's own word.
        """
        return not self._loose.any() or bool(self._contact.statistics.hits)

    def is_needed(self) -> bool:
        """Whether a body is held by nothing at the accepted step. Collective."""
        if not self._loose.any() or self._holding is not None:
            return bool(self._loose.any())
        self._contact.update()
        is_free = self._loose & ~touched(self._contact, len(self._loose))
        if not self.is_asked_for and is_free.any():
            is_free &= has_no_springs(self._problem)
        return bool(is_free.any()) and (self.is_asked_for or self.is_of_use())

    def pass_by(self, solve: Callable[[], int]) -> int | None:
        """Solve a step without the forces; return None if that fails or moves a loose
        body further than contact is found. Collective."""
        self.share = 0.0
        return self._without(solve, self._limit)

    def solve(
        self, solve: Callable[[], int], alone: Callable[[], int] | None = None
    ) -> int:
        """Solve one step, each time by `solve`, or `alone` where the forces are left
        out; return all iterations. Collective."""
        ways, iterations = (solve, alone or solve), None
        self._begun, self.gave_up = self._problem.tangents, None
        if self._holding is not None:
            iterations = self._hold_on(*ways)
        return self._fade(*ways) if iterations is None else iterations

    def _fade(self, solve: Callable[[], int], alone: Callable[[], int]) -> int:
        """Solve one step under forces that fade; return all iterations."""
        scale, iterations, work = SHARE * self._factor, 0, 0.0
        weakest = before = np.inf
        most = self._most or MOST
        for _ in range(most):
            asked = scale
            more, scale = self._under(scale, solve)
            iterations += more
            done, share = self._viscosity.measure()
            work += done
            last, moved = None, (self._viscosity.motions(), self._viscosity.change())
            if share <= NEARLY:
                last = self._without(alone, SETTLED * self._limit)
            is_idle = self._loose.any() and 0.5 * before < share <= IDLE
            weakest = min(scale, weakest)
            if last is not None or share <= REST or is_idle:
                self.work += work
                self.share = share if last is None else 0.0
                if last is None and is_idle:
                    self._hold(weakest, *moved)
                return iterations + (last or 0)
            if self._loose.any() and not self._contact.statistics.active_points:
                self._contact.advance()  # a flight is no slip
            # Forces that let motions keep to their limit. Where weaker ones have just
            # failed, they fade slowly
            least = FADES if scale <= asked else SLOWLY
            _, loose = self._motions()
            scale *= max(least, min(1.0, loose / (0.8 * self._limit)))
            before = share
        raise ConvergenceError(
            f"viscous forces have not faded after {most} solves: they are "
            f"{share:.3g} of all forces of a body that nothing holds"
        )

    def _hold(self, scale: float, motions: Array, change: Array) -> None:
        """Go on holding what has moved without resistance, and say so once."""
        motions[~self._loose] = 0.0
        loose = float(motions.max())
        self._holding = scale * max(1.0, loose / (DRIFT * self._limit))
        self._without_it = Backoff()
        if self._said:
            return
        self._said, problem = True, self._problem
        body = int(motions.argmax())
        warnings.warn(
            f"{problem.convergence.groups.names()[body]} may "
            f"{motion_in_words(problem, body, change)}: nothing resists that, and no "
            f"more than {self.share:.1e} of its forces drives it. Viscous forces hold "
            "it from here on; prescribe it if the place matters",
            ContactWarning,
            stacklevel=3,
        )

    def _hold_on(
        self, solve: Callable[[], int], alone: Callable[[], int]
    ) -> int | None:
        """Solve one step under the forces that hold a motion, or without them where it
        is held; return None if more than noise drives it."""
        assert self._holding is not None
        before = self._contact.state()
        if not self._without_it.rests():
            last = self._without(alone, SETTLED * self._limit)
            if last is not None:
                self._holding, self.share = None, 0.0
                return last
            self._without_it.failed()
        iterations, work = 0, 0.0
        try:
            # The second solve takes what the first has left to the forces that are held
            for _ in range(2):
                more, self._holding = self._under(self._holding, solve)
                iterations += more
                done, self.share = self._viscosity.measure()
                work += done
            if self.share <= IDLE:
                self.work += work
                return iterations
        except FAILURES as failure:
            if isinstance(failure, SetUpError):
                raise
        self._contact.restore(before)
        self._holding = None
        return None

    def _under(self, scale: float, solve: Callable[[], int]) -> tuple[int, float]:
        """Solve once under viscous forces; return iterations and their last scale."""
        before = self._contact.state()
        self._viscosity.begin()
        for attempt in range(ATTEMPTS):
            self._require_progress()
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

    def _require_progress(self) -> None:
        """Give up where the forces have taken more tangents than steps that arrive."""
        taken = self._problem.tangents - self._begun
        if not self.is_asked_for and taken > MOST_TANGENTS:
            self.gave_up = (
                f"viscous forces have not faded after {taken} tangents, where steps that "
                f"arrive need less than {MOST_TANGENTS}: stabilize=True goes on for longer"
            )
            raise ConvergenceError(self.gave_up)

    def _motions(self) -> tuple[Array, float]:
        """Find the motions of all bodies and the largest of loose ones. Collective."""
        motions = self._viscosity.motions()
        return motions, float(motions[self._loose].max(initial=0.0))

    def _require_approach(self, motions: Array) -> None:
        """Refuse motions of held bodies that may have passed loose ones. Collective.

        They move by more than the gap before the step and the limit.
        """
        for zone, meets in zip(self._contact.zones, self._meets):
            held = float(motions[meets & ~self._loose].max(initial=0.0))
            if not self._loose[meets].any() or held <= self._limit:
                continue
            reach = zone.distance("reach").min(initial=np.inf)
            gap = max(zone.opposite.gap.min(initial=reach), 0.0)
            gap = self._contact.layout.comm.allreduce(gap, op=MPI.MIN)
            gap = max(gap, self._apart(zone))
            if held > self._limit + gap:
                raise ConvergenceError(
                    f"a held body moves by {held:.3g} in this step, with a gap of "
                    f"{gap:.3g} to what nothing holds: it may have passed it"
                )

    def _apart(self, zone: ZoneData) -> float:
        """Distance between boxes around slave and masters of a zone at the accepted
        step, 0 where they overlap or with tools. Length. Collective."""
        facets, contact = zone.facets, self._contact
        if facets.bodies:
            return 0.0
        V, dim = contact.u.function_space, facets.slave_surface.gdim
        x = V.tabulate_dof_coordinates()[:, :dim] + contact.u_old.reshape(-1, dim)
        low, high = (
            ends_of(x[surface.dofs], contact.layout.comm)
            for surface in (facets.slave_surface, facets.master_surface)
        )
        return float(np.maximum(low[0] - high[1], high[0] - low[1]).max(initial=0.0))

    def _without(self, solve: Callable[[], int], farthest: float) -> int | None:
        """Solve without viscous forces; return None if it fails or moves too far."""
        before = self._contact.state()
        self._viscosity.begin()
        try:
            iterations = solve()
            motions, loose = self._motions()
            self._require_approach(motions)
            if loose <= farthest:
                return iterations
        except FAILURES as failure:
            if isinstance(failure, SetUpError):
                raise
        self._contact.restore(before)
        return None

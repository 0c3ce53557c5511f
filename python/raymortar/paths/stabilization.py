"""Viscous forces, which fade until each load step ends without them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

from mpi4py import MPI

import numpy as np

from ..core.compat import Array, Mask
from ..core.discretization.ranks import ends_of
from ..core.discretization.surfaces import bodies_of_facets
from ..core.errors import ConvergenceError, SetUpError, warn
from ..core.interface.zone_data import ZoneData, mean_facet_size
from ..core.solvers.solver import temporarily
from ..core.state import State
from ..diagnose.failure import FAILURES, attempt
from ..diagnose.lost_contact import has_no_springs, motion_in_words, touched
from .prediction import Backoff
from .soft_start import iterations_of
from .viscosity import Viscosity

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

# Share of all forces up to which a motion counts as driven by nothing but noise
IDLE = 1e-3

# Forces that hold such a motion act in one cell, as a share of its stiffness
HOLDS = 0.1

# Largest motion in the last solve, without viscous forces, as a share of the limit: a
# body that moves further is held by nothing. And in a linear step, of a motion that
# needs no forces to hold it any more
SETTLED, RESISTED = 0.1, 0.01


class Stabilization:
    """Solve steps in several solves under fading viscous forces. Collective.

    Bodies that only contact holds find their place: no solve moves them further than
    contact is found, and the forces fade as they move less. The step ends when a solve
    without the forces moves hardly anything, when the forces are negligible, or when
    forces on one cell hold a motion that nothing else resists and nothing drives. Such
    forces stay in the next steps, which are solved as those of held bodies.

    `most` is the largest number of solves of one step, `MOST` where the user asks for
    the forces, which None tells; else a step takes at most `MOST_TANGENTS` besides.
    `work` is the work of the viscous forces so far. Energy. `share` is the largest share
    of all forces of a body at the end of the last step. `gave_up` tells why the last step
    was given up, if it took too many tangents. `has_caught` tells whether a loose body,
    which no support holds, has been caught, and `holds` whether a motion is held.
    """

    def __init__(self, solver: Any, factor: float, most: int | None = None) -> None:
        self._problem = problem = solver.problem
        assert problem.contact.unknowns.only  # or it raises
        self._solver, self._factor = solver, factor
        self._most, self.is_asked_for = most, most is None
        self._contact = contact = problem.contact
        self.work = self.share = 0.0
        groups = problem.convergence.groups
        held = groups.on_rows(problem.constrained)
        self._loose = groups.sum(held)[: groups.bodies] == 0.0
        self.has_loose, self.has_caught = bool(self._loose.any()), False
        self._limit = np.inf
        if self.has_loose:
            self._limit = FARTHEST * mean_facet_size(contact.zones)
        self._begun = problem.tangents  # before the present step
        self.gave_up: str | None = None
        self.holds = self._said = False
        self._without_it = Backoff()
        # Motions of bodies, and change of the displacement, in a linear step that has
        # moved a loose body far
        self._free: tuple[Array, Array] | None = None

    @cached_property
    def _viscosity(self) -> Viscosity:
        return Viscosity(self._problem)

    @cached_property
    def _meets(self) -> Mask:
        """Whether slave or masters of each zone are on each body, (zones, bodies)."""
        contact = self._contact
        found = np.zeros((len(contact.zones), contact.system.bodies.count))
        for meets, zone in zip(found, contact.zones):
            for surface in (zone.facets.slave_surface, zone.facets.master_surface):
                meets[bodies_of_facets(contact.system.bodies, surface)] = 1.0
        self._problem.comm.Allreduce(MPI.IN_PLACE, found, op=MPI.MAX)
        return found > 0.0

    def is_of_use(self) -> bool:
        """Whether supports hold all bodies or contact is in reach. Collective.

        A body in free flight needs the user's own word.
        """
        return not self.has_loose or bool(self._contact.statistics.hits)

    def is_needed(self) -> bool:
        """Whether a body is held by nothing at the accepted step. Collective."""
        if not self.has_loose:
            return False
        self._contact.update()
        is_free = self._loose & ~touched(self._contact, len(self._loose))
        if not self.is_asked_for and is_free.any():
            is_free &= has_no_springs(self._problem)
        return bool(is_free.any()) and (self.is_asked_for or self.is_of_use())

    def _plain(self) -> int:
        """Solve once by the solver as it was given."""
        return iterations_of(self._solver)

    def pass_by(self) -> int | None:
        """Solve a step without the forces; return None if that fails or moves a loose
        body further than contact is found. Collective."""
        self.share = 0.0
        return self._within(self._plain, self._limit)

    def solve(self, each: Callable[[], int] | None = None) -> int:
        """Solve one step under the forces, each time by `each`; return all iterations.
        Collective."""
        self._begun, self.gave_up = self._problem.tangents, None
        scale, iterations, work = SHARE * self._factor, 0, 0.0
        most, each = self._most or MOST, each or self._plain
        for _ in range(most):
            asked = scale
            more, scale = self._under(scale, each)
            iterations += more
            done, share = self._viscosity.measure()
            work += done
            last, (_, loose) = None, self._motions()
            if share <= NEARLY:
                last = self._without()
                if last is None and self._free is not None:
                    last = self._hold(SETTLED * self._limit)
            if last is not None or share <= REST:
                self.work += work
                self.has_caught = self.has_loose
                if last is None:
                    self.share = share
                return iterations + (last or 0)
            if self.has_loose and not self._contact.statistics.active_points:
                self._contact.advance()  # a flight is no slip
            # Forces that let motions keep to their limit. Where weaker ones have just
            # failed, they fade slowly
            least = FADES if scale <= asked else SLOWLY
            scale *= max(least, min(1.0, loose / (0.8 * self._limit)))
        raise ConvergenceError(
            f"viscous forces have not faded after {most} solves: they are "
            f"{share:.3g} of all forces of a body that nothing holds"
        )

    def _without(self, share: float = SETTLED) -> int | None:
        """Solve without viscous forces, first for a linear step; return None if that
        fails, or moves a loose body by more than a share of the limit."""
        begin, steps = self._contact.state(), int(self.has_loose)
        if self.has_loose and self._takes_off(share):
            self._contact.restore(begin)
            return None
        self._viscosity.begin()
        last = self._within(self._plain, SETTLED * self._limit, begin)
        return None if last is None else last + steps

    def _takes_off(self, share: float = SETTLED) -> bool:
        """Take a linear step and tell whether it moves a loose body far: a motion that
        nothing resists is by far its largest part."""
        self._viscosity.begin()
        with temporarily(self._solver, max_it=1):
            attempt(self._plain)
        motions, loose = self._motions()
        takes_off = share * self._limit < loose < np.inf
        self._free = (motions, self._viscosity.change()) if takes_off else None
        return bool(takes_off)

    def hold(self) -> int | None:
        """Solve a step with a motion held that nothing resists; return None if there is
        none, or that fails. Collective."""
        begin = self._contact.state()
        takes_off = self._takes_off()
        self._contact.restore(begin)
        return self._hold(self._limit) if takes_off else None

    def _hold(self, farthest: float) -> int | None:
        """Solve with the motion held of the loose body that has taken off, and say so
        once; return None if that fails or moves a body too far."""
        assert self._free is not None
        (motions, change), problem = self._free, self._problem
        body = int(np.where(self._loose, motions, 0.0).argmax())
        self._viscosity.hold(body, change)
        self._without_it = Backoff()
        self._without_it.failed()
        iterations = self.hold_on(self._plain, farthest)
        if iterations is not None and self.holds and not self._said:
            self._said = True
            warn(
                f"{problem.convergence.groups.names()[body]} may "
                f"{motion_in_words(problem, body, change)}: nothing resists that. Viscous "
                "forces hold it from here on; prescribe it if its place matters",
            )
        return iterations

    def hold_on(
        self, solve: Callable[[], int], farthest: float | None = None
    ) -> int | None:
        """Solve one step as `solve` does with motions held, and from there without where
        more than noise drives them, or now and then, as something else may hold them;
        return None if that fails or moves a loose body too far. Collective."""
        self.holds, last = True, None
        with self._viscosity.acting(HOLDS, holds=True):
            iterations = self._within(solve, farthest or self._limit)
        if iterations is not None:
            work, self.share = self._viscosity.measure()
            if self.share > IDLE:
                last = self._within(self._plain, self._limit)
            else:
                self.work += work
                if not self._without_it.rests():
                    last = self._without(RESISTED)
                    self._without_it.failed()
                if last is None:
                    return iterations
        self._viscosity.release()
        self.holds, self.share = False, 0.0
        return None if iterations is None or last is None else iterations + last

    def _under(self, scale: float, solve: Callable[[], int]) -> tuple[int, float]:
        """Solve once under viscous forces; return iterations and their last scale."""
        before = self._contact.state()
        self._viscosity.begin()
        for attempt in range(ATTEMPTS):
            # Steps that arrive take fewer tangents
            taken = self._problem.tangents - self._begun
            if not self.is_asked_for and taken > MOST_TANGENTS:
                self.gave_up = (
                    f"viscous forces have not faded after {taken} tangents, where steps "
                    f"that arrive need less than {MOST_TANGENTS}: stabilize=True goes on "
                    "for longer"
                )
                raise ConvergenceError(self.gave_up)
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
        x = V.tabulate_dof_coordinates()[:, :dim] + contact.states.u_old.reshape(
            -1, dim
        )
        low, high = (
            ends_of(x[surface.dofs], contact.layout.comm)
            for surface in (facets.slave_surface, facets.master_surface)
        )
        return float(np.maximum(low[0] - high[1], high[0] - low[1]).max(initial=0.0))

    def _within(
        self, solve: Callable[[], int], farthest: float, begin: State | None = None
    ) -> int | None:
        """Solve; return None if that fails or moves a loose body too far from where the
        solve, or what is given, begins."""
        if begin is None:
            begin = self._contact.state()
            self._viscosity.begin()

        def near() -> int | None:
            iterations = solve()
            motions, loose = self._motions()
            self._require_approach(motions)
            return iterations if loose <= farthest else None

        iterations = attempt(near)
        if iterations is None:
            self._contact.restore(begin)
        return iterations

"""Load steps with viscous forces, which fade until each step ends without them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

import numpy as np

from ..compat import Array, Mask
from ..convergence.failure import FAILURES
from ..errors import ConvergenceError, SetUpError
from ..host.bodies import bodies_of_facets
from ..interface.stiffness import mean_facet_size
from .viscosity import Viscosity

if TYPE_CHECKING:
    from ..interaction import Interaction
    from ..interface.zone_data import ZoneData

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

# Largest motion in the last solve, without viscous forces, as a share of that: what
# moves further is a body that nothing holds
SETTLED = 0.1


class Stabilization:
    """Solves steps in several solves under fading viscous forces. Collective.

    Bodies that only contact holds find their place: no solve moves them further than
    contact is found, and the forces fade as they move less. The step ends when a solve
    without the forces moves hardly anything, or when the forces are negligible.

    Parameters
    ----------
    solver
        As of `LoadSteps`.
    factor
        Factor on the forces.
    most
        Largest number of solves of one step. None: `MOST`.

    Attributes
    ----------
    work
        Work of the viscous forces so far. Energy.
    share
        Largest share of all forces of a body at the end of the last step.
    """

    def __init__(self, solver: Any, factor: float, most: int | None = None) -> None:
        self.solver, self._factor, self._most = solver, factor, most
        problem = solver.problem
        self.viscosity = Viscosity(problem)
        self._contact = contact = problem.contact
        self.work = self.share = 0.0
        self._limit = FARTHEST * mean_facet_size(contact.layout, contact.zones)
        groups = problem.convergence.groups
        held = groups.on_rows(problem.constrained)
        self._loose = groups.sum(held)[: groups.bodies] == 0.0
        if not self._loose.any():
            self._limit = np.inf
        self._bodies = [_bodies_of_zone(contact, zone) for zone in contact.zones]

    def is_of_use(self) -> bool:
        """Whether viscous forces may help: if supports hold all bodies, or contact is
        in reach. A body in free flight needs the user's own word. Collective."""
        return not self._loose.any() or bool(self._contact.statistics.hits)

    def columns(self) -> dict[str, Callable[[], float]]:
        """What a `History` records of the forces, by column."""
        return {
            "viscous_work": lambda: self.work,
            "viscous_share": lambda: self.share,
        }

    def solve(self, solve: Callable[[], int]) -> int:
        """Solve one step. Collective.

        Parameters
        ----------
        solve
            One solve from the present state; its iterations.

        Returns
        -------
        Iterations of all solves.

        Raises
        ------
        ConvergenceError
            If the forces do not fade.
        """
        work, share = self.work, self.share
        try:
            return self._fade(solve)
        except FAILURES:
            self.work, self.share = work, share  # the step is taken back
            raise

    def _fade(self, solve: Callable[[], int]) -> int:
        """Solve one step. `work` and `share` include solves that a later failure takes
        back."""
        scale, iterations = SHARE * self._factor, 0
        most = MOST if self._most is None else self._most
        for _ in range(most):
            found = self._viscous(scale, solve)
            iterations += found[0]
            asked, (scale, work, share) = scale, found[1:]
            self.work, self.share = self.work + work, share
            if share <= NEARLY:
                last = self._without(solve)
                if last is not None:
                    self.share = 0.0
                    return iterations + last
            if share <= REST:
                return iterations
            if self._loose.any() and not self._contact.statistics.active_points:
                self._contact.advance()  # a flight is no slip
            # Where weaker forces have just failed, fade slowly
            scale *= self._fading(FADES if scale <= asked else SLOWLY)
        raise ConvergenceError(
            f"viscous forces have not faded after {most} solves: they are "
            f"{self.share:.3g} of all forces of a body that nothing holds"
        )

    def _viscous(
        self, scale: float, solve: Callable[[], int]
    ) -> tuple[int, float, float, float]:
        """One solve under viscous forces: iterations, scale in the end, work and
        share."""
        before, viscosity = self._contact.state(), self.viscosity
        viscosity.begin()
        for attempt in range(ATTEMPTS):
            viscosity.scale = scale
            try:
                with viscosity.acting():
                    iterations = solve()
            except SetUpError:
                raise
            except FAILURES:
                self._contact.restore(before)
                if attempt == ATTEMPTS - 1:
                    raise
                scale /= FADES
                continue
            motions = viscosity.motions()
            self._require_approach(motions)
            loose = self._of_loose(motions)
            if loose <= self._limit:
                return iterations, scale, *viscosity.measure()
            scale *= 2.0 * loose / self._limit
            self._contact.restore(before)
        raise ConvergenceError(
            "a body that contact alone holds moves by more than the size of its "
            f"facets, {self._limit:.3g}, in one solve"
        )

    def _of_loose(self, motions: Array) -> float:
        """Largest motion of loose bodies, of those of all bodies."""
        return float(motions[self._loose].max(initial=0.0))

    def _require_approach(self, motions: Array) -> None:
        """Refuse motions of held bodies that may have passed loose ones: by more than
        the gap before the step and the limit. Collective."""
        for zone, bodies in zip(self._contact.zones, self._bodies):
            held = float(motions[bodies & ~self._loose].max(initial=0.0))
            reach = zone.distance("reach").min(initial=np.inf)
            gap = max(zone.faced.gap.min(initial=reach), 0.0)
            gap = self._contact.layout.comm.allreduce(gap, op=MPI.MIN)
            if self._loose[bodies].any() and held > self._limit + gap:
                raise ConvergenceError(
                    f"a held body moves by {held:.3g} in this step, with a gap of "
                    f"{gap:.3g} to what nothing holds: it may have passed it"
                )

    def _fading(self, least: float) -> float:
        """Factor on the forces for the next solve, with which motions keep to their
        limit."""
        loose = self._of_loose(self.viscosity.motions())
        return max(least, min(1.0, loose / (0.8 * self._limit)))

    def _without(self, solve: Callable[[], int]) -> int | None:
        """Iterations of a solve without viscous forces. None if it fails or moves too
        far."""
        before = self._contact.state()
        self.viscosity.begin()
        try:
            iterations = solve()
            if self._of_loose(self.viscosity.motions()) <= SETTLED * self._limit:
                return iterations
        except FAILURES:
            pass
        self._contact.restore(before)
        return None


def _bodies_of_zone(contact: Interaction, zone: ZoneData) -> Mask:
    """Whether slave or masters of a zone are on each body, (bodies,). Collective."""
    found = np.zeros(contact.bodies.count)
    for surface in (zone.facets.slave_surface, zone.facets.master_surface):
        found[bodies_of_facets(contact.bodies, surface)] = 1.0
    contact.layout.comm.Allreduce(MPI.IN_PLACE, found, op=MPI.MAX)
    return found > 0.0

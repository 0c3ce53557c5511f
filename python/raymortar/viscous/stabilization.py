"""Viscous forces, which fade until each load step ends without them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from ..core.compat import Mask
from ..core.errors import ConvergenceError, SetUpError
from ..diagnose.failure import FAILURES
from ..diagnose.holding import has_no_springs, unheld_axes
from .bearing import bearing
from .budget import Budget
from .grip import has_friction
from .held_motions import SETTLED, HeldMotions
from .landing import Landing
from .loads import NOISE
from .rigid_moves import in_flight, loads_of
from .settling import Settling

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

# Largest number of solves of one motion. Forces grow after each that fails or moves too
# far
ATTEMPTS = 5


class Stabilization(HeldMotions):
    """Solve steps in several solves under fading viscous forces. Collective.

    Bodies that only contact holds find their place: no solve moves them further than
    contact is found, and the forces fade as they move less. The step ends when a solve
    without the forces moves hardly anything, when the forces are negligible, or when
    forces on one cell hold a motion that nothing else resists and nothing drives. Such
    forces stay in the next steps, which are solved as those of held bodies.

    `most` is the largest number of solves of one step, `MOST` where the user asks for
    the forces, which None tells; else a step takes at most `MOST_TANGENTS` besides.
    `has_caught` tells whether a loose body, which no support holds, has been caught.
    """

    def __init__(self, solver: Any, factor: float, most: int | None = None) -> None:
        super().__init__(solver)
        self._factor = factor
        self._most, self.is_asked_for = most, most is None
        self.has_caught = False
        self._begun = self._problem.tangents  # before the present step
        self._fading = Budget(self._problem)
        # Whether bodies have fallen in this step, or a larger one, and nothing has borne them
        self._stays = False

    def is_of_use(self) -> bool:
        """Whether supports hold all bodies or contact is in reach. Collective.

        A body in free flight needs the user's own word.
        """
        hits = bool(self._contact.statistics.hits)
        return not self.is_lost and (hits or not self.has_loose)

    def is_needed(self) -> bool:
        """Whether a body is held by nothing at the accepted step, or falls along axes on
        which nothing holds it. Collective."""
        if self.is_lost or not (self.has_loose or self._guided.any()):
            return False
        self._contact.update()
        bodies = self._loose | self._guided
        pairs = bearing(self._problem, bodies, self._facet)
        is_free, _ = in_flight(pairs, bodies)
        is_loose = is_free & self._loose
        if is_loose.any() and not self.is_asked_for:
            is_loose &= self._is_unsprung()
        if is_loose.any():
            return self.is_asked_for or self.is_of_use()
        is_guided = is_free & self._guided
        if self._stays or not (is_guided.any() and self._contact.statistics.hits):
            return False
        return bool((is_guided & self._would_fall()).any())

    @cached_property
    def _guided(self) -> Mask:
        """Whether conditions hold each body, and it is free along an axis all the same."""
        axes = unheld_axes(self._problem, self._problem.constrained)
        return np.asarray(axes.any(axis=1) & ~self._loose)

    def _is_unsprung(self) -> Mask:
        """Whether each body is on no springs, or on such that its load stretches far."""
        problem, found = self._problem, has_no_springs(self._problem)
        if not found.all():
            axes = loads_of(problem, self._facet).axes
            # Hoops may resist a growth of the radius
            found |= axes[:, int(problem.contact.system.axisymmetric) :].all(axis=1)
        return found

    def _would_fall(self) -> Mask:
        """Whether a load drives each body along an axis on which nothing holds it."""
        loads = loads_of(self._problem, self._facet)
        return np.asarray(np.linalg.norm(loads.free, axis=1) > NOISE * loads.amounts)

    def pass_by(self) -> int | None:
        """Solve a step without the forces; return None if that fails or moves a loose
        body further than contact is found. Collective."""
        self.share = 0.0
        return self._within(self._plain, self._limit)

    def solve(self, each: Callable[[], int] | None = None) -> int:
        """Solve one step under the forces, each time by `each`; return all iterations.
        Collective."""
        self.begin()
        self._begun = self._problem.tangents
        self._fading.begin()
        scale, iterations = SHARE * self._factor, 0
        most, each = self._most or MOST, each or self._plain
        work, last = self._fall()
        if last is not None:
            self.work += work
            return last
        for _ in range(most):
            asked = scale
            more, scale = self._under(scale, each)
            iterations += more
            done, share = self._viscosity.measure()
            work += done
            last, (motions, loose) = None, self._motions()
            self._moving = motions, self._viscosity.change()
            flies = self.has_loose and not self._contact.statistics.active_points
            if flies:
                self._fading.begin()
            self._fading.note(share)
            if share <= NEARLY:
                last = self._without()
                may_hold = last is None and self._free is not None
                if may_hold and not self._no_hold.rests():
                    last = self._hold(SETTLED * self._limit)
            # A user who asks for the forces lets bodies fall and roll far
            stalls = self._fading.is_spent and not self.is_asked_for
            stalls &= self.has_loose
            if last is None and (stalls or self.goes_on):
                last = self.give_in(share)
            if last is not None or share <= REST:
                self.work += work
                self.has_caught = self.has_loose
                if last is None:
                    self.share = share
                return iterations + (last or 0)
            if flies:
                self._contact.advance()  # a flight is no slip
            # Forces that let motions keep to their limit. Where weaker ones have just
            # failed, they fade slowly
            least = FADES if scale <= asked else SLOWLY
            scale *= max(least, min(1.0, loose / (0.8 * self._limit)))
        raise ConvergenceError(
            f"viscous forces have not faded after {most} solves: they are "
            f"{share:.3g} of all forces of a body that nothing holds"
        )

    def accepted(self) -> None:
        super().accepted()
        self._stays = False

    def land(self) -> int | None:
        """Solve a step from where bodies land; return None if none falls, or that fails.
        Collective."""
        self.begin()
        work, last = self._fall()
        self.work += work if last is not None else 0.0
        return last

    def _fall(self) -> tuple[float, int | None]:
        """Move loose bodies as rigid ones to where they rest, or else to where they land,
        and solve from there; return the work of their loads and the iterations, None if
        that fails.

        Nothing keeps bodies without friction where they rest: they may come back.
        """
        bodies = self._loose | self._guided
        if not bodies.any():
            return 0.0, None
        problem, facet = self._problem, self._facet
        settling = Settling(problem, self._loose, facet) if self.has_loose else None
        landed = None
        if not self._stays:
            landing = Landing(problem, bodies, facet)
            landed, self._stays = landing.land(), landing.has_failed
        place = self._contact.state()
        settled, last = settling.settle() if settling else None, None
        if settled is not None:
            last = self._landed()
            if last is not None or has_friction(self._contact):
                return settled + (landed or 0.0), last
            self._contact.restore(place)
        if landed is not None:
            last = self._landed()
        return landed or 0.0, last

    def _landed(self) -> int | None:
        """Solve without the forces where bodies have landed; return the iterations, None
        if that fails."""
        last, self.share = self._without(), 0.0
        if last is None and self._free is not None:
            last = self._hold(self._limit, may_let_go=True)
        self.has_caught |= last is not None and self.has_loose
        return last

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
            self._approach.require(motions)
            if loose <= self._limit:
                return iterations, scale
            scale *= 2.0 * loose / self._limit
            self._contact.restore(before)
        raise ConvergenceError(
            "a body that contact alone holds moves by more than the size of its "
            f"facets, {self._limit:.3g}, in one solve"
        )

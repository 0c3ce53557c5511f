"""Viscous forces, which fade until each load step ends without them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..core.errors import ConvergenceError, SetUpError
from ..diagnose.failure import FAILURES
from ..diagnose.holding import has_no_springs, touched
from .budget import Budget
from .held_motions import SETTLED, HeldMotions
from .landing import Landing
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

    def is_of_use(self) -> bool:
        """Whether supports hold all bodies or contact is in reach. Collective.

        A body in free flight needs the user's own word.
        """
        hits = bool(self._contact.statistics.hits)
        return not self.is_lost and (hits or not self.has_loose)

    def is_needed(self) -> bool:
        """Whether a body is held by nothing at the accepted step. Collective."""
        if not self.has_loose or self.is_lost:
            return False
        self._contact.update()
        is_free = self._loose & ~touched(self._contact, len(self._loose))
        if not self.is_asked_for and is_free.any():
            is_free &= has_no_springs(self._problem)
        return bool(is_free.any()) and (self.is_asked_for or self.is_of_use())

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
            in_flight = self.has_loose and not self._contact.statistics.active_points
            if in_flight:
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
            if in_flight:
                self._contact.advance()  # a flight is no slip
            # Forces that let motions keep to their limit. Where weaker ones have just
            # failed, they fade slowly
            least = FADES if scale <= asked else SLOWLY
            scale *= max(least, min(1.0, loose / (0.8 * self._limit)))
        raise ConvergenceError(
            f"viscous forces have not faded after {most} solves: they are "
            f"{share:.3g} of all forces of a body that nothing holds"
        )

    def _fall(self) -> tuple[float, int | None]:
        """Move loose bodies as rigid ones to where they rest, or else to where they land,
        and solve from there; return the work of their loads and the iterations, None if
        that fails.

        Nothing keeps bodies without friction where they rest: they may come back.
        """
        if not self.has_loose:
            return 0.0, None
        given = self._problem, self._loose, self._limit
        settling = Settling(*given)
        landed, place = Landing(*given).land(), self._contact.state()
        settled, last = settling.settle(), None
        if settled is not None:
            last = self._landed()
            if last is not None or self._has_friction():
                return settled + (landed or 0.0), last
            self._contact.restore(place)
        if landed is not None:
            last = self._landed()
        return landed or 0.0, last

    def _has_friction(self) -> bool:
        return any(one.friction is not None for one in self._contact.contacts)

    def _landed(self) -> int | None:
        """Solve without the forces where bodies have landed; return the iterations, None
        if that fails."""
        last, self.share = self._without(), 0.0
        if last is None and self._free is not None:
            last = self._hold(self._limit, may_let_go=True)
        self.has_caught |= last is not None
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

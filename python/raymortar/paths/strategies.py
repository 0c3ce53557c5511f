"""Ways to solve one load step, and the order in which they are tried."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from functools import partial
from weakref import WeakMethod

from ..core import on_demand
from ..core.errors import ConvergenceError, SetUpError
from ..core.finding import Finding
from ..core.state import State
from ..diagnose.failure import FAILURES, attempt, in_use_of
from ..solvers.correcting import correcting
from ..solvers.settings import temporarily
from ..viscous.stabilization import Stabilization
from .as_given import AsGiven
from .energy_balance import Balance, balance_of_step
from .load_path import PrescribedPath
from .prediction import Lessons
from .strategy import (
    EXTRAPOLATED,
    FULL,
    SMALL_GAMMA,
    VISCOUS,
    WAYS,
    Strategy,
    is_curable,
)
from .ways import FadingForces, HeldBody, PartialSteps, SmallGamma, SoftStep

_unborne_loads = on_demand.function("raymortar.diagnose.unborne.unborne_loads")

# Solves of one step under viscous forces that the user has not asked for
MOST_VISCOUS = 40


class Strategies:
    """Solve steps: first by the solver as it was given, after a failure in other ways.

    `others` are tried after a failure, in their order (docs/measured/robustness_paths.md).
    In the opposite one, those that this step calls for go before the solver: viscous
    forces where nothing else holds a body, what solved the last steps else.
    `trying` is called with the name of each other way before it is tried. After a step
    `used` is the name of the way that solved it, `present` of the one that solves at
    present, and `balance` the energies of one that another way solved, where they are
    looked at.
    """

    def __init__(
        self,
        path: PrescribedPath,
        trying: Callable[[str], None],
        extrapolates: bool | None,
        automatic: bool,
        may_be_viscous: bool,
        stabilization: Stabilization | None = None,
    ) -> None:
        self._path, self.solver, self._trying = path, path.solver, trying
        self._automatic, self._may_be_viscous = automatic, may_be_viscous
        self._contact = self.solver.problem.contact
        self.used = self.present = FULL
        self.balance: Balance | None = None
        # Takes a user's own state back to the last accepted step
        self.rejected: Callable[[], None] = lambda: None
        # Refuses a state that has lost contact: the next way may keep it
        self.require_contact: Callable[[], None] = lambda: None
        self._lessons = Lessons(FULL)
        self._given = AsGiven(path, extrapolates, automatic)
        self._asked_for = forces = stabilization
        if forces is None and automatic and may_be_viscous:
            forces = Stabilization(self.solver, 1.0, MOST_VISCOUS)
        self._forces, self._small_gamma = forces, SmallGamma(self.solver, self._lessons)
        fading = FadingForces(forces, path, self._small_gamma if automatic else None)
        held = () if forces is None else (HeldBody(forces),)
        self._fading = fading
        self.others: tuple[Strategy, ...] = (
            *held,
            SoftStep(self._given),
            PartialSteps(path, self._lessons, WeakMethod(self.restore)),
            self._small_gamma,
            fading,
        )

    def remember(self) -> list[float]:
        """Numbers from which `recall` goes on."""
        of_ways = [number for way in self.others for number in way.remember()]
        lessons = self._lessons.remember(WAYS)
        return [WAYS.index(self.used), *lessons, *of_ways, *self._given.remember()]

    def recall(self, numbers: Sequence[float], starts: Sequence[State]) -> None:
        """Go on from numbers, and the starts of the last steps. Collective."""
        left = iter(numbers)
        self.used = WAYS[int(next(left))]
        self._lessons.recall([next(left) for _ in self._lessons.remember(WAYS)], WAYS)
        for way in self.others:
            way.recall(left)
        self._given.recall(left, starts)

    def solve(self, now: State, last: State | None, ratio: float) -> int:
        """Solve from the present state; return the iterations. Collective.

        `last` is the state at the start of the last step, None in the first step, and
        `ratio` the size of this step over that of the step before. If no other way
        helps, the failure of the solver as it was given is raised.
        """
        self.balance = None
        self._given.plain.begin_step()
        if last is None:
            self._require_support()
        # A solve stops as soon as it is in trouble if another way is left
        convergence = self.solver.problem.convergence
        patient = not (self._automatic or self._asked_for)
        corrected = correcting(self.solver) if self._automatic else nullcontext()
        with corrected, temporarily(convergence, patient=patient, hasty=False):
            try:
                iterations = self._held(now, last, ratio)
                if iterations is None:
                    iterations = self._before(now)
                if iterations is None:
                    iterations = self._full(now, last, ratio)
                return iterations
            except FAILURES as failure:
                tries_others = self._automatic and self._asked_for is None
                if not (tries_others and self._is_curable(failure)):
                    raise
                convergence.hasty = False
                # No variable keeps the failure: in a cycle with this frame, ranks would
                # free the solver, which is collective, at different times
                iterations = self._after(now)
                if iterations is None:
                    raise
                self._lessons.solved(self.used, plain_failed=True)
                return iterations

    def _require_support(self) -> None:
        """Refuse loads that nothing bears, however small the step is. Collective."""
        led = in_use_of(self.solver.problem).controlled
        if led or self._asked_for is not None:
            return
        if (text := _unborne_loads(self.solver.problem)) is not None:
            raise SetUpError(text)

    def _full(self, now: State, last: State | None, ratio: float) -> int:
        """Solve by the solver as it was given, and learn from it."""
        # If a small gamma has just solved a step, it costs no more than what the plain
        # solver takes to come back from a jump
        convergence = self.solver.problem.convergence
        convergence.hasty = self._lessons.last == SMALL_GAMMA
        with self._given.more_iterations():
            iterations = self._as_given(now, last, ratio)
        self._lessons.solved(FULL, plain_failed=False)
        self._given.plain.learn(iterations)
        return iterations

    def _as_given(self, now: State, last: State | None, ratio: float) -> int:
        """Solve by the solver as it was given, from where the last step leads first."""
        # After a step of another way a smooth path may need no more than a better start,
        # after a jump none leads on
        goes_on, self.used = self.used != VISCOUS, FULL
        iterations = self._given.solve(now, last, ratio, goes_on)
        if iterations is None:
            self.restore(now)
            iterations = self._given.from_here()
        if self._given.is_ahead:
            self.used = EXTRAPOLATED
        return iterations

    def _held(self, now: State, last: State | None, ratio: float) -> int | None:
        """Solve under viscous forces if they are asked for, or hold a motion; return
        None if they do not, or fail without being asked for."""
        forces = self._forces
        if forces is not None and forces.holds:
            with self._given.more_iterations():
                solve = partial(self._as_given, now, last, ratio)
                iterations = forces.hold_on(solve)
            if iterations is not None:
                return iterations
            self.restore(now)
        if self._asked_for is None:
            return None
        iterations = None if self._asked_for.is_needed() else self._asked_for.pass_by()
        self.used = FULL
        if iterations is None:
            self.present = VISCOUS
            try:
                iterations = self._fading.solve(first=True)
            finally:
                self.present = FULL
            self.used = VISCOUS
        return iterations

    def _before(self, now: State) -> int | None:
        """Solve in the first way that goes before the solver as it was given, and
        converges; return None if none does."""
        for way in reversed(self.others):
            if way.goes_first():
                iterations = self._attempt(way, True, now)
                if iterations is not None:
                    return iterations
                self.restore(now)
        return None

    def _after(self, now: State) -> int | None:
        """Solve in the first other way that converges; return None if none does."""
        self._contact.restore(now)
        self._require_support()
        for way in self.others:
            if way.is_of_use():
                self.restore(now)
                self._trying(way.name)
                iterations = self._attempt(way, False, now)
                if iterations is not None:
                    return iterations
                self._contact.restore(now)  # the next way is judged there
        return None

    def _attempt(self, way: Strategy, first: bool, now: State) -> int | None:
        """Solve in another way from the present state; return None if it fails."""
        kept = len(self._small_gamma.given)

        def measured() -> int | None:
            iterations = way.solve(first)
            if iterations is not None:
                self.require_contact()
                self.balance = self._balanced(way.name, now)
            return iterations

        iterations, self.present = None, way.name
        try:
            iterations = attempt(measured)
        finally:
            self.present = FULL
            if iterations is None:
                self._small_gamma.give_back(kept)
        if iterations is not None:
            self.used = way.name
        return iterations

    def _balanced(self, name: str, now: State) -> Balance | None:
        """Balance the energies of the step from a state. Collective.

        A step that needs energy which nothing supplies is refused: another equilibrium
        was found, and no path of equilibria leads there.
        """
        if not self._may_be_viscous:
            return None
        balance = balance_of_step(self.solver.problem, self._path, now)
        if balance.lacks_energy:
            raise ConvergenceError(
                f"{name}: the step jumps, and needs an energy of {-balance.most:.3g} "
                "that no load supplies"
            )
        return balance

    def _is_curable(self, failure: Exception) -> bool:
        """Whether another way may cure a failure."""
        return is_curable(failure, self.solver, self._path.sizes.is_smallest)

    def restore(self, now: State) -> None:
        """Go back to a state. Collective."""
        self._contact.restore(now)
        self._path.restart()
        self.rejected()

    def doubts(self) -> list[Finding]:
        """Doubts about how the accepted step was solved."""
        return self._forces.doubts() if self._forces else []

    def gave_up(self) -> list[str]:
        """Tell what the last failed step was given up for besides its own failure."""
        forces = self._forces
        if forces is None:
            return []
        if forces.gave_up and self._asked_for is None:
            return [forces.gave_up]
        return forces.unborne()

    def accepted(self, begin: State) -> None:
        """Note that the step is accepted which began at a state."""
        for way in self.others:
            way.accepted()
        self._given.accepted(begin, jumps=self.used == VISCOUS)

    def finish(self) -> None:
        """Give gamma back at the end of the path. Collective."""
        self._small_gamma.give_back(0)

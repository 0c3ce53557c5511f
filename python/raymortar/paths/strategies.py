"""Ways to solve one load step, and the order in which they are tried."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack
from functools import cached_property, partial
from typing import Any

import numpy as np

from ..core.convergence.convergence import is_in_trouble
from ..core.errors import ConvergenceError, SetUpError
from ..core.solvers.newton import SNESSolver
from ..core.solvers.solver import MAX_IT, temporarily
from ..core.state import State
from ..diagnose.failure import FAILURES, attempt
from .energy_balance import Balance, balance_of_step
from .load_path import PrescribedPath
from .prediction import Lessons, Prediction
from .soft_start import (
    MORE_ITERATIONS,
    PlainSolver,
    iterations_of,
    lend_tenths,
    set_gammas,
    solve_by_small_gamma,
    with_line_search,
)
from .stabilization import Stabilization

FULL, EXTRAPOLATED, SOFT = "full", "extrapolated", "soft start"
SMALL_GAMMA, VISCOUS = "small gamma, line search", "viscous forces"
WAYS = (FULL, EXTRAPOLATED, SOFT, SMALL_GAMMA, VISCOUS)

# Names of ways, and what solves in them; None: they do not work
Ways = Iterator[tuple[str, Callable[[], int | None]]]

# Solves of one step under viscous forces that the user has not asked for
MOST_VISCOUS = 40


class Strategies:
    """Solve steps: first by the solver as it was given, after a failure in other ways.

    A way that solved the last steps after such failures goes first, see `Lessons`.
    `trying` is called with the name of each other way before it is tried. After a step
    `used` is the name of the way that solved it, and `balance` the energies of one that
    another way solved, where they are looked at.
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
        self._asked_for = stabilization
        goes_ahead = extrapolates or (extrapolates is None and path.led is None)
        self._prediction = Prediction(path, bool(extrapolates)) if goes_ahead else None
        self.used = FULL
        self.balance: Balance | None = None
        # Coefficients before each reduction that stays; the path's end restores the first
        self._given: list[list[Any]] = []
        # Takes a user's own state back to the last accepted step
        self.rejected: Callable[[], None] = lambda: None
        self._contact = self.solver.problem.contact
        self._lessons = Lessons(FULL)
        self._plain = PlainSolver(self.solver, automatic)

    def remember(self) -> list[float]:
        """Numbers from which `recall` goes on."""
        viscous = self._asked_for or self.__dict__.get("_viscous")
        return [
            WAYS.index(self.used),
            len(self._given),
            *((viscous.has_caught, viscous.work) if viscous else (0, 0)),
            *self._lessons.remember(WAYS),
            *self._plain.remember(),
            *(self._prediction.remember() if self._prediction else ()),
        ]

    def recall(self, numbers: Sequence[float], starts: Sequence[State]) -> None:
        """Go on from numbers, and the starts of the last steps. Collective."""
        used, tenths, has_caught, work, *numbers = numbers
        self.used = WAYS[int(used)]
        self._given = [lend_tenths(self.solver.problem) for _ in range(int(tenths))]
        if has_caught or work:
            viscous = self._asked_for or self._viscous
            if viscous is not None:
                viscous.has_caught, viscous.work = has_caught > 0.0, work
        self._lessons.recall(numbers[:4], WAYS)
        self._plain.recall(numbers[4:9])
        if self._prediction:
            self._prediction.recall(numbers[9:] or (0, 0), starts)

    def solve(self, now: State, last: State | None, ratio: float) -> int:
        """Solve from the present state; return the iterations. Collective.

        `last` is the state at the start of the last step, None in the first step, and
        `ratio` the size of this step over that of the step before. If no other way
        helps, the failure of the solver as it was given is raised.
        """
        self.balance = None
        self._plain.begin_step()
        # A solve stops as soon as it is in trouble if another way is left
        convergence = self.solver.problem.convergence
        patient = not (self._automatic or self._asked_for)
        with temporarily(convergence, patient=patient, hasty=False):
            try:
                iterations = self._held(now, last, ratio)
                if iterations is None:
                    iterations = self._in_turn(self._first(), now)
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
                iterations = self._otherwise(now)
                if iterations is None:
                    raise
                self._lessons.solved(self.used, plain_failed=True)
                return iterations

    def _full(self, now: State, last: State | None, ratio: float) -> int:
        """Solve by the solver as it was given, and learn from it."""
        # Where a small gamma has just solved a step, it costs no more than what the plain
        # solver takes to come back from a jump
        convergence = self.solver.problem.convergence
        convergence.hasty = self._lessons.last == SMALL_GAMMA
        with self._more_iterations():
            iterations = self._as_given(now, last, ratio)
        self._lessons.solved(FULL, plain_failed=False)
        self._plain.learn(iterations)
        return iterations

    def _held(self, now: State, last: State | None, ratio: float) -> int | None:
        """Solve under viscous forces if they are asked for, or hold a motion; return
        None if they do not, or fail without being asked for."""
        forces = self._asked_for
        holding = forces or self._viscous
        if holding is not None and holding.holds:
            with self._more_iterations():
                solve = partial(self._as_given, now, last, ratio)
                iterations = holding.hold_on(solve)
            if iterations is not None:
                return iterations
            self.restore(now)
        if forces is None:
            return None
        iterations = None if forces.is_needed() else forces.pass_by()
        self.used = FULL
        if iterations is None:
            iterations = forces.solve(self._each)
            self.used = VISCOUS
        return iterations

    def _first(self) -> Ways:
        """Yield the ways that go before the plain solver: viscous forces where nothing
        else holds a body, and a small gamma where that solved the last steps."""
        if self._viscous is not None and self._viscous.is_needed():
            yield VISCOUS, partial(self._viscous.solve, self._each)
        if self._lessons.first() == SMALL_GAMMA:
            yield SMALL_GAMMA, self._by_small_gamma

    def _in_turn(self, ways: Ways, now: State) -> int | None:
        """Solve in the first way that converges; return None if none does."""
        for name, solve in ways:
            iterations = self._attempt(name, solve, now)
            if iterations is not None:
                return iterations
            self.restore(now)
        return None

    def _each(self) -> int:
        """Solve once on the way of a body that is caught: if need be by a small gamma,
        as many points close at once."""
        now = self._contact.state()
        try:
            return iterations_of(self.solver)
        except FAILURES as failure:
            if not (self._automatic and self._is_curable(failure)):
                raise
        self._contact.restore(now)
        return self._by_small_gamma()

    def _otherwise(self, now: State) -> int | None:
        """Solve in the first other way that converges; return None if none does."""
        self._contact.restore(now)
        for name, solve in self._others():
            self.restore(now)
            self._trying(name)
            iterations = self._attempt(name, solve, now)
            if iterations is not None:
                return iterations
        return None

    def _others(self) -> Ways:
        """Yield the other ways by name (docs/measured/robustness_paths.md)."""
        viscous = self._viscous
        if viscous is not None and viscous.has_caught:
            yield VISCOUS, viscous.hold
        if self._plain.may_start_softly():
            yield SOFT, self._softly
        yield SMALL_GAMMA, self._by_small_gamma
        if viscous is not None and viscous.is_of_use():
            yield VISCOUS, viscous.solve

    def _softly(self) -> int:
        """Solve from a soft start, for as long as the plain solver may."""
        with self._more_iterations():
            return self._plain.start_softly()

    def _by_small_gamma(self) -> int:
        """Solve with a tenth of gamma, then with gamma, both by a line search."""
        return solve_by_small_gamma(self._searching or self.solver, self._given)

    def _attempt(
        self, name: str, solve: Callable[[], int | None], now: State
    ) -> int | None:
        """Solve in another way from the present state; return None if it fails."""
        kept = len(self._given)

        def measured() -> int | None:
            iterations = solve()
            if iterations is not None:
                self.balance = self._balanced(name, now)
            return iterations

        iterations = None
        try:
            iterations = attempt(measured)
        finally:
            if iterations is None:
                self._give_back(kept)
        if iterations is not None:
            self.used = name
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
        """Whether a solve cycled or diverged, or a line search found no descent, rather
        than that iterations ran out; or whether these did in the smallest step, where
        halving has not helped."""
        if isinstance(failure, SetUpError):
            return False
        if not isinstance(failure, ConvergenceError):
            return True
        problem = self.solver.problem
        # PETSc stops at a NaN without asking our test of convergence
        broken = bool(problem.history) and not np.isfinite(problem.history[-1])
        norms = problem.convergence.norms
        ran_out = len(norms) > getattr(self.solver, "max_it", np.inf)
        is_last = ran_out and self._path.sizes.is_smallest
        found_none = getattr(self.solver, "finds_no_descent", False)
        if problem.convergence.jumped or is_in_trouble(norms):
            return True
        return broken or is_last or found_none

    def _as_given(self, now: State, last: State | None, ratio: float) -> int:
        """Solve by the solver as it was given, from where the last step leads first."""
        was, self.used = self.used, FULL
        prediction = self._prediction
        # After a step of another way a smooth path may need no more than a better start,
        # after a jump none leads on
        goes_on = was != VISCOUS
        if prediction and last is not None and (prediction.always or goes_on):
            if prediction.leads_on(now, last, ratio):
                iterations = self._from_ahead(prediction, now)
                if iterations is not None:
                    return iterations
        # A predicted start has the slip of the last step, and the nodes that have closed;
        # this one has to find them
        return self._plain.solve(opens=True)

    def _more_iterations(self) -> AbstractContextManager[object]:
        """Let solves go on for longer while they are not in trouble, unless the user
        has limited them: in a halved step active sets are as far away as before."""
        solver, found = self.solver, ExitStack()
        if self._automatic and getattr(solver, "max_it", None) == MAX_IT:
            most, convergence = MORE_ITERATIONS * MAX_IT, solver.problem.convergence
            found.enter_context(temporarily(convergence, lasts=True))
            found.enter_context(temporarily(solver, max_it=most))
        return found

    def _from_ahead(self, prediction: Prediction, now: State) -> int | None:
        """Solve from where the last step leads; return None if that fails."""
        iterations = None
        with temporarily(self.solver.problem.convergence, patient=False):
            try:
                iterations = self._plain.solve()
                self.used = EXTRAPOLATED if prediction.always else FULL
            except FAILURES:
                self.restore(now)
        prediction.note(iterations is not None)
        return iterations

    def restore(self, now: State) -> None:
        """Go back to a state. Collective."""
        self._contact.restore(now)
        self._path.restart()
        self.rejected()

    def _give_back(self, kept: int) -> None:
        """Undo reductions of gamma beyond a number of them. Collective."""
        if len(self._given) > kept:
            set_gammas(self._contact.contacts, self._given[kept])
            del self._given[kept:]

    def gave_up(self) -> list[str]:
        """Tell what the last failed step was given up for besides its own failure."""
        viscous = self.__dict__.get("_viscous")
        return [viscous.gave_up] if viscous and viscous.gave_up else []

    def accepted(self, begin: State) -> None:
        """Note that the step is accepted which began at a state."""
        if self._prediction:
            self._prediction.accepted(begin, self.used == VISCOUS)

    def finish(self) -> None:
        """Give gamma back at the end of the path. Collective."""
        self._give_back(0)

    # Other solvers with the settings of the given one, made when first needed

    @cached_property
    def _searching(self) -> SNESSolver | None:
        return with_line_search(self.solver)

    @cached_property
    def _viscous(self) -> Stabilization | None:
        if not (self._automatic and self._may_be_viscous):
            return None
        return Stabilization(self.solver, 1.0, MOST_VISCOUS)

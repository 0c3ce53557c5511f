"""Paths of the load factor, the sizes of their steps, and checks of what leads them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from ..core.compat import Array, Mask
from ..core.errors import (
    ContactError,
    described,
    is_one_of,
    is_real_number,
    is_truth_value,
    is_whole_number,
    warn,
)
from ..core.problem import CoupledProblem
from ..core.solvers.newton import NewtonSolver, SNESSolver
from ..core.state import State
from ..records.history import History
from ..records.output import is_file
from .controls import ArcLength, DisplacementControl

STRATEGIES = ("auto", "halve")

# Relative difference of numbers of steps that are equal
SAME_SIZE = 1e-9


class StepSizes:
    """Halve steps after failures and let them grow after easy ones.

    Sizes are counted in first steps. As halves they are exact: halved steps that grow
    again end where the user's steps end.
    """

    def __init__(
        self, steps: int, max_halvings: int, largest: float, easy: float
    ) -> None:
        self._all, self._least = float(steps), 0.5**max_halvings
        self._largest, self._easy = largest, easy
        self._done, self.size, self._last = 0.0, 1.0, 1.0

    def remember(self) -> list[float]:
        """Numbers from which `recall` goes on."""
        return [self._all, self._done, self.size, self._last]

    def recall(self, numbers: Sequence[float], as_rest: bool) -> bool:
        """Go on from numbers, as the rest of a path or a path of one's own; return False
        where not as many steps are left as there are."""
        known, done, *sizes = numbers
        if abs(known - done - self._all) > SAME_SIZE * self._all:
            return False
        if as_rest:
            self._all, self._done = known, done
        self.size, self._last = sizes[:2]
        return True

    @property
    def ended(self) -> bool:
        """Whether the path is at its end."""
        return self._done == self._all

    @property
    def done(self) -> float:
        """Share of the path after the last step."""
        return self._done / self._all

    @property
    def share(self) -> float:
        """Share of the path after the next step."""
        return (self._done + self.size) / self._all

    @property
    def part(self) -> float:
        """Size of the next step as a share of the path."""
        return self.size / self._all

    @property
    def ratio(self) -> float:
        """Size of the next step over the size of the last accepted one."""
        return self.size / self._last

    @property
    def is_smallest(self) -> bool:
        """Whether the next step is of the smallest size."""
        return self.size <= self._least

    def halve(self) -> bool:
        """Halve the next step; return False if it is the smallest."""
        if self.is_smallest:
            return False
        self.size = max(0.5 * self.size, self._least)
        return True

    def accept(self, iterations: int) -> None:
        """Accept the step and choose the size of the next one."""
        self._done += self.size
        self._last = self.size
        is_easy = 2.0 * self.size <= self._largest and iterations <= self._easy
        may_grow = self.size < 1.0 or is_easy
        if may_grow and self._done % (2.0 * self.size) == 0.0:
            self.size *= 2.0
        while self.size > self._all - self._done > 0.0:
            self.size *= 0.5


class ArcSizes(StepSizes):
    """Let the iterations of each step decide the next radius, in first radii."""

    def recall(self, numbers: Sequence[float], as_rest: bool) -> bool:
        """Go on from numbers: nobody knows how many steps are left."""
        self.size, self._last = numbers[2:4]
        return True

    def accept(self, iterations: int) -> None:
        easy = max(self._easy, 1) / max(iterations, 1)
        # However small a step is, contact needs some iterations. So steps shrink only
        # above twice the iterations of an easy step, and halved steps grow again
        if self.size >= 1.0 and easy < 1.0:
            easy = min(1.0, 2.0 * easy)
        elif self.size < 1.0:
            easy *= 2.0
        grown = self.size * min(max(easy**0.5, 0.5), 2.0)
        most = 1.0 if self.size < 1.0 else self._largest
        self._last, self.size = self.size, min(max(grown, self._least), most)


class PrescribedPath:
    """Lead steps by the load factor, with which `apply` is called.

    `factor` is the load factor of the last accepted step. `has_parts` tells whether a step
    may be solved in parts.
    """

    has_parts = True

    def __init__(
        self,
        solver: Any,
        apply: Callable[[float, float], Any],
        ends: tuple[float, float],
        sizes: StepSizes,
    ) -> None:
        self._given, self._apply = solver, apply
        self._ends, self.sizes = ends, sizes
        self.factor = ends[0]

    def remember(self) -> list[float]:
        """Numbers from which `recall` goes on."""
        return [*self._ends, self.factor, *self.sizes.remember()]

    def recall(self, numbers: Sequence[float], starts: Sequence[State]) -> None:
        """Go on from numbers, and the starts of the last steps, where this path is the
        rest of theirs. Collective."""
        begin, end, factor, *sizes = numbers
        if self._ends == (factor, end) and self.sizes.recall(sizes, as_rest=True):
            self._ends = begin, end

    @property
    def solver(self) -> Any:
        """Solver of a step after `begin`."""
        return self._given

    @property
    def led(self) -> Mask | None:
        """Whether an owned dof of u leads; None if the load factor does."""
        return None

    @property
    def led_weights(self) -> Array | None:
        """Weights of the owned dofs in a chosen displacement, if one leads."""
        return None

    @property
    def ended(self) -> bool:
        """Whether the path is at its end."""
        return self.sizes.ended

    @property
    def next(self) -> float:
        """Load factor of the next step; the path's end is met exactly."""
        begin, end = self._ends
        share = self.sizes.share
        return end if share == 1.0 else begin + share * (end - begin)

    @property
    def time(self) -> float:
        """Quantity that grows along the path, at the end of a solved step."""
        return self.factor

    @property
    def controlled(self) -> float:
        """Quantity that leads the path. Collective."""
        return self.time

    def begin(self) -> None:
        """Set the loads of the next step."""
        self._apply(self.next, self.next - self.factor)

    def begin_part(self, share: float) -> None:
        """Set the loads of a part of the next step in place of those of `begin`."""
        size = share * (self.next - self.factor)
        self._apply(self.next if share == 1.0 else self.factor + size, size)

    def set_first_loads(self) -> None:
        """Set the loads of the last accepted step in place of those of `begin`."""
        self._apply(self.factor, self.next - self.factor)

    def restart(self) -> None:
        """Go back to the last accepted step, whose state has been restored."""

    def extrapolate(self, ratio: float) -> None:
        """Extrapolate the load factor by a ratio of its last change."""

    def reached(self) -> None:
        """Take over the end of a solved step, before its results are recorded."""
        self.factor = self.next

    def describe(self) -> str:
        """Name the failed step for a message."""
        return f"load factor {self.next:.6g} failed"


def with_size(apply: Any) -> Callable[[float, float], Any]:
    """Pass the step size on if `apply` has two arguments without default.

    Raises
    ------
    ContactError
        If it can be called with neither one nor two arguments.
    """
    try:
        signature = inspect.signature(apply)
    except (TypeError, ValueError):  # some built-in functions have no signature
        return lambda factor, size: apply(factor)
    found = signature.parameters.values()
    positional = (p for p in found if p.kind <= p.POSITIONAL_OR_KEYWORD)
    count = 2 if sum(p.default is p.empty for p in positional) == 2 else 1
    try:
        signature.bind(*range(count))
    except TypeError as error:
        raise ContactError(
            "apply must be a function of the load factor, or of that and the step's "
            f"size, not of {signature} ({error})"
        ) from None
    return apply if count == 2 else lambda factor, size: apply(factor)


def check_solver(solver: Any) -> None:
    """Raise unless `solver` is a solver of a problem."""
    problem = getattr(solver, "problem", None)
    if not (isinstance(problem, CoupledProblem) and hasattr(solver, "solve")):
        raise ContactError(
            f"solver must be a NewtonSolver or an SNESSolver, not {described(solver)}"
        )


def check_arguments(given: Any) -> None:
    """Raise unless all arguments, as attributes of `LoadSteps`, can be used."""
    fault = next((text for is_fine, text in _rules(given) if not is_fine), None)
    if fault:
        raise ContactError(fault)


def _rules(given: Any) -> Iterator[tuple[bool, str]]:
    """Yield whether an argument can be used, and what to say if not."""
    progress, steps, halvings = given.progress, given.steps, given.max_halvings
    shown = progress is None or isinstance(progress, bool) or is_file(progress)
    yield shown, f"progress must be True, False, None or a file, not {progress!r}"
    numbers = f"steps = {steps!r} and max_halvings = {halvings!r}"
    yield all(
        map(is_whole_number, (steps, halvings))
    ), f"{numbers} must be whole numbers"
    text = f"steps = {steps} must be positive, max_halvings = {halvings} not negative"
    yield steps >= 1 and halvings >= 0, text
    largest, easy, path = given.largest, given.easy, given.path
    text = f"largest = {largest!r} must be at least 1"
    yield is_real_number(largest) and largest >= 1, text
    text = f"easy = {easy!r} must be a number of iterations"
    yield is_real_number(easy) and easy >= 0, text
    ends = list(path) if isinstance(path, (tuple, list, np.ndarray)) else []
    finite = len(ends) == 2 and all(is_real_number(t) and np.isfinite(t) for t in ends)
    yield finite, f"path must be two numbers, its ends, not {path!r}"
    text = f"path = {path!r} must have two ends, load factors that differ"
    yield ends[0] != ends[1], text
    extrapolate, strategy, scale = given.extrapolate, given.strategy, given.stabilize
    text = f"extrapolate must be True or False (or None), not {extrapolate!r}"
    yield extrapolate is None or is_truth_value(extrapolate), text
    text = f"strategy must be one of {STRATEGIES}, not {strategy!r}"
    yield strategy is None or is_one_of(strategy, STRATEGIES), text
    scales = is_real_number(scale) and 0.0 <= scale < np.inf
    text = f"stabilize must be True, False, None or a factor, not {scale!r}"
    yield scale is None or is_truth_value(scale) or scales, text
    text = f"apply must be a function of the load factor, not {given.apply!r}"
    yield callable(given.apply), text
    for name in ("on_accept", "on_reject"):
        hook = getattr(given, name)
        text = f"{name} must be a function without argument, not {hook!r}"
        yield hook is None or callable(hook), text
    history, control, solver = given.history, given.control, given.solver
    text = f"history must be a History, not {history!r}"
    yield history is None or isinstance(history, History), text
    own = history is None or history.problem is solver.problem
    yield own, "history is of another problem than the solver"
    if control is None:
        return
    kinds = "a DisplacementControl, an ArcLength or None"
    known = isinstance(control, (DisplacementControl, ArcLength))
    yield known, f"control must be {kinds}, not {control!r}"
    control.check()
    led = isinstance(solver, (NewtonSolver, SNESSolver))
    yield led, "control needs a NewtonSolver or an SNESSolver"
    text = "control leads paths of one displacement: the problem has other unknowns"
    yield solver.problem.contact.unknowns.is_plain, text
    yield not scale, "control and stabilize exclude each other"


def warn_of_velocities(bodies: Sequence[Any]) -> None:
    """Warn of velocities of free bodies, which have no inertia in load steps."""
    for body in bodies:
        if body.freedom.velocity.any():
            warn(
                f"LoadSteps has no inertia and leaves out the velocity = {body.velocity} "
                f"of the rigid {body.name}: dynamics.TimeSteps takes it, and Body.move "
                "prescribes a motion"
            )

"""Load steps that halve on failure and grow again."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, TextIO

import numpy as np

from petsc4py import PETSc

from .contact import ContactState
from .errors import (
    ContactError,
    ConvergenceError,
    SetUpError,
    require_agreement,
    together,
)
from .history import History
from .options import is_real_number, is_truth_value, is_whole_number
from .problem import NonlinearProblem
from .progress import Progress, check_progress, line

# What a smaller step may cure
_FAILURES = (ConvergenceError, ContactError, PETSc.Error)


class LoadSteps:
    """A quasi-static path of the load factor, with steps as large as they may be.

    After a failure the step is halved; then, and where `largest` allows it, it doubles
    again.

    Parameters
    ----------
    solver
        `NewtonSolver` or `SNESSolver`.
    apply
        Called with the load factor before each solve: sets loads and Dirichlet values.
    steps
        Steps if none fails.
    max_halvings
        Of the first step's size; then the failure is raised.
    extrapolate
        Start each solve where the last step's change of displacement and multiplier,
        in proportion to the steps' sizes, would lead; where that fails, from the last
        accepted state. Saves one or two iterations of a step on a smooth path (in
        sliding the first iterate slips the right way) and is of no use on a rough
        one.
    largest
        How many times the first step's size a step may grow to. With friction the
        path's result depends on the steps, so that the default is 1: no growth beyond
        the size that was asked for.
    easy
        Newton iterations up to which a step is an easy one, after which the size may
        grow beyond the first step's.
    path
        Load factor at the start and at the end.
    progress
        One line for each step: load factor, Newton iterations, halvings so far,
        integration points in contact, smallest gap, largest pressure. On a terminal
        it is rewritten in place, and away while the caller has the step; elsewhere
        each has a line of its own. None: on standard error where that is a terminal
        (under ``mpirun`` it is none); True: on standard error; False: nothing; a file
        that is open for writing: there. Rank 0 decides and writes.
    history
        `History` that records every accepted step.

    Attributes
    ----------
    halvings
        So far.

    Examples
    --------
    >>> def apply(t):
    ...     top.value[:] = (0.0, -0.2 * t)
    >>> for step in LoadSteps(solver, apply, steps=5):
    ...     print(step.factor, step.iterations)
    """

    def __init__(
        self,
        solver: Any,
        apply: Any,
        steps: int = 10,
        max_halvings: int = 6,
        extrapolate: bool = False,
        largest: int = 1,
        easy: int = 5,
        path: tuple[float, float] = (0.0, 1.0),
        progress: bool | TextIO | None = None,
        history: History | None = None,
    ) -> None:
        _check_solver(solver)
        comm = solver.problem.comm
        with together(comm):
            _check_numbers(steps, max_halvings, largest, easy)
            _check_truth(extrapolate)
            path = _check_path(path)
            check_progress(progress)
            _check_calls(solver, apply, history)
        require_agreement(
            comm,
            solver=type(solver).__name__,
            steps=steps,
            max_halvings=max_halvings,
            extrapolate=extrapolate,
            largest=largest,
            easy=easy,
            path=path,
            history=history is not None,
        )
        self.solver, self.apply = solver, apply
        # Python's own, which do not overflow
        self.steps, self.max_halvings = int(steps), int(max_halvings)
        self.extrapolate, self.largest, self.easy = extrapolate, largest, easy
        self.path, self.progress, self.history = path, progress, history
        self.halvings = 0

    def __iter__(self) -> Iterator[LoadStep]:
        """Solve step by step; each accepted step is yielded as a `LoadStep`."""
        contact = self.solver.problem.contact
        progress = Progress(contact.layout.comm, self.progress)
        try:
            for number, step in enumerate(self._steps(progress.solving), 1):
                if progress.shown:
                    counts = contact.statistics
                    progress.accepted(
                        line(
                            number, step.factor, step.iterations, self.halvings, counts
                        )
                    )
                yield step
        finally:
            progress.clear()
        progress.finished()

    def _steps(self, solving: Callable[[float], None]) -> Iterator[LoadStep]:
        """The accepted steps; says at which load factor it tries the next one."""
        contact = self.solver.problem.contact
        # In units of the smallest step, so that the path ends at exactly 1
        unit = 2**self.max_halvings
        done, size = 0, unit
        last, last_size = None, size
        while done < self.steps * unit:
            while size > self.steps * unit - done:
                size //= 2
            factor = self._factor((done + size) / (self.steps * unit))
            before = contact.state()
            solving(factor)
            self.apply(factor)
            try:
                iterations = self._solve(before, last, size / last_size)
            except SetUpError:
                raise
            except _FAILURES as failure:
                contact.restore(before)
                if size == 1:
                    raise ConvergenceError(
                        f"load factor {factor:.6g} failed after "
                        f"{self.max_halvings} halvings of the step: {failure}"
                    ) from failure
                size //= 2
                self.halvings += 1
                continue
            if self.history is not None:
                self.history.record(factor, iterations, self.halvings)
            contact.advance()
            done += size
            last, last_size = before, size
            # On the grid of the larger size, so that the steps asked for are met again
            if self._may_grow(size / unit, iterations) and done % (2 * size) == 0:
                size *= 2
            yield LoadStep(factor, iterations, self.halvings)

    def _factor(self, share: float) -> float:
        """Load factor after a share of the path, its end met exactly."""
        begin, end = self.path
        return end if share == 1.0 else begin + share * (end - begin)

    def _may_grow(self, size: float, iterations: int) -> bool:
        """Whether twice a step, in first steps, is not too much after the last one."""
        if size < 1.0:
            return True
        return 2.0 * size <= self.largest and iterations <= self.easy

    def _solve(self, now: ContactState, last: ContactState | None, ratio: float) -> int:
        """Iterations from the extrapolated state or else from the present one."""
        problem = self.solver.problem
        before, problem.stops_at_loss = problem.stops_at_loss, True
        try:
            return self._solve_from(now, last, ratio)
        finally:
            problem.stops_at_loss = before

    def _solve_from(
        self, now: ContactState, last: ContactState | None, ratio: float
    ) -> int:
        """The same, from whichever of the two leads on."""
        contact = self.solver.problem.contact
        if self.extrapolate and last is not None:
            contact.u.x.array[:] += ratio * (now.u - last.u)
            if now.multiplier is not None and last.multiplier is not None:
                change = now.multiplier - last.multiplier
                contact.multiplier.x.array[:] += ratio * change
            try:
                return self.solver.solve()[0]
            except _FAILURES:
                contact.restore(now)
        return self.solver.solve()[0]

    def run(self) -> list[LoadStep]:
        """All steps at once."""
        return list(self)


def _check_solver(solver: Any) -> None:
    """Raise unless a thing solves a problem."""
    problem = getattr(solver, "problem", None)
    if not (isinstance(problem, NonlinearProblem) and hasattr(solver, "solve")):
        raise ContactError(
            "solver must be a NewtonSolver, SNESSolver or FixedPointSolver, not "
            f"{solver!r}"
        )


def _check_numbers(steps: Any, max_halvings: Any, largest: Any, easy: Any) -> None:
    """Raise unless numbers of steps can be ones."""
    if not (is_whole_number(steps) and is_whole_number(max_halvings)):
        raise ContactError(
            f"steps = {steps!r} and max_halvings = {max_halvings!r} must be whole "
            "numbers"
        )
    if steps < 1 or max_halvings < 0:
        raise ContactError(
            f"steps = {steps} must be positive, max_halvings = {max_halvings} not "
            "negative"
        )
    if not (is_real_number(largest) and largest >= 1):
        raise ContactError(f"largest = {largest!r} must be at least 1")
    if not (is_real_number(easy) and easy >= 0):
        raise ContactError(f"easy = {easy!r} must be a number of iterations")


def _check_truth(extrapolate: Any) -> None:
    if not is_truth_value(extrapolate):
        raise ContactError(f"extrapolate must be True or False, not {extrapolate!r}")


def _check_path(path: Any) -> tuple[float, float]:
    """Both ends of a path as numbers."""
    ends = list(path) if isinstance(path, (tuple, list, np.ndarray)) else []
    if len(ends) != 2 or not all(is_real_number(t) and np.isfinite(t) for t in ends):
        raise ContactError(f"path must be two numbers, its ends, not {path!r}")
    return float(ends[0]), float(ends[1])


def _check_calls(solver: Any, apply: Any, history: Any) -> None:
    """Raise unless loads can be applied and steps recorded."""
    if not callable(apply):
        raise ContactError(
            f"apply must be a function of the load factor, not {apply!r}"
        )
    if history is None:
        return
    if not isinstance(history, History):
        raise ContactError(f"history must be a History, not {history!r}")
    if history.problem is not solver.problem:
        raise ContactError("history is of another problem than the solver")


class LoadStep:
    """An accepted step: load factor, Newton iterations, halvings so far."""

    def __init__(self, factor: float, iterations: int, halvings: int) -> None:
        self.factor, self.iterations, self.halvings = factor, iterations, halvings

    def __repr__(self) -> str:
        return (
            f"LoadStep(factor={self.factor:.6g}, iterations={self.iterations}, "
            f"halvings={self.halvings})"
        )

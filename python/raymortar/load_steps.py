"""Load steps: a path of the load factor, solved step by step."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, TextIO

from .errors import (
    ContactLost,
    ConvergenceError,
    SetUpError,
    require_agreement,
    together,
)
from .history import History
from .load_step import LoadStep
from .load_step_checks import (
    check_calls,
    check_numbers,
    check_path,
    check_solver,
    check_stabilize,
    check_strategy,
    check_truth,
    with_size,
)
from .lost_contact import lost_contact
from .progress import Progress, check_progress, line
from .stabilization import Stabilization
from .state import ContactState
from .step_sizes import StepSizes
from .strategies import FAILURES, Strategies


class LoadSteps:
    """A quasi-static path of the load factor, with steps as large as they may be.

    A step whose solve cycles or diverges is tried in other ways first (`strategy`);
    after a failure it is halved. Then, and where `largest` allows it, it doubles again.

    Parameters
    ----------
    solver
        `NewtonSolver` or `SNESSolver`.
    apply
        Called with the load factor before each solve: sets loads and Dirichlet values.
        If it takes two arguments, the second is the step's size, which is also what
        ``Contact.dt`` is for laws of the slip rate.
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
    strategy
        ``"auto"``: a solve that cycles or diverges is ended as soon as that shows, and
        the step is tried in other ways: from an extrapolated state, by way of a tenth
        of gamma, with a line search, and by both of these. Only where none helps the
        step is halved. What else the solver was given is kept. Nothing is done where
        nothing is wrong. ``"halve"`` or None: the step is halved at once.
    stabilize
        True: viscous forces hold what nothing else does, bodies that contact alone
        holds and paths that snap; they fade to zero within each step. A number scales
        them. Their work and share are columns ``viscous_work`` and ``viscous_share`` of
        `history`.

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
        strategy: str | None = "auto",
        stabilize: bool | float | None = None,
    ) -> None:
        check_solver(solver)
        comm = solver.problem.comm
        with together(comm):
            check_numbers(steps, max_halvings, largest, easy)
            check_truth(extrapolate)
            check_strategy(strategy)
            check_stabilize(stabilize)
            path = check_path(path)
            check_progress(progress)
            check_calls(solver, apply, history)
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
            strategy=strategy,
            stabilize=stabilize,
        )
        self.solver, self.apply = solver, apply
        # Python's own, which do not overflow
        self.steps, self.max_halvings = int(steps), int(max_halvings)
        self.extrapolate, self.largest, self.easy = extrapolate, largest, easy
        self.path, self.progress, self.history = path, progress, history
        self.strategy, self.stabilize = strategy, stabilize
        self._apply = with_size(apply)
        self._stabilization = self._viscous_forces()
        self.halvings = 0

    def _viscous_forces(self) -> Stabilization | None:
        """What `stabilize` asks for, with its columns in `history`."""
        if not self.stabilize:
            return None
        forces = Stabilization(self.solver, float(self.stabilize))
        if self.history is not None:
            self.history.include(forces.columns())
        return forces

    def __iter__(self) -> Iterator[LoadStep]:
        """Solve step by step; each accepted step is yielded as a `LoadStep`."""
        contact = self.solver.problem.contact
        progress = Progress(contact.layout.comm, self.progress)
        try:
            for number, step in enumerate(self._steps(progress.solving), 1):
                if progress.shown:
                    progress.accepted(line(number, step, contact.statistics))
                yield step
        finally:
            progress.clear()
        progress.finished()

    def _steps(self, solving: Callable[[float], None]) -> Iterator[LoadStep]:
        """The accepted steps; says at which load factor it tries the next one."""
        contact = self.solver.problem.contact
        sizes = StepSizes(self.steps, self.max_halvings, self.largest, self.easy)
        ways = Strategies(self.solver, self.extrapolate, self.strategy == "auto")
        last, at = None, self.path[0]
        while not sizes.ended:
            factor = self._factor(sizes.share)
            before = contact.state()
            solving(factor)
            if contact.friction is not None:
                contact.dt = abs(factor - at)
            self._apply(factor, factor - at)
            try:
                iterations = self._solve(ways, before, last, sizes.ratio)
            except SetUpError:
                raise
            except FAILURES as failure:
                contact.restore(before)
                if not sizes.halve():
                    raise self._given_up(factor, failure) from failure
                self.halvings += 1
                continue
            if self.history is not None:
                self.history.record(factor, iterations, self.halvings)
            contact.advance()
            sizes.accept(iterations)
            last, at = before, factor
            yield LoadStep(factor, iterations, self.halvings, ways.used)

    def _solve(
        self,
        ways: Strategies,
        now: ContactState,
        last: ContactState | None,
        ratio: float,
    ) -> int:
        """Iterations of a step from the present state."""
        problem = self.solver.problem
        with problem.silent_about_loss():
            if self._stabilization is None:
                iterations = ways.solve(now, last, ratio)
            else:
                contact = problem.contact
                iterations = self._stabilization.solve(
                    lambda: ways.solve(contact.state(), None, 1.0)
                )
        loss = lost_contact(problem)
        if loss is not None:
            raise ContactLost(f"contact is lost: {loss}")
        return iterations

    def _given_up(self, factor: float, failure: Exception) -> ConvergenceError:
        return ConvergenceError(
            f"load factor {factor:.6g} failed after {self.max_halvings} halvings of the "
            f"step: {failure}"
        )

    def _factor(self, share: float) -> float:
        """Load factor after a share of the path, its end met exactly."""
        begin, end = self.path
        return end if share == 1.0 else begin + share * (end - begin)

    def run(self) -> list[LoadStep]:
        """All steps at once."""
        return list(self)

"""Load steps: a path of the load factor, solved step by step."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TextIO, cast

from ..diagnose.failure import FAILURES
from ..diagnose.lost_contact import lost_contact
from ..diagnose.outcome import Doubts
from ..diagnose.tools import ToolsOnPath
from ..errors import (
    BodyLeft,
    ContactLost,
    ContactWarning,
    ConvergenceError,
    SetUpError,
    require_agreement,
    together,
)
from ..interface.state import State
from ..results.summaries import of_load_steps
from .control import ArcLength, DisplacementControl
from .history import History
from .load_path import ArcPath, DisplacementPath, PrescribedPath
from .load_step import LoadStep
from .load_step_checks import (
    check_calls,
    check_control,
    check_numbers,
    check_path,
    check_solver,
    check_stabilize,
    check_strategy,
    check_truth,
    with_size,
)
from .output import Output, check_output
from .progress import HALVED, Progress, check_progress, line
from .stabilization import Stabilization
from .step_sizes import StepSizes
from .strategies import Strategies


class LoadSteps:
    """A quasi-static path of the load factor, solved step by step.

    If the solve of a step cycles or diverges, other ways are tried first (`strategy`).
    If all fail, the step is halved. Later steps double again, up to their first size,
    and beyond that if `largest` allows it.

    Parameters
    ----------
    solver
        `NewtonSolver`, `SNESSolver` or `FixedPointSolver`, such as the
        ``snes_solver`` of a `NonlinearProblem`.
    apply
        Function of the load factor that sets loads and prescribed displacements. It is
        called before each solve. If it takes two arguments, the second is the step's
        size, which ``Contact.dt`` is too, for laws of the slip rate.
    steps
        Number of steps if none fails.
    max_halvings
        How often the first step's size may be halved. After that the failure is raised.
    extrapolate
        Start each solve where the last step leads: its change of displacement and
        multiplier, scaled with the steps' sizes. If that fails, start from the last
        accepted state. This saves one or two iterations of a step on a smooth path, as
        in sliding, where the first iterate slips the right way. On a rough path it
        saves nothing.
    largest
        A step may grow to this many times the first step's size. The default is 1,
        because with friction the result of a path depends on its steps.
    easy
        A step of at most this many Newton iterations is easy: the next one may be
        larger than the first.
    path
        Load factor at the start and at the end.
    progress
        One line for each step: its number, load factor, Newton iterations, halvings so
        far, points in contact, smallest gap, largest pressure. On a terminal each step
        rewrites the line, which is off while the caller works on the step. In a log
        each step has a line of its own, and so has each other way that is tried, and
        each halving. None: on standard error if that is a terminal (under ``mpirun`` it
        is none). True: on standard error. False: nothing. A file that is open for
        writing: there. Rank 0 decides and writes.
    history
        `History` that records every accepted step.
    strategy
        ``"auto"``: a solve stops as soon as it is seen to cycle or diverge. Then the
        step is tried in other ways: from an extrapolated state, by way of a tenth of
        gamma, in steps that end where surfaces first cross, with a line search, with
        that and a tenth of gamma, and under viscous forces that fade. If none helps,
        the step is halved. All other settings of the solver are kept. ``"halve"`` or
        None: the step is halved at once.
    stabilize
        True: viscous forces slow down free bodies, which nothing but contact keeps in
        place, and paths that snap. They fade to zero within each step. A number scales
        them. Their work and share are columns ``viscous_work`` and ``viscous_share`` of
        `history`.
    control
        `DisplacementControl` or `ArcLength`, for snap-through. A chosen displacement, or
        the length of the path, grows from step to step, and the load factor is an
        unknown. ``path`` then says where the load factor starts and, with `ArcLength`,
        where it ends. `history` has it as column ``load_factor``, and what grows (the
        displacement, or the length so far) as ``controlled``. ``time`` is the share of
        the whole displacement, or the length so far.
    output
        Path of a ``.pvd`` or ``.xdmf`` file, to which every accepted step is added with
        all of its fields, segments and points; or an `Output`.

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
        control: DisplacementControl | ArcLength | None = None,
        output: str | Path | Output | None = None,
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
            check_control(control, solver, path, stabilize)
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
            output=output is not None,
            strategy=strategy,
            stabilize=stabilize,
            control=type(control).__name__,
        )
        self.solver, self.apply = solver, apply
        self._problem = solver.problem  # which its own solver does not keep
        # Python's own, which do not overflow
        self.steps, self.max_halvings = int(steps), int(max_halvings)
        self.extrapolate, self.largest, self.easy = extrapolate, largest, easy
        self.path, self.progress, self.history = path, progress, history
        self.strategy, self.stabilize = strategy, stabilize
        self._apply = with_size(apply)
        self._stabilization = self._viscous_forces()
        self.control = control
        self._path = self._new_path()
        if control is not None and history is not None:
            history.include(self._control_columns())
        self.output = check_output(output, solver.problem)
        self.halvings = 0

    def __repr__(self) -> str:
        return of_load_steps(self, self._path.factor)

    def _viscous_forces(self) -> Stabilization | None:
        """Viscous forces, if `stabilize` asks for them. Adds their columns to
        `history`."""
        if not self.stabilize:
            return None
        forces = Stabilization(self.solver, float(self.stabilize))
        if self.history is not None:
            self.history.include(forces.columns())
        return forces

    def __iter__(self) -> Iterator[LoadStep]:
        """Solve step by step; each accepted step is yielded as a `LoadStep`."""
        problem = self.solver.problem
        progress = Progress(problem.comm, self.progress, problem.steps_accepted)
        try:
            for step in self._steps(progress):
                if progress.shown:
                    progress.accepted(line(step, problem.contact.statistics))
                yield step
        finally:
            progress.clear()
        progress.finished()

    def _new_path(self) -> PrescribedPath | DisplacementPath | ArcPath:
        """A new path, at its start. Collective."""
        control, given = self.control, (self.solver, self._apply, self.path)
        limits = self.steps, self.max_halvings, self.largest, self.easy
        if isinstance(control, ArcLength):
            return ArcPath(*given, *limits, control)
        if isinstance(control, DisplacementControl):
            return DisplacementPath(*given, StepSizes(*limits), control)
        return PrescribedPath(*given, StepSizes(*limits))

    def _control_columns(self) -> dict[str, Callable[[], float]]:
        """What a `History` records of a path whose load factor is an unknown."""
        return {
            "load_factor": lambda: self._path.factor,
            "controlled": lambda: cast(Any, self._path).controlled,
        }

    def _steps(self, progress: Progress) -> Iterator[LoadStep]:
        """Yield the accepted steps, and report which load factor and way is tried
        next."""
        contact = self.solver.problem.contact
        path = self._path = self._new_path()
        one_mesh = len(contact.host.displacements) == 1
        viscous = self.control is None and self._stabilization is None and one_mesh
        automatic = self.strategy == "auto"
        ways = Strategies(path, self.extrapolate, automatic, viscous, progress.trying)
        last, tools, doubts = None, ToolsOnPath(contact), Doubts(self.solver.problem)
        snapped = False
        tools.look()
        while not path.ended:
            before = contact.state()
            progress.solving(path.next)
            for one in contact.contacts:
                timed = one.friction is not None or one.layout.bodies
                if timed and path.next != path.factor:
                    one.dt = abs(path.next - path.factor)
            path.begin()
            try:
                iterations = self._solve(ways, before, last, path.ratio)
                doubts.require_gradual()
            except BodyLeft as failure:
                contact.restore(before)
                path.restart()
                ways.finish()
                raise ConvergenceError(f"{path.describe()}: {failure}") from failure
            except SetUpError:
                raise
            except FAILURES as failure:
                contact.restore(before)
                path.restart()
                if not path.halve():
                    ways.finish()
                    raise self._given_up(path, failure) from failure
                self.halvings += 1
                progress.trying(HALVED)
                continue
            path.reached()
            tools.look()
            doubts.warn(stacklevel=3)
            if ways.released and not snapped:
                snapped = True
                warnings.warn(_snap(path.factor, ways), ContactWarning, stacklevel=3)
            if self.history is not None:
                self.history.record(path.time, iterations, self.halvings)
            if self.output is not None:
                self.output.write(path.time)
            contact.advance()
            path.accept(iterations)
            last = before
            self.solver.problem.steps_accepted += 1
            number = self.solver.problem.steps_accepted
            yield LoadStep(
                path.factor,
                iterations,
                self.halvings,
                ways.used,
                number,
                ways.released,
            )
        ways.finish()
        tools.warn()

    def _solve(
        self,
        ways: Strategies,
        now: State,
        last: State | None,
        ratio: float,
    ) -> int:
        """Iterations of a step from the present state."""
        problem = self.solver.problem
        with problem.as_part(**self._in_use()):
            if self._stabilization is None:
                iterations = ways.solve(now, last, ratio)
            else:
                contact = problem.contact
                iterations = self._stabilization.solve(
                    lambda: ways.solve(contact.state(), None, 1.0)
                )
        loss = lost_contact(problem, self._path.led)
        if loss is not None:
            raise ContactLost(f"contact is lost: {loss}")
        return iterations

    def _in_use(self) -> dict[str, Any]:
        """What is in use, for the advice that a failure gives. Collective."""
        found: dict[str, Any] = {
            "steps": True,
            "automatic": self.strategy == "auto",
            "controlled": self.control is not None,
            "led": self._path.led_weights,
        }
        if self.control is not None or self._stabilization is not None:
            found["may_be_viscous"] = False
        return found

    def _given_up(self, path: Any, failure: Exception) -> ConvergenceError:
        """The error, after the accepted state is there again. Collective."""
        contact, loads = self._problem.contact, []
        if contact.layout.bodies:
            contact.update()
            loads = contact.free_bodies.rubbed()
        return ConvergenceError(
            f"{path.describe()} after {self.max_halvings} halvings of the step: "
            f"{'; '.join([str(failure), *loads])}"
        )

    def run(self) -> list[LoadStep]:
        """Solve all steps."""
        return list(self)


def _snap(factor: float, ways: Strategies) -> str:
    """A warning that a step has passed a snap."""
    return (
        f"a snap was passed before load factor {factor:.6g}, by way of "
        f'"{ways.used}": it sets an energy of {ways.released:.3g} free, and without '
        "inertia its end is one of several. See LoadStep.released; control= follows "
        "the path of equilibria"
    )

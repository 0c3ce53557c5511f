"""Load steps: a path of the load factor, solved step by step."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any, TextIO

from ..core.errors import (
    BodyLeft,
    ContactLost,
    ConvergenceError,
    SetUpError,
    require_agreement,
    together,
    warn,
)
from ..core.state import State
from ..diagnose.failure import FAILURES, as_part, what_limits
from ..diagnose.lost_contact import lost_contact
from ..diagnose.missed import MastersOnPath
from ..diagnose.outcome import Doubts
from ..records.history import History
from ..records.output import (
    HALVED,
    Effort,
    LoadStep,
    Output,
    Progress,
    check_output,
    line,
)
from ..results import looking
from ..viscous.stabilization import Stabilization
from .arc_path import ArcPath
from .controls import ArcLength, DisplacementControl
from .led_paths import DisplacementPath
from .load_path import (
    ArcSizes,
    PrescribedPath,
    StepSizes,
    check_arguments,
    check_solver,
    warn_of_velocities,
    with_size,
)
from .memory import memory_of
from .soft_start import propose_nodes
from .speaker import Speaker
from .strategies import Strategies

# Arguments that all ranks must be given alike
_AGREED = "steps max_halvings extrapolate largest easy path strategy stabilize".split()


class LoadSteps:
    """A quasi-static path of the load factor, solved step by step.

    If the solve of a step cycles or diverges, other ways are tried first (`strategy`).
    If all fail, the step is halved. Later steps double again, up to their first size,
    and beyond that if `largest` allows it.

    Parameters
    ----------
    solver
        `NewtonSolver` or `SNESSolver`, such as the ``snes_solver`` of a
        `NonlinearProblem`.
    apply
        Function of the load factor that sets loads and prescribed displacements. It is
        called before each solve. If it takes two arguments, the second is the step's
        size, which ``Contact.dt`` is too, for laws of the slip rate.
    steps
        Number of steps if none fails.
    max_halvings
        How often the first step's size may be halved. After that the failure is raised.
    extrapolate
        Where a solve starts. True: at the last accepted state plus the change of all
        unknowns in the last step, or in the one before it, scaled with the steps'
        sizes, whichever leaves the smaller imbalance of forces (with `control` the last
        one); if that fails, at the last accepted state. None: the same, but only where
        the imbalance is smaller than at the last accepted state, so not where a path
        turns round, and not with `control`. This saves one or two iterations of a step
        on a smooth path, as in sliding, where the first iterate slips the right way.
        False: at the last accepted state.
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
        each step has a separate line, and so has each other way that is tried, and each
        halving. A step that takes long says every 10 s how far it is. None: on standard
        error if that is a terminal (under ``mpirun`` it is none). True: on standard
        error. False: nothing. A file that is open for writing: there. Rank 0 decides
        and writes.
    history
        `History` that records every accepted step.
    strategy
        ``"auto"``: a solve stops as soon as it is seen to cycle or diverge. Then the
        step is tried in other ways: with a softer gamma where bodies bend, by way of
        parts of the step, with a line search by way of a tenth of gamma, and under
        viscous forces that fade. If all fail, it is halved. Parts or a tenth of gamma
        that solved two steps in a row go first in the next ones; after 2, 4, 8 steps
        the solver as it was given does. All its other settings are kept. ``"halve"`` or
        None: the step is halved at once.
    stabilize
        Viscous forces, which fade to zero within each step, slow down loose bodies,
        which no support holds. None: where such a body touches nothing and something is
        in its reach, and in steps that fail otherwise. True: also from any height, and
        where a loose body would move by more than a slave facet; a number scales them.
        Their work and share are then columns ``viscous_work`` and ``viscous_share`` of
        `history`. A step whose bodies are held needs none.
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
    on_accept, on_reject
        Functions without argument that every rank calls, for a state of your own, such
        as plastic strains: when a step is accepted, recorded and written, and whenever
        displacement and multiplier have gone back to the last accepted step, before the
        step is tried in another way, halved or given up.

    Attributes
    ----------
    halvings
        So far.

    Examples
    --------
    >>> def apply(t):
    ...     top.value[:] = (0.0, -0.2 * t)
    >>> for step in LoadSteps(solver, apply, steps=5):
    ...     print(step.factor, step.iterations, step.tangents)
    """

    def __init__(
        self,
        solver: Any,
        apply: Any,
        steps: int = 10,
        max_halvings: int = 6,
        extrapolate: bool | None = None,
        largest: int = 1,
        easy: int = 5,
        path: tuple[float, float] = (0.0, 1.0),
        progress: bool | TextIO | None = None,
        history: History | None = None,
        strategy: str | None = "auto",
        stabilize: bool | float | None = None,
        control: DisplacementControl | ArcLength | None = None,
        output: str | Path | Output | None = None,
        on_accept: Callable[[], object] | None = None,
        on_reject: Callable[[], object] | None = None,
    ) -> None:
        check_solver(solver)
        self.solver, self.apply = solver, apply
        self._problem = solver.problem  # which its own solver does not keep
        self.steps, self.max_halvings, self.path = steps, max_halvings, path
        self.extrapolate, self.largest, self.easy = extrapolate, largest, easy
        self.progress, self.history, self.halvings = progress, history, 0
        self.strategy, self.stabilize, self.control = strategy, stabilize, control
        self.on_accept, self.on_reject = on_accept, on_reject
        with together(solver.problem.comm):
            check_arguments(self)
            self._apply = with_size(apply)
        # Python's own numbers
        self.steps, self.max_halvings = int(steps), int(max_halvings)
        self.path = float(path[0]), float(path[1])
        require_agreement(
            solver.problem.comm,
            solver=type(solver).__name__,
            history=history is not None,
            output=output is not None,
            control=type(control).__name__,
            on_accept=on_accept,
            on_reject=on_reject,
            **{name: getattr(self, name) for name in _AGREED},
        )
        self._stabilization: Stabilization | None = None
        columns: dict[str, Callable[[], float]] = {}
        if stabilize:
            forces = self._stabilization = Stabilization(solver, float(stabilize))
            columns["viscous_work"] = lambda: forces.work
            columns["viscous_share"] = lambda: forces.share
        self._path, self._memory = self._new_path(), memory_of(solver.problem.contact)
        if control is not None:
            columns["load_factor"] = lambda: self._path.factor
            columns["controlled"] = lambda: self._path.controlled
        if columns and history is not None:
            history.include(columns)
        self.output = check_output(output, solver.problem)

    def __repr__(self) -> str:
        begin, end = self.path
        led = "" if self.control is None else f" led by {type(self.control).__name__}"
        return (
            f"<LoadSteps from {begin:g} to {end:g} in {self.steps} steps{led} with "
            f"{type(self.solver).__name__}, strategy {self.strategy!r}, at load factor "
            f"{self._path.factor:.6g}, {self.halvings} halvings>"
        )

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

    def run(self) -> list[LoadStep]:
        """Solve all steps."""
        return list(self)

    def _new_path(self) -> PrescribedPath:
        """Make a path at its start. Collective."""
        control, given = self.control, (self.solver, self._apply, self.path)
        limits = self.steps, self.max_halvings, self.largest, self.easy
        if isinstance(control, ArcLength):
            return ArcPath(control, *given, ArcSizes(*limits))
        if isinstance(control, DisplacementControl):
            return DisplacementPath(control, *given, StepSizes(*limits))
        return PrescribedPath(*given, StepSizes(*limits))

    def _steps(self, progress: Progress) -> Iterator[LoadStep]:
        """Solve and yield the steps, and report each load factor and way."""
        problem = self.solver.problem
        contact, self._path = problem.contact, self._new_path()
        path = self._path
        options = self.extrapolate, self.strategy == "auto", self._may_be_viscous
        ways = Strategies(path, progress.trying, *options, self._stabilization)
        rejected = partial(self._tell, self.on_reject)
        ways.rejected, ways.require_contact = rejected, self._require_contact
        self._warn_of_velocities()
        masters, doubts = MastersOnPath(contact), Doubts(problem)
        snapped, effort = False, Effort(problem)
        speaker = Speaker(problem, progress, lambda: ways.present)
        masters.look()
        if self.history is not None:
            self.history.require_columns()
        self._memory.follow(self, path, ways)
        last = self._memory.starts[-1] if self._memory.starts else None
        while not path.ended:
            before = contact.state()
            progress.solving(path.next)
            for one in contact.contacts:
                timed = one.friction is not None or one.layout.bodies
                if timed and path.next != path.factor:
                    one.dt = abs(path.next - path.factor)
            self._begin_step()
            # `apply` may change the state, as the lock of a bolt does, within this step:
            # its solves begin with that, and a halved step goes back before it
            now = contact.state()
            with ExitStack() as seen:
                try:
                    with speaker.during():
                        iterations = self._solve(ways, now, last)
                    # All look at this state, which nothing changes until it is accepted
                    seen.enter_context(looking.at(contact.zones))
                    self._require_contact()
                    doubts.require_gradual()
                except FAILURES as failure:
                    seen.close()
                    left = isinstance(failure, BodyLeft)
                    if isinstance(failure, SetUpError) and not left:
                        raise
                    ways.restore(before)
                    if left or not path.sizes.halve():
                        ways.finish()
                        raise self._given_up(failure, ways.gave_up()) from failure
                    self.halvings += 1
                    progress.trying(HALVED)
                    continue
                self._reached()
                problem.evaluate()
                masters.look()
                found, balance = doubts.look() + ways.doubts(), ways.balance
                released = None if balance is None else balance.released
                if balance is not None and balance.has_snapped and not snapped:
                    snapped = True
                    warn(balance.describe_snap(path.factor))
                if self.history is not None:
                    self.history.record(path.time, iterations, self.halvings)
                if self.output is not None:
                    self.output.write(path.time)
            contact.advance()
            self._passed()
            self._tell(self.on_accept)
            ways.accepted(before)
            path.sizes.accept(iterations)
            self._memory.note(before)
            last = before
            count = problem.steps_accepted = problem.steps_accepted + 1
            yield self._accepted(
                path.factor,
                iterations,
                self.halvings,
                ways.used,
                count,
                released,
                *effort.taken(),
                found,
            )
        ways.finish()
        masters.warn()
        doubts.end()
        for one in contact.contacts:
            for follower in one.assembly.present.followers:
                if (text := follower.path_ended()) is not None:
                    warn(text)

    def _begin_step(self) -> None:
        """Set the loads of a step before it is solved."""
        self._path.begin()

    def _reached(self) -> None:
        """Take over the end of a solved step, before its results are recorded."""
        self._path.reached()

    def _passed(self) -> None:
        """Go on from a step that has been recorded and accepted."""

    def _warn_of_velocities(self) -> None:
        """Warn of velocities of free bodies, which have no inertia here."""
        warn_of_velocities(self._problem.contact.layout.bodies)

    def _accepted(self, *results: Any) -> LoadStep:
        """Make what the caller gets of an accepted step."""
        return LoadStep(*results)

    def _tell(self, function: Callable[[], object] | None) -> None:
        """Call a function for the user's own state, if there is one. Collective."""
        if function is not None:
            with together(self._problem.comm):
                function()

    @property
    def _may_be_viscous(self) -> bool:
        """Whether viscous forces are possible and not yet used."""
        one_mesh = len(self._problem.contact.unknowns.displacements) == 1
        return one_mesh and self.control is None and self._stabilization is None

    def _solve(self, ways: Strategies, now: State, last: State | None) -> int:
        """Solve a step from the present state; return the iterations."""
        problem, path = self.solver.problem, self._path
        use = {"automatic": self.strategy == "auto", "led": path.led_weights}
        use |= {"controlled": self.control is not None, "steps": True}
        with as_part(problem, **use, may_be_viscous=self._may_be_viscous):
            return ways.solve(now, last, path.sizes.ratio)

    def _require_contact(self) -> None:
        """Refuse a solved step that has lost contact. Collective."""
        loss = self._loss()
        if loss is not None:
            raise ContactLost(f"contact is lost: {loss}")

    def _loss(self) -> str | None:
        """Tell how the solved step has lost contact, if so. Collective."""
        return lost_contact(self._problem, self._path.led)

    def _given_up(
        self, failure: Exception, more: Sequence[str] = ()
    ) -> ConvergenceError:
        """Make the error of a failed step, after its start is restored. Collective."""
        contact, failed = self._problem.contact, self._path.describe()
        # Where a body is lost, all else that is said of the failed iterate follows from it
        head = str(failure).split(" (")[0].split(":")[0]
        texts: list[Any] = [*more, head if more else failure]
        if isinstance(failure, BodyLeft):
            return ConvergenceError(f"{failed}: {failure}")
        if contact.layout.bodies:
            contact.update()
            texts += contact.system.free_bodies.rubbed()
        if not isinstance(failure, ContactLost):
            texts += propose_nodes(self._problem)
            texts += [one.advice for one in self._problem.terms if one.advice]
            if self.control is None and not more:
                texts += what_limits(self._problem, self.max_halvings)
        return ConvergenceError(
            f"{failed} after {self.max_halvings} halvings of the step: "
            f"{'; '.join(map(str, texts))}"
        )

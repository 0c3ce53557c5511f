"""Time steps: motion with contact, solved step by step."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, TextIO

import numpy as np
import ufl
from dolfinx.fem import Function

from ..core.errors import (
    ContactError,
    ConvergenceError,
    described,
    is_real_number,
    is_whole_number,
    positive,
    require_agreement,
    together,
)
from ..core.state import Owner, Quantity, State
from ..diagnose.lost_contact import passed_surfaces
from ..mass.inertia import Inertia
from ..paths.load_path import PrescribedPath, StepSizes, check_solver
from ..paths.load_steps import LoadSteps
from ..paths.strategies import Strategies
from ..records.functionals import check_functional
from ..records.history import History
from ..records.output import LoadStep, Output, Progress
from .account import Account, Energy
from .motion import End, InertiaTerm, Motion
from .moving_bodies import MovingBodies
from .schemes import (
    SCHEMES,
    Adaptive,
    AdaptiveSizes,
    GeneralizedAlpha,
    Midpoint,
    Scheme,
    TimePath,
)

# Newton iterations of an easy step, which fixed sizes do not ask for
EASY = 5


@dataclass(eq=False)
class TimeStep(LoadStep):
    """An accepted time step: `LoadStep` with its time, size and energies.

    Attributes
    ----------
    dt
        Size of the step.
    energy
        `Energy` at the end of the step; None where neither `energy` nor `history` was
        given.
    """

    kind: ClassVar[str] = "time"

    dt: float = 0.0
    energy: Energy | None = None

    @property
    def time(self) -> float:
        """Time at the end of the step."""
        return self.factor


class TimeSteps(LoadSteps):
    """Motion of bodies in contact, solved step by step.

    A step whose solve fails is tried in other ways and then halved, as load steps are:
    see `LoadSteps`. Loads, masses, contact and friction then go back to the accepted
    step.

    Parameters
    ----------
    solver
        `NewtonSolver` or `SNESSolver` of a problem whose form has stresses and loads,
        without inertia.
    inertia
        `Inertia` of the problem's bodies.
    apply
        Function of the time, or of time and step size, that sets loads and prescribed
        displacements; None: they do not change. It is called before each solve, with
        `Midpoint` for the middle of the step and again for its end.
    end, dt
        Last time, and size of the steps. It is reduced so that steps end there.
    scheme
        `Newmark`, `Midpoint` or `GeneralizedAlpha`; None: ``GeneralizedAlpha(0.8)``.
    velocity
        Velocities at the start, in the space of the unknowns: a Function, of several
        unknowns a list; None: at rest. Of free rigid bodies set ``Body.velocity``.
    start
        First time.
    adapt
        `Adaptive`: steps follow their iterations and errors. None: all have the same
        size, except where a solve fails.
    touch
        How often a step may be halved in which surfaces that were all apart touch, or
        surfaces in contact part. 0: never.
    energy
        UFL functional of the stored energy, of bodies on meshes of their own a list of
        one for each: for `TimeStep.energy` and for the column ``elastic``.
    max_halvings, extrapolate, progress, history, strategy, output, on_accept, on_reject
        The same as for `LoadSteps`. The history gets columns ``kinetic``, ``elastic``,
        ``contact_work``, ``external_work``, with damping ``dissipated``, ``momentum_x``,
        ..., ``moment_of_momentum`` (in space with axes) about the origin, and
        ``impulse_0_x``, ...: of contact on each slave surface so far.

    Attributes
    ----------
    halvings
        So far.

    Notes
    -----
    With `Midpoint` contact, output and the columns of other tables belong
    to the middle of a step, the energies above to its end.

    Examples
    --------
    >>> inertia = Inertia(rho * ufl.inner(a, v) * ufl.dx, contact)
    >>> steps = TimeSteps(solver, inertia, apply, end=1.0, dt=1e-3, velocity=v0)
    >>> for step in steps:
    ...     print(step.time, step.iterations, step.tangents, step.energy)
    """

    def __init__(
        self,
        solver: Any,
        inertia: Inertia,
        apply: Callable[..., Any] | None = None,
        *,
        end: float,
        dt: float,
        scheme: Scheme | None = None,
        velocity: Function | Sequence[Function] | None = None,
        start: float = 0.0,
        adapt: Adaptive | None = None,
        touch: int = 0,
        energy: ufl.Form | Sequence[ufl.Form] | None = None,
        max_halvings: int = 6,
        extrapolate: bool = False,
        progress: bool | TextIO | None = None,
        history: History | None = None,
        strategy: str | None = "auto",
        output: str | Path | Output | None = None,
        on_accept: Callable[[], object] | None = None,
        on_reject: Callable[[], object] | None = None,
    ) -> None:
        check_solver(solver)
        problem = solver.problem
        with together(problem.comm):
            scheme = GeneralizedAlpha() if scheme is None else scheme
            _check(inertia, problem, end, dt, start, scheme, adapt, touch)
            forms = check_functional("energy", energy)
        require_agreement(
            problem.comm, end=end, dt=dt, start=start, scheme=scheme, adapt=adapt,
            touch=touch, energy=len(forms),
        )  # fmt: skip
        self.inertia, self.scheme, self.dt = inertia, scheme, float(dt)
        self.adapt, self.touch = adapt, int(touch)
        self.motion = Motion(inertia, scheme)
        for part in problem.contact.system.parts:  # to keep moment of momentum
            part.present.couples_over_gaps = isinstance(scheme, Midpoint)
        self.bodies = MovingBodies(problem.contact, scheme)
        self._inertia_term = InertiaTerm(problem, self.motion)
        self._account = Account(problem, self.motion, self.bodies, forms)
        self._accounts = bool(forms) or history is not None
        if velocity is not None:
            given = velocity if isinstance(velocity, (list, tuple)) else [velocity]
            self.motion.set_velocity(given)
        self._has_begun, self._end = False, End(*(np.zeros(0),) * 4)
        super().__init__(
            solver, apply or _unchanged, 1, max_halvings, extrapolate,
            path=(float(start), float(end)), progress=progress, history=history,
            strategy=strategy, output=output, on_accept=on_accept, on_reject=on_reject,
        )  # fmt: skip
        problem.contact.states.owners["motion"] = self
        if history is not None:
            history.include(self._account.columns())

    def __repr__(self) -> str:
        begin, end = self.path
        return (
            f"<TimeSteps from {begin:g} to {end:g} by {self.dt:g} with {self.scheme}, "
            f"{type(self.solver).__name__}, {self.halvings} halvings>"
        )

    @property
    def velocity(self) -> Any:
        """Velocity at the accepted step: a Function, of several unknowns a list."""
        found = self.motion.velocity
        return found[0] if len(found) == 1 else found

    @property
    def acceleration(self) -> Any:
        """Acceleration at the accepted step, as `velocity`."""
        found = self.motion.acceleration
        return found[0] if len(found) == 1 else found

    @property
    def fields(self) -> list[Function]:
        """Functions of the accepted step besides the unknowns. A `Checkpoint` has them by
        itself."""
        return self.motion.fields

    def quantities(self) -> Iterator[Quantity]:
        """Yield the arrays of motion and of its account, by which it extends the
        state."""
        owners: tuple[Owner, ...] = self.motion, self.bodies, self._account
        for one in owners:
            yield from one.quantities()

    def resume(self, time: float) -> None:
        """Go on from a time whose unknowns, `fields` and history come from an
        earlier run, as `Checkpoint.read` sets them. Collective."""
        with together(self._problem.comm):
            if not (is_real_number(time) and time <= self.path[1]):
                raise ContactError(f"time must be one before the end, not {time!r}")
            lacking = [
                name
                for name in self._problem.contact.states.owners.lacking
                if "motion" in name
            ]
            if lacking:
                raise ContactError(
                    f"the state that was read has no {', '.join(lacking)}: it is not of "
                    f"TimeSteps with {self.scheme}"
                )
        self.path, self._has_begun = (float(time), self.path[1]), True
        motion = self.motion
        motion.dt = self.dt
        if not motion.was_read:
            motion.last = self.dt
        self.bodies.take_ends()
        middle = isinstance(self.scheme, Midpoint)
        of = motion.middle if middle else self._problem.contact.unknowns.functions
        if self._accounts and not self._account.go_on(motion.values(of)):
            self._problem.contact.update()
            self._account.begin()
            self._account.set_begin(self.inertia.apply(self.motion.acceleration))

    def _warn_of_velocities(self) -> None:
        """Say nothing: a velocity without mass has been refused."""

    # Path

    def _new_path(self) -> PrescribedPath:
        """Make a path from the accepted time to the end. Collective."""
        begin, end = self.path
        count = (end - begin) / self.dt
        sizes: StepSizes
        if self.adapt is None:
            count = int(np.ceil(count * (1.0 - 1e-9)))
            sizes = StepSizes(count, self.max_halvings, 1, EASY)
        else:
            sizes = AdaptiveSizes(count, self.max_halvings, self.adapt)
        path = TimePath(self.solver, self._set_loads, self.path, sizes)
        path.solved_at = 0.5 if isinstance(self.scheme, Midpoint) else 1.0
        return path

    def _set_loads(self, time: float, dt: float) -> None:
        """Take the inertia of the step before off the bodies, whether or not it was
        solved, and set the loads of a time."""
        self.bodies.release()
        self._apply(time, dt)

    def _begin(self) -> None:
        """Find the accelerations that motion starts with. Collective."""
        problem, contact = self._problem, self._problem.contact
        self._apply(self.path[0], self.dt)
        contact.update()
        static = self._account.begin()
        self.motion.set_acceleration(static, problem.prescribed)
        self.bodies.set_accelerations(contact)
        of_inertia = self.inertia.apply(self.motion.acceleration)
        self._account.set_begin(of_inertia)
        self._has_begun = True

    def _steps(self, progress: Progress) -> Iterator[LoadStep]:
        """Solve and yield the steps; between them the problem has no inertia."""
        if not self._has_begun:
            self._begin()
        steps = super()._steps(progress)
        while True:
            with self._inertia_term.acting(), self.bodies.acting():
                step = next(steps, None)
            if step is None:
                return
            yield step

    def _begin_step(self) -> None:
        super()._begin_step()
        dt = self._path.next - self._path.factor
        self.motion.begin(dt)
        self.bodies.begin(dt)

    def _reached(self) -> None:
        self.bodies.solved()
        if self._accounts:
            self._account.record(self._end)
        super()._reached()

    def _passed(self) -> None:
        path, unknowns = self._path, self._problem.contact.unknowns
        if isinstance(self.scheme, Midpoint):
            self._set_loads(path.factor, self.motion.dt)
        lacking = unknowns.lacking(self._problem.bcs)
        prescribed = unknowns.owned_values() + lacking.owned
        self.motion.accept(self._end, (lacking.fixed, prescribed))
        self.bodies.accept()
        self.path = path.factor, self.path[1]

    def _accepted(self, *results: Any) -> LoadStep:
        energy = self._account.now if self._accounts else None
        step = TimeStep(*results)
        step.dt, step.energy = self.motion.dt, energy
        return step

    # Solves

    @property
    def _may_be_viscous(self) -> bool:
        return False

    def _loss(self) -> str | None:
        return "; ".join(passed_surfaces(self._problem)) or None

    def _solve(self, ways: Strategies, now: State, last: State | None) -> int:
        """Solve a step; refuse it where it is too large for its error, or for a first or
        last touch: energy that one takes the other would give [theory (6.5)]."""
        was_apart = self._is_apart()
        iterations = super()._solve(ways, now, last)
        self._end = self.motion.end()
        sizes = self._path.sizes
        if isinstance(sizes, AdaptiveSizes):
            error = self.motion.error(self._end)
            if sizes.is_too_far(error):
                raise ConvergenceError(f"the local error {error:.3g} is too large")
        if sizes.size > 0.5 ** self.touch and self._is_apart() != was_apart:
            raise ConvergenceError("surfaces touch or part in a step to be halved")
        return iterations

    def _is_apart(self) -> bool:
        """Whether nothing is in contact at the last update. Collective."""
        return self.touch > 0 and not self._problem.contact.statistics.active_points


def _unchanged(time: float) -> None:
    """Change no load."""


def _check(
    inertia: Any, problem: Any, end: Any, dt: Any, start: Any, scheme: Any, adapt: Any,
    touch: Any,
) -> None:  # fmt: skip
    """Raise unless all arguments can be used."""
    if not isinstance(inertia, Inertia):
        raise ContactError(f"inertia must be an Inertia, not {described(inertia)}")
    if inertia.contact.contacts != problem.contact.contacts:
        raise ContactError("inertia is of another contact than the problem")
    if problem.constraints is not None:
        raise ContactError(
            "TimeSteps takes no problem with constraints, which accelerations would not "
            "meet"
        )
    positive("dt", dt)
    for name, value in (("start", start), ("end", end)):
        if not (is_real_number(value) and np.isfinite(value)):
            raise ContactError(f"{name} must be a time, not {value!r}")
    if not end > start:
        raise ContactError(f"end = {end!r} must be after start = {start!r}")
    if not isinstance(scheme, SCHEMES):
        names = ", ".join(one.__name__ for one in SCHEMES)
        raise ContactError(f"scheme must be one of {names}, not {scheme!r}")
    scheme.check()
    if adapt is not None:
        if not isinstance(adapt, Adaptive):
            raise ContactError(f"adapt must be an Adaptive, not {adapt!r}")
        adapt.check()
    if not (is_whole_number(touch) and touch >= 0):
        raise ContactError(f"touch must be a whole number from 0 on, not {touch!r}")

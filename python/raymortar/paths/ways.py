"""Strategies: soft start, partial steps, small gamma, viscous forces."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any
from weakref import WeakMethod

import numpy as np

from ..core.errors import SetUpError
from ..core.interaction import Interaction
from ..core.interface.point_results import CLOSED
from ..core.solvers.newton import SNESSolver
from ..core.state import State
from ..diagnose.failure import FAILURES, iterations_of
from ..diagnose.few_facets import ENOUGH
from ..solvers.correcting import correcting
from ..viscous.budget import Backoff
from ..viscous.stabilization import Stabilization
from .as_given import AsGiven
from .load_path import PrescribedPath
from .prediction import Lessons
from .soft_start import (
    lend_tenths,
    set_gammas,
    solve_by_small_gamma,
    solve_roughly,
    with_line_search,
)
from .strategy import (
    PARTIAL,
    SMALL_GAMMA,
    SOFT,
    VISCOUS,
    Strategy,
    is_broken,
    is_curable,
)

# Smallest part of a step
SMALLEST_PART = 0.25


class SoftStep(Strategy):
    """The solver as it was given, from a soft start."""

    name = SOFT

    def __init__(self, as_given: AsGiven) -> None:
        self._as_given = as_given

    def is_of_use(self) -> bool:
        return self._as_given.plain.may_start_softly()

    def solve(self, first: bool) -> int:
        """Solve for as long as the plain solver may."""
        with self._as_given.more_iterations():
            return self._as_given.plain.start_softly()


class PartialSteps(Strategy):
    """The solver as it was given, from where parts of the step lead.

    It is for steps too large for one solve: the first iterations turn cells inside out.
    Each part is solved roughly, from where the last one leads, and halved where that
    fails. Only the whole step is kept. This goes first where it solved the last steps.
    """

    name = PARTIAL

    def __init__(
        self,
        path: PrescribedPath,
        lessons: Lessons,
        restore: WeakMethod[Callable[[State], None]],
    ) -> None:
        self._path, self._lessons, self._restore = path, lessons, restore

    def goes_first(self) -> bool:
        return self._lessons.first() == self.name

    def is_of_use(self) -> bool:
        """Tell whether the step is too large for what many facets carry. Few break solves
        at corners and edges, in small steps as well."""
        problem = self._path.solver.problem
        if not (self._path.has_parts and is_broken(problem)):
            return False
        dim = problem.contact.u.function_space.dofmap.index_map_bs
        return _closed_facets(problem.contact) >= ENOUGH ** (dim - 1)

    def solve(self, first: bool = False) -> int:
        solver, contact = self._path.solver, self._path.solver.problem.contact
        now = contact.state()
        before = here = now
        iterations, done, last, size = 0, 0.0, 1.0, 0.5
        while done < 1.0:
            self._begin(now, done + size)
            self._go_on(now, before, here, size / last)
            try:
                is_part = done + size < 1.0
                iterations += (solve_roughly if is_part else iterations_of)(solver)
            except FAILURES as failure:
                size *= 0.5
                may_help = is_broken(solver.problem) and size >= SMALLEST_PART
                if not may_help or isinstance(failure, SetUpError):
                    self._begin(now, 1.0)
                    raise
                continue
            before, here = here, contact.state()
            done, last = done + size, size
        return iterations

    def _begin(self, now: State, share: float) -> None:
        """Set the loads of a part at the state where the step begins, which they may
        change. Collective."""
        restore = self._restore()
        assert restore is not None
        restore(now)
        self._path.begin_part(share)

    def _go_on(self, now: State, before: State, here: State, ratio: float) -> None:
        """Go to the end of the last part, and on by a multiple of its change. Tractions
        stay: those that go on close and open points."""
        contact = self._path.solver.problem.contact
        contact.states.extrapolate(here, now, 1.0)
        end, begin = map(contact.states.values_of, (here, before))
        contact.unknowns.set_values(end + ratio * (end - begin))


def _closed_facets(contact: Interaction) -> int:
    """Count the slave facets with a point in contact. Collective."""
    contact.update()
    count = 0
    for zone in (zone for zone in contact.zones if not zone.tied):
        points = zone.points()
        count += len(np.unique(points["slave"][points["status"] >= CLOSED]))
    return int(contact.layout.comm.allreduce(count))


class SmallGamma(Strategy):
    """A tenth of gamma, then gamma, both by a line search. It goes first where that
    solved the last steps."""

    name = SMALL_GAMMA

    def __init__(self, solver: Any, lessons: Lessons) -> None:
        self._solver, self._lessons = solver, lessons
        # Coefficients before each reduction that stays; the path's end restores the first
        self.given: list[list[Any]] = []

    @cached_property
    def _searching(self) -> SNESSolver | None:
        return with_line_search(self._solver)

    def goes_first(self) -> bool:
        return self._lessons.first() == self.name

    def solve(self, first: bool = False) -> int:
        """Solve both; where the second solve fails, the tenth may stay."""
        given, searching = self._solver, self._searching
        with correcting(given, searching):
            return solve_by_small_gamma(searching or given, self.given)

    def give_back(self, kept: int) -> None:
        """Undo reductions of gamma beyond a number of them. Collective."""
        if len(self.given) > kept:
            set_gammas(self._solver.problem.contact.contacts, self.given[kept])
            del self.given[kept:]

    def remember(self) -> list[float]:
        return [len(self.given)]

    def recall(self, numbers: Iterator[float]) -> None:
        tenths = range(int(next(numbers)))
        self.given = [lend_tenths(self._solver.problem) for _ in tenths]


class HeldBody(Strategy):
    """A motion held by viscous forces on one cell, where they have caught a body."""

    name = VISCOUS

    def __init__(self, forces: Stabilization) -> None:
        self._forces = forces

    def is_of_use(self) -> bool:
        return self._forces.has_caught

    def solve(self, first: bool) -> int | None:
        return self._forces.hold()


class FadingForces(Strategy):
    """Viscous forces that fade. They go first where nothing else holds a body.

    Many points may close at once on the way of a body, and some cycle at corners. So a
    solve that fails under these forces is repeated by a small gamma, if there is such a
    way. If that fails as well, it is left out at the next failures of the step.
    """

    name = VISCOUS

    def __init__(
        self,
        forces: Stabilization | None,
        path: PrescribedPath,
        small_gamma: SmallGamma | None,
    ) -> None:
        self.forces, self._path, self._small_gamma = forces, path, small_gamma
        self._without_it = Backoff()

    def goes_first(self) -> bool:
        return self.forces is not None and self.forces.is_needed()

    def is_of_use(self) -> bool:
        return self.forces is not None and self.forces.is_of_use()

    def solve(self, first: bool) -> int | None:
        forces = self.forces
        if forces is None:
            return None
        if first and not (forces.has_loose or forces.is_asked_for):
            return forces.land()
        self._without_it.reset()
        return forces.solve(self._each)

    def _each(self) -> int:
        """Solve once, if need be by a small gamma."""
        solver, sizes = self._path.solver, self._path.sizes
        contact = solver.problem.contact
        now = contact.state()
        try:
            return iterations_of(solver)
        except FAILURES as failure:
            is_lost = not is_curable(failure, solver, sizes.is_smallest)
            if self._small_gamma is None or is_lost or self._without_it.rests():
                raise
        contact.restore(now)
        try:
            iterations = self._small_gamma.solve()
        except FAILURES:
            self._without_it.failed()
            raise
        self._without_it.reset()
        return iterations

    def accepted(self) -> None:
        if self.forces is not None:
            self.forces.accepted()

    def remember(self) -> list[float]:
        forces = self.forces
        return [forces.has_caught, forces.work] if forces else [0.0, 0.0]

    def recall(self, numbers: Iterator[float]) -> None:
        has_caught, work = next(numbers), next(numbers)
        if self.forces is not None and (has_caught or work):
            self.forces.has_caught, self.forces.work = has_caught > 0.0, work

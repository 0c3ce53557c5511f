"""Ways to solve one load step, and the order in which they are tried."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cached_property, partial
from typing import Any

import numpy as np

from ..convergence.failure import FAILURES
from ..convergence.trouble import is_in_trouble
from ..errors import ConvergenceError, SetUpError
from ..interface.state import State
from ..solvers.capped import CappedSolver
from ..solvers.line_search import with_line_search
from ..solvers.newton import NewtonSolver
from ..solvers.snes import SNESSolver
from .energy_balance import balance_of_step
from .gamma_detour import (
    set_each,
    solve_by_small_gamma,
    solve_with_small_gamma,
    with_multipliers,
)
from .stabilization import Stabilization

FULL, EXTRAPOLATED = "full", "extrapolated"
LINE_SEARCH, SMALL_GAMMA = "line search", "small gamma"
CAPPED = "capped"
BOTH = "small gamma, line search"
KEPT = "small gamma kept"
VISCOUS = "viscous forces"

# How often a path may reduce gamma to a tenth
MOST_KEPT = 2

# Solves of one step under viscous forces that the user has not asked for
MOST_VISCOUS = 40


def iterations_of(solver: Any) -> Callable[[], int]:
    """A function that solves once and returns the iterations."""
    return lambda: int(solver.solve()[0])


class Strategies:
    """Solves steps: first by the solver as it was given, after a failure in other ways.

    Parameters
    ----------
    path
        A path of `load_path`, whose solver solves a step.
    extrapolate
        Whether steps begin with the extrapolated state.
    automatic
        Whether other ways are tried.
    viscous
        Whether viscous forces are one of the other ways.
    trying
        Is called with the name of each other way before it is tried.

    Attributes
    ----------
    used
        Name of the way that solved the last step.
    released
        Energy that the last step has set free in a snap, found by another way.
    """

    def __init__(
        self,
        path: Any,
        extrapolate: bool,
        automatic: bool,
        viscous: bool,
        trying: Callable[[str], None],
    ) -> None:
        self._path, self.solver, self.extrapolate = path, path.solver, extrapolate
        self.automatic, self._may_be_viscous = automatic, viscous
        self._trying = trying
        self.used, self.released = FULL, 0.0
        # Coefficients before each reduction; the path's end restores the first
        self._given: list[Any] = []
        self._contact = self.solver.problem.contact

    def solve(self, now: State, last: State | None, ratio: float) -> int:
        """Solve from the present state. Collective.

        Parameters
        ----------
        now
            The present state.
        last
            State at the start of the last step. None in the first step.
        ratio
            Size of this step over that of the step before.

        Returns
        -------
        Iterations.

        Raises
        ------
        ConvergenceError, ContactError, PETSc.Error
            The failure of the solver as it was given, if no other way helps.
        """
        self.released = 0.0
        with self._attentive():
            try:
                return self._as_given(now, last, ratio)
            except SetUpError:
                raise
            except FAILURES as failure:
                if not (self.automatic and self._is_curable(failure)):
                    raise
                # No variable keeps the failure: in a cycle with this frame, ranks would
                # free the solver, which is collective, at different times
                iterations = self._otherwise(now, last, ratio)
                if iterations is None:
                    raise
                return iterations

    def _otherwise(self, now: State, last: State | None, ratio: float) -> int | None:
        """Iterations of the first other way that converges. None if none does."""
        for name, solve in self._others(now, last, ratio):
            self._restore(now)
            self._trying(name)
            kept = len(self._given)
            try:
                iterations = solve()
                self.released = self._released(name, now)
            except SetUpError:
                raise
            except FAILURES:
                if len(self._given) > kept:
                    set_each(with_multipliers(self._contact), self._given.pop())
                continue
            self.used = name
            return iterations
        return None

    def _released(self, name: str, now: State) -> float:
        """Energy that a snap since a state has set free, 0 where none was passed.
        Collective.

        Raises
        ------
        ConvergenceError
            If the step needs energy that nothing supplies: another equilibrium was
            found, and no path of equilibria leads there.
        """
        if not self._may_be_viscous or name == EXTRAPOLATED:
            return 0.0
        balance = balance_of_step(self.solver.problem, self._path, now)
        if balance.lacks_energy:
            raise ConvergenceError(
                f"{name}: the step jumps, and needs an energy of {-balance.most:.3g} "
                "that no load supplies"
            )
        return balance.released

    @contextmanager
    def _attentive(self) -> Iterator[None]:
        """Within it, a solve stops as soon as it is in trouble, if another way is
        left."""
        convergence = self.solver.problem.convergence
        convergence.patient = not self.automatic
        try:
            yield
        finally:
            convergence.patient = True

    def _is_curable(self, failure: Exception) -> bool:
        """Whether a solve cycled or diverged, rather than ran out of iterations."""
        if not isinstance(failure, ConvergenceError):
            return True
        problem = self.solver.problem
        # PETSc stops at a NaN without asking our test of convergence
        broken = bool(problem.history) and not np.isfinite(problem.history[-1])
        return broken or is_in_trouble(problem.convergence.norms)

    def _as_given(self, now: State, last: State | None, ratio: float) -> int:
        """Solve from the extrapolated state. If that fails, solve from the present
        one."""
        if self.extrapolate and last is not None:
            try:
                iterations = self._extrapolated(now, last, ratio)
                self.used = EXTRAPOLATED
                return iterations
            except FAILURES:
                self._restore(now)
        iterations = self.solver.solve()[0]
        self.used = FULL
        return iterations

    def _restore(self, now: State) -> None:
        self._contact.restore(now)
        self._path.restart()

    def _extrapolated(self, now: State, last: State, ratio: float) -> int:
        """Solve from the extrapolated state."""
        self._path.extrapolate(ratio)
        self._contact.extrapolate(now, last, ratio)
        return self.solver.solve()[0]

    def _others(
        self, now: State, last: State | None, ratio: float
    ) -> Iterator[tuple[str, Callable[[], int]]]:
        """The other ways by name, in the order in which measurements recommend them
        (docs/robustness_paths.md)."""
        if last is not None and not self.extrapolate:
            yield EXTRAPOLATED, partial(self._extrapolated, now, last, ratio)
        yield SMALL_GAMMA, lambda: solve_by_small_gamma(self.solver)
        if self._capped is not None:
            yield CAPPED, iterations_of(self._capped)
        searching = self._with_line_search
        if searching is not None:
            yield LINE_SEARCH, iterations_of(searching)
            yield BOTH, partial(solve_by_small_gamma, searching)
        if len(self._given) < MOST_KEPT and with_multipliers(self._contact):
            yield KEPT, self._keep_small_gamma
        viscous = self._viscous
        if viscous is not None and viscous.is_of_use():
            yield VISCOUS, partial(viscous.solve, iterations_of(self.solver))

    def _keep_small_gamma(self) -> int:
        """Solve with a tenth of gamma, and keep it for the rest of the path."""
        given = [contact.gamma for contact in with_multipliers(self._contact)]
        iterations = solve_with_small_gamma(self.solver)
        self._given.append(given)
        return iterations

    def finish(self) -> None:
        """Give gamma back, at the end of the path. Collective."""
        if self._given:
            set_each(with_multipliers(self._contact), self._given[0])
            self._given.clear()

    @cached_property
    def _capped(self) -> CappedSolver | None:
        """The same solver with capped steps, made when it is first needed."""
        solver = self.solver
        plain = isinstance(solver, SNESSolver) or (
            isinstance(solver, NewtonSolver)
            and solver.convergence_criterion == "residual"
        )
        return CappedSolver(solver) if plain else None

    @cached_property
    def _viscous(self) -> Stabilization | None:
        """Viscous forces, for steps that have no equilibrium nearby. Made when first
        needed."""
        if not self._may_be_viscous:
            return None
        return Stabilization(self.solver, 1.0, MOST_VISCOUS)

    @cached_property
    def _with_line_search(self) -> SNESSolver | None:
        """The same solver with a line search, made when it is first needed."""
        return with_line_search(self.solver)

"""Ways to solve one load step, and the order in which they are tried."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property, partial
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
from dolfinx.fem import Function

from ..convergence.convergence import is_in_trouble
from ..diagnose.failure import FAILURES
from ..errors import ContactWarning, ConvergenceError, SetUpError
from ..interface.state import State
from ..interface.stiffness import mean_facet_size
from ..interface.zone_data import opposite_points, path
from ..solvers.newton import NewtonSolver
from ..solvers.snes import SNESSolver
from ..solvers.solver import CoupledSolver
from .energy_balance import balance_of_step
from .lessons import Lessons
from .load_path import PrescribedPath
from .prediction import Prediction, extrapolate
from .stabilization import Stabilization

FULL, EXTRAPOLATED, CAPPED = "full", "extrapolated", "capped"
LINE_SEARCH, SMALL_GAMMA = "line search", "small gamma"
BOTH, KEPT = "small gamma, line search", "small gamma kept"
VISCOUS = "viscous forces"

# Ways that go first once they have solved two steps: those that leave nothing behind
# and cost little more than the plain solver
LEARNT = EXTRAPOLATED, SMALL_GAMMA, CAPPED, LINE_SEARCH, BOTH

# Overlap at which a step ends, in sizes of slave facets. Without overlap no gap would
# ever close
OVERLAP = 0.01

# Share of Newton's step that is always taken
LEAST = 0.05

# Factor for the number of iterations, as shorter steps need more
MORE_ITERATIONS = 2

_LINE_SEARCH = "snes_linesearch_type"

# Smaller coefficient, over the one in use. It hardly changes the solution, but with it
# fewer points open and close during a solve (docs/measured/robustness_paths.md)
SMALL = 0.1

# Largest number of times that a path reduces gamma to a tenth
MOST_KEPT = 2

# Solves of one step under viscous forces that the user has not asked for
MOST_VISCOUS = 40


def iterations_of(solver: Any) -> int:
    """Solve once and return the iterations."""
    return int(solver.solve()[0])


def solve_by_small_gamma(solver: Any) -> int:
    """Solve with a tenth of gamma, then with gamma from there. Collective."""
    contacts = solver.problem.contact.contacts
    given = _reduce_gamma(contacts)
    try:
        # Warnings of the first solve are of no interest: its state is not kept
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ContactWarning)
            iterations = iterations_of(solver)
    finally:
        _set_gamma(contacts, given)
    return iterations + iterations_of(solver)


def solve_with_small_gamma(solver: Any, kept: list[Any] | None = None) -> int:
    """Solve with a tenth of gamma, which stays; note the given one. Collective.

    With a multiplier, this solution is as good as the one with gamma: both meet the
    contact conditions in the mean.
    """
    given = _reduce_gamma(_with_multipliers(solver.problem.contact))
    if kept is not None:
        kept.append(given)
    return iterations_of(solver)


def _with_multipliers(contact: Any) -> list[Any]:
    """List the contacts that have a multiplier."""
    return [one for one in contact.contacts if one.multiplier is not None]


def _set_gamma(contacts: Sequence[Any], gammas: Sequence[Any]) -> None:
    """Give each contact its coefficient. Collective."""
    for contact, gamma in zip(contacts, gammas):
        contact.set_gamma(gamma)


def _reduce_gamma(contacts: Sequence[Any]) -> list[Any]:
    """Reduce coefficients to a tenth; return the given ones. Collective."""
    given = [contact.gamma for contact in contacts]
    for contact, gamma in zip(contacts, given):
        if isinstance(gamma, Function):
            small = Function(gamma.function_space)
            small.x.array[:] = SMALL * gamma.x.array
        else:
            small = SMALL * gamma
        contact.set_gamma(small)
    return given


class CappedSolver:
    """Newton's method with steps so short that no facet passes its master. Collective.

    A step may take an open facet below its master by a small overlap only. Facets that
    are closed already do not limit the step. Tangent, linear solver and tolerances are
    those of another solver, and twice its most iterations are allowed.
    """

    def __init__(self, solver: CoupledSolver) -> None:
        self.solver: Any = solver
        self.problem = solver.problem
        contact = self.problem.contact
        self._overlap = OVERLAP * mean_facet_size(contact.layout, contact.zones)

    def solve(self) -> tuple[int, bool]:
        """Solve from the present u and multiplier, as `SNESSolver.solve`."""
        return self.solver.iterate_by(self._iterate, 3), True

    def _iterate(
        self, x: PETSc.Vec, b: PETSc.Vec, dx: PETSc.Vec, trial: PETSc.Vec
    ) -> tuple[int, str | None]:
        """Iterate from x; return the iterations and why they failed, if so."""
        solver, problem = self.solver, self.problem
        convergence = problem.convergence
        rtol, atol = solver.tolerances[0], solver.force_tolerance
        for iteration in range(MORE_ITERATIONS * solver.max_it + 1):
            problem.F(x, b)
            convergence.accept()
            if convergence.reached(rtol, atol):
                return iteration, None
            if convergence.is_stuck:
                break
            solver.linearise(x, {})
            solver.correct(b, dx)
            if not np.isfinite(dx.norm()):
                break
            x.copy(trial)
            trial.axpy(-1.0, dx)
            x.axpy(-self._share(x, trial), dx)
        return iteration, ""

    def _share(self, x: PETSc.Vec, trial: PETSc.Vec) -> float:
        """Share of the step from x to the trial that is taken. Collective."""
        contact, comm = self.problem.contact, self.problem.comm
        before = [opposite_points(zone) for zone in contact.zones]
        contact.from_vector(trial)
        at = contact.u.x.array.reshape(-1, contact.u.function_space.dofmap.index_map_bs)
        share = 1.0
        for zone, hits in zip(contact.zones, before):
            gap = path(zone, hits, at, comm).gap
            crosses = (hits.gap > 0.0) & ~hits.closed & (gap < -self._overlap)
            room = (hits.gap + self._overlap)[crosses]
            shares = room / (hits.gap - gap)[crosses]
            share = float(np.min(shares, initial=share))
        contact.from_vector(x)
        return max(float(comm.allreduce(share, op=MPI.MIN)), LEAST)


def with_line_search(solver: Any) -> SNESSolver | None:
    """SNES with line search, on the matrix and with the linear solver of another one.

    None if the given solver already has a line search, or is of another kind.
    Collective.
    """
    options = dict(solver.options.given) if hasattr(solver, "options") else {}
    # A tolerance of the user's is among the settings that are taken. The default was
    # the rounding error of all bodies when the solver was made: asked for as a
    # tolerance, it would be one that the softest body is not solved to
    options.pop("snes_atol", None)
    if isinstance(solver, SNESSolver):
        if options.get(_LINE_SEARCH) != "basic" or solver.snes.getType() != "newtonls":
            return None
    elif not (
        isinstance(solver, NewtonSolver) and solver.convergence_criterion == "residual"
    ):
        return None
    other = SNESSolver(solver.problem, {**options, _LINE_SEARCH: "l2"}, matrix=solver.A)
    rtol, most = solver.tolerances[0], MORE_ITERATIONS * solver.max_it
    other.snes.setTolerances(rtol=rtol, max_it=most, atol=solver.force_tolerance)
    return other


class Strategies:
    """Solve steps: first by the solver as it was given, after a failure in other ways.

    A way that solved the last steps after such failures goes first, see `Lessons`.
    `trying` is called with the name of each other way before it is tried. After a step
    `used` is the name of the way that solved it, and `released` the energy that it has
    set free in a snap, found by another way.
    """

    def __init__(
        self,
        path: PrescribedPath,
        trying: Callable[[str], None],
        extrapolates: bool | None,
        automatic: bool,
        may_be_viscous: bool,
    ) -> None:
        self._path, self.solver, self._trying = path, path.solver, trying
        self._extrapolates, self._automatic = extrapolates, automatic
        self._may_be_viscous = may_be_viscous
        predicts = extrapolates is None and path.led is None
        self._prediction = Prediction(path) if predicts else None
        self.used, self.released = FULL, 0.0
        self._tried_ahead = False  # in this step, from where the last one leads
        # Coefficients before each reduction; the path's end restores the first
        self._given: list[list[Any]] = []
        # Takes a user's own state back to the last accepted step
        self.rejected: Callable[[], None] = lambda: None
        self._contact = self.solver.problem.contact
        self._lessons = Lessons(FULL)

    def solve(self, now: State, last: State | None, ratio: float) -> int:
        """Solve from the present state; return the iterations. Collective.

        `last` is the state at the start of the last step, None in the first step, and
        `ratio` the size of this step over that of the step before. If no other way
        helps, the failure of the solver as it was given is raised.
        """
        self.released, self._tried_ahead = 0.0, False
        # A solve stops as soon as it is in trouble if another way is left
        convergence = self.solver.problem.convergence
        convergence.patient = not self._automatic
        try:
            iterations = self._as_last(now, last, ratio)
            if iterations is None:
                iterations = self._as_given(now, last, ratio)
                self._lessons.solved(FULL, plain_failed=False)
            return iterations
        except FAILURES as failure:
            if not (self._automatic and self._is_curable(failure)):
                raise
            # No variable keeps the failure: in a cycle with this frame, ranks would
            # free the solver, which is collective, at different times
            iterations = self._otherwise(now, last, ratio)
            if iterations is None:
                raise
            self._lessons.solved(self.used, plain_failed=True)
            return iterations
        finally:
            convergence.patient = True

    def _as_last(self, now: State, last: State | None, ratio: float) -> int | None:
        """Solve in the way that solved the last steps; return None if it fails, or if
        the solver as it was given is to be tried."""
        learnt = self._lessons.first()
        if learnt not in LEARNT:
            return None
        for name, solve in self._others(now, last, ratio):
            if name == learnt:
                iterations = self._attempt(name, solve, now)
                if iterations is None:
                    self.restore(now)
                return iterations
        return None

    def _otherwise(self, now: State, last: State | None, ratio: float) -> int | None:
        """Solve in the first other way that converges; return None if none does."""
        for name, solve in self._others(now, last, ratio):
            self.restore(now)
            self._trying(name)
            iterations = self._attempt(name, solve, now)
            if iterations is not None:
                return iterations
        return None

    def _attempt(self, name: str, solve: Callable[[], int], now: State) -> int | None:
        """Solve in another way from the present state; return None if it fails."""
        kept = len(self._given)
        try:
            iterations = solve()
            self.released = self._released(name, now)
        except FAILURES as failure:
            if len(self._given) > kept:
                self._set_kept(self._given.pop())
            if isinstance(failure, SetUpError):
                raise
            return None
        self.used = name
        return iterations

    def _released(self, name: str, now: State) -> float:
        """Find the energy that a snap since a state has set free. Collective.

        A step that needs energy which nothing supplies is refused: another equilibrium
        was found, and no path of equilibria leads there.
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

    def _is_curable(self, failure: Exception) -> bool:
        """Whether a solve cycled or diverged, rather than ran out of iterations; or
        did so in the smallest step, where halving has not helped."""
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
        return broken or is_last or is_in_trouble(norms)

    def _as_given(self, now: State, last: State | None, ratio: float) -> int:
        """Solve by the solver as it was given, from the extrapolated state first."""
        if self._extrapolates and last is not None:
            try:
                iterations = self._extrapolated(now, last, ratio)
                self.used = EXTRAPOLATED
                return iterations
            except FAILURES:
                self._tried_ahead = True
                self.restore(now)
        elif self._prediction and last is not None and self.used == FULL:
            ahead = self._predicted(self._prediction, now, last, ratio)
            if ahead is not None:
                return ahead
        self.used = FULL
        return iterations_of(self.solver)

    def _predicted(
        self, prediction: Prediction, now: State, last: State, ratio: float
    ) -> int | None:
        """Solve from where the last step leads, if it leads on; return None if not, or
        if that fails."""
        if not prediction.leads_on(now, last, ratio):
            return None
        self._tried_ahead = True
        convergence, iterations = self.solver.problem.convergence, None
        patient, convergence.patient = convergence.patient, False
        try:
            iterations = iterations_of(self.solver)
        except FAILURES as failure:
            if isinstance(failure, SetUpError):
                raise
            self.restore(now)
        finally:
            convergence.patient = patient
        prediction.note(iterations is not None)
        return iterations

    def restore(self, now: State) -> None:
        """Go back to a state. Collective."""
        self._contact.restore(now)
        self._path.restart()
        self.rejected()

    def _others(
        self, now: State, last: State | None, ratio: float
    ) -> Iterator[tuple[str, Callable[[], int]]]:
        """Yield the other ways by name, as measurements order them.

        See docs/measured/robustness_paths.md.
        """
        solver = self.solver
        if last is not None and not self._tried_ahead:
            yield EXTRAPOLATED, partial(self._extrapolated, now, last, ratio)
        yield SMALL_GAMMA, partial(solve_by_small_gamma, solver)
        if self._capped is not None:
            yield CAPPED, partial(iterations_of, self._capped)
        if self._searching is not None:
            yield LINE_SEARCH, partial(iterations_of, self._searching)
            yield BOTH, partial(solve_by_small_gamma, self._searching)
        if len(self._given) < MOST_KEPT and _with_multipliers(self._contact):
            yield KEPT, partial(solve_with_small_gamma, solver, self._given)
        if self._viscous is not None and self._viscous.is_of_use():
            yield VISCOUS, partial(self._viscous.solve, partial(iterations_of, solver))

    def _extrapolated(self, now: State, last: State, ratio: float) -> int:
        """Solve from the extrapolated state."""
        extrapolate(self._path, now, last, ratio)
        return iterations_of(self.solver)

    def _set_kept(self, gammas: list[Any]) -> None:
        """Give reduced coefficients back. Collective."""
        _set_gamma(_with_multipliers(self._contact), gammas)

    def finish(self) -> None:
        """Give gamma back at the end of the path. Collective."""
        if self._given:
            self._set_kept(self._given[0])
            self._given.clear()

    # Other solvers with the settings of the given one, made when first needed

    @cached_property
    def _capped(self) -> CappedSolver | None:
        plain = getattr(self.solver, "convergence_criterion", "residual") == "residual"
        fits = plain and isinstance(self.solver, (NewtonSolver, SNESSolver))
        return CappedSolver(self.solver) if fits else None

    @cached_property
    def _searching(self) -> SNESSolver | None:
        return with_line_search(self.solver)

    @cached_property
    def _viscous(self) -> Stabilization | None:
        if not self._may_be_viscous:
            return None
        return Stabilization(self.solver, 1.0, MOST_VISCOUS)

"""Ways to solve one load step, and the order in which they are tried."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
from dolfinx.fem import Function

from ..convergence.convergence import is_in_trouble
from ..diagnose.failure import FAILURES
from ..diagnose.lost_contact import largest_motions, touched_bodies
from ..errors import ContactWarning, ConvergenceError, SetUpError
from ..interface.state import State
from ..interface.stiffness import mean_facet_size
from ..interface.zone_data import opposite_points, path
from ..solvers.newton import NewtonSolver
from ..solvers.snes import SNESSolver
from ..solvers.solver import CoupledSolver
from .energy_balance import balance_of_step
from .load_path import PrescribedPath
from .prediction import Backoff, Prediction
from .stabilization import Stabilization, loose_bodies

FULL, CAPPED = "full", "capped"
SMALL_GAMMA, VISCOUS = "small gamma", "viscous forces"
# As measurements order them (docs/robustness_paths.md)
WAYS = CAPPED, SMALL_GAMMA, VISCOUS

# Smaller coefficient, over the one in use. It hardly changes the solution, but with it
# fewer points open and close during a solve
SMALL = 0.1

# Overlap at which a step ends, in sizes of slave facets. Without overlap no gap would
# ever close
OVERLAP = 0.01

# Share of Newton's step that is always taken
LEAST = 0.05

# Factor for the number of iterations, as shorter steps need more
MORE_ITERATIONS = 2

# Solves of one step under viscous forces that the user has not asked for
MOST_VISCOUS = 40


def iterations_of(solver: Any) -> int:
    """Solve once and return the iterations."""
    return int(solver.solve()[0])


def solve_by_small_gamma(solver: Any) -> int:
    """Solve with a tenth of gamma, then with gamma from there. Collective."""
    contacts = solver.problem.contact.contacts
    given = [contact.gamma for contact in contacts]
    try:
        for contact, gamma in zip(contacts, given):
            contact.set_gamma(_small(gamma))
        # Warnings of the first solve are of no interest: its state is not kept
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ContactWarning)
            iterations = iterations_of(solver)
    finally:
        for contact, gamma in zip(contacts, given):
            contact.set_gamma(gamma)
    return iterations + iterations_of(solver)


def _small(gamma: Any) -> Any:
    """A tenth of a coefficient."""
    if not isinstance(gamma, Function):
        return SMALL * gamma
    small = Function(gamma.function_space)
    small.x.array[:] = SMALL * gamma.x.array
    return small


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


class Strategies:
    """Solve steps: first by the solver as it was given, after a failure in other ways.

    A way that has solved a step is the first one in the next, and the solver as it was
    given is tried again after 1, 2, 4, ... steps. `trying` is called with the name of
    each other way before it is tried. After a step `used` is the name of the way that
    solved it, and `released` the energy that it has set free in a snap, found by another
    way.
    """

    def __init__(
        self,
        path: PrescribedPath,
        trying: Callable[[str], None],
        extrapolate: bool | None,
        automatic: bool,
        may_be_viscous: bool,
    ) -> None:
        self._path, self.solver, self._trying = path, path.solver, trying
        self._automatic, self._may_be_viscous = automatic, may_be_viscous
        predicts = path.led is None if extrapolate is None else extrapolate
        self._prediction = Prediction(path, bool(extrapolate)) if predicts else None
        self.used, self.released = FULL, 0.0
        self._plain, self._favourite = Backoff(), FULL
        self._contact = self.solver.problem.contact
        self._asks_viscous = automatic and may_be_viscous
        self._loose, self._falls = loose_bodies(self.solver.problem), False

    def solve(self, now: State, last: State | None, ratio: float) -> int:
        """Solve from the present state; return the iterations. Collective.

        `last` is the state at the start of the last step, None in the first step, and
        `ratio` the size of this step over that of the step before. If no other way
        helps, the failure of the solver as it was given is raised.
        """
        self.released, self._falls = 0.0, self._has_untouched()
        # A solve stops as soon as it is in trouble if another way is left
        convergence = self.solver.problem.convergence
        convergence.patient = not self._automatic
        try:
            iterations = None
            if self._falls:
                iterations = self._otherwise(now, [VISCOUS])
            elif self._plain.rests():
                iterations = self._otherwise(now, [self._favourite])
            if iterations is None:
                iterations = self._as_given(now, last, ratio)
                self._plain.worked()
                if self._has_rolled(now):
                    iterations = self._held_back(now, iterations)
            return iterations
        except FAILURES as failure:
            if not (self._automatic and self._is_curable(failure)):
                raise
            # No variable keeps the failure: in a cycle with this frame, ranks would
            # free the solver, which is collective, at different times
            iterations = self._otherwise(now, WAYS)
            if iterations is None:
                raise
            if self.used != VISCOUS:
                self._plain.failed()
            return iterations
        finally:
            convergence.patient = True

    def _has_rolled(self, now: State) -> bool:
        """Whether a body that contact alone holds has moved by more than a slave facet,
        and nothing that is held has driven it. Collective."""
        if not (self._asks_viscous and self._loose.any()):
            return False
        zones, contact = self._contact.zones, self._contact
        if any(zone.motions.have_moved() for zone in zones):
            return False
        moved = largest_motions(contact, now.u)
        driven = 2.0 * moved.max(initial=0.0, where=~self._loose)
        limit = max(mean_facet_size(contact.layout, zones), driven)
        return bool(moved.max(initial=0.0, where=self._loose) > limit)

    def _held_back(self, now: State, iterations: int) -> int:
        """Solve under viscous forces in place of a solve that let a body roll; keep that
        one if they do not fade. Collective."""
        rolled = self._contact.state()
        held = self._otherwise(now, [VISCOUS])
        if held is not None:
            return held
        self.restore(rolled)
        return iterations

    def once(self) -> int:
        """Solve by the solver as it was given; return the iterations. Collective."""
        self.used, self.released = FULL, 0.0
        convergence = self.solver.problem.convergence
        patient, convergence.patient = convergence.patient, not self._automatic
        try:
            return iterations_of(self.solver)
        finally:
            convergence.patient = patient

    def _otherwise(self, now: State, names: Sequence[str]) -> int | None:
        """Solve in the first of some ways that converges; None if none does."""
        for name in sorted(names, key=lambda name: name != self._favourite):
            solve = self._way(name)
            if solve is None:
                continue
            self.restore(now)
            self._trying(name)
            try:
                iterations = solve()
                self.released = self._released(name, now)
            except FAILURES as failure:
                if isinstance(failure, SetUpError):
                    raise
                continue
            self.used = name
            if name != VISCOUS:  # whose many solves are the last resort
                self._favourite = name
            return iterations
        self.restore(now)
        return None

    def _released(self, name: str, now: State) -> float:
        """Find the energy that a snap since a state has set free. Collective.

        A step that needs energy which nothing supplies is refused: another equilibrium
        was found, and no path of equilibria leads there.
        """
        if not self._may_be_viscous or self._falls:
            return 0.0
        balance = balance_of_step(self.solver.problem, self._path, now)
        if balance.lacks_energy:
            raise ConvergenceError(
                f"{name}: the step jumps, and needs an energy of {-balance.most:.3g} "
                "that no load supplies"
            )
        return balance.released

    def _has_untouched(self) -> bool:
        """Whether a body has neither supports nor contact. Collective."""
        if not (self._asks_viscous and self._loose.any()):
            return False
        return bool((self._loose & ~touched_bodies(self._contact)).any())

    def _is_curable(self, failure: Exception) -> bool:
        """Whether a solve cycled or diverged, rather than ran out of iterations."""
        if isinstance(failure, SetUpError):
            return False
        if not isinstance(failure, ConvergenceError):
            return True
        problem = self.solver.problem
        # PETSc stops at a NaN without asking our test of convergence
        broken = bool(problem.history) and not np.isfinite(problem.history[-1])
        return broken or is_in_trouble(problem.convergence.norms)

    def _as_given(self, now: State, last: State | None, ratio: float) -> int:
        """Solve by the solver as it was given, from where the last step leads first."""
        self.used, prediction = FULL, self._prediction
        if prediction and last is not None and prediction.take(now, last, ratio):
            convergence = self.solver.problem.convergence
            patient, convergence.patient = convergence.patient, False
            try:
                iterations = iterations_of(self.solver)
                prediction.trust.worked()
                return iterations
            except FAILURES as failure:
                if isinstance(failure, SetUpError):
                    raise
                prediction.trust.failed()
                self.restore(now)
            finally:
                convergence.patient = patient
        return iterations_of(self.solver)

    def restore(self, now: State) -> None:
        """Go back to a state. Collective."""
        self._contact.restore(now)
        self._path.restart()

    def _way(self, name: str) -> Callable[[], int] | None:
        """Another way to solve a step; None: it is of no use here."""
        if name == CAPPED and self._capped is not None:
            return partial(iterations_of, self._capped)
        if name == SMALL_GAMMA:
            return partial(solve_by_small_gamma, self.solver)
        if name == VISCOUS and self._viscous is not None and self._viscous.is_of_use():
            return partial(self._viscous.solve, self.once)
        return None

    # Other solvers with the settings of the given one, made when first needed

    @cached_property
    def _capped(self) -> CappedSolver | None:
        plain = getattr(self.solver, "convergence_criterion", "residual") == "residual"
        fits = plain and isinstance(self.solver, (NewtonSolver, SNESSolver))
        return CappedSolver(self.solver) if fits else None

    @cached_property
    def _viscous(self) -> Stabilization | None:
        if not self._may_be_viscous:
            return None
        return Stabilization(self.solver, 1.0, MOST_VISCOUS)

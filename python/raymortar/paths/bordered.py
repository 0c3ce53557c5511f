"""Newton's method on displacement, multiplier and load factor."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from ..compat import Array, Mask
from ..diagnose.failure import in_use_of, one_of, ways_to_hold
from ..diagnose.lost_contact import loose_bodies
from ..diagnose.outcome import require_convergence
from ..errors import ConvergenceError, raise_everywhere, require_agreement
from ..solvers.petsc_objects import renew
from .load_path import PrescribedPath, StepSizes

# Change of the load factor, as a share of the path, for difference quotients. Only
# loads and prescribed displacements are differentiated, in which the residual is
# linear: if `apply` is linear, rounding is the only error
CHANGE = 1e-6

# Share of the largest displacement below which the loads count as not moving the
# displacement that leads
NO_CHANGE = 1e-12


class LedPath(PrescribedPath, ABC):
    """Lead steps by one more equation, with the load factor as an unknown. Collective.

    Newton's method goes from u to u - X and from t to t + dt. The equation is
    g X = c + e dt. Each iteration solves three times with one factorised tangent: for
    the residual, for its derivative by the load factor, and for a spring that keeps the
    tangent regular.

    Attributes
    ----------
    trial
        Load factor of the present iterate.
    """

    def __init__(
        self,
        solver: Any,
        apply: Callable[[float, float], Any],
        ends: tuple[float, float],
        sizes: StepSizes,
    ) -> None:
        super().__init__(solver, apply, ends, sizes)
        self.problem, self._contact = solver.problem, solver.problem.contact
        self._u, self._n = self._contact.u, self._contact.layout.n_u
        self._comm: MPI.Comm = self.problem.comm
        self._change = CHANGE * (ends[1] - ends[0])
        self.trial = self._before = self.factor

    @abstractmethod
    def row(self) -> tuple[Array, float, float]:
        """Return g (owned dofs), e and c of the equation. Collective."""

    @abstractmethod
    def is_met(self) -> bool:
        """Whether the equation is met, to rounding. Collective."""

    def share(self, change: Array, step: float) -> float:
        """Return the share of a correction that is applied. Collective."""
        return 1.0

    def check(self) -> None:
        """Refuse solutions that do not go on along the path. Collective."""

    @property
    def solver(self) -> Any:
        return self

    @property
    def led(self) -> Mask:
        """Whether an owned dof of u leads the path; an arc's length counts all."""
        weights = self.led_weights
        return np.ones(self._n, dtype=bool) if weights is None else weights != 0.0

    @property
    def next(self) -> float:
        """Load factor at the start of the step, as its end is not known."""
        return self.factor

    def begin(self) -> None:
        self.trial = self.factor

    def restart(self) -> None:
        self.trial = self.factor
        self._load(self.factor)

    def extrapolate(self, ratio: float) -> None:
        self.trial = self.factor + ratio * (self.factor - self._before)

    def reached(self) -> None:
        self._before, self.factor = self.factor, self.trial

    def describe(self) -> str:
        return f"the step after load factor {self.factor:.6g} failed"

    def _load(self, factor: float) -> None:
        """Set the loads of a factor."""
        self._apply(factor, factor - self.factor)

    def solve(self) -> tuple[int, bool]:
        """Solve from the present displacement, multiplier and load factor."""
        given, problem = self._given, self.problem
        require_agreement(self._comm, max_it=given.max_it, rtol=given.tolerances)
        x, vectors = problem.start(), [problem.create_vector() for _ in range(4)]
        converged = False
        try:
            with given.options:
                iterations, reason = self._iterate(x, *vectors)
            converged = reason is None
        finally:
            for vector in (x, *vectors):
                vector.destroy()
            if not converged:
                renew(given.krylov_solver, given.A)
        text = f"after {iterations} iterations{reason}"
        require_convergence(problem, converged, text)
        self.check()
        return iterations, True

    def _iterate(
        self, x: PETSc.Vec, b: PETSc.Vec, *work: PETSc.Vec
    ) -> tuple[int, str | None]:
        """Return the iterations and why they failed, None if they converged."""
        given, convergence = self._given, self.problem.convergence
        rtol, atol = given.tolerances[0], given.force_tolerance
        iteration = 0
        while True:
            self._load(self.trial)
            self.problem.F(x, b)
            # The first residual is no measure: a step starts from a solution
            if iteration:
                convergence.accept()
            if convergence.reached(rtol, atol) and self.is_met():
                return iteration, None
            if convergence.is_stuck:
                return iteration, ", and was stopped"
            if iteration == given.max_it:
                return iteration, ""
            if not self._correct(x, b, *work):
                return iteration, " (the linear solver failed)"
            iteration += 1

    def _correct(self, x: PETSc.Vec, b: PETSc.Vec, *work: PETSc.Vec) -> bool:
        """Move to the next iterate; return False if there is none. Collective.

        The change -X of x has A X = b + dt slope, and g X = c + e dt. A spring s at the
        dof k to which g gives most weight keeps A regular where it is not, at limit
        points and where nothing but contact holds what leads: with z = s A^-1 e_k,
        X = A^-1 b + dt A^-1 slope + X_k z.
        """
        given, n, (slope, b_step, slope_step) = self._given, self._n, work
        self._differentiate(slope, b_step)
        g, by_factor, right = self.row()
        spring = self._spring(g)
        given.linearise(x, spring)
        given.correct(b, b_step)
        given.correct(slope, slope_step)
        slope.set(0.0)
        for row, stiffness in spring.items():
            slope[row] = stiffness
        slope.assemble()
        given.correct(slope, b)
        solved = [v.getArray(readonly=True)[:n] for v in (b_step, slope_step, b)]
        k = [row - self._contact.layout.begin for row in spring]
        # Product with g, and entry at the spring, of each solution
        table = np.array([[g @ v, v[k].sum()] for v in solved])
        self._comm.Allreduce(MPI.IN_PLACE, table)
        if not np.isfinite(table).all():
            return False
        of_b, of_slope, of_spring = table
        system = np.array([of_slope - [by_factor, 0.0], of_spring - [0.0, 1.0]]).T
        weight, way = largest(self._comm, g), largest(self._comm, solved[1])
        scaled = system / np.outer([weight or 1.0, 1.0], [way or 1.0, 1.0])
        if abs(np.linalg.det(scaled)) <= NO_CHANGE:
            raise ConvergenceError(self._why_not_led(g, weight > 0.0))
        step, moved = np.linalg.solve(system, [right, 0.0] - of_b)
        b_step.axpy(step, slope_step)
        b_step.axpy(moved, b)
        share = self.share(b_step.getArray(readonly=True), step)
        x.axpy(-share, b_step)
        self.trial += share * step
        return True

    def _why_not_led(self, g: Array, leads: bool) -> str:
        """Say why the loads do not move the displacement that leads. Collective."""
        free = loose_bodies(self.problem, g)
        if not free:
            return (
                "the loads do not move what leads the path: is what was chosen of a "
                "loaded body, or touched by one, and free to move?"
            )
        ways = one_of(ways_to_hold(in_use_of(self.problem)))
        # The displacement that leads belongs to another body, so it holds none of these
        if leads and free == loose_bodies(self.problem):
            return (
                f"the loads do not move what leads the path: {'; '.join(free)}. Try "
                f"{ways}"
            )
        return f"{'; '.join(free)}: what leads the path does not hold that. Try {ways}"

    def _spring(self, g: Array) -> dict[int, float]:
        """Return row and stiffness of the spring on the rank that owns it. Collective.

        It is at the free dof to which g gives most weight.
        """
        weights = np.where(self.problem.constrained, 0.0, np.abs(g))
        mine = float(weights.max(initial=0.0))
        most, rank = self._comm.allreduce((mine, self._comm.rank), op=MPI.MAXLOC)
        if most == 0.0 or rank != self._comm.rank:
            return {}
        k = int(np.argmax(weights))
        stiffness = float(self._contact.stiffness_diagonal[k])
        return {self._contact.layout.begin + k: stiffness}

    def _rigid_motions(self) -> Array:
        """Return the motions of all rigid bodies that slaves meet."""
        return np.concatenate([zone.motions.present() for zone in self._contact.zones])

    def _differentiate(self, slope: PETSc.Vec, loads: PETSc.Vec) -> None:
        """Differentiate the last residual by the load factor; overwrite `loads`."""
        self.problem.loads(loads)
        was = self._rigid_motions()
        self._load(self.trial + self._change)
        moved = not np.array_equal(self._rigid_motions(), was)
        self.problem.loads(slope)
        self._load(self.trial)
        message = None
        if moved:
            message = (
                "control leads loads and prescribed displacements, and apply moves a "
                "rigid body: let apply leave bodies where they are, and move what they "
                "touch"
            )
        raise_everywhere(self._comm, message)
        slope.axpy(-1.0, loads)
        slope.scale(1.0 / self._change)


def largest(comm: MPI.Comm, values: Array) -> float:
    """Find the largest magnitude on any rank. Collective."""
    return float(comm.allreduce(np.abs(values).max(initial=0.0), op=MPI.MAX))

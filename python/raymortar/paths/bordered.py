"""Newton's method on displacement, multiplier and load factor."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from ..compat import Array
from ..diagnose.failure import in_use_of, one_of, ways_to_hold
from ..diagnose.lost_contact import loose_bodies
from ..diagnose.outcome import require_convergence
from ..errors import ConvergenceError, raise_everywhere, require_agreement
from ..solvers.newton import NewtonSolver
from ..solvers.petsc_objects import renew
from ..solvers.snes import SNESSolver
from .constraints import largest

# Change of the load factor, as a share of the path, for difference quotients. Only
# loads and prescribed displacements are differentiated, in which the residual is
# linear: if `apply` is linear, rounding is the only error
CHANGE = 1e-6

# Share of the largest displacement below which the loads count as not moving what leads
NO_CHANGE = 1e-12


class BorderedSolver:
    """Newton's method for displacement, multiplier and load factor, with one more
    equation for the load factor. Collective.

    Each iteration solves three times with one factorised tangent: for the residual, for
    its derivative by the load factor, and for a spring that keeps the tangent regular.

    Parameters
    ----------
    solver
        Gives tangent, linear solver, tolerances and the largest number of iterations.
    apply
        Function of the load factor.
    constraint
        One of `constraints`.
    factor
        Load factor at first.
    change
        Change of the load factor for difference quotients.

    Attributes
    ----------
    factor
        Load factor. A solve starts there, and leaves its solution there.
    """

    def __init__(
        self,
        solver: NewtonSolver | SNESSolver,
        apply: Callable[[float], Any],
        constraint: Any,
        factor: float,
        change: float,
    ) -> None:
        self.solver, self.problem = solver, solver.problem
        self._apply, self._constraint = apply, constraint
        self.factor, self._change = factor, change

    def solve(self) -> tuple[int, bool]:
        """Solve from the present displacement, multiplier and load factor.

        Returns
        -------
        iterations, converged

        Raises
        ------
        ConvergenceError
            If the solve fails. The load factor is then the old one.
        """
        solver, problem, start = self.solver, self.problem, self.factor
        require_agreement(problem.comm, max_it=solver.max_it, rtol=solver.tolerances)
        x, vectors = problem.start(), [problem.create_vector() for _ in range(4)]
        converged = False
        try:
            with solver.options:
                iterations, reason = self._iterate(x, *vectors)
            converged = reason is None
        finally:
            for vector in (x, *vectors):
                vector.destroy()
            if not converged:
                self.factor = start
                renew(solver.krylov_solver, solver.A)
        text = f"after {iterations} iterations{reason}"
        require_convergence(problem, converged, text)
        self._constraint.check(self.factor)
        return iterations, True

    def _iterate(
        self, x: PETSc.Vec, b: PETSc.Vec, *work: PETSc.Vec
    ) -> tuple[int, str | None]:
        """Number of iterations, and why they failed; None if they converged."""
        solver, convergence = self.solver, self.problem.convergence
        rtol, atol = solver.tolerances[0], solver.force_tolerance
        iteration = 0
        while True:
            self._apply(self.factor)
            self.problem.F(x, b)
            # The first residual is no measure: a step starts from a solution
            if iteration:
                convergence.accept()
            balanced = convergence.reached(rtol, atol)
            if balanced and self._constraint.is_met(self.factor):
                return iteration, None
            if convergence.is_stuck:
                return iteration, ", and was stopped"
            if iteration == solver.max_it:
                return iteration, ""
            if not self._correct(x, b, *work):
                return iteration, " (the linear solver failed)"
            iteration += 1

    def _correct(
        self,
        x: PETSc.Vec,
        b: PETSc.Vec,
        slope: PETSc.Vec,
        b_step: PETSc.Vec,
        slope_step: PETSc.Vec,
    ) -> bool:
        """Move to the next iterate. False if there is none. Collective.

        The change -X of x has A X = b + dt slope, and g X = c + e dt. A spring s at the
        dof k to which g gives most weight keeps A regular where it is not, at limit
        points and where nothing but contact holds what leads: with z = s A^-1 e_k,
        X = A^-1 b + dt A^-1 slope + X_k z.
        """
        solver, constraint = self.solver, self._constraint
        self._differentiate(slope, b_step)
        g, by_factor, right = constraint.row(self.factor)
        spring = self._spring(g)
        solver.linearise(x, spring)
        solver.correct(b, b_step)
        solver.correct(slope, slope_step)
        slope.set(0.0)
        for row, stiffness in spring.items():
            slope[row] = stiffness
        slope.assemble()
        solver.correct(slope, b)
        solved = [v.getArray(readonly=True) for v in (b_step, slope_step, b)]
        g_of, k_of = self._products(g, spring, solved)
        if not np.isfinite([g_of, k_of]).all():
            return False
        comm = self.problem.comm
        size = largest(comm, g), largest(comm, solved[1][: len(g)])
        system = np.array([[g_of[1] - by_factor, g_of[2]], [-k_of[1], 1.0 - k_of[2]]])
        found = _solved(system, [right - g_of[0], k_of[0]], size)
        if found is None:
            raise ConvergenceError(self._why_not_led(g, size[0] > 0.0))
        step, moved = found
        b_step.axpy(step, slope_step)
        b_step.axpy(moved, b)
        share = constraint.share(b_step.getArray(readonly=True), step)
        x.axpy(-share, b_step)
        self.factor += share * step
        return True

    def _why_not_led(self, g: Array, leads: bool) -> str:
        """A message on why loads do not move what leads, given its weights.
        Collective."""
        free = loose_bodies(self.problem, g)
        if not free:
            return (
                "the loads do not move what leads the path: is what was chosen of a "
                "loaded body, or touched by one, and free to move?"
            )
        ways = one_of(ways_to_hold(in_use_of(self.problem)))
        # What leads belongs to another body, so it holds none of these
        if leads and free == loose_bodies(self.problem):
            return (
                f"the loads do not move what leads the path: {'; '.join(free)}. Try "
                f"{ways}"
            )
        return f"{'; '.join(free)}: what leads the path does not hold that. Try {ways}"

    def _spring(self, g: Array) -> dict[int, float]:
        """Row and stiffness of the spring: at the free dof to which g gives most
        weight, on the rank that owns it. Empty on other ranks. Collective."""
        contact, comm = self.problem.contact, self.problem.comm
        weights = np.where(self.problem.constrained, 0.0, np.abs(g))
        most, rank = comm.allreduce(
            (float(weights.max(initial=0.0)), comm.rank), op=MPI.MAXLOC
        )
        if most == 0.0 or rank != comm.rank:
            return {}
        k = int(np.argmax(weights))
        return {contact.layout.begin + k: float(contact.stiffness_diagonal[k])}

    def _products(
        self, g: Array, spring: dict[int, float], vectors: list[Array]
    ) -> list[list[float]]:
        """For each vector: its product with g, and its entry at the spring.
        Collective."""
        begin = self.problem.contact.layout.begin
        at = [row - begin for row in spring]
        sums = np.array([[g @ v[: len(g)], v[at].sum()] for v in vectors]).T.copy()
        self.problem.comm.Allreduce(MPI.IN_PLACE, sums)
        return list(sums.tolist())

    def _rigid_motions(self) -> Array:
        """Motions of all rigid bodies that slaves meet."""
        zones = self.problem.contact.zones
        return np.concatenate([zone.motions.present() for zone in zones])

    def _differentiate(self, slope: PETSc.Vec, loads: PETSc.Vec) -> None:
        """Derivative of the residual by the load factor. Call it after
        `NonlinearProblem.F`. The vector `loads` is overwritten."""
        h = self._change
        self.problem.loads(loads)
        was = self._rigid_motions()
        self._apply(self.factor + h)
        moved = not np.array_equal(self._rigid_motions(), was)
        self.problem.loads(slope)
        self._apply(self.factor)
        message = None
        if moved:
            message = (
                "control leads loads and prescribed displacements, and apply moves a "
                "rigid body: let apply leave bodies where they are, and move what they "
                "touch"
            )
        raise_everywhere(self.problem.comm, message)
        slope.axpy(-1.0, loads)
        slope.scale(1.0 / h)


def _solved(
    system: Array, right: list[float], size: tuple[float, float]
) -> Array | None:
    """Changes of the load factor and of the spring's dof. None if the load factor does
    not move what leads.

    Parameters
    ----------
    system, right
        Two equations: the constraint's, and the spring's.
    size
        Largest weight of the constraint, and largest change that the load factor makes.
    """
    rows, columns = np.array([size[0] or 1.0, 1.0]), np.array([size[1] or 1.0, 1.0])
    scaled = system / rows[:, None] / columns
    if abs(np.linalg.det(scaled)) <= NO_CHANGE:
        return None
    return np.linalg.solve(system, right)

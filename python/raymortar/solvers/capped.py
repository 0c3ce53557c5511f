"""Newton's method with steps that end where two surfaces first cross."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from ..interface.faced import nearest_hits, path
from ..interface.stiffness import mean_facet_size
from .newton import NewtonSolver
from .outcome import require_convergence
from .petsc_objects import renew
from .snes import SNESSolver

if TYPE_CHECKING:
    from ..interface.zone_data import Faced, ZoneData

# Overlap at which a step ends, in sizes of slave facets. Without overlap no gap would
# ever close
OVERLAP = 0.01

# Share of Newton's step that is always taken
LEAST = 0.05

# Factor for the number of iterations, as shorter steps need more
MORE_ITERATIONS = 2


class CappedSolver:
    """Newton's method with steps so short that no facet passes its master. Collective.

    A step may take an open facet below its master by a small overlap only. Facets that
    are closed already do not limit the step.

    Parameters
    ----------
    solver
        Gives its tangent, linear solver and tolerances. Twice its most iterations are
        allowed.
    """

    def __init__(self, solver: NewtonSolver | SNESSolver) -> None:
        self.solver, self.problem = solver, solver.problem
        contact = self.problem.contact
        size = mean_facet_size(contact.layout, contact.zones)
        self._overlap = OVERLAP * size

    def solve(self) -> tuple[int, bool]:
        """Solve from the present u and multiplier, as `SNESSolver.solve`."""
        solver, problem = self.solver, self.problem
        x, vectors = problem.start(), [problem.create_vector() for _ in range(3)]
        converged = False
        try:
            with solver.options:
                iterations, converged = self._iterate(x, *vectors)
        finally:
            for vector in (x, *vectors):
                vector.destroy()
            if not converged:
                renew(solver.krylov_solver, solver.A)
        require_convergence(problem, converged, f"after {iterations} iterations")
        return iterations, True

    def _iterate(
        self, x: PETSc.Vec, b: PETSc.Vec, dx: PETSc.Vec, trial: PETSc.Vec
    ) -> tuple[int, bool]:
        """Number of iterations, and whether they have converged."""
        solver, problem = self.solver, self.problem
        convergence, comm = problem.convergence, problem.comm
        rtol, atol = solver.tolerances[0], solver.force_tolerance
        for iteration in range(MORE_ITERATIONS * solver.max_it + 1):
            problem.F(x, b)
            convergence.accept()
            if convergence.reached(rtol, atol):
                return iteration, True
            if convergence.is_stuck:
                break
            solver.linearise(x, {})
            solver.correct(b, dx)
            finite = bool(np.isfinite(dx.getArray(readonly=True)).all())
            if not comm.allreduce(finite, op=MPI.LAND):
                break
            x.copy(trial)
            trial.axpy(-1.0, dx)
            x.axpy(-self._share(x, trial), dx)
        return iteration, False

    def _share(self, x: PETSc.Vec, trial: PETSc.Vec) -> float:
        """Share of the step from x to the trial that is taken. Collective."""
        contact = self.problem.contact
        faced = [nearest_hits(zone) for zone in contact.zones]
        contact.from_vector(trial)
        shares = [self._of_zone(*part) for part in zip(contact.zones, faced)]
        contact.from_vector(x)
        share = float(self.problem.comm.allreduce(min(shares), op=MPI.MIN))
        return max(share, LEAST)

    def _of_zone(self, zone: ZoneData, faced: Faced) -> float:
        """Share of the step that one zone allows on this rank. Collective."""
        u = self.problem.contact.u
        at = u.x.array.reshape(-1, u.function_space.dofmap.index_map_bs)
        gap = path(zone, faced, at, self.problem.comm).gap
        crosses = (faced.gap > 0.0) & ~faced.closed & (gap < -self._overlap)
        room = faced.gap[crosses] + self._overlap
        return float(np.min(room / (faced.gap - gap)[crosses], initial=1.0))

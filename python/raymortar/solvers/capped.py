"""Newton's method with shortened steps: up to a crossing, or by a line search."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from ..diagnose.outcome import require_convergence
from ..interface.zone_data import nearest_hits, path
from ..interface.stiffness import mean_facet_size
from .newton import NewtonSolver
from .petsc_objects import renew
from .snes import SNESSolver
from .solver import CoupledSolver

# Overlap at which a step ends, in sizes of slave facets. Without overlap no gap would
# ever close
OVERLAP = 0.01

# Share of Newton's step that is always taken
LEAST = 0.05

# Factor for the number of iterations, as shorter steps need more
MORE_ITERATIONS = 2

_LINE_SEARCH = "snes_linesearch_type"


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
        """Iterate from x; the number of iterations, and whether they have converged."""
        solver, problem = self.solver, self.problem
        convergence = problem.convergence
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
            if not np.isfinite(dx.norm()):
                break
            x.copy(trial)
            trial.axpy(-1.0, dx)
            x.axpy(-self._share(x, trial), dx)
        return iteration, False

    def _share(self, x: PETSc.Vec, trial: PETSc.Vec) -> float:
        """Share of the step from x to the trial that is taken. Collective."""
        contact, comm = self.problem.contact, self.problem.comm
        before = [nearest_hits(zone) for zone in contact.zones]
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

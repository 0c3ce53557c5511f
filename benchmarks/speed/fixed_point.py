"""Fixed point on the pairing against Newton's method on everything."""

from __future__ import annotations

import sys
import time
from pathlib import Path

from mpi4py import MPI

import raymortar

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from models import hertz_cylinder  # noqa: E402
from models import shallow_ironing  # noqa: E402


class _Counted:
    """A solver, with its pairings and failures counted."""

    def __init__(self, problem_or_solver, fixed_point):
        solver = problem_or_solver
        if isinstance(solver, raymortar.NonlinearProblem):
            solver = raymortar.SNESSolver(solver)
        self.solver = raymortar.FixedPointSolver(solver) if fixed_point else solver
        self.problem, self.fixed_point = solver.problem, fixed_point
        self.iterations = self.solves = self.failures = self.pairings = 0

    def solve(self):
        self.solves += 1
        try:
            iterations, converged = self.solver.solve()
        except raymortar.ConvergenceError:
            self.failures += 1
            raise
        self.iterations += iterations
        if self.fixed_point:
            self.pairings += len(self.solver.residuals)
        else:
            self.pairings += iterations + 1
        return iterations, converged


def ironing(fixed_point, press, slide, until, size):
    """Steps of the shallow ironing problem."""
    model = shallow_ironing.Ironing(MPI.COMM_SELF, size)
    model.solver = _Counted(model.solver, fixed_point)
    for _ in model.path(0.0, press, slide, until):
        pass
    return model.solver


def hertz(fixed_point, facets_across):
    """A cylinder pressed on a block, then held by a force."""
    made = []

    def make(problem):
        made.append(_Counted(problem, fixed_point))
        return made[-1]

    hertz_cylinder.solve(
        MPI.COMM_SELF,
        hertz_cylinder.SMALL,
        facets_across=facets_across,
        make_solver=make,
    )
    return made[0]


def row(name, fixed_point, run, *arguments):
    """Time, iterations, pairings and failures of one path."""
    start = time.process_time()
    try:
        counted, finished = run(fixed_point, *arguments), True
    except raymortar.ConvergenceError:
        return {"path": name, "fixed_point": fixed_point, "finished": False}
    return {
        "path": name,
        "fixed_point": fixed_point,
        "finished": finished,
        "solves": counted.solves,
        "failures": counted.failures,
        "iterations": counted.iterations,
        "pairings": counted.pairings,
        "seconds": time.process_time() - start,
    }


def rows(quick):
    """Both methods on both paths."""
    paths = [("hertz", hertz, 10 if quick else 40)]
    if quick:
        paths.append(("ironing", ironing, 2, 20, 1.05, 40))
    else:
        paths.append(("ironing, 100 slide steps", ironing, 10, 100, 1.2, 60))
        paths.append(("ironing, 20 slide steps", ironing, 10, 20, 1.2, 60))
    return [
        row(name, fixed_point, run, *arguments)
        for name, run, *arguments in paths
        for fixed_point in (False, True)
    ]

"""Paths with the factors of earlier tangents, and with MUMPS at each iteration.

    scripts/python benchmarks/parallel/lagged.py [--cases flat,solid] [--sizes 0,1,2]

Writes `lagged.csv`: Newton iterations, GMRES iterations of a system, and CPU seconds
of the path, assembly included; each row from a process of its own, on one rank.
Neo-Hookean bodies with friction.

- flat: shallow ironing in 2D, pressed in 10 steps and dragged by 30
- solid: the ironing of `kept`, in 3D
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from mpi4py import MPI

import kept
import numpy as np
import ufl
from rows import run

import raymortar
from raymortar import solvers

# Behind this folder's modules
sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))

from models import shallow_ironing  # noqa: E402

NU = 0.3
COLUMNS = (*("case", "unknowns", "linear", "steps", "newton", "krylov", "seconds"),)
LINEAR = {
    "mumps": lambda case: solvers.direct(),
    "lagged": lambda case: solvers.lagged_factors(
        "umfpack" if case == "flat" else "mumps"
    ),
}
# For about 2,000, 8,000 and 30,000 unknowns, and 3,000, 12,000 and 38,000
SIZES = {"flat": (60, 120, 240), "solid": (4, 7, 11)}


def neo_hookean(u, E):
    """Residual of a neo-Hookean body."""
    mu, lmbda = E / (2 + 2 * NU), E * NU / ((1 + NU) * (1 - 2 * NU))
    F = ufl.Identity(3) + ufl.grad(u)
    P = mu * (F - ufl.inv(F).T) + lmbda * ufl.ln(ufl.det(F)) * ufl.inv(F).T
    v = ufl.TestFunction(u.function_space)
    return ufl.inner(P, ufl.grad(v)) * ufl.dx(metadata={"quadrature_degree": 2})


def flat(size, options):
    """Solver, and a function that runs the path and gives steps and iterations."""
    model = shallow_ironing.Ironing(
        MPI.COMM_SELF, size, "neo-hookean", options=options, extrapolate=False
    )

    def walk():
        rows = list(model.path(0.0, 10, 100, 1.3))
        return len(rows), sum(row.iterations for row in rows)

    return model.solver, walk


def solid(size, options):
    """The same in 3D."""
    problem, parts = kept.ironing(size, neo_hookean)
    solver = raymortar.SNESSolver(problem, options)

    def walk():
        path = kept.steps_of(solver, parts)
        return len(path), sum(step.iterations for step in path)

    return solver, walk


def measure(case, size, linear):
    """One row."""
    make = {"flat": flat, "solid": solid}[case]
    solver, walk = make(SIZES[case][size], LINEAR[linear](case))
    ksp, counts = solver.krylov_solver, []
    solver.snes.setMonitor(lambda snes, i, norm: counts.append(ksp.its))
    start = time.process_time()
    steps, newton = walk()
    seconds = time.process_time() - start
    lagged = linear == "lagged"
    values = (
        *(case, solver.problem.contact.layout.size_global, linear, steps, newton),
        round(float(np.mean(counts)), 1) if lagged else "",
        round(seconds, 2),
    )
    return dict(zip(COLUMNS, values, strict=True))


if __name__ == "__main__":
    run(__file__, __doc__, COLUMNS, measure, SIZES, ",".join(LINEAR))

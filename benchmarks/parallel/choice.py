"""Sizes from which multigrid is faster than direct factors, in whole solves and paths.

    scripts/python benchmarks/parallel/choice.py                       # 3D
    scripts/python -n 2 benchmarks/parallel/choice.py                  # on two ranks
    scripts/python benchmarks/parallel/choice.py triangle,1,100 --runs 1
    scripts/python benchmarks/parallel/choice.py triangle,1,100 --path --runs 1

Cases are cell, degree and level, see `linear.py`, and with `--path` those of the load
steps of `../parameters/corrections.py`. Prints unknowns, tangents and the processor's
seconds, the mean of the ranks, medians of some runs, by turns: of what is the automatic
choice below the change of solver (`factors`), and of multigrid.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from pathlib import Path
from unittest import mock

from mpi4py import MPI

import numpy as np
from linear import LAWS, make_problem

import raymortar
from raymortar.solvers import automatic
from raymortar.solvers.automatic import suited_to_size, with_fallback
from raymortar.solvers.linear import inexact

HERE = Path(__file__).resolve().parent
COMM = MPI.COMM_WORLD
CASES = "tetrahedron,1,4 hexahedron,1,4 tetrahedron,2,2 tetrahedron,1,5 hexahedron,1,5"


def below_the_change(problem):
    """Options of the automatic choice for a problem that is small enough."""
    with mock.patch.multiple(
        automatic, MOST_DIRECT={1: np.inf, 2: np.inf}, MOST_DIRECT_2D=np.inf
    ):
        return suited_to_size(problem, snes=True)[0]


SOLVERS = {
    "factors": below_the_change,
    "multigrid": lambda _: inexact() | with_fallback(),
}


def solve(name, cell, degree, level, law):
    """Unknowns and tangents of a whole nonlinear solve, without its set-up."""
    problem = make_problem(cell, degree, level, "augmented", law)
    options = {"snes_rtol": 1e-8, **SOLVERS[name](problem)}
    solver = raymortar.SNESSolver(problem, options)
    return problem, lambda: solver.solve()


def path(name, cell, degree, level, law):
    """Unknowns and tangents of a path of load steps."""
    sys.path[:0] = [
        str(HERE.parent / "parameters"),
        str(HERE.parents[1] / "tests/helpers"),
    ]
    import corrections

    friction = LAWS[law][0]
    mu = friction.mu if friction else 0.0
    problem, load = corrections.sheared(cell, degree, level, mu, SOLVERS[name])
    return problem, load.run


def seconds(make, *case):
    """Unknowns, tangents and seconds. Collective."""
    problem, run = make(*case)
    COMM.Barrier()
    start = time.process_time()
    run()
    spent = COMM.allreduce(time.process_time() - start) / COMM.size
    return problem.contact.layout.size_global, problem.tangents, spent


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("cases", nargs="*", default=CASES.split())
    parser.add_argument("--laws", default="none,Coulomb")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--path", action="store_true")
    given = parser.parse_args()
    for case in given.cases:
        cell, degree, level = case.split(",")
        for law in given.laws.split(","):
            one, make = (
                cell,
                int(degree),
                int(level),
                law,
            ), path if given.path else solve
            # Compiles the forms
            seconds(make, "factors", cell, int(degree), 1, law)
            found = {name: [] for name in SOLVERS}
            for _ in range(given.runs):
                for name, runs in found.items():
                    runs.append(seconds(make, name, *one))
            if COMM.rank == 0:
                texts = [
                    f"{name} {runs[0][1]} tangents, "
                    f"{statistics.median(run[2] for run in runs):.2f} s"
                    for name, runs in found.items()
                ]
                print(
                    f"{case} {law}: {runs[0][0]} unknowns; {'; '.join(texts)}",
                    flush=True,
                )


if __name__ == "__main__":
    main()

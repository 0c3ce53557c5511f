"""Iterations of the iterative solver on several ranks.

    scripts/python benchmarks/parallel/ranks.py [--ranks 1,2,4,8] [--output DIR]

The blocks of `linear.py`, in tetrahedra. Writes `ranks.csv`: Krylov iterations with
contact and of the bodies alone. Ranks may share processors, which takes long.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import json
import subprocess
import sys
from pathlib import Path

from mpi4py import MPI

import numpy as np
from linear import (
    LAWS,
    METHODS,
    iterations_of,
    iterations_of_the_bodies,
    make_problem,
    make_solver,
)
from run import environment

# Divisions of the blocks by the degree, for about 12,000 unknowns
LEVELS = {1: 4, 2: 2}
COLUMNS = (
    *("ranks", "degree", "method", "friction", "unknowns", "newton"),
    *("krylov_mean", "krylov_most", "alone"),
)


def measure_all(comm):
    """Rows of all cases on the ranks of this run."""
    for degree, method, law in itertools.product(LEVELS, METHODS, LAWS):
        problem = make_problem("tetrahedron", degree, LEVELS[degree], method, law)
        newton, krylov = iterations_of(make_solver(problem, "bodies"))
        alone = iterations_of_the_bodies(problem)
        unknowns = problem.contact.layout.size_global
        counts = round(float(np.mean(krylov)), 2), max(krylov), alone
        values = comm.size, degree, method, law, unknowns, newton, *counts
        yield dict(zip(COLUMNS, values, strict=True))


def run(ranks):
    """Rows of a run on some ranks, as they come."""
    version = subprocess.run(["mpirun", "--version"], capture_output=True, text=True)
    options = ["--map-by", ":OVERSUBSCRIBE", "--bind-to", "none"]
    options = options if "Open MPI" in version.stdout else []
    command = ["mpirun", *options, "-n", str(ranks), sys.executable, __file__, "--here"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, env=environment()
    ) as child:
        yield from (json.loads(line) for line in child.stdout if line[:1] == "{")
    if child.returncode:
        raise RuntimeError(f"{ranks} ranks failed")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ranks", default="1,2,4,8")
    parser.add_argument("--here", action="store_true", help="print rows of these ranks")
    parser.add_argument("--output", type=Path, default=Path(__file__).parent)
    arguments = parser.parse_args()
    if arguments.here:
        for row in measure_all(MPI.COMM_WORLD):
            if MPI.COMM_WORLD.rank == 0:
                print(json.dumps(row), flush=True)
        return
    arguments.output.mkdir(parents=True, exist_ok=True)
    with open(arguments.output / "ranks.csv", "w", newline="") as file:
        table = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        table.writeheader()
        for ranks in map(int, arguments.ranks.split(",")):
            for row in run(ranks):
                print(*row.values(), flush=True)
                table.writerow(row)


if __name__ == "__main__":
    main()

"""One problem on more and more ranks: seconds of contact, volume and solver.

    scripts/python benchmarks/parallel/strong.py                       # 1 to 16 ranks
    scripts/python benchmarks/parallel/strong.py --ranks 1,2 --levels 6
    scripts/python benchmarks/parallel/strong.py --ranks 32,64 --levels 20 --more

Two blocks of hexahedra with friction, 40,000, 300,000 and 1.2 million unknowns (levels
6, 12 and 20). Seconds are elapsed ones, of the rank that takes longest, medians of three
calls: `setup` (contact, problem and solver are made, the first pairing and the pattern
of the matrix), `pairing` (anew, after the bodies have moved), `residual` and `tangent`
of contact, `volume` (residual and tangent of the bodies), `solver` (one system by
multigrid, which is set up for it). `idle` is the time of residual and tangent of the rank
that has least to do, without what it waits for.
Bytes are of the rank that sends most. Writes `strong.csv`, row by row; a large machine
takes the first command, and needs about 2, 12 and 50 GB in all.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import json
import logging
import resource
import subprocess
import sys
import time
from pathlib import Path

from mpi4py import MPI

import numpy as np
from linear import make_problem
from run import environment

import raymortar
from raymortar import solvers
from raymortar.core import compat
from raymortar.io import partitions

COMM = MPI.COMM_WORLD
REPEATS = 3
LEVELS = (6, 12, 20)
RANKS = (1, 2, 4, 8, 16)
PARTITIONS = {
    "columns": partitions.columns((0.0, 0.0, 1.0)),
    "strips": partitions.strips,
    "graph": None,
}
STAGES = ("pairing", "residual", "tangent", "volume", "solver")
SHARED = {"contact": STAGES[:3], "volume": STAGES[3:4], "solver": STAGES[4:]}
MATRIX_BYTES, VECTOR_BYTES = 16, 12  # value, row and column; value and row
COLUMNS = (
    *("level", "ranks", "partition", "unknowns", "slave_facets"),
    *("largest_share", "mean_share", "without"),
    *("mesh", "setup", *STAGES, "idle", "krylov"),
    *("value_bytes", "matrix_bytes", "vector_bytes", "megabytes"),
)


def most(value):
    """Largest over the ranks. Collective."""
    return COMM.allreduce(value, op=MPI.MAX)


def elapsed(call):
    """Seconds of a call on this rank, all of which start together."""
    COMM.Barrier()
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def timed(call):
    """Median of the slowest rank's seconds."""
    return float(np.median([most(elapsed(call)) for _ in range(REPEATS)]))


class Parts:
    """A problem whose contact presses throughout, and the calls that are timed."""

    def __init__(self, level, partition):
        self.made = {}
        # Compiles the forms of the bodies and of contact's coefficient
        warm = make_problem("hexahedron", 1, 1, "augmented", "Coulomb")
        raymortar.SNESSolver(warm, solvers.iterative("bodies"))
        COMM.Barrier()
        start = time.perf_counter()
        self.problem = make_problem(
            "hexahedron", 1, level, "augmented", "Coulomb", PARTITIONS[partition], self
        )
        contact = self.contact = self.problem.contact
        lam = contact.multiplier.x.array.reshape(-1, contact.layout.components)
        # The slave's normal points down
        lam[:, -1] = 1.0
        self.solver = raymortar.SNESSolver(self.problem, solvers.iterative("bodies"))
        self.A, self.b = self.solver.A, self.solver.b
        x = self.problem.start()
        self.problem.F(x, self.b)
        self.problem.J(x, self.A)
        everything = time.perf_counter() - start
        self.made["setup"] = most(everything - self.made["mesh"])
        self.made["mesh"] = most(self.made["mesh"])
        self.r = self.problem.create_vector()
        self._by = 1e-10

    def mesh_made(self, seconds):
        """Called by `make_problem` once it has a mesh."""
        self.made["mesh"] = seconds

    def pairing(self):
        """At a new configuration, so that there is something to do."""
        self._by *= -1.1
        self.contact.u.x.array[:] += self._by
        self.contact.update()

    def residual(self):
        """Of contact, with what ranks send each other."""
        self.contact.assemble_vector(self.b, self.problem.bcs)
        self.b.assemble()

    def tangent(self):
        """Of contact, likewise."""
        self.contact.assemble_matrix(self.A, self.problem.bcs)
        self.A.assemble()

    def volume(self):
        """Residual and tangent of the bodies."""
        own = np.zeros(len(self.contact.u.x.array))
        compat.assemble_residual(own, self.problem.L)
        self.A.zeroEntries()
        compat.assemble_jacobian(self.A, self.problem.a, self.problem.bcs)
        self.A.assemble()

    def system(self):
        """The tangent and the residual, which the solver starts from."""
        self.problem.F(self.problem.start(), self.b)
        self.problem.J(self.problem.start(), self.A)

    def solve(self):
        """One system, with the set-up of its preconditioner."""
        ksp = self.solver.krylov_solver
        ksp.setOperators(self.A)
        ksp.solve(self.b, self.r)

    def idle(self):
        """Least seconds of a rank in residual and tangent until it waits."""

        def parts():
            self.contact.assemble_vector(self.b, self.problem.bcs)
            self.contact.assemble_matrix(self.A, self.problem.bcs)

        seconds = elapsed(parts)
        self.b.assemble()
        self.A.assemble()
        return COMM.allreduce(seconds, op=MPI.MIN)


def measure(level, partition):
    """Row of the ranks of this run. Collective."""
    parts = Parts(level, partition)
    contact = parts.contact
    seconds = {name: timed(getattr(parts, name)) for name in STAGES[:-1]}
    idle = parts.idle()
    parts.system()
    with parts.solver.options:  # which a solver has in PETSc's table as it solves
        seconds["solver"] = most(elapsed(parts.solve))
    counts = contact.statistics
    sent = counts.communication.largest
    mine = sum(len(zone.facets.slave.facets) for zone in contact.zones)
    return {
        "level": level,
        "ranks": COMM.size,
        "partition": partition,
        "unknowns": contact.layout.size_global,
        "slave_facets": counts.slave_facets,
        "largest_share": most(mine),
        "mean_share": counts.slave_facets / COMM.size,
        "without": COMM.allreduce(int(mine == 0)),
        **{name: round(value, 5) for name, value in parts.made.items()},
        **{name: round(value, 6) for name, value in seconds.items()},
        "idle": round(idle, 6),
        "krylov": parts.solver.krylov_solver.its,
        "value_bytes": sent.value_bytes,
        "matrix_bytes": sent.matrix_entries * MATRIX_BYTES,
        "vector_bytes": sent.vector_entries * VECTOR_BYTES,
        "megabytes": round(
            COMM.allreduce(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) / 1024
        ),
    }


def measure_on(ranks, level, partition):
    """The row of a run of its own."""
    version = subprocess.run(["mpirun", "--version"], capture_output=True, text=True)
    options = ["--map-by", ":OVERSUBSCRIBE", "--bind-to", "none"]
    options = options if "Open MPI" in version.stdout else []
    command = ["mpirun", *options, "-n", str(ranks), sys.executable, __file__]
    done = subprocess.run(
        [*command, "--here", str(level), partition],
        stdout=subprocess.PIPE,
        text=True,
        env=environment(),
    )
    if done.returncode:
        raise RuntimeError(f"{ranks} ranks failed")
    return json.loads(done.stdout.strip().splitlines()[-1])


def efficiencies(rows):
    """Lines of what ranks save: seconds of the fewest over these, and over their
    number, of contact, volume and solver."""
    groups = {}
    for row in rows:
        groups.setdefault((row["level"], row["partition"]), []).append(row)
    for (level, partition), found in groups.items():
        first = min(found, key=lambda row: row["ranks"])
        for row in found:
            more, said = row["ranks"] / first["ranks"], []
            for name, parts in SHARED.items():
                before, now = (sum(one[p] for p in parts) for one in (first, row))
                said.append(f"{name} {before / (more * now):.2f}")
            head = f"level {level}, {partition}, {row['ranks']} ranks"
            yield f"efficiency, {head}: {', '.join(said)}"


def numbers(text):
    """Whole numbers between commas."""
    return [int(part) for part in text.split(",")]


def main(arguments=None):
    """Measure what is asked for; 0."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ranks", type=numbers, default=list(RANKS))
    parser.add_argument("--levels", type=numbers, default=list(LEVELS))
    parser.add_argument("--partitions", nargs="+", default=["columns", "graph"])
    parser.add_argument("--more", action="store_true", help="add to the file's rows")
    parser.add_argument("--output", type=Path, default=Path(__file__).parent)
    parser.add_argument("--here", nargs=2, metavar=("LEVEL", "PARTITION"))
    args = parser.parse_args(arguments)
    if args.here:
        logging.disable(logging.WARNING)
        row = measure(int(args.here[0]), args.here[1])
        if COMM.rank == 0:
            print(json.dumps(row))
        return 0
    args.output.mkdir(parents=True, exist_ok=True)
    path = args.output / "strong.csv"
    more, rows = args.more and path.exists(), []
    with path.open("a" if more else "w", newline="") as file:
        table = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        if not more:
            table.writeheader()
        for level, partition, ranks in itertools.product(
            args.levels, args.partitions, args.ranks
        ):
            row = measure_on(ranks, level, partition)
            print(", ".join(f"{name} {row[name]}" for name in COLUMNS), flush=True)
            table.writerow(row)
            file.flush()
            rows.append(row)
    print("\n".join(efficiencies(rows)))
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""The share of multigrid's set-up in whole nonlinear solves, and what it is made of.

    scripts/python benchmarks/parallel/set_up.py                        # 40,000 unknowns
    scripts/python benchmarks/parallel/set_up.py --cases hexahedron,1,12 --more
    scripts/python benchmarks/parallel/set_up.py --ranks 2 --more
    scripts/python benchmarks/parallel/set_up.py --options bodies_most=-1 --more

The blocks of `linear.py` by the solver that a user gets who chooses nothing, from the
first residual to the solution. Seconds are those of the processor, the mean of the
ranks: `assembly` (residuals and tangents, of contact too), `set_up` and its parts
(`levels`: the aggregates of the bodies; `springs`: S; `products` of the coarser levels;
`smoothers` and the coarsest level's factors; `near`: factors near contact), and `cycles`
(the preconditioner is used). GMRES takes the rest of `all`. Each row is of a process of
its own, or of an `mpirun`. Writes `set_up.csv`, row by row.
"""

from __future__ import annotations

import argparse
import itertools
import json
import logging
import subprocess
import sys
import time
from pathlib import Path

from mpi4py import MPI

from linear import make_problem, peak_megabytes
from rows import write_row
from run import environment

import raymortar
from raymortar.solvers import elimination
from raymortar.solvers.automatic import with_fallback
from raymortar.solvers.linear import inexact

COMM = MPI.COMM_WORLD
# Cell, degree and level: 40,000, 280,000 and 1.2 million unknowns
CASES = "hexahedron,1,6 tetrahedron,2,3"
PARTS = ("levels", "springs", "products", "smoothers", "near")
COLUMNS = (
    *("cell", "degree", "friction", "ranks", "options", "level", "unknowns"),
    *("newton", "krylov", "sets", "all", "assembly", "set_up", *PARTS, "cycles"),
    *("elapsed", "megabytes"),
)


class Clock:
    """Seconds of the processor by name, each without those within it."""

    def __init__(self):
        self.spent, self.calls, self._inner = {}, {}, []

    def watch(self, owner, attribute, name):
        """Time the calls of a function or method."""
        call = getattr(owner, attribute)

        def timed(*arguments, **named):
            start = time.process_time()
            self._inner.append(0.0)
            try:
                return call(*arguments, **named)
            finally:
                took = time.process_time() - start
                own = took - self._inner.pop()
                self.spent[name] = self.spent.get(name, 0.0) + own
                self.calls[name] = self.calls.get(name, 0) + 1
                if self._inner:
                    self._inner[-1] += took

        setattr(owner, attribute, timed)


def watched():
    """A clock that watches the parts of the preconditioner."""
    clock, kind = Clock(), elimination.BodiesPreconditioner
    clock.watch(elimination, "BodiesLevels", "levels")
    clock.watch(elimination, "set_levels", "products")
    clock.watch(kind, "_eliminate", "springs")
    clock.watch(kind, "_set_near", "near")
    clock.watch(kind, "setUp", "smoothers")  # all else in it
    clock.watch(kind, "apply", "cycles")
    return clock


def measure(cell, degree, level, friction, options):
    """The row of the ranks of this run. Collective."""
    own = dict(one.split("=") for one in options.split() if one)
    # Compiles the forms
    make_solver(make_problem(cell, degree, 1, "augmented", friction), own).solve()
    problem = make_problem(cell, degree, level, "augmented", friction)
    solver, clock, krylov = make_solver(problem, own), watched(), []
    for name in ("F", "J"):
        clock.watch(type(problem), name, "assembly")
    solver.snes.setMonitor(lambda *_: krylov.append(solver.krylov_solver.its))
    COMM.Barrier()
    start, begin = time.process_time(), time.perf_counter()
    newton, reason = solver.solve()
    seconds, elapsed = time.process_time() - start, time.perf_counter() - begin
    if reason <= 0:
        raise RuntimeError(f"no convergence: {reason}")
    names = ("all", "assembly", *PARTS, "cycles")
    spent = {**clock.spent, "all": seconds}
    mean = {k: COMM.allreduce(spent.get(k, 0.0)) / COMM.size for k in names}
    mean["set_up"] = sum(mean[k] for k in PARTS)
    row = {
        "cell": cell,
        "degree": degree,
        "friction": friction,
        "ranks": COMM.size,
        "options": options,
        "level": level,
        "unknowns": problem.contact.layout.size_global,
        "newton": newton,
        "krylov": " ".join(map(str, krylov[1:])),
        "sets": clock.calls.get("products", 0),
        **{k: float(f"{v:.4g}") for k, v in mean.items()},
        "elapsed": float(f"{elapsed:.4g}"),
        "megabytes": round(COMM.allreduce(peak_megabytes())),
    }
    return {name: row[name] for name in COLUMNS}


def make_solver(problem, options):
    """What the automatic choice gives large problems, here at any size."""
    linear = inexact() | with_fallback(**options)
    return raymortar.SNESSolver(problem, {"snes_rtol": 1e-8, **linear})


def measure_on(ranks, *case):
    """The row of a run of its own."""
    command = [sys.executable, __file__, "--row", *map(str, case)]
    if ranks > 1:
        options = ["--map-by", ":OVERSUBSCRIBE", "--bind-to", "none"]
        command = ["mpirun", *options, "-n", str(ranks), *command]
    done = subprocess.run(
        command, stdout=subprocess.PIPE, text=True, env=environment(), check=True
    )
    lines = [line for line in done.stdout.splitlines() if line.startswith('{"')]
    return json.loads(lines[-1])


def main(arguments=None):
    """Measure what is asked for; 0."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", default=CASES, help="cell,degree,level ...")
    parser.add_argument("--laws", nargs="+", default=["none"])
    parser.add_argument("--ranks", nargs="+", type=int, default=[1])
    parser.add_argument("--options", default="", help="name=value, of `iterative`")
    parser.add_argument("--more", action="store_true", help="add to the file's rows")
    parser.add_argument("--output", type=Path, default=Path(__file__).parent)
    names = "CELL", "DEGREE", "LEVEL", "LAW", "OPTIONS"
    parser.add_argument("--row", nargs=5, metavar=names)
    args = parser.parse_args(arguments)
    if args.row:
        cell, degree, level, law, options = args.row
        logging.disable(logging.WARNING)
        row = measure(cell, int(degree), int(level), law, options)
        if COMM.rank == 0:
            print(json.dumps(row))
        return 0
    args.output.mkdir(parents=True, exist_ok=True)
    path = args.output / "set_up.csv"
    if not (args.more and path.exists()):
        write_row(path, {name: name for name in COLUMNS}, "w")
    for ranks, case, law in itertools.product(
        args.ranks, args.cases.split(), args.laws
    ):
        row = measure_on(ranks, *case.split(","), law, args.options)
        print(", ".join(f"{k} {v}" for k, v in row.items()), flush=True)
        write_row(path, row, "a")  # one by one: large ones take long
    return 0


if __name__ == "__main__":
    sys.exit(main())

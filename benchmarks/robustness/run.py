"""Paths of load steps, by halving alone, and with other ways and viscous forces.

``scripts/python benchmarks/robustness/run.py [NAME ...]`` solves those of `paths.py`
whose names contain one of those given, all by default, prints a row for each and, for
all, writes paths.csv.
"""

from __future__ import annotations

import csv
import sys
import time
import warnings
from collections import Counter
from pathlib import Path

import paths

import raymortar

FILE = Path(__file__).with_name("paths.csv")
COLUMNS = (
    "path strategy arrived until steps halvings iterations all_iterations used seconds"
).split()


def solve(name, strategy):
    """Row of a path."""
    case = paths.PATHS[name]()
    solver = raymortar.NewtonSolver(case.problem)
    options = {"strategy": strategy, "progress": False, **case.options}
    if strategy == "halve":
        options.pop("stabilize", None)
    load = raymortar.LoadSteps(solver, case.apply, case.steps, **options)
    begin, steps, arrived = time.process_time(), [], True
    try:
        for step in load:
            steps.append(step)
    except (raymortar.ConvergenceError, raymortar.ContactError):
        arrived = False
    used = Counter(step.strategy for step in steps if step.strategy != "full")
    return {
        "path": name,
        "strategy": strategy,
        "arrived": "yes" if arrived else "no",
        "until": f"{steps[-1].factor if steps else 0.0:.4g}",
        "steps": len(steps),
        "halvings": load.halvings,
        "iterations": sum(step.iterations for step in steps),
        "all_iterations": case.problem.tangents,
        "used": "; ".join(f"{way} {n}" for way, n in used.items()),
        "seconds": f"{time.process_time() - begin:.1f}",
    }


def main(names):
    warnings.simplefilter("ignore", raymortar.ContactWarning)
    wanted = [n for n in paths.PATHS if not names or any(part in n for part in names)]
    rows = []
    for name in wanted:
        for strategy in ("halve", "auto"):
            rows.append(solve(name, strategy))
            print(*rows[-1].values(), sep=", ", flush=True)
    if not names:
        with open(FILE, "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)


if __name__ == "__main__":
    main(sys.argv[1:])

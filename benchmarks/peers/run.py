"""Contact in raymortar, GetFEM and CalculiX on the same meshes: error over seconds.

    scripts/python benchmarks/peers/run.py                   # an hour on an idle core
    scripts/python benchmarks/peers/run.py --quick           # the coarsest meshes, once
    scripts/python benchmarks/peers/run.py --scenes blocks --programs CalculiX
    scripts/python benchmarks/peers/run.py --scenes patch --sizes 4 --longest 30
    scripts/python benchmarks/peers/run.py --plot            # of the rows that are there

Every row is of a process of its own. Seconds are processor time, user and system, of
all that a program's user waits for: of ccx the whole process; of raymortar the whole
process, from the start of Python to the end, with forms that are compiled already; of
GetFEM all but the making of the mesh, which DOLFINx does here. Programs take turns,
three times each: medians. Writes `peers.csv`, and docs/pictures/peers.png.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import json
import logging
import os
import resource
import statistics
import subprocess
import sys
import warnings
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(HERE), str(ROOT)]

FIELDS = (
    *("scene", "program", "form", "setting", "degree", "n", "more", "unknowns"),
    *("increments", "iterations", "cutbacks", "error", "vertical", "horizontal"),
    *("seconds", "least", "most", "turns", "failed"),
)
KEYS = FIELDS[:7]
TURNS = 3
LONGEST = 3600  # on a busy machine
# Sizes by degree, and steps times `more` at the size in the middle
SIZES = {
    "patch": {1: (4, 8), 2: (4,)},
    "hertz_2d": {1: (6, 12, 24), 2: (6, 12)},
    "hertz_3d": {1: (4, 6, 8)},
    "blocks": {1: (4, 8, 12), 2: (4,)},
    "ironing": {1: (20, 40, 80)},
}
MORE = {"hertz_2d": (12, 2), "blocks": (8, 4), "ironing": (40, 4)}
PROGRAMS = {
    "raymortar": (("default", "as used"), ("dual", "alike"), ("points", "alike")),
    "GetFEM": (("rays", "as used"), ("rays", "alike")),
    "CalculiX": tuple(
        (form, "as used") for form in ("surface", "node", "mortar", "pglinmortar")
    ),
}
# As its users run it only where it needs no penalties (`getfem_cases`)
PLACED = ("blocks", "ironing")
# Forces that stand for exact ones: scene, n, degree, more
REFERENCES = (("blocks", 12, 2, 4), ("ironing", 160, 1, 1))


def program_of(name):
    """Class of a program, None where it is missing."""
    if name == "raymortar":
        from raymortar_cases import Ours

        return Ours
    if name == "GetFEM":
        import getfem_cases

        return getfem_cases.GetFEM if getfem_cases.gf else None
    import calculix_cases

    return calculix_cases.CalculiX if calculix_cases.PROGRAM else None


def spent():
    """Processor time of this process so far."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def solved(scene, program, form, setting, degree, n, more):
    """A run in this process, as a dict with its seconds."""
    from peer_case import Failed
    from peer_scenes import SCENES

    warnings.simplefilter("ignore")
    logging.disable(logging.WARNING)
    case = SCENES[scene](n, degree, more)
    case.cells  # of the mesh: no part of what GetFEM takes
    before = 0.0 if program == "raymortar" else spent()
    row = {}
    solver = program_of(program)(case, form, setting == "alike")
    try:
        effort = solver.solve()
    except Failed as error:
        return {"failed": str(error), "unknowns": solver.unknowns}
    seconds = getattr(solver, "seconds", spent() - before)
    found = solver.found()
    row |= {
        "unknowns": solver.unknowns,
        "increments": effort.increments,
        "iterations": effort.iterations,
        "cutbacks": effort.cutbacks,
        "vertical": found.forces[-1, -1],
        "horizontal": found.forces[-1, 0],
        "seconds": seconds,
        "path": [found.times.tolist(), found.forces.tolist()],
    }
    try:
        error = case.error(case, found)
        # No number where a program gives no pressures
        row |= {"error": error} if error == error else {}
    except (FileNotFoundError, KeyError):
        pass  # the reference is what is being made
    return row


def apart(key):
    """The same in a process of its own."""
    command = [sys.executable, __file__, "--one", json.dumps(key)]
    env = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    try:
        done = subprocess.run(
            command, stdout=subprocess.PIPE, text=True, timeout=LONGEST, env=env
        )
    except subprocess.TimeoutExpired:
        return {"failed": f"took more than {LONGEST} s"}
    lines = [line for line in done.stdout.splitlines() if line.startswith('{"')]
    if done.returncode or not lines:
        return {"failed": f"ended with {done.returncode}"}
    return json.loads(lines[-1])


def groups(scenes, programs, quick, only=None):
    """Runs on one mesh, which take turns."""
    for scene in scenes:
        for degree, sizes in SIZES[scene].items():
            for n in sizes[:1] if quick else sizes:
                if only and n not in only:
                    continue
                steps = MORE.get(scene, (None, 1))
                for more in (1, steps[1]) if n == steps[0] and degree == 1 else (1,):
                    yield [
                        (scene, name, form, setting, degree, n, more)
                        for name in programs
                        for form, setting in PROGRAMS[name]
                        if (name, setting) != ("GetFEM", "as used") or scene in PLACED
                    ]


def measured(group, turns):
    """Rows of runs that take turns; what fails is run once."""
    found = {key: [] for key in group}
    for _, key in itertools.product(range(turns), group):
        if not any("failed" in one for one in found[key]):
            found[key].append(apart(key))
    for key, done in found.items():
        row = dict(zip(KEYS, key)) | {k: v for k, v in done[0].items() if k in FIELDS}
        seconds = [one["seconds"] for one in done if "seconds" in one]
        if seconds:
            row["seconds"] = statistics.median(seconds)
            row |= {"least": min(seconds), "most": max(seconds), "turns": len(seconds)}
        yield {k: f"{v:.5g}" if isinstance(v, float) else v for k, v in row.items()}


def rows_of(path):
    """Rows that are there."""
    if not path.exists():
        return []
    with path.open(newline="") as lines:
        return list(csv.DictReader(lines))


def write(path, rows):
    """All rows."""
    with path.open("w", newline="") as file:
        table = csv.DictWriter(file, FIELDS, lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def measure(args):
    """Rows of what is asked for, in place of those of the same settings."""
    path = args.output / "peers.csv"
    here = [name for name in args.programs if program_of(name)]
    for name in set(args.programs) - set(here):
        print(f"{name} is missing: its rows stay as they were")
    rows, turns = rows_of(path), 1 if args.quick else TURNS
    for group in groups(args.scenes, here, args.quick, args.sizes):
        # One by one where none take turns: an interrupted run keeps its rows
        parts = [[key] for key in group] if args.quick else [group]
        for row in itertools.chain.from_iterable(measured(p, turns) for p in parts):
            same = [str(row[k]) for k in KEYS]
            rows = [old for old in rows if [str(old[k]) for k in KEYS] != same]
            rows.append(row)
            shown = (f"{k} {row[k]}" for k in FIELDS[7:] if row.get(k, "") != "")
            print(*same, "|", ", ".join(shown), flush=True)
            write(path, rows)


def references(path):
    """Forces of fine meshes, degree 2 where that is, by the default law."""
    found = json.loads(path.read_text()) if path.exists() else {}
    for scene, n, degree, more in REFERENCES:
        row = apart((scene, "raymortar", "default", "as used", degree, n, more))
        if "failed" in row:
            raise SystemExit(f"{scene}: {row['failed']}")
        times, forces = row["path"]
        # Of the steps that all programs take
        kept = range(more - 1, len(times), more)
        found[scene] = {
            "n": n,
            "degree": degree,
            "times": [times[k] for k in kept],
            "forces": [[float(f"{f:.6g}") for f in forces[k]] for k in kept],
        }
        path.write_text(json.dumps(found, indent=1) + "\n")


def main(arguments=None):
    """Measure and draw; 0."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scenes", nargs="+", choices=SIZES, default=list(SIZES))
    parser.add_argument(
        "--programs", nargs="+", choices=PROGRAMS, default=list(PROGRAMS)
    )
    parser.add_argument("--sizes", nargs="+", type=int, help="these n only")
    parser.add_argument("--longest", type=int, help="processor seconds of a run of ccx")
    parser.add_argument("--quick", action="store_true", help="coarsest meshes, once")
    parser.add_argument("--plot", action="store_true", help="do not solve")
    parser.add_argument("--references", action="store_true", help="make them anew")
    parser.add_argument("--output", type=Path, default=HERE)
    parser.add_argument("--pictures", type=Path, default=ROOT / "docs" / "pictures")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    args = parser.parse_args(arguments)
    if args.longest:
        os.environ["PEERS_LONGEST"] = str(args.longest)
    if args.one:
        print(json.dumps(solved(*json.loads(args.one))))
        return 0
    if args.references:
        references(HERE / "references.json")
        return 0
    args.output.mkdir(parents=True, exist_ok=True)
    if not args.plot:
        measure(args)
    import peer_plot

    peer_plot.draw(rows_of(args.output / "peers.csv"), args.pictures / "peers.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())

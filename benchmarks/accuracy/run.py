"""Run time against error of contact problems with known answers.

    scripts/python benchmarks/accuracy/run.py            # all: about half an hour
    scripts/python benchmarks/accuracy/run.py --quick    # some seconds
    scripts/python benchmarks/accuracy/run.py --plot     # plots of the CSV that is there

Writes `accuracy.csv`, row by row, and beside it plots; `scripts/measured` puts the tables into docs/measured.
"""

import argparse
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(HERE), str(ROOT / "tests" / "helpers"), str(ROOT / "demos")]
sys.path.append(str(ROOT / "benchmarks"))

import getfem_peer  # noqa: E402
import plots  # noqa: E402
import rows  # noqa: E402
from sweeps import Run, demo, getfem, measure  # noqa: E402

# Cells of an edge by dimension and degree
SIZES = {(2, 1): (4, 8, 16, 32, 64), (2, 2): (4, 8, 16, 32, 64)}
SIZES |= {(3, 1): (4, 8, 16), (3, 2): (2, 4, 8)}
CELLS = {2: ("triangle", "quadrilateral"), 3: ("tetrahedron", "hexahedron")}
TANGENTS = ("fixed", "full")
QUADRATURES = (1, 2, 3, 4, 5, 6, 8, 12)


def kinds(dim):
    """Cells and degrees of a dimension."""
    return [(cell, degree) for cell in CELLS[dim] for degree in (1, 2)]


def refinement():
    """Size of the mesh, regular and shaken, in all problems and both roles."""
    for problem, dim in (("B2", 2), ("B4", 2), ("B1", 3)):
        for cell, degree in kinds(dim):
            sizes = SIZES[dim, degree]
            for n in sizes:
                yield Run(problem, cell, degree, n)
            for n in sizes if dim == 2 else sizes[:2]:
                yield Run(problem, cell, degree, n, shake=0.2)
            for n in sizes if problem == "B4" else ():
                yield Run(problem, cell, degree, n, swap=True)
    for n in (4, 8):
        yield Run("B4 3D", "hexahedron", 1, n)


def quadrature():
    """Degree of the rule on segments, on irregular meshes."""
    for problem, dim in (("B2", 2), ("B1", 3), ("B4", 2)):
        for cell, degree in kinds(dim):
            n = {2: 16, 3: 8 // degree}[dim]
            for q in QUADRATURES:
                yield Run(problem, cell, degree, n, q, shake=0.2)


def settings():
    """Method, multiplier and measure, at the sizes in the middle."""
    for problem, dim in (("B2", 2), ("B1", 3)):
        for cell, degree in kinds(dim):
            for n in SIZES[dim, degree][:3] if dim == 2 else SIZES[dim, degree][:2]:
                yield Run(problem, cell, degree, n, multiplier="vector")
                yield Run(problem, cell, degree, n, measure="current")
                for factor in (10, 100, 1000):
                    yield Run(problem, cell, degree, n, method=f"penalty {factor}")


def closed_forms():
    """Cattaneo and Mindlin's cylinders, and Hertz's spheres."""
    for degree, sizes in ((1, (10, 20, 40)), (2, (10, 20, 40))):
        for n in sizes:
            for q in (None, 2, 8) if n == 20 else (None,):
                yield Run("D2", "quadrilateral", degree, n, q)
    for n in (6, 8, 12):
        for q in (None, 2, 8) if n == 8 else (None,):
            yield Run("D3", "hexahedron", 1, n, q)


def tangents():
    """Both tangents, on the second mesh of each kind (in 2D the third too), and in
    the demos."""
    for problem, dim in (("B2", 2), ("B4", 2), ("B1", 3)):
        for cell, degree in kinds(dim):
            for n in SIZES[dim, degree][1 : 5 - dim]:
                for tangent in TANGENTS:
                    yield "raymortar", Run(problem, cell, degree, n, tangent=tangent)
    for tangent in TANGENTS:
        for degree in (1, 2):
            yield "demo", Run("D2", "quadrilateral", degree, 20, tangent=tangent)
        yield "demo", Run("D3", "hexahedron", 1, 8, tangent=tangent)


def peer():
    """Both programs with a vector multiplier and a flat master bent by its values."""
    for problem, dim in (("B2", 2), ("B1", 3)):
        for cell, degree in kinds(dim):
            for n in SIZES[dim, degree]:
                # 4: what GetFEM's demos take, and for B2 and B1 enough
                yield "GetFEM", _alike(problem, cell, degree, n, 4)
                yield "raymortar", _alike(problem, cell, degree, n, None)


def _alike(*args):
    return Run(*args, multiplier="vector", curved=False)


def quick():
    """One small run of each kind."""
    yield Run("B2", "quadrilateral", 2, 4)
    yield Run("B2", "quadrilateral", 2, 8)
    yield Run("B2", "quadrilateral", 2, 4, method="penalty 100")
    yield Run("B4", "triangle", 1, 4, swap=True)


def raymortars(sweep):
    """Runs of a sweep with the program that solves them."""
    return (("raymortar", run) for run in sweep())


SWEEPS = {
    "closed_forms": lambda: (("demo", run) for run in closed_forms()),
    "quadrature": lambda: raymortars(quadrature),
    "settings": lambda: raymortars(settings),
    "tangents": tangents,
    "refinement": lambda: raymortars(refinement),
    "peer": peer,
}
JOBS = {"raymortar": measure, "demo": demo, "GetFEM": getfem}


def solve_all(table, arguments):
    """Run what is asked for. A setting that fails is said, and has no row."""
    jobs = [job for name in arguments.sweeps for job in SWEEPS[name]()]
    if arguments.quick:
        jobs = [*raymortars(quick), ("GetFEM", _alike("B2", "quadrilateral", 2, 4, 4))]
    if getfem_peer.gf is None:
        print(getfem_peer.MISSING)
        jobs = [job for job in jobs if job[0] != "GetFEM"]
    for program, run in jobs:
        if arguments.problems and run.problem not in arguments.problems:
            continue
        try:
            table.add(JOBS[program](run))
        except RuntimeError as error:
            print(f"{program}: {run} failed: {error}")


def main(arguments=None):
    """Run the benchmark; 0 if every plot could be drawn."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="some seconds")
    parser.add_argument("--plot", action="store_true", help="do not solve")
    parser.add_argument("--problems", nargs="+", help="of B1 B2 B4 D2 D3")
    parser.add_argument("--sweeps", nargs="+", choices=SWEEPS, default=list(SWEEPS))
    parser.add_argument("--append", action="store_true", help="keep earlier rows")
    parser.add_argument("--output", type=Path, default=HERE / "results")
    arguments = parser.parse_args(arguments)
    path = arguments.output / "accuracy.csv"
    if not arguments.plot:
        # What cannot be measured here stays as it was
        absent = "GetFEM" if getfem_peer.gf is None else None
        solve_all(rows.Table(path, arguments.append, absent), arguments)
    plots.draw(rows.read(path), arguments.output)
    return 0


if __name__ == "__main__":
    sys.exit(main())

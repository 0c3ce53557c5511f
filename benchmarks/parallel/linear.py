"""Iterative linear solvers against mesh refinement, and against MUMPS.

    scripts/python benchmarks/parallel/linear.py [--levels 1,2,4,8] [--output DIR]

A block pressed on another (hexahedra, degree 1, neo-Hookean), without friction and
sheared with it. Writes `linear.csv`: Krylov iterations of each Newton iteration, CPU
seconds of the whole solve, assembly included, and what memory grew by meanwhile; each row
from a process of its own, on one rank.
"""

from __future__ import annotations

import argparse
import csv
import functools
import itertools
import json
import resource
import subprocess
import sys
import time
from pathlib import Path

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, Coulomb, Penalty, compat, solvers

E, NU = 10.0, 0.3
# Without friction, with it, and the sideways motion of the top
LAWS = {"none": (None, 0.0), "Coulomb": (Coulomb(0.3), 0.004)}
METHODS = {"augmented": AugmentedLagrangian, "penalty": Penalty}
LINEAR = {
    "mumps": dict,
    **{name: functools.partial(solvers.iterative, name) for name in solvers.MULTIGRIDS},
}


def clamp(V, scene, name, value):
    facets = scene.facet_tags.find(scene.tags[name])
    dofs = fem.locate_dofs_topological(V, 2, facets)
    return fem.dirichletbc(np.array(value), dofs, V)


def make_problem(level, method, law):
    n = level
    scene = two_blocks(
        MPI.COMM_WORLD,
        3,
        "hexahedron",
        lower_divisions=(4 * n, 4 * n, 2 * n),
        upper_divisions=(3 * n, 3 * n, 2 * n),
        lower_size=(1.0, 1.0, 0.5),
        upper_size=(0.8, 0.8, 0.5),
    )
    friction, slide = LAWS[law]
    V = compat.vector_space(scene.mesh, 1)
    u, v = fem.Function(V), ufl.TestFunction(V)
    mu, lmbda = E / (2 + 2 * NU), E * NU / ((1 + NU) * (1 - 2 * NU))
    F = ufl.Identity(3) + ufl.grad(u)
    P = mu * (F - ufl.inv(F).T) + lmbda * ufl.ln(ufl.det(F)) * ufl.inv(F).T
    contact = raymortar.Contact(
        u,
        scene.facet_tags,
        [(scene.tags["slave"], scene.tags["master"])],
        METHODS[method](),
        friction=friction,
    )
    bcs = [clamp(V, scene, "bottom", (0.0, 0.0, 0.0))]
    bcs.append(clamp(V, scene, "top", (slide, 0.0, -0.02)))
    form = ufl.inner(P, ufl.grad(v)) * ufl.dx(metadata={"quadrature_degree": 2})
    return raymortar.NonlinearProblem(form, contact, bcs)


def measure(level, method, law, linear):
    """One row: unknowns, Newton and Krylov iterations, seconds."""
    problem = make_problem(level, method, law)
    options = {"snes_rtol": 1e-8, **LINEAR[linear]()}
    solver, steps = raymortar.SNESSolver(problem, options), []
    solver.krylov_solver.setMonitor(lambda ksp, i, norm: steps.append(i))
    before, start = peak_megabytes(), time.process_time()
    newton, _ = solver.solve()
    seconds = time.process_time() - start
    krylov = [a for a, b in zip(steps, [*steps[1:], 0]) if b == 0]
    return {
        "method": method,
        "friction": law,
        "linear": linear,
        "level": level,
        "unknowns": problem.contact.layout.size_global,
        "newton": newton,
        "krylov_mean": round(float(np.mean(krylov)), 1),
        "krylov_most": max(krylov),
        "seconds": round(seconds, 2),
        "megabytes": round(peak_megabytes() - before),
    }


def peak_megabytes():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def measure_apart(*case):
    """`measure` in a process of its own, whose peak of memory is that of the case."""
    command = [sys.executable, __file__, "--row", *map(str, case)]
    out = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
    return json.loads(out.splitlines()[-1])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--levels", default="1,2,4,8", help="cells are 4 per level, edge"
    )
    parser.add_argument("--methods", default=",".join(METHODS))
    parser.add_argument("--laws", default=",".join(LAWS))
    parser.add_argument("--linear", default=",".join(LINEAR))
    parser.add_argument("--output", type=Path, default=Path(__file__).parent)
    parser.add_argument("--row", nargs=4, metavar=("LEVEL", "METHOD", "LAW", "LINEAR"))
    arguments = parser.parse_args()
    if arguments.row:
        level, *case = arguments.row
        print(json.dumps(measure(int(level), *case)))
        return
    choices = (
        getattr(arguments, name).split(",")
        for name in ("methods", "laws", "levels", "linear")
    )
    rows = []
    for method, law, level, linear in itertools.product(*choices):
        rows.append(measure_apart(level, method, law, linear))
        print(*rows[-1].values(), flush=True)
    arguments.output.mkdir(parents=True, exist_ok=True)
    with open(arguments.output / "linear.csv", "w", newline="") as file:
        table = csv.DictWriter(file, rows[0], lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


if __name__ == "__main__":
    main()

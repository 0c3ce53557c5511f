"""Iterative linear solvers against mesh refinement, and against MUMPS.

    scripts/python benchmarks/parallel/linear.py [--levels 1,2,4,8] [--output DIR]
    scripts/python benchmarks/parallel/linear.py --cells tetrahedron --degrees 2
        --levels 2,4 --linear mumps,default,bodies --name bodies

A block pressed on another (neo-Hookean), without friction and sheared with it. Writes
`linear.csv`, or `NAME.csv`: Krylov iterations of each Newton iteration, CPU seconds of
the whole solve, assembly included, what memory grew by meanwhile, and its peak; each
row from a process of its own, on one rank. `default`: what a user gets who chooses
nothing. Beside `bodies`, `alone`: iterations and seconds of one system of the same
bodies without contact, at the solution, by the same levels.
"""

from __future__ import annotations

import argparse
import itertools
import json
import resource
import subprocess
import sys
import time
from pathlib import Path

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem.petsc import assemble_matrix
from rows import write_row

import raymortar
from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, Coulomb, Penalty, solvers
from raymortar.core import compat
from raymortar.core.solvers.petsc_objects import PetscOptions
from raymortar.io.partitions import strips
from raymortar.solvers.levels import BodiesLevels, set_levels

E, NU = 10.0, 0.3
# Without friction, with it, and the sideways motion of the top
LAWS = {"none": (None, 0.0), "Coulomb": (Coulomb(0.3), 0.004)}
METHODS = {"augmented": AugmentedLagrangian, "penalty": Penalty}
COLUMNS = (
    *("cell", "degree", "method", "friction", "linear", "level", "unknowns"),
    *("newton", "krylov_mean", "krylov_most", "seconds", "megabytes", "peak"),
    *("alone", "alone_seconds"),
)
LINEAR = {
    "mumps": solvers.direct,
    "default": dict,
    "bodies": solvers.iterative,
}


def clamp(V, scene, name, value):
    facets = scene.facet_tags.find(scene.tags[name])
    dofs = fem.locate_dofs_topological(V, scene.facet_tags.dim, facets)
    return fem.dirichletbc(np.array(value), dofs, V)


def make_problem(cell, degree, level, method, law, partition=strips, watch=None):
    """Two blocks in contact; `watch` is told the seconds that the mesh has taken."""
    n, start = level, time.perf_counter()
    dim = 2 if cell in ("triangle", "quadrilateral") else 3
    scene = two_blocks(
        MPI.COMM_WORLD,
        dim,
        cell,
        lower_divisions=(4 * n,) * (dim - 1) + (2 * n,),
        upper_divisions=(3 * n,) * (dim - 1) + (2 * n,),
        lower_size=(1.0,) * (dim - 1) + (0.5,),
        upper_size=(0.8,) * (dim - 1) + (0.5,),
        partition=partition,
    )
    if watch is not None:
        watch.mesh_made(time.perf_counter() - start)
    friction, slide = LAWS[law]
    V = compat.vector_space(scene.mesh, degree)
    u, v = fem.Function(V), ufl.TestFunction(V)
    mu, lmbda = E / (2 + 2 * NU), E * NU / ((1 + NU) * (1 - 2 * NU))
    F = ufl.Identity(dim) + ufl.grad(u)
    P = mu * (F - ufl.inv(F).T) + lmbda * ufl.ln(ufl.det(F)) * ufl.inv(F).T
    contact = raymortar.Contact(
        u,
        scene.facet_tags,
        [(scene.tags["slave"], scene.tags["master"])],
        METHODS[method](),
        friction=friction,
    )
    down = (slide,) + (0.0,) * (dim - 2) + (-0.02,)
    bcs = [clamp(V, scene, "bottom", (0.0,) * dim), clamp(V, scene, "top", down)]
    form = ufl.inner(P, ufl.grad(v)) * ufl.dx(
        metadata={"quadrature_degree": 2 * degree}
    )
    return raymortar.NonlinearProblem(form, contact, bcs)


def make_solver(problem, linear):
    return raymortar.SNESSolver(problem, {"snes_rtol": 1e-8, **LINEAR[linear]()})


def iterations_of(solver):
    """Newton iterations of a solve, and the Krylov iterations of each."""
    ksp, counts = solver.krylov_solver, []
    solver.snes.setMonitor(lambda snes, i, norm: counts.append(ksp.its))
    newton, _ = solver.solve()
    return newton, counts[1:]


def measure(cell, degree, level, method, law, linear):
    """One row: unknowns, Newton and Krylov iterations, seconds."""
    problem = make_problem(cell, degree, level, method, law)
    solver = make_solver(problem, linear)
    before, start = peak_megabytes(), time.process_time()
    newton, krylov = iterations_of(solver)
    seconds = time.process_time() - start
    memory, alone = peak_megabytes(), ("", "")
    if linear == "bodies":
        start = time.process_time()
        alone = iterations_of_the_bodies(problem), time.process_time() - start
        alone = alone[0], round(alone[1], 2)
    return dict(
        zip(
            COLUMNS,
            (
                *(cell, degree, method, law, linear, level),
                problem.contact.layout.size_global,
                newton,
                round(float(np.mean(krylov)), 1),
                max(krylov),
                round(seconds, 2),
                round(memory - before),
                round(memory),
                *alone,
            ),
            strict=True,
        )
    )


def iterations_of_the_bodies(problem):
    """GMRES of the volume's tangent, on the levels that contact has too."""
    K = assemble_matrix(problem.a, bcs=problem.bcs)
    K.assemble()
    ksp = PETSc.KSP().create(K.comm)
    with PetscOptions("alone_", LINEAR["bodies"]()):
        ksp.setOptionsPrefix("alone_displacement_")
        ksp.setOperators(K)
        ksp.setType("gmres")
        ksp.setTolerances(rtol=1e-8)
        levels = BodiesLevels(problem, "alone_displacement_levels_")
        set_levels(ksp, levels, K)
        ksp.setFromOptions()
        x, b = K.createVecs()
        b.array[:] = np.where(problem.constrained, 0.0, 1.0)
        ksp.solve(b, x)
    return ksp.getIterationNumber()


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
    parser.add_argument("--cells", default="hexahedron")
    parser.add_argument("--degrees", default="1")
    parser.add_argument("--name", default="linear")
    parser.add_argument("--methods", default=",".join(METHODS))
    parser.add_argument("--laws", default=",".join(LAWS))
    parser.add_argument("--linear", default=",".join(LINEAR))
    parser.add_argument("--more", action="store_true", help="add to the file's rows")
    parser.add_argument("--output", type=Path, default=Path(__file__).parent)
    names = "CELL", "DEGREE", "LEVEL", "METHOD", "LAW", "LINEAR"
    parser.add_argument("--row", nargs=6, metavar=names)
    arguments = parser.parse_args()
    if arguments.row:
        cell, degree, level, *case = arguments.row
        print(json.dumps(measure(cell, int(degree), int(level), *case)))
        return
    choices = (
        getattr(arguments, name).split(",")
        for name in ("cells", "degrees", "methods", "laws", "levels", "linear")
    )
    arguments.output.mkdir(parents=True, exist_ok=True)
    path = arguments.output / f"{arguments.name}.csv"
    if not (arguments.more and path.exists()):
        write_row(path, {name: name for name in COLUMNS}, "w")
    for cell, degree, method, law, level, linear in itertools.product(*choices):
        row = measure_apart(cell, degree, level, method, law, linear)
        print(*row.values(), flush=True)
        write_row(path, row, "a")  # one by one: large ones take long


if __name__ == "__main__":
    main()

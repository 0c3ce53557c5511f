"""Paths with the factors of earlier tangents, and with MUMPS at each iteration.

    scripts/python benchmarks/parallel/lagged.py [--cases flat,solid] [--sizes 0,1,2]

Writes `lagged.csv`: Newton iterations, how often the tangent was factorised, GMRES
iterations of a system, and CPU seconds of the path, assembly included; each row from a
process of its own, on one rank. Neo-Hookean bodies with friction.

- flat: shallow ironing in 2D, pressed in 10 steps and dragged by 30
- solid: a stiff half pipe pressed into a slab and dragged along it, in 3D
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from rows import measure_rows, write_row

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import Coulomb, solvers, tools

# Behind this folder's modules
sys.path.append(str(Path(__file__).parents[2] / "demos"))

import shallow_ironing  # noqa: E402

NU = 0.3
COLUMNS = (
    *("case", "unknowns", "linear", "steps", "newton", "factorisations", "krylov"),
    "seconds",
)
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


def ironing(n):
    """A stiff half pipe, pressed by a fiftieth of the slab's height and dragged along
    a third of its length."""
    radius, start, height = 3.0, 3.0, 3.0

    def bent(x):
        r = radius - x[:, 2]
        along, up = start + r * np.sin(x[:, 0]), radius - r * np.cos(x[:, 0])
        return np.column_stack([along, x[:, 1], height + up])

    tags = {"bottom": 1, "slave": 2, "master": 3, "symmetry": 4, "grips": 5}
    slab = Block(
        (9 * n // 2, n, 3 * n // 2),
        (0.0, 0.0, 0.0),
        (9.0, 2.0, height),
        tags={"bottom": 1, "top": 2, "front": 4},
    )
    die = Block(
        (6 * n, n + 1, 1),
        (-0.5 * np.pi, 0.0, 0.0),
        (0.5 * np.pi, 2.6, 0.2),
        mapping=bent,
        tags={"bottom": 3, "front": 4, "left": 5, "right": 5},
    )
    mesh, cells, facets = assemble_blocks(MPI.COMM_WORLD, [slab, die], "hexahedron")
    scene = Scene(mesh, cells, facets, tags, {"slab": 1, "die": 2})
    V = tools.vector_space(mesh, 1)
    u = fem.Function(V)
    E = tools.by_body(mesh, cells, {"slab": 1.0, "die": 1000.0}, scene.bodies)
    down, along = (fem.Constant(mesh, 0.0) for _ in range(2))
    bcs = [
        tools.prescribe(V, scene.find("bottom")),
        tools.prescribe(V, scene.find("symmetry"), component=1),
        tools.prescribe(V, scene.find("grips"), along, 0),
        tools.prescribe(V, scene.find("grips"), down, 2),
    ]
    contact = raymortar.Contact(
        u,
        facets,
        [(2, 3)],
        friction=Coulomb(0.3),
        search=raymortar.Search(reach=0.5, depth=0.5),
    )
    problem = raymortar.NonlinearProblem(neo_hookean(u, E), contact, bcs)

    def press(factor):
        down.value = -0.2 * factor

    def slide(factor):
        along.value = 2.0 * factor

    return problem, [(press, 4), (slide, 10)]


def flat(size, options):
    """Solver, and a function that runs the path and gives steps and iterations."""
    model = shallow_ironing.Ironing(
        MPI.COMM_SELF, size, "neo-hookean", options=options, extrapolate=False
    )

    def run():
        rows = list(model.path(0.0, 10, 100, 1.3))
        return len(rows), sum(row.iterations for row in rows)

    return model.solver, run


def solid(size, options):
    """The same in 3D."""
    problem, parts = ironing(size)
    solver = raymortar.SNESSolver(problem, options)

    def run():
        path = []
        for apply, steps in parts:
            path += raymortar.LoadSteps(solver, apply, steps).run()
        return len(path), sum(step.iterations for step in path)

    return solver, run


def measure(case, size, linear):
    """One row."""
    make = {"flat": flat, "solid": solid}[case]
    solver, run = make(SIZES[case][size], LINEAR[linear](case))
    ksp, counts = solver.krylov_solver, []
    solver.snes.setMonitor(lambda snes, i, norm: counts.append(ksp.its))
    start = time.process_time()
    steps, newton = run()
    seconds = time.process_time() - start
    lagged = linear == "lagged"
    values = (
        *(case, solver.problem.contact.layout.size_global, linear, steps, newton),
        ksp.getPythonContext().factorisations if lagged else newton,
        round(float(np.mean(counts)), 1) if lagged else "",
        round(seconds, 2),
    )
    return dict(zip(COLUMNS, values, strict=True))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", default=",".join(SIZES))
    parser.add_argument("--sizes", default="0,1,2")
    parser.add_argument("--linear", default=",".join(LINEAR))
    parser.add_argument("--output", type=Path, default=Path(__file__).parent)
    parser.add_argument("--row", nargs=3, metavar=("CASE", "SIZE", "LINEAR"))
    arguments = parser.parse_args()
    if arguments.row:
        case, size, linear = arguments.row
        print(json.dumps(measure(case, int(size), linear)))
        return
    path = arguments.output / "lagged.csv"
    write_row(path, {name: name for name in COLUMNS}, "w")
    names = "cases", "sizes", "linear"
    choices = [getattr(arguments, name).split(",") for name in names]
    measure_rows(__file__, choices, path)


if __name__ == "__main__":
    main()

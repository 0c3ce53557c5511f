"""Krylov iterations of condensed contact beside those of the same bodies without it.

    [mpirun -n RANKS] scripts/python benchmarks/parallel/condensed.py [--output DIR]
    scripts/python benchmarks/parallel/condensed.py --row CELL DEGREE LEVEL MASTER LAW

A block pressed on another, or a rigid ball on a block (neo-Hookean), without friction
and sheared with it, by a plain PETSc SNES. Writes `condensed.csv`: the mean Krylov
iterations (GMRES to 1e-8) of all Newton iterations by hypre on the matrix as it is, and
by `CondensedPreconditioner`, with CPU seconds of the solve; beside them those of one
system of the bodies alone by hypre, at the solution. Each row from a process of its own.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem.petsc import assemble_matrix
from rows import measure_rows, write_row

import raymortar
from meshes.scenes import two_blocks
from raymortar import rigid
from raymortar.core import compat

COMM = MPI.COMM_WORLD
E, NU = 10.0, 0.3
# Without friction, with it, and the sideways motion
LAWS = {"none": (None, 0.0), "Coulomb": (raymortar.Coulomb(0.3), 0.004)}
PRECONDITIONERS = {
    "hypre": {"pc_type": "hypre"},
    "condensed": {
        "pc_type": "python",
        "pc_python_type": "raymortar.solvers.CondensedPreconditioner",
    },
}
COLUMNS = (
    *("cell", "degree", "master", "friction", "ranks", "unknowns", "newton"),
    *("hypre", "condensed", "most", "seconds", "alone"),
)


class Case:
    """A problem with its load, and the same once more for another solver."""

    def __init__(self, cell, degree, level, master, law):
        n, (friction, slide) = level, LAWS[law]
        scene = two_blocks(
            COMM,
            3,
            cell,
            lower_divisions=(4 * n, 4 * n, 2 * n),
            upper_divisions=(3 * n, 3 * n, 2 * n),
            lower_size=(1.0, 1.0, 0.5),
            upper_size=(0.8, 0.8, 0.5),
        )
        V = compat.vector_space(scene.mesh, degree)
        self.u, v = fem.Function(V), ufl.TestFunction(V)
        mu, lmbda = E / (2 + 2 * NU), E * NU / ((1 + NU) * (1 - 2 * NU))
        F = ufl.Identity(3) + ufl.grad(self.u)
        P = mu * (F - ufl.inv(F).T) + lmbda * ufl.ln(ufl.det(F)) * ufl.inv(F).T
        dx = ufl.dx(metadata={"quadrature_degree": 2 * degree})
        ball = rigid.Body(rigid.Sphere((0.4, 0.4, 1.8), 0.8))
        held, pair = ("bottom", "top"), (scene.tags["slave"], scene.tags["master"])
        moved = (slide, 0.0, -0.02)
        if master == "ball":
            held, pair = ("bottom", "slave"), (scene.tags["top"], ball)
            ball.move((slide, 0.0, -0.03))
            moved = (0.0, 0.0, 0.0)
        method = raymortar.AugmentedLagrangian(condition="nodes", multiplier="dual")
        contact = raymortar.Contact(
            self.u, scene.facet_tags, [pair], method, friction=friction
        )
        bcs = []
        for name, value in zip(held, ((0.0, 0.0, 0.0), moved)):
            facets = scene.facet_tags.find(scene.tags[name])
            dofs = fem.locate_dofs_topological(V, 2, facets)
            bcs.append(fem.dirichletbc(np.array(value), dofs, V))
        form = ufl.inner(P, ufl.grad(v)) * dx
        self.problem = raymortar.CondensedProblem(form, self.u, contact, bcs)

    def solve(self, options):
        """Newton iterations, and the Krylov iterations of each."""
        snes, counts = PETSc.SNES().create(COMM), []
        self.problem.attach(snes)
        snes.setTolerances(rtol=1e-8)
        ksp, table = snes.getKSP(), PETSc.Options()
        for name, value in options.items():
            table[name] = value
        ksp.setType("gmres")
        ksp.setGMRESRestart(200)
        ksp.setTolerances(rtol=1e-8, max_it=400)
        ksp.setFromOptions()
        snes.setMonitor(lambda _, i, norm: counts.append(ksp.its))
        snes.solve(None, self.problem.create_vector())
        for name in options:
            table.delValue(name)
        return snes.getIterationNumber(), counts[1:]

    def alone(self):
        """GMRES of the bodies' tangent without contact, by hypre."""
        K = assemble_matrix(self.problem.a, bcs=self.problem.bcs)
        K.assemble()
        ksp = PETSc.KSP().create(COMM)
        ksp.setOperators(K)
        ksp.setType("gmres")
        ksp.setGMRESRestart(200)
        ksp.setTolerances(rtol=1e-8)
        ksp.getPC().setType("hypre")
        x, b = K.createVecs()
        b.array[:] = np.where(self.problem.coupled.prescribed, 0.0, 1.0)
        ksp.solve(b, x)
        return ksp.getIterationNumber()


def measure(cell, degree, level, master, law):
    """One row."""
    case = cell, int(degree), int(level), master, law
    found = {}
    for name, options in PRECONDITIONERS.items():
        solved, start = Case(*case), time.process_time()
        newton, krylov = solved.solve(options)
        found[name] = krylov
    seconds = time.process_time() - start
    size = solved.problem.create_vector().getSize()
    means = [round(float(np.mean(krylov)), 1) for krylov in found.values()]
    values = (cell, degree, master, law, COMM.size, size, newton, *means)
    values += (max(found["condensed"]), round(seconds, 2), solved.alone())
    return dict(zip(COLUMNS, values, strict=True))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path(__file__).parent)
    parser.add_argument("--row", nargs=5)
    arguments = parser.parse_args()
    if arguments.row:
        row = measure(*arguments.row)
        if COMM.rank == 0:
            print(json.dumps(row))
        return
    path = arguments.output / "condensed.csv"
    write_row(path, {name: name for name in COLUMNS}, "w")
    cells, laws = ("hexahedron", "tetrahedron"), LAWS
    for degree, levels in (("1", "24"), ("2", "12")):
        measure_rows(__file__, (cells, degree, levels, ("block",), laws), path)
    measure_rows(__file__, (cells, "2", "2", ("ball",), laws), path)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""benchmarks/tangent.py [--repeat N]

Newton iterations and processor time of the two tangents, fixed points and moving
segments, on scenes where segments matter little and much. Prints a table as CSV.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from statistics import median

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

import raymortar
from raymortar import compat
from raymortar.scenes import two_blocks

E, NU = 10.0, 0.3
STEPS = 4
RTOL = 1e-9


def neo_hookean(u):
    """Energy density."""
    mu, lmbda = E / (2.0 * (1.0 + NU)), E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU))
    F = ufl.Identity(len(u)) + ufl.grad(u)
    J = ufl.det(F)
    return 0.5 * mu * (ufl.inner(F, F) - len(u) - 2.0 * ufl.ln(J)) + (
        0.5 * lmbda * ufl.ln(J) ** 2
    )


def held(V, scene, name):
    """Dirichlet condition of all components on a side, and its value."""
    facets = scene.facet_tags.find(scene.tags[name])
    dim = scene.mesh.topology.dim
    value = fem.Constant(scene.mesh, np.zeros(dim, dtype=PETSc.ScalarType))
    dofs = fem.locate_dofs_topological(V, dim - 1, facets)
    return fem.dirichletbc(value, dofs, V), value


def path(scene, tangent, motion, degree=1, friction=None):
    """Iterations of each step of a motion of the top; None where one fails."""
    V = compat.vector_space(scene.mesh, degree)
    u = fem.Function(V)
    pair = (scene.tags["slave"], scene.tags["master"])
    contact = raymortar.Contact(
        u, scene.facet_tags, [pair], friction=friction, tangent=tangent
    )
    v = ufl.TestFunction(V)
    form = ufl.derivative(
        neo_hookean(u) * ufl.dx(metadata={"quadrature_degree": 2 * degree}), u, v
    )
    conditions, values = zip(*(held(V, scene, name) for name in ("bottom", "top")))
    problem = raymortar.NonlinearProblem(form, contact, bcs=list(conditions))
    solver = raymortar.NewtonSolver(problem)
    solver.rtol = RTOL
    iterations = []
    for step in range(1, STEPS + 1):
        values[1].value[:] = motion(step / STEPS)
        try:
            iterations.append(solver.solve()[0])
        except raymortar.ConvergenceError:
            return iterations + [None]
        contact.advance()
    return iterations


def down(dim, depth, slide=0.0):
    """Motion that presses by a depth in the first half of a path that slides."""
    direction = np.eye(dim)

    def at(s):
        press = min(1.0, 2.0 * s) if slide else s
        drag = max(0.0, 2.0 * s - 1.0)
        return -press * depth * direction[-1] + drag * slide * direction[0]

    return at


def scenes(comm):
    """Name, scene and options of `path`."""
    narrow = {"upper_size": (0.9, 1.0)}
    narrow_3d = {"upper_size": (0.8, 0.8, 1.0)}
    over, over_3d = {"lower_size": (0.8, 1.0)}, {"lower_size": (0.8, 0.8, 1.0)}
    for cell, dim, inner, outer in (
        ("quadrilateral", 2, narrow, over),
        ("hexahedron", 3, narrow_3d, over_3d),
        ("tetrahedron", 3, narrow_3d, over_3d),
    ):
        press = {"motion": down(dim, 0.4 if dim == 2 else 0.2)}
        slide = {"motion": down(dim, 0.1, 0.3), "friction": raymortar.Coulomb(0.3)}
        yield f"{cell}, inside", two_blocks(comm, dim, cell, **inner), press
        yield f"{cell}, equal", two_blocks(comm, dim, cell), press
        yield f"{cell}, overhanging", two_blocks(
            comm, dim, cell, **over_3d if dim == 3 else outer
        ), press
        yield f"{cell}, sliding over the edge", two_blocks(comm, dim, cell), slide
    yield (
        "quadrilateral P2, overhanging",
        two_blocks(comm, 2, "quadrilateral", **over),
        {"motion": down(2, 0.4), "degree": 2},
    )


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[1])
    parser.add_argument(
        "--repeat", type=int, default=3, help="runs to take the median of"
    )
    parser.add_argument("--only", default="", help="scenes whose name contains this")
    options = parser.parse_args(arguments)
    table = csv.writer(sys.stdout)
    table.writerow(["scene", "tangent", "iterations", "seconds"])
    for name, scene, how in scenes(MPI.COMM_WORLD):
        if options.only not in name:
            continue
        for tangent in ("fixed", "full"):
            seconds = []
            for _ in range(options.repeat):
                start = time.process_time()
                iterations = path(scene, tangent, **how)
                seconds.append(time.process_time() - start)
            counts = " ".join("fails" if n is None else str(n) for n in iterations)
            table.writerow([name, tangent, counts, f"{median(seconds):.2f}"])
            sys.stdout.flush()


if __name__ == "__main__":
    main()

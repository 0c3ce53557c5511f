"""Contact with a rigid tool against the same with a meshed one: residual, tangent, pairing.

Writes cost.csv beside it. A block of n x n facets lies on a flat tool, every point in
contact with friction: a `rigid.Plane`, a `rigid.Surface` of (n - 1) x (n - 1) facets, and
a meshed block with as many, all of whose dofs are prescribed. Microseconds of CPU time
per slave facet, the least of some repeats; what is compared is their ratio.
"""

import argparse
import csv
import sys
import time
from pathlib import Path

from mpi4py import MPI

import numpy as np
from dolfinx import fem

import raymortar
from meshes.scenes import two_blocks
from raymortar import rigid
from raymortar.core import compat

sys.path.insert(0, str(Path(__file__).parents[1] / "speed"))
from scene import neo_hookean  # noqa: E402

SIZES = {"quadrilateral": 4000, "tetrahedron": 16, "hexahedron": 24}


def face_of(cell, n):
    """The tool's face as a Surface: z = 1 over the unit square, a solid below it."""
    t = np.linspace(0.0, 1.0, n + 1)
    if cell == "quadrilateral":
        points = np.column_stack([t, np.ones(n + 1)])
        k = np.arange(n)
        return rigid.Surface(points, np.column_stack([k + 1, k]), closed=False)
    x, y = (a.ravel() for a in np.meshgrid(t, t, indexing="ij"))
    points = np.column_stack([x, y, np.ones_like(x)])
    i, j = (a.ravel() for a in np.indices((n, n)))
    k = i * (n + 1) + j
    corners = np.column_stack([k, k + n + 1, k + n + 2, k + 1])
    if cell == "tetrahedron":
        corners = np.vstack([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    return rigid.Surface(points, corners, closed=False)


def tool_of(kind, cell, n, tags):
    """What the slave meets."""
    if kind == "meshed":
        return tags["master"]
    if kind == "Surface":
        return face_of(cell, n - 1)
    if cell == "quadrilateral":
        return rigid.Line((0.0, 1.0), (0.0, 1.0))
    return rigid.Plane((0.0, 0.0, 1.0), (0.0, 0.0, 1.0))


def least(call, repeats, before=lambda: None):
    """CPU seconds of a call."""
    seconds = []
    for _ in range(repeats):
        before()
        start = time.process_time()
        call()
        seconds.append(time.process_time() - start)
    return min(seconds)


def measure(kind, cell, degree, n, repeats):
    """Facets, and microseconds a facet of pairing, residual and tangent."""
    dim = 2 if cell == "quadrilateral" else 3
    below = (n - 1,) * (dim - 1) + (1,)
    scene = two_blocks(MPI.COMM_SELF, dim, cell, below, (n,) * (dim - 1) + (1,))
    V = compat.vector_space(scene.mesh, degree)
    u = fem.Function(V)
    pair = scene.tags["slave"], tool_of(kind, cell, n, scene.tags)
    contact = raymortar.Contact(
        u,
        scene.facet_tags,
        [pair],
        raymortar.AugmentedLagrangian(1.0),
        friction=raymortar.Coulomb(0.3),
        offset=-1e-3 / n,
    )
    master = fem.locate_dofs_geometrical(V, lambda x: x[dim - 1] < 1.0 - 1e-9)
    bcs = [fem.dirichletbc(np.zeros(dim), master, V)]
    problem = raymortar.NonlinearProblem(neo_hookean(u), contact, bcs)
    contact.update()
    statuses = contact.points()["status"]
    assert len(statuses) and statuses.min() > 0, "all points are to be in contact"
    b, A = problem.b, problem.A
    shift = 1e-10

    def move():
        nonlocal shift
        shift *= -1.1
        u.x.array[:] += shift

    contact.assemble_matrix(A, bcs)
    A.assemble()

    def tangent():
        contact.assemble_matrix(A, bcs)
        A.assemble()

    seconds = [
        least(contact.update, repeats, move),
        least(lambda: contact.assemble_vector(b, bcs), repeats),
        least(tangent, repeats, A.zeroEntries),
    ]
    facets = len(scene.find("slave"))
    return [facets, *(1e6 * s / facets for s in seconds)]


def main():
    """Measure and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--file", type=Path, default=Path(__file__).parent / "cost.csv")
    args = parser.parse_args()
    with args.file.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(
            ["cell", "degree", "tool", "facets", "pairing", "residual", "tangent"]
        )
        for cell, n in SIZES.items():
            for degree in (1, 2):
                for kind in ("meshed", "Surface", "Plane"):
                    facets, *costs = measure(kind, cell, degree, n, args.repeats)
                    row = [cell, degree, kind, facets, *(f"{c:.3g}" for c in costs)]
                    table.writerow(row)
                    print(*row, flush=True)


if __name__ == "__main__":
    main()

"""Seconds to pair and assemble surfaces that meet themselves, beside named pairs.

Two layers lie on each other, one cell thick or eight. Their facets are two named pairs,
one in each order; or one tag; or all facets of the mesh are in contact, outer ones too.
CPU microseconds for each facet that is integrated over: one pairing from nothing
(candidates, segments, rays), and one assembly (residual, tangent).

    scripts/python benchmarks/speed/self_contact.py [FACETS...]

writes results/self_contact.csv, and with sizes given prints it only.
"""

import csv
import sys
from pathlib import Path

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem

sys.path.insert(0, str(Path(__file__).parents[2]))

from meshes.scenes import two_blocks  # noqa: E402
from raymortar import Contact, Penalty
from raymortar.core import compat

STAGES = "candidates", "segments", "rays", "residual", "tangent"
SKIN, REPEATS = 77, 3
# Dimension, facets between the layers, cells through each of them
CASES = [(2, n, cells) for cells in (1, 8) for n in (1000, 10000)]
CASES += [(3, 1000, 1), (3, 1000, 8), (3, 10000, 1)]


def layers(dim, facets, cells):
    """Two layers with about so many facets between them, unlike on both sides."""
    n = round(0.5 * facets) if dim == 2 else round((0.5 * facets) ** 0.5)
    divisions = (n,) * (dim - 1) + (cells,), (n + 1,) * (dim - 1) + (cells,)
    # Cells as high as they are wide
    size = (1.0,) * (dim - 1) + (cells / n,)
    cell = {2: "quadrilateral", 3: "hexahedron"}[dim]
    options = {"lower_size": size, "upper_size": size}
    return two_blocks(MPI.COMM_WORLD, dim, cell, *divisions, **options)


def kinds(scene):
    """Functions that make contacts of the same facets, by what they are given."""
    tags, mesh = scene.facet_tags, scene.mesh
    one, other = scene.tags["slave"], scene.tags["master"]
    values = np.where(np.isin(tags.values, [one, other]), SKIN, tags.values)
    joined = compat.meshtags(mesh, mesh.topology.dim - 1, tags.indices, values)
    u = fem.Function(compat.vector_space(mesh, 1))

    def made(facets, *pairs):
        return lambda: [Contact(u, facets, pair, Penalty(1.0)) for pair in pairs]

    yield "named", made(tags, [(one, other)], [(other, one)])
    yield "one tag", made(joined, [(SKIN, SKIN)])
    yield "all", made(None, "all")


def measured(contact):
    """CPU seconds by stage, facets that are integrated over, and points that hit."""
    V = contact.u.function_space
    v, w = ufl.TrialFunction(V), ufl.TestFunction(V)
    A = contact.create_matrix(fem.form(ufl.inner(v, w) * ufl.dx))
    contact.update()
    b = contact.create_vector()
    contact.assemble_vector(b, [])
    contact.assemble_matrix(A, [])
    stats = contact.statistics
    for made in (A, b):
        made.destroy()
    found = [getattr(stats, f"seconds_{name}") for name in STAGES]
    return np.array(found), stats.slave_facets


def microseconds(make):
    """Least time of each stage for one facet, and the number of facets."""
    found = []
    for _ in range(REPEATS):
        each = [measured(contact) for contact in make()]
        facets = sum(count for _, count in each)
        found.append(sum(times for times, _ in each) / facets * 1e6)
    return np.min(found, axis=0), facets


def rows(cases):
    """Rows of the table, case by case."""
    for dim, size, cells in cases:
        for kind, make in kinds(layers(dim, size, cells)):
            times, facets = microseconds(make)
            shown = {f"us_{s}": f"{t:.3g}" for s, t in zip(STAGES, times)}
            row = {"dim": dim, "between": size, "cells": cells, "pairs": kind}
            yield {**row, "facets": facets, **shown}


def main(arguments):
    """Measure, and write a CSV file where no sizes are given."""
    sizes = [int(a) for a in arguments]
    found = list(rows([(d, n, 1) for d in (2, 3) for n in sizes] or CASES))
    file = Path(__file__).parent / "results" / "self_contact.csv"
    with sys.stdout if sizes else file.open("w", newline="") as out:
        writer = csv.DictWriter(out, found[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(found)


if __name__ == "__main__":
    main(sys.argv[1:])

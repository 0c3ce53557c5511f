"""Seconds to pair one tag with itself, beside named pairs of the same facets.

Two layers of one cell each lie on each other. Their facets are one tag; two named pairs,
one in each order; or all facets of the mesh, outer ones too. CPU seconds of one pairing
from nothing: candidates, segments and rays. A ratio is to the named pairs.

    scripts/python benchmarks/speed/self_contact.py [FACETS...]
"""

import sys
from pathlib import Path

from mpi4py import MPI

import numpy as np
from dolfinx import fem

sys.path.insert(0, str(Path(__file__).parents[2]))

from meshes.scenes import two_blocks  # noqa: E402
from raymortar import Contact, Penalty, compat  # noqa: E402

STAGES = "candidates", "segments", "rays"
SKIN = 77


def layers(dim, facets):
    """Two layers with about so many facets between them, unlike on both sides."""
    n = round(0.5 * facets) if dim == 2 else round((0.5 * facets) ** 0.5)
    cells = (n,) * (dim - 1) + (1,), (n + 1,) * (dim - 1) + (1,)
    # Cells as high as they are wide
    size = (1.0,) * (dim - 1) + (1.0 / n,)
    cell = {2: "quadrilateral", 3: "hexahedron"}[dim]
    comm = MPI.COMM_WORLD
    options = {"lower_size": size, "upper_size": size}
    return two_blocks(comm, dim, cell, *cells, **options)


def seconds(contact):
    """CPU seconds by stage, and the number of facets that are integrated over."""
    contact.update()
    stats = contact.statistics
    found = [getattr(stats, f"seconds_{name}") for name in STAGES]
    return np.array(found), stats.slave_facets


def kinds(scene):
    """Functions that make contacts of the same facets, by what they are given."""
    tags, mesh = scene.facet_tags, scene.mesh
    one, other = scene.tags["slave"], scene.tags["master"]
    values = np.where(np.isin(tags.values, [one, other]), SKIN, tags.values)
    joined = compat.meshtags(mesh, mesh.topology.dim - 1, tags.indices, values)

    def made(facets, *pairs):
        u = fem.Function(compat.vector_space(mesh, 1))
        return lambda: [Contact(u, facets, pair, Penalty(1.0)) for pair in pairs]

    yield "named, both orders", made(tags, [(one, other)], [(other, one)])
    yield "one tag", made(joined, [(SKIN, SKIN)])
    yield "all", made(None, "all")


def microseconds(make, repeats=3):
    """Least time of each stage for one facet, and the number of facets."""
    found = []
    for _ in range(repeats):
        each = [seconds(contact) for contact in make()]
        facets = sum(count for _, count in each)
        found.append(sum(times for times, _ in each) / facets * 1e6)
    return np.min(found, axis=0), facets


def main(arguments):
    """Print a table."""
    sizes = [int(a) for a in arguments] or [1000, 10000, 100000]
    print("| facets |", " | ".join(STAGES), "| sum | search | all stages |")
    for dim in (2, 3):
        for size in sizes:
            scene, base = layers(dim, size), None
            for name, make in kinds(scene):
                times, facets = microseconds(make)
                base = times if base is None else base
                shown = " | ".join(f"{t:.2f}" for t in (*times, times.sum()))
                ratio = f"{times[0] / base[0]:.2f} | {times.sum() / base.sum():.2f}"
                print(f"| {dim}D, {name}, {facets} | {shown} | {ratio} |")


if __name__ == "__main__":
    main(sys.argv[1:])

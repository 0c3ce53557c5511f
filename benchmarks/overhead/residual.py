"""What a residual and a tangent cost beside the volume and the kernels of contact.

Writes residual.csv beside it; residual_before.csv has the rows of the code in which
iterations went through Python. Six scenes: two blocks, or a block below a rigid ball that
is held or free; with friction and without; in 2D and 3D. Microseconds are medians of
CPU time; "overhead" is the residual less DOLFINx's `assemble_vector` of the same
form, moving and pairing the surfaces, and the kernels of contact. Frames are calls of
Python functions of raymortar; DOLFINx adds none to three, by its version.
"""

import argparse
import csv
import statistics
import sys
import time
from pathlib import Path

from mpi4py import MPI

import numpy as np
from dolfinx import fem
from dolfinx.fem import petsc

import raymortar
from meshes.scenes import two_blocks
from raymortar import _cpp, rigid
from raymortar.core import compat
from raymortar.core.interface.zone_data import on_sides

sys.path.insert(0, str(Path(__file__).parents[1] / "speed"))
from scene import neo_hookean  # noqa: E402

# Dimension, what the slave meets, friction
SCENES = {
    "2D, two blocks": (2, "block", None),
    "2D, held circle": (2, "held", None),
    "2D, held circle, friction": (2, "held", raymortar.Coulomb(0.3)),
    "2D, free circle, friction": (2, "free", raymortar.Coulomb(0.3)),
    "3D, held ball": (3, "held", None),
    "3D, two blocks, friction": (3, "block", raymortar.Coulomb(0.3)),
}
SIZES = {2: (24, 12), 3: (6, 3)}


def tool(dim, kind):
    """A ball that touches the lower block's upper face, held or free along the last
    axis."""
    middle = [0.5] * (dim - 1) + [1.48]
    shape = (rigid.Circle if dim == 2 else rigid.Sphere)(tuple(middle), 0.5)
    if kind == "held":
        return rigid.Body(shape)
    force = [0.0] * (dim - 1) + [-0.01]
    return rigid.Body(shape, free=("xyz"[dim - 1],), force=force)


def problem_of(dim, kind, friction):
    """A problem whose slave is in contact."""
    across, along = SIZES[dim]
    cell = "quadrilateral" if dim == 2 else "hexahedron"
    low, high = ((n,) * (dim - 1) + (along,) for n in (across - 1, across))
    scene = two_blocks(MPI.COMM_SELF, dim, cell, low, high)
    V = compat.vector_space(scene.mesh, 1)
    u = fem.Function(V)
    tags = scene.tags
    pair = (tags["slave"], tags["master"])
    if kind != "block":
        pair = (tags["master"], tool(dim, kind))
    contact = raymortar.Contact(u, scene.facet_tags, [pair], friction=friction)
    facets = scene.facet_tags
    held = [
        fem.locate_dofs_topological(V, dim - 1, facets.find(tags[name]))
        for name in ("bottom", "top")
    ]
    zero = fem.Constant(scene.mesh, np.zeros(dim))
    bcs = [fem.dirichletbc(zero, dofs, V) for dofs in held]
    return raymortar.NonlinearProblem(neo_hookean(u), contact, bcs=bcs)


def microseconds(call, repeats):
    """Median CPU time of a call."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        call()
        times.append(time.process_time() - start)
    return 1e6 * statistics.median(times)


def frames(call):
    """Number of our Python functions that a call enters."""
    count, ours = 0, (str(Path(raymortar.__file__).parent), "<")

    def note(frame, event, argument):
        nonlocal count
        count += event == "call" and frame.f_code.co_filename.startswith(ours)

    sys.setprofile(note)
    try:
        call()
    finally:
        sys.setprofile(None)
    return count


def measure(name, repeats):
    """A row of the table."""
    problem = problem_of(*SCENES[name])
    x, b = problem.start(), problem.create_vector()
    A = problem.create_matrix()
    zones = problem.contact.zones
    # Another iterate each time: nothing may be kept. Prescribed values stay, which would
    # be lifted
    other = [x, x.copy()]
    free = ~problem.prescribed
    for size, vector in zip((1e-9, 2e-9), other):
        vector.array[: problem.contact.layout.n][free] += size
    turn = iter(range(10**9))

    def residual():
        problem.F(other[next(turn) % 2], b)

    def tangent():
        problem.J(other[next(turn) % 2], A)

    def volume():
        petsc.assemble_vector(problem.L).destroy()

    u = [vector.array_r[: problem.contact.layout.n] for vector in other]

    def kernels():
        now = u[next(turn) % 2]
        for zone in zones:
            zone.cpp.set_displacement(*on_sides(zone, now))
            zone.cpp.pair()
            _cpp.add_residual(zone.cpp, b.handle, zone.assembly)
        b.assemble()

    residual()
    tangent()
    whole = microseconds(residual, repeats)
    of_volume, of_contact = (microseconds(part, repeats) for part in (volume, kernels))
    return {
        "scene": name,
        "unknowns": x.size,
        "residual_us": round(whole, 1),
        "volume_us": round(of_volume, 1),
        "contact_us": round(of_contact, 1),
        "overhead_us": round(whole - of_volume - of_contact, 1),
        "over_volume": round(whole / of_volume, 2),
        "residual_frames": frames(residual),
        "tangent_us": round(microseconds(tangent, repeats), 1),
        "tangent_frames": frames(tangent),
    }


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=200)
    parser.add_argument("--output", type=Path, default=Path(__file__).parent)
    chosen = parser.parse_args(arguments)
    rows = []
    for name in SCENES:
        rows.append(measure(name, chosen.repeats))
        print(rows[-1], flush=True)
    with open(
        chosen.output / "residual.csv", "w", newline="", encoding="utf-8"
    ) as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())

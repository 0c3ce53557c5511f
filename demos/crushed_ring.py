"""Self-contact: a ring is pressed flat between two plates, its inner wall on itself.

Its inner wall is one tag, slave and master. By symmetry it is a quarter on a rigid line.
"""

import sys
from types import SimpleNamespace

from mpi4py import MPI

import bodies
import common
import drawing
import numpy as np
from dolfinx import fem

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import io, rigid, tools

# Any consistent units; forces per thickness
E, NU, RADIUS, WALL = 100.0, 0.3, 1.0, 0.15
PUSH = RADIUS - WALL  # way of each plate
TAGS = {"inner": 1, "outer": 2, "low": 3, "high": 4}


def ring(comm, size, begin):
    """The ring from an angle to the top, in degrees. Collective."""

    def mapping(x):
        r, angle = RADIUS - WALL + WALL * x[:, 0], np.radians(x[:, 1])
        return np.column_stack([r * np.cos(angle), r * np.sin(angle)])

    sides = dict(zip(("left", "right", "bottom", "top"), TAGS.values()))
    cells = size, round((90 - begin) * 16 * size / 90)
    block = Block(cells, (0.0, begin), (1.0, 90.0), mapping=mapping, tags=sides)
    return Scene(*assemble_blocks(comm, [block], "quadrilateral", 2), TAGS)


def crush(comm, size, steps, itself=True):
    """Press the half ring onto itself, or the quarter onto a rigid line. Collective."""
    scene = ring(comm, size, -90 if itself else 0)
    V = tools.vector_space(scene.mesh, 2)
    u = fem.Function(V, name="displacement")
    bcs = [tools.prescribe(V, scene.find("high"), component=0)]
    bcs += [tools.prescribe(V, scene.find("low"), component=0 if itself else 1)]
    plates = [rigid.Body(rigid.Line((0.0, RADIUS), (0.0, -1.0)), name="plate")]
    if itself:
        plates += [rigid.Body(rigid.Line((0.0, -RADIUS), (0.0, 1.0)), name="lower")]
    pairs = [("outer", plate) for plate in plates]
    outside = raymortar.Contact(u, scene.facet_tags, pairs, names=TAGS)
    pairs = [("inner", "inner" if itself else rigid.Line((0.0, 0.0), (0.0, 1.0)))]
    law = raymortar.Penalty(exact=True)
    inside = raymortar.Contact(u, scene.facet_tags, pairs, law, names=TAGS)
    F = bodies.NeoHookean(E, NU).residual(u, 4)
    problem = raymortar.NonlinearProblem(F, [outside, inside], bcs)
    history = raymortar.History(problem)

    def close(t):
        for plate, way in zip(plates, (-PUSH, PUSH)):
            plate.move((0.0, way * (1.0 - (1.0 - t) ** 2)))

    path = raymortar.LoadSteps(problem.snes_solver, close, steps, history=history)
    return SimpleNamespace(
        u=u,
        scene=scene,
        contact=inside,
        iterations=[step.iterations for step in path],
        halvings=path.halvings,
        way=-2.0 * history["translation_plate_y"],
        force=history["push_plate_y"],
    )


def draw(found, half, path, parts):
    """The ring with its mirror image, before and after, and force over way."""
    options = {"figsize": (10.0, 4.0), "layout": "constrained"}
    figure, (left, right) = drawing.pyplot().subplots(1, 2, **options)
    (x, moved, mises), halves = parts, [(1, 1), (-1, 1)]
    drawing.draw_field(left, x[..., :2], np.full_like(mises, np.nan), halves)
    colours = drawing.draw_field(left, x[..., :2] + moved, mises, halves)
    left.axis("off")
    figure.colorbar(colours, ax=left, label="von Mises stress", shrink=0.6)
    right.semilogy(half.way, half.force, color=drawing.EXACT, label="quarter on a line")
    right.semilogy(found.way, found.force, "o", color=drawing.COMPUTED, label="half")
    right.set(xlabel="approach of the plates", ylabel="force on half a plate")
    right.legend()
    figure.savefig(path)


def main(arguments=None):
    """Run the demo; 0 if both models have the same force."""
    parser = common.options("crushed_ring", __doc__)
    parser.add_argument("--size", type=int, default=2, help="cells through the wall")
    parser.add_argument("--steps", type=int, default=16, help="load steps")
    args = parser.parse_args(arguments)
    comm, report = MPI.COMM_WORLD, common.Report(MPI.COMM_WORLD)
    args.output.mkdir(parents=True, exist_ok=True)
    size = args.size * (1 + args.fine)
    found, half = (crush(comm, size, args.steps, way) for way in (True, False))
    report.effort(found.contact, found.iterations, found.halvings)
    for meeting in found.contact.results.meetings():
        report.say(str(meeting))
    report.add("force at the end", found.force[-1], half.force[-1], 0.001)
    depth = 1.0 - found.contact.statistics.min_gap / WALL
    report.add("1 + penetration / wall", depth, 1.0, 0.001)
    mises = bodies.NeoHookean(E, NU).mises(found.u)
    fields = [found.u, found.contact.pressure(), mises]
    io.write_xdmf(args.output / "crushed_ring.xdmf", found.scene.mesh, fields)
    parts = drawing.gather_cells(found.scene.mesh, found.u, mises)
    if comm.rank == 0:
        draw(found, half, args.output / "crushed_ring.png", parts)
    return report.finish("the quarter")


if __name__ == "__main__":
    sys.exit(main())

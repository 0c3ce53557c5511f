"""Self-contact: a ring is crushed flat until its inner wall meets itself (2D).

The right half of the ring between two rigid plates; its inner wall is one tag, which is
slave and master. By symmetry it is a quarter on a rigid line, without self-contact.
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
E, NU, RADIUS, WALL, GAMMA = 100.0, 0.3, 1.0, 0.15, 2e4
PUSH = RADIUS - WALL - 0.01  # of each plate: the walls lie on each other
TAGS = {"inner": 1, "outer": 2, "low": 3, "high": 4}


def ring(comm, size, begin):
    """The ring from an angle to the top, in degrees. Collective."""

    def mapping(x):
        r, angle = RADIUS - WALL + WALL * x[:, 0], np.radians(x[:, 1])
        return np.column_stack([r * np.cos(angle), r * np.sin(angle)])

    tags = {"left": "inner", "right": "outer", "bottom": "low", "top": "high"}
    sides = {side: TAGS[name] for side, name in tags.items()}
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
    lines = {"top": rigid.Line((0.0, RADIUS), (0.0, -1.0))}
    if itself:
        lines["bottom"] = rigid.Line((0.0, -RADIUS), (0.0, 1.0))
    plates = [rigid.Body(line, name=name) for name, line in lines.items()]
    pairs = [("outer", plate) for plate in plates]
    pairs += [("inner", "inner" if itself else rigid.Line((0.0, 0.0), (0.0, 1.0)))]
    method = raymortar.Penalty(GAMMA, exact=True)
    contact = raymortar.Contact(u, scene.facet_tags, pairs, method, names=TAGS)
    F = bodies.NeoHookean(E, NU).residual(u, 4)
    problem = raymortar.NonlinearProblem(F, contact, bcs)
    history = raymortar.History(problem)

    def close(t):
        for plate, way in zip(plates, (-1.0, 1.0)):
            plate.move((0.0, way * PUSH * t))

    path = raymortar.LoadSteps(problem.snes_solver, close, steps, history=history)
    iterations = [step.iterations for step in path]
    gap = np.nan_to_num(contact.gap().x.array)[contact.pressure().x.array > 0.0]
    return SimpleNamespace(
        u=u,
        scene=scene,
        contact=contact,
        iterations=iterations,
        halvings=path.halvings,
        way=2.0 * PUSH * history["time"],
        force=history["push_top_y"],
        deepest=comm.allreduce(-np.min(gap, initial=0.0), op=MPI.MAX),
    )


def draw(found, half, path, parts):
    """The crushed ring with its mirror image, and force over way."""
    plt = drawing.pyplot()
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    x, moved, mises = parts
    for sign in (1.0, -1.0):
        at = (x[..., :2] + moved) * [sign, 1.0]
        colours = drawing.draw_field(left, at, mises, [(1, 1)], mises.max())
    left.set_aspect("equal")
    left.axis("off")
    figure.colorbar(colours, ax=left, label="von Mises stress", shrink=0.6)
    right.plot(half.way, half.force, color=drawing.EXACT, label="quarter, rigid line")
    label = "half, inner wall on itself"
    right.plot(found.way, found.force, "o", ms=4, color=drawing.COMPUTED, label=label)
    right.set(xlabel="how much the plates come closer", ylabel="force of half a plate")
    right.legend()
    figure.savefig(path)


def main(arguments=None):
    """Run the demo; 0 if both models have the same forces."""
    parser = common.options("crushed_ring", __doc__)
    parser.add_argument("--size", type=int, default=2, help="cells through the wall")
    parser.add_argument("--steps", type=int, default=24, help="load steps")
    args = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    args.output.mkdir(parents=True, exist_ok=True)
    size, report = args.size * (2 if args.fine else 1), common.Report(comm)
    found = crush(comm, size, args.steps)
    half = crush(comm, size, args.steps, itself=False)
    report.effort(found.contact, found.iterations, found.halvings)
    for meeting in found.contact.meetings():
        report.say(str(meeting))
    report.add("1 + penetration / wall", 1.0 + found.deepest / WALL, 1.0, 1e-3)
    report.add("force at the end", found.force[-1], half.force[-1], 0.01)
    at = np.argmin(abs(half.way - PUSH))
    same = np.argmin(abs(found.way - half.way[at]))
    report.add("force at half of the way", found.force[same], half.force[at], 1e-6)
    mises = bodies.NeoHookean(E, NU).mises(found.u)
    fields = [found.u, found.contact.pressure(), mises]
    io.write_xdmf(args.output / "crushed_ring.xdmf", found.scene.mesh, fields)
    parts = drawing.gather_cells(found.scene.mesh, found.u, mises)
    if comm.rank == 0:
        draw(found, half, args.output / "crushed_ring.png", parts)
    return report.finish("the quarter")


if __name__ == "__main__":
    sys.exit(main())

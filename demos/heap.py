"""General contact: a plate presses a heap of discs into a box; nobody is paired (2D).

`pairs="all"`: every facet of discs and box may meet every other, and the plate. Which
discs touch is told after the fact, with their forces, which have to balance on each.
"""

import sys

from mpi4py import MPI

import bodies
import common
import drawing
import numpy as np
from dolfinx import fem

import raymortar
from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from raymortar import io, rigid, tools

# Any consistent units; forces per thickness
E, NU, GAMMA, FRICTION = 100.0, 0.3, 1000.0, 0.2
RADIUS, GAP, PUSH = 0.5, 0.004, 0.12
SIZE = 2 * RADIUS + GAP  # room for a disc
HEIGHT = RADIUS + 0.5 * np.sqrt(3.0) * SIZE  # of the upper discs' middles
CENTRES = [(k * SIZE, RADIUS + GAP) for k in (-1, 0, 1)]
CENTRES += [(k * SIZE, HEIGHT + GAP) for k in (-0.5, 0.5)]
FOOT = 1


def disc(centre, size, body):
    """A square in the middle, and four sectors around it."""
    inner = 0.45 * RADIUS

    def sector(turn):
        def mapping(x):
            s, t = x[:, :1], x[:, 1:]
            low = inner * np.hstack([s, np.ones_like(s)])
            angle = 0.25 * np.pi * s
            high = RADIUS * np.hstack([np.sin(angle), np.cos(angle)])
            return ((1 - t) * low + t * high) @ turn + centre

        return mapping

    square = np.array(centre) - inner, np.array(centre) + inner
    blocks = [Block((size, size), *square, body=body)]
    for turn in (
        [[1, 0], [0, 1]],
        [[0, -1], [1, 0]],
        [[-1, 0], [0, -1]],
        [[0, 1], [-1, 0]],
    ):
        mapping = sector(np.array(turn, dtype=float))
        blocks.append(
            Block((size, size), (-1.0, 0.0), (1.0, 1.0), mapping=mapping, body=body)
        )
    return blocks


def box(size):
    """A floor and two walls, held at the bottom."""
    wide, thick, high = 1.5 * SIZE + 0.5 * GAP, 0.3, 1.2
    n, m = 6 * size, 4 * size
    ends = [(-wide - thick, -wide), (-wide, wide), (wide, wide + thick)]
    floor = [
        Block((cells, size), (a, -thick), (b, 0.0), tags={"bottom": FOOT}, body="box")
        for cells, (a, b) in zip((size, n, size), ends)
    ]
    walls = [
        Block((size, m), (a, 0.0), (b, high), body="box") for a, b in (ends[0], ends[2])
    ]
    return floor + walls


def main(arguments=None):
    """Run the demo; 0 if forces balance."""
    parser = common.options("heap", __doc__)
    parser.add_argument("--size", type=int, default=4, help="cells along a sector")
    parser.add_argument("--steps", type=int, default=6, help="load steps")
    args = parser.parse_args(arguments)
    comm, report = MPI.COMM_WORLD, common.Report(MPI.COMM_WORLD)
    args.output.mkdir(parents=True, exist_ok=True)
    size = args.size * (2 if args.fine else 1)
    blocks = box(size) + [b for k, c in enumerate(CENTRES) for b in disc(c, size, k)]
    mesh, _, tags = assemble_blocks(comm, blocks, "quadrilateral", 2)
    V = tools.vector_space(mesh, 1)
    u = fem.Function(V, name="displacement")
    bcs = [tools.prescribe(V, tags.find(FOOT))]
    top = HEIGHT + RADIUS + GAP
    plate = rigid.Body(rigid.Line((0.0, top), (0.0, -1.0)), name="plate")
    pairs = [("all", "all"), ("all", plate)]
    law = raymortar.Penalty(GAMMA), raymortar.Coulomb(FRICTION)
    contact = raymortar.Contact(u, None, pairs, *law)
    F = bodies.NeoHookean(E, NU).residual(u, 4)
    problem = raymortar.NonlinearProblem(F, contact, bcs)

    def press(t):
        plate.move((0.0, -PUSH * t))

    path = raymortar.LoadSteps(problem.snes_solver, press, args.steps, stabilize=True)
    iterations = [step.iterations for step in path]
    report.effort(contact, iterations, path.halvings)
    for meeting in contact.results.meetings():
        report.say(str(meeting))
    push = contact.results.resultant_on(plate).force[1]
    held = problem.reactions({"foot": bcs})["foot"]
    report.add("force of the plate, of the foot", push, held[1], 1e-8)
    left, right = (contact.resultant(f"body_{k}").force for k in (0, 5))
    report.say(f"outer discs are out of balance by {np.abs([left, right]).max():.1e}")
    mises = bodies.NeoHookean(E, NU).mises(u)
    fields = [u, contact.pressure(), mises]
    io.write_xdmf(args.output / "heap.xdmf", mesh, fields)
    wide = 1.1 * (1.5 * SIZE + 0.3)
    line = (-wide, wide), 2 * (top - PUSH,)
    file = args.output / "heap.png"
    drawing.field_and_tractions(file, contact, mises, "von Mises stress", line)
    return report.finish("expected")


if __name__ == "__main__":
    sys.exit(main())

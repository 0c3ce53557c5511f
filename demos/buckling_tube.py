"""Self-contact: a tube buckles under its ends, and its folds come to lie on each other.

Axisymmetric. The inside and the outside of the wall are one tag, which meets itself. By
symmetry half of the tube folds onto a mirror, which is a rigid line, in the same way.
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
from meshes.meshing import assemble_blocks
from raymortar import io, rigid, tools

# Any consistent units. WAVE: amplitude of two waves of the wall; PUSH: way of the top
E, NU, RADIUS, WALL, LENGTH, WAVE, PUSH = 100.0, 0.4, 1.0, 0.08, 2.0, 0.02, 1.46
FOOT, TOP, SKIN = 1, 2, 3


def section(comm, size, share):
    """A share of the wall in the half plane (r, z), from the foot on. Collective."""

    def mapping(x):
        z = LENGTH * x[:, 1]
        r = RADIUS + 0.5 * WAVE * (1.0 - np.cos(4.0 * np.pi * z / LENGTH))
        return np.column_stack([r + WALL * (x[:, 0] - 0.5), z])

    tags = {"bottom": FOOT, "top": TOP, "left": SKIN, "right": SKIN}
    cells = size, round(96 * size * share)
    block = Block(cells, (0.0, 0.0), (1.0, share), mapping=mapping, tags=tags)
    return assemble_blocks(comm, [block], "quadrilateral", 2)


def fold(comm, size, steps, share=1.0):
    """Move the upper end down, of the tube or of half of it onto a mirror. Collective."""
    mesh, _, tags = section(comm, size, share)
    V = tools.vector_space(mesh, 2)
    u, down = fem.Function(V, name="displacement"), fem.Constant(mesh, 0.0)
    foot = [tools.prescribe(V, tags.find(FOOT))]
    top = [tools.prescribe(V, tags.find(TOP), down, 1)]
    pairs = [("skin", "skin")]
    mirror = rigid.Body(rigid.Line((0.0, 0.5 * LENGTH), (0.0, -1.0)), name="mirror")
    if share == 1.0:
        top += [tools.prescribe(V, tags.find(TOP), component=0)]
    else:
        pairs += [("skin", mirror)]
    law, options = raymortar.Penalty(exact=True), {"axisymmetric": True}
    contact = raymortar.Contact(u, tags, pairs, law, names={"skin": SKIN}, **options)
    F = bodies.NeoHookean(E, NU).turned_residual(u, 4)
    problem = raymortar.NonlinearProblem(F, contact, foot + top)
    history = raymortar.History(problem, reactions={"foot": foot})

    def move(t):
        down.value = -PUSH * share * t
        mirror.move((0.0, -PUSH * share * t))

    path = raymortar.LoadSteps(problem.snes_solver, move, steps, history=history)
    return SimpleNamespace(
        u=u,
        contact=contact,
        iterations=[step.iterations for step in path],
        halvings=path.halvings,
        way=PUSH * np.array(history["time"]),
        force=np.array(history["reaction_foot_y"]),
    )


def draw(found, half, path, parts):
    """The wall before and after, and force over way."""
    figure, (left, right) = drawing.pyplot().subplots(
        1, 2, figsize=(9, 4), layout="constrained"
    )
    x, u = parts
    drawing.draw_field(left, x[..., :2], np.full_like(u[..., :1], np.nan))
    size = np.linalg.norm(u, axis=-1, keepdims=True)
    colours = drawing.draw_field(left, x[..., :2] + u, size)
    left.set(xlabel="r", ylabel="z")
    figure.colorbar(colours, ax=left, label="displacement")
    right.plot(half.way, half.force, color=drawing.EXACT, label="half, on a mirror")
    right.plot(found.way, found.force, "o", color=drawing.COMPUTED, label="tube")
    right.set(xlabel="way of the upper end", ylabel="force")
    right.legend()
    figure.savefig(path)


def main(arguments=None):
    """Run the demo; 0 if both models have the same force."""
    parser = common.options("buckling_tube", __doc__)
    parser.add_argument("--size", type=int, default=1, help="cells through the wall")
    parser.add_argument("--steps", type=int, default=25, help="load steps")
    args = parser.parse_args(arguments)
    comm, report = MPI.COMM_WORLD, common.Report(MPI.COMM_WORLD)
    args.output.mkdir(parents=True, exist_ok=True)
    size = args.size * (1 + args.fine)
    found, half = (fold(comm, size, args.steps, share) for share in (1.0, 0.5))
    report.effort(found.contact, found.iterations, found.halvings)
    report.say(", ".join(map(str, found.contact.results.meetings())))
    peaks = (one.force[one.way < 0.5 * PUSH].max() for one in (found, half))
    report.add("force as it buckles", *peaks, 1e-6)
    report.add("force at the end", found.force[-1], half.force[-1], 0.002)
    depth = 1.0 - found.contact.statistics.min_gap / WALL
    report.add("1 + penetration / wall", depth, 1.0, 0.001)
    mesh, fields = found.u.function_space.mesh, [found.u, found.contact.pressure()]
    io.write_xdmf(args.output / "buckling_tube.xdmf", mesh, fields)
    parts = drawing.gather_cells(mesh, found.u)
    if comm.rank == 0:
        draw(found, half, args.output / "buckling_tube.png", parts)
    return report.finish("half of it")


if __name__ == "__main__":
    sys.exit(main())

"""A round pin that wears flat under a constant load, by implicit steps (2D).

A polymer pin slides on a rigid flat. Archard's wear takes k p per slide, so the worn
volume is k times force times slide, and the flat is as wide as this volume makes it once
it is deeper than the pin yields. Each step wears far deeper than explicit steps may.
"""

import sys

from mpi4py import MPI

import common
import drawing
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import io, rigid, tools

# mm, N; forces per thickness
RADIUS, WIDTH, HEIGHT, E, NU = 10.0, 6.0, 6.0, 2000.0, 0.4
FORCE, WEAR, SLIDE = 20.0, 1e-4, 250.0
TAGS = {"nose": 1, "top": 2}


def scene_of(comm, size):
    """The pin, with `size` cells across."""

    def rounded(x):
        nose = RADIUS - np.sqrt(RADIUS**2 - x[:, 0] ** 2)
        return np.column_stack([x[:, 0], nose + (HEIGHT - nose) * x[:, 1]])

    ends, sides = ((-WIDTH / 2, 0.0), (WIDTH / 2, 1.0)), ("bottom", "top")
    tags = dict(zip(sides, TAGS.values()))
    pin = Block((size, size // 2), *ends, mapping=rounded, tags=tags)
    return Scene(*assemble_blocks(comm, [pin], "quadrilateral"), TAGS)


def half_width(slide):
    """Of the flat of a stiff pin: its segment is the worn volume."""
    return (1.5 * RADIUS * WEAR * FORCE * slide) ** (1.0 / 3.0)


def solve(comm, size, steps, report):
    """Press the flat against the pin and slide; what has worn at each step."""
    scene = scene_of(comm, size)
    mesh, V = scene.mesh, tools.vector_space(scene.mesh, 1)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    strain, one = ufl.sym(ufl.grad(u)), ufl.Identity(2)
    stress = E / (1 + NU) * (strain + NU / (1 - 2 * NU) * ufl.tr(strain) * one)
    F = ufl.inner(stress, ufl.grad(v)) * ufl.dx
    line = rigid.Line((0.0, 0.0), (0.0, 1.0))
    flat = rigid.Body(line, free=("y",), force=(0.0, FORCE))
    at_nodes = raymortar.AugmentedLagrangian(condition="nodes", multiplier="vector")
    pair = TAGS["nose"], flat
    contact = raymortar.Contact(u, scene.facet_tags, [pair], at_nodes)
    wear = raymortar.fluxes.Wear(contact, raymortar.fluxes.Archard(WEAR), implicit=True)
    bcs = [tools.prescribe(V, scene.find("top"))]
    problem = raymortar.NonlinearProblem(F, contact, bcs)
    problem.solve()
    contact.advance()
    rows = []

    def slide(t):
        flat.move((t, 0.0))

    solver, path = problem.snes_solver, (0.0, SLIDE)
    for step in raymortar.LoadSteps(
        solver, slide, steps, path=path, on_accept=wear.accept
    ):
        points = contact.points()
        closed = points["weight"][points["status"] > 1].sum()
        rows.append((step.factor, wear.volume(), 0.5 * comm.allreduce(closed)))
        report.say(
            f"{step.factor:6.1f} mm: {step.iterations:2} iterations, half-width "
            f"{rows[-1][2]:.3f} mm, deepest {wear.depth.x.array.max():.4f} mm"
        )
    return u, contact, wear, np.array(rows)


def main(arguments=None):
    """Run the demo; 0 if volume and width are those of Archard's law."""
    parser = common.options("pin", __doc__)
    parser.add_argument("--size", type=int, default=40, help="cells across the pin")
    parser.add_argument("--steps", type=int, default=25)
    args = parser.parse_args(arguments)
    report = common.Report(MPI.COMM_WORLD)
    args.output.mkdir(parents=True, exist_ok=True)
    size = args.size * (2 if args.fine else 1)
    u, contact, wear, rows = solve(MPI.COMM_WORLD, size, args.steps, report)
    report.add("worn volume", rows[-1, 1], WEAR * FORCE * SLIDE, 1e-3, "mm2")
    report.add("half-width", rows[-1, 2], half_width(SLIDE), 0.1, "mm")
    mesh = u.function_space.mesh
    io.write_xdmf(args.output / "pin.xdmf", mesh, [u, wear.depth, contact.pressure()])
    u.x.array[1::2] += wear.depth.x.array  # what is left
    slide = np.linspace(0.0, SLIDE, 200)
    exact, computed = (slide, half_width(slide), "a stiff pin"), (
        *rows[:, ::2].T,
        "computed",
    )
    axes = {"xlabel": "slide (mm)", "ylabel": "half-width (mm)", "xlim": (0, None)}
    path, label, zoom = args.output / "pin.png", "worn depth (mm)", (-3, 3, -0.1, 2)
    drawing.field_and_curve(path, u, wear.depth, label, exact, computed, axes, zoom)
    return report.finish("wear")


if __name__ == "__main__":
    sys.exit(main())

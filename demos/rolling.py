"""Rolling: a rigid wheel rolls on a layer of rubber (2D, plane strain).

The wheel is a circle without a mesh. A force presses it down, its rotation is prescribed,
and where it gets to is for friction to say: its two translations are free, unknowns of
the coupled system. Without slip it moves by angle times radius.
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
from meshes.meshing import Block, Scene, assemble_blocks
from raymortar import io, rigid, tools

# Any consistent units; forces per thickness
E, NU, FRICTION = 40.0, 0.49, 0.6
RADIUS, FORCE, HEIGHT = 0.2, 0.25, 0.4
START = 0.3
TAGS = {"bottom": 1, "slave": 2}


def layer(comm, length, per_length):
    """Rubber below y = 0. Collective."""
    divisions = round(length * per_length), round(HEIGHT * per_length)
    tags = {"bottom": TAGS["bottom"], "top": TAGS["slave"]}
    block = Block(divisions, (0.0, -HEIGHT), (length, 0.0), tags=tags)
    return Scene(*assemble_blocks(comm, [block], "quadrilateral"), TAGS)


def roll(comm, angle, steps, per_length):
    """Press the wheel down, and turn it by an angle in steps."""
    scene = layer(comm, 2.0 * START + angle * RADIUS, per_length)
    mesh = scene.mesh
    V = tools.vector_space(mesh, 2)
    u = fem.Function(V, name="displacement")
    residual = bodies.NeoHookean(E, NU).residual(u, 4)
    bottom = fem.locate_dofs_topological(
        V, 1, scene.facet_tags.find(scene.tags["bottom"])
    )
    bcs = [fem.dirichletbc(np.zeros(2), bottom, V)]

    wheel = rigid.Body(
        rigid.Circle((START, 1.2 * RADIUS), RADIUS),
        name="wheel",
        free=("x", "y"),
        force=(0.0, -FORCE),
    )
    contact = raymortar.Contact(
        u,
        scene.facet_tags,
        [(TAGS["slave"], wheel)],
        friction=raymortar.Coulomb(FRICTION),
    )
    problem = raymortar.NonlinearProblem(residual, contact, bcs)
    solver = raymortar.SNESSolver(problem)
    history = raymortar.History(problem)
    raymortar.LoadSteps(solver, lambda t: None, 1, history=history).run()

    def turn(t):
        wheel.move(rotation=-angle * t)

    path = raymortar.LoadSteps(solver, turn, steps, history=history, extrapolate=True)
    iterations = [step.iterations for step in path]
    return SimpleNamespace(
        scene=scene,
        u=u,
        wheel=wheel,
        contact=contact,
        history=history,
        iterations=iterations,
    )


def draw(result, cells, path):
    """Deformed layer with the wheel, and its way over the angle."""
    figure, (left, right) = drawing.pyplot().subplots(
        1, 2, figsize=(10.0, 3.6), layout="constrained"
    )
    way = result.history["translation_wheel_x"]
    angle = -result.history["rotation_wheel"]
    x, u = cells
    moved = np.linalg.norm(u, axis=2, keepdims=True)
    colours = drawing.draw_field(left, x[..., :2] + u, moved)
    figure.colorbar(colours, ax=left, label="displacement", shrink=0.6)
    around = np.linspace(0.0, 2.0 * np.pi, 200)
    centre = result.wheel.place[:2]
    ring = centre[:, None] + RADIUS * np.array([np.cos(around), np.sin(around)])
    left.plot(*ring, color=drawing.EXACT)
    left.set(aspect="equal", xlabel="x", ylabel="y")
    left.set(xlim=centre[0] + np.array([-2.0, 2.0]) * RADIUS)
    right.plot(angle, RADIUS * angle, color=drawing.EXACT, label="angle times radius")
    right.plot(
        angle,
        way - way[0],
        "o",
        ms=3.5,
        mfc="none",
        color=drawing.COMPUTED,
        label="way",
    )
    right.set(xlabel="angle [rad]", ylabel="way of the wheel")
    right.legend()
    figure.savefig(path)


def main(arguments=None):
    """Run the demo; 0 if the wheel rolls without slip."""
    parser = common.options("rolling", __doc__)
    parser.add_argument("--angle", type=float, default=0.6, help="radians")
    parser.add_argument(
        "--size", type=int, default=32, help="facets per unit of length"
    )
    args = parser.parse_args(arguments)
    angle = 4.0 * np.pi if args.fine else args.angle
    comm = MPI.COMM_WORLD
    report = common.Report(comm)
    args.output.mkdir(parents=True, exist_ok=True)
    result = roll(comm, angle, max(1, round(10.0 * angle)), args.size)
    report.effort(result.contact, result.iterations)
    way = result.history["translation_wheel_x"]
    report.add("way of the wheel", way[-1] - way[0], angle * RADIUS, 0.01)
    up = result.history["push_wheel_y"][-1]
    report.add("force on the wheel", up, FORCE, 1e-6)
    pressure = result.contact.traction("normal")
    io.write_xdmf(args.output / "rolling.xdmf", result.scene.mesh, [result.u, pressure])
    cells = drawing.gather_cells(result.scene.mesh, result.u)
    if comm.rank == 0:
        draw(result, cells, args.output / "rolling.png")
    return report.finish("rolling")


if __name__ == "__main__":
    sys.exit(main())

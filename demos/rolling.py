"""Rolling: a rigid wheel rolls on a layer of rubber (2D, plane strain).

The wheel is a circle without a mesh. A force presses it down, its rotation is prescribed,
and where it gets to is for friction to say: its two translations are free, unknowns of
the coupled system. Without slip it moves by angle times radius.
"""

import sys

from mpi4py import MPI

import common
import drawing
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import CellType, create_rectangle, locate_entities_boundary, meshtags

import raymortar
from raymortar import io, rigid, tools

# Any consistent units; forces per thickness
E, NU, FRICTION = 40.0, 0.49, 0.6
RADIUS, FORCE, HEIGHT, START = 0.2, 0.25, 0.4, 0.3
SURFACE = 1


def main(arguments=None):
    """Run the demo; 0 if the wheel rolls without slip."""
    parser = common.options("rolling", __doc__)
    parser.add_argument("--angle", type=float, default=0.6, help="radians")
    parser.add_argument("--size", type=int, default=32, help="facets per unit length")
    args = parser.parse_args(arguments)
    angle = 4.0 * np.pi if args.fine else args.angle
    comm = MPI.COMM_WORLD

    # A layer of rubber below y = 0, held at its bottom
    length = 2.0 * START + angle * RADIUS
    corners = [np.array([0.0, -HEIGHT]), np.array([length, 0.0])]
    cells = [round(length * args.size), round(HEIGHT * args.size)]
    mesh = create_rectangle(comm, corners, cells, CellType.quadrilateral)
    top, bottom = (
        locate_entities_boundary(mesh, 1, lambda x: np.isclose(x[1], y))
        for y in (0.0, -HEIGHT)
    )
    facet_tags = meshtags(mesh, 1, np.sort(top), SURFACE)
    V = tools.vector_space(mesh, 2)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    bcs = [tools.prescribe(V, bottom)]

    # Neo-Hookean, almost incompressible
    mu, lmbda = E / (2.0 * (1.0 + NU)), E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU))
    F = ufl.Identity(2) + ufl.grad(u)
    log_J = ufl.ln(ufl.det(F))
    energy = 0.5 * mu * (ufl.inner(F, F) - 2 - 2 * log_J) + 0.5 * lmbda * log_J**2
    residual = ufl.derivative(energy * ufl.dx(degree=4), u, v)

    # The wheel starts above the layer: a first step brings it down by its force
    wheel = rigid.Body(
        rigid.Circle((START, 1.2 * RADIUS), RADIUS),
        name="wheel",
        free=("x", "y"),
        force=(0.0, -FORCE),
    )
    friction = raymortar.Coulomb(FRICTION)
    contact = raymortar.Contact(u, facet_tags, [(SURFACE, wheel)], friction=friction)
    problem = raymortar.NonlinearProblem(residual, contact, bcs)
    history, solver = raymortar.History(problem), problem.snes_solver
    raymortar.LoadSteps(solver, lambda t: None, 1, history=history).run()

    def turn(t):
        wheel.move(rotation=-angle * t)

    steps = max(1, round(10.0 * angle))
    path = raymortar.LoadSteps(solver, turn, steps, history=history, extrapolate=True)
    iterations = [step.iterations for step in path]

    # Way and force against closed forms
    report = common.Report(comm)
    report.effort(contact, iterations)
    way = history["translation_wheel_x"] - history["translation_wheel_x"][0]
    report.add("way of the wheel", way[-1], angle * RADIUS, 0.01)
    report.add("force on the wheel", history["push_wheel_y"][-1], FORCE, 1e-6)

    # A file for ParaView, and a picture
    args.output.mkdir(parents=True, exist_ok=True)
    io.write_xdmf(args.output / "rolling.xdmf", mesh, [u, contact.traction("normal")])
    x, moved = drawing.gather_cells(mesh, u)
    if comm.rank == 0:
        figure, (left, right) = drawing.pyplot().subplots(
            1, 2, figsize=(10.0, 3.6), layout="constrained"
        )
        size = np.linalg.norm(moved, axis=2, keepdims=True)
        colours = drawing.draw_field(left, x[..., :2] + moved, size)
        figure.colorbar(colours, ax=left, label="displacement", shrink=0.6)
        around = np.linspace(0.0, 2.0 * np.pi, 200)
        ring = RADIUS * np.array([np.cos(around), np.sin(around)])
        left.plot(*(ring + wheel.place[:2, None]), color=drawing.EXACT)
        left.set(aspect="equal", xlabel="x", ylabel="y")
        turned = -history["rotation_wheel"]
        style = {"color": drawing.COMPUTED, "ms": 3.5, "mfc": "none", "label": "way"}
        exact = {"color": drawing.EXACT, "label": "angle times radius"}
        right.plot(turned, RADIUS * turned, **exact)
        right.plot(turned, way, "o", **style)
        right.set(xlabel="angle (rad)", ylabel="way of the wheel")
        right.legend()
        figure.savefig(args.output / "rolling.png")
    return report.finish("rolling")


if __name__ == "__main__":
    sys.exit(main())

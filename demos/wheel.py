"""A wheel with an elastic tyre rolls on a road (2D, plane strain, friction).

The rim of the tyre follows a rigid hub by a tie. A force on the hub presses it down,
friction turns it while it is led along the road, and a moment then brakes it.
"""

import sys

from mpi4py import MPI

import common
import drawing
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import locate_entities_boundary, meshtags

import raymortar
from meshes.discs import ring_blocks
from meshes.meshing import assemble_blocks
from raymortar import io, rigid, tools

# Lengths over the radius of the rim; any unit of stress, forces per thickness. A soft
# spring holds the hub before the tyre meets the road
E, NU, FRICTION = 1.0, 0.45, 0.5
INNER, OUTER, FORCE, MOMENT, WAY = 1.0, 2.0, 0.03, 0.01, 0.9
RIM, TYRE, SPRING = 1, 2, 1e-6


def main(arguments=None):
    """Run the demo; 0 if forces and moments are in balance, and the wheel rolls."""
    parser = common.options("wheel", __doc__)
    parser.add_argument("--size", type=int, default=12, help="cells along a quarter")
    args = parser.parse_args(arguments)
    comm, n = MPI.COMM_WORLD, args.size * (2 if args.fine else 1)

    # A ring above the road, whose inner and outer surfaces have tags
    middle = np.array([0.0, OUTER])
    blocks = ring_blocks(n, (INNER, OUTER), n // 2, 1, middle)
    mesh, _, _ = assemble_blocks(comm, blocks, "quadrilateral", 2)
    share = 0.5 * (INNER + OUTER)

    def side(is_inner):
        return lambda x: (np.hypot(x[0], x[1] - OUTER) < share) == is_inner

    rim, tyre = (locate_entities_boundary(mesh, 1, side(k)) for k in (True, False))
    facets = np.concatenate([rim, tyre])
    values = np.repeat(np.array([RIM, TYRE], np.int32), [len(rim), len(tyre)])
    facet_tags = meshtags(mesh, 1, np.sort(facets), values[np.argsort(facets)])

    # Neo-Hookean rubber
    V = tools.vector_space(mesh, 2)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    mu, lmbda = E / (2.0 * (1.0 + NU)), E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU))
    F = ufl.Identity(2) + ufl.grad(u)
    log_J = ufl.ln(ufl.det(F))
    density = 0.5 * mu * (ufl.inner(F, F) - 2 - 2 * log_J) + 0.5 * lmbda * log_J**2
    residual = ufl.derivative(density * ufl.dx(degree=4), u, v)

    # The hub is a frame without a surface; its height and rotation are free
    free = dict(free=("y", "r"), stiffness={"y": SPRING})
    hub = rigid.Body(rigid.Frame(middle), name="hub", **free)
    tie = raymortar.Tie(u, facet_tags, [(RIM, hub)])
    road = rigid.Body(rigid.Line((0.0, 0.0), (0.0, 1.0)), name="road")
    friction = raymortar.Coulomb(FRICTION)
    contact = raymortar.Contact(u, facet_tags, [(TYRE, road)], friction=friction)
    problem = raymortar.NonlinearProblem(residual, [tie, contact], [])
    history = raymortar.History(problem)

    def press(t):
        hub.force = (0.0, -FORCE * t)

    def roll(t):
        hub.move((WAY * t, 0.0))

    def brake(t):
        hub.moment = MOMENT * t

    path = []
    for apply, steps in (press, 3), (roll, 9), (brake, 3):
        steps = raymortar.LoadSteps(problem.snes_solver, apply, steps, history=history)
        path += [step.iterations for step in steps]

    # Road and hub carry the load; forces of the road turn the hub as its moment says
    report = common.Report(comm)
    report.effort(problem.contact, path)
    load = FORCE + SPRING * history["translation_hub_y"][-1]
    report.add("force on the road", -history["push_road_y"][-1], load, 1e-9)
    report.add("force on the hub", history["push_hub_y"][-1], load, 1e-9)
    report.add("moment on the hub, braked", -history["moment_hub"][-1], MOMENT, 1e-9)
    (x, y), arm = (history[f"push_road_{k}"][-1] for k in "xy"), hub.place[:2]
    taken = history["moment_road"][-1] + arm[1] * x - arm[0] * y
    report.add("moment of the road about it", taken, MOMENT, 1e-9)
    way, turned = history["translation_hub_x"], -history["rotation_hub"]
    report.add("angle after rolling", turned[11], WAY / OUTER, 0.005)

    # A file for ParaView, and a picture
    args.output.mkdir(parents=True, exist_ok=True)
    energy = tools.nodal_field(density, mesh, "stored energy", quadrature_degree=4)
    io.write_xdmf(args.output / "wheel.xdmf", mesh, [u, energy, *contact.fields()])
    at, moved, values = drawing.gather_cells(mesh, u, energy)
    if comm.rank == 0:
        figure, (left, right) = drawing.pyplot().subplots(
            1, 2, figsize=(10.0, 3.8), layout="constrained"
        )
        colours = drawing.draw_field(left, at[..., :2] + moved, values)
        figure.colorbar(colours, ax=left, label="stored energy density", shrink=0.8)
        left.axhline(0.0, color=drawing.EXACT)
        spoke = INNER * np.array([np.sin(turned[-1]), np.cos(turned[-1])])
        left.plot(*np.stack([arm - spoke, arm + spoke], axis=1), color=drawing.EXACT)
        left.set(aspect="equal", xlabel="x", ylabel="y")
        exact, found = (way, way / OUTER, "way over radius"), (way, turned, "hub")
        right.set(xlabel="way of the hub", ylabel="angle (rad)")
        drawing.beside(right, exact, found)
        figure.savefig(args.output / "wheel.png")
    return report.finish("balance")


if __name__ == "__main__":
    sys.exit(main())

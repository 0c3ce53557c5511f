"""Press fit: a soft block is pushed into a channel that narrows (2D, plane strain).

The block overlaps the walls by 1 mm when the path begins, slides by more than twice
its length with Coulomb friction, and loses a quarter of its height on the way. The
data are those of Fischer and Wriggers (2006), who give the force as a curve only: it
rises while the block enters, and falls to a plateau when all of it is in the narrow
part. There the walls are parallel, so that friction carries mu times what presses.
"""

import sys

from mpi4py import MPI

import common
import drawing
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.channel import scene_of
from raymortar import io, tools

# Stresses in MPa, lengths in mm, forces in N per mm of thickness
E_BLOCK, E_WALL, NU, FRICTION, PUSH = 689.6, 6896.0, 0.32, 0.1, 1000.0
# Points hop between stick and slip where the wall bends
OPTIONS = {"snes_linesearch_type": "l2", "snes_max_it": 40}


def draw(states, way, push, limit, file):
    """The block on its way, and the forces of both halves along it."""
    places = [[name, "forces"] for name in "012"]
    look = {"figsize": (11, 4.8), "layout": "constrained"}
    figure, panels = drawing.pyplot().subplot_mosaic(places, **look)
    for axes, (moved, _, (x, u, mises)) in zip(map(panels.get, "012"), states):
        at, images = x[..., :2] + u, [(1, 1), (1, -1)]
        colours = drawing.draw_field(axes, at, mises, images, top=300.0)
        axes.set_title(f"pushed by {moved:.0f} mm", loc="left")
        axes.axis("off")
    axes = panels.pop("forces")
    label = "von Mises stress (MPa)"
    figure.colorbar(colours, ax=[*panels.values()], label=label, shrink=0.7)
    axes.plot(way, 2e-3 * push, color=drawing.COMPUTED, label="push")
    axes.plot(way, 2e-3 * limit, "--", color=drawing.EXACT, label="friction's limit")
    axes.set(xlabel="push (mm)", ylabel="force of both halves (kN/mm)")
    axes.set(xlim=(0.0, PUSH), ylim=(0.0, 35.0))
    axes.legend(loc="lower right")
    figure.savefig(file.with_suffix(".png"))


def main(arguments=None):
    """Run the demo; 0 if forces balance and friction carries what it can."""
    parser = common.options("press_fit", __doc__)
    parser.add_argument("--size", type=int, default=12, help="cells over half a height")
    parser.add_argument("--steps", type=int, default=50)
    args = parser.parse_args(arguments)
    comm, more = MPI.COMM_WORLD, 2 if args.fine else 1
    args.output.mkdir(parents=True, exist_ok=True)

    # Neo-Hookean, plane strain
    scene = scene_of(comm, args.size * more)
    mesh, V = scene.mesh, tools.vector_space(scene.mesh, 1)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    moduli = {"block": E_BLOCK, "channel": E_WALL}
    E, I = tools.by_body(mesh, scene.cell_tags, moduli, scene.bodies), ufl.Identity(3)
    mu, lmbda = E / (2.0 * (1.0 + NU)), E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU))
    H = ufl.grad(u)
    F = I + ufl.as_tensor([[H[0, 0], H[0, 1], 0], [H[1, 0], H[1, 1], 0], [0, 0, 0]])
    J = ufl.det(F)
    energy = mu * (ufl.inner(F, F) - 3 - 2 * ufl.ln(J)) + lmbda * ufl.ln(J) ** 2
    residual = ufl.derivative(0.5 * energy * ufl.dx(degree=2), u, v)
    stress = tools.von_mises(mu / J * (F * F.T - I) + lmbda * ufl.ln(J) / J * I)
    pushed = fem.Constant(mesh, 0.0)
    support = tools.prescribe(V, scene.find("outside"))
    bcs = [tools.prescribe(V, scene.find("pushed"), pushed, 0), support]
    bcs.append(tools.prescribe(V, scene.find("symmetry"), component=1))

    pair, law = (scene.tags["slave"], scene.tags["master"]), raymortar.Coulomb(FRICTION)
    contact = raymortar.Contact(u, scene.facet_tags, [pair], friction=law)
    problem = raymortar.NonlinearProblem(residual, contact, bcs)
    solver = raymortar.SNESSolver(problem, OPTIONS)
    # The overlap is pushed out first, with the block held where it is
    solver.solve()
    contact.advance()
    file = args.output / "press_fit.csv"
    history = raymortar.History(problem, file, {"support": support})
    history.record(0.0)

    def push(factor):
        pushed.value = PUSH * factor

    def state():
        mises = tools.nodal_field(stress, mesh, "mises", quadrature_degree=2)
        return float(pushed.value), mises, drawing.gather_cells(mesh, u, mises)

    states = [state()]
    path = raymortar.LoadSteps(solver, push, args.steps * more, history=history)
    for step in path:
        if step.factor >= (0.45, 1.0)[min(len(states) - 1, 1)] - 1e-9:
            states.append(state())
    fields = [u, contact.multiplier, states[-1][1]]
    io.write_xdmf(file.with_suffix(".xdmf"), mesh, fields)

    # Balance of push and support; friction's limit at the end
    report, H = common.Report(comm), -history["force_0_x"]
    report.effort(contact, history["iterations"], path.halvings)
    off = np.abs(H + history["reaction_support_x"]).max() / H.max()
    report.add("1 + push - support of the wall", 1.0 + off, 1.0, 1e-7)
    parts = map(history.vectors, ("normal_0", "tangential_0"))
    normal, along = (np.linalg.norm(part, axis=1) for part in parts)
    report.add("friction at the end", along[-1], FRICTION * normal[-1], 0.02, "N/mm")
    report.add("push at the end", H[-1], FRICTION * normal[-1], 0.05, "N/mm")
    report.add("largest push", H.max(), FRICTION * normal[-1], unit="N/mm")
    if comm.rank == 0:
        draw(states, PUSH * history["time"], H, FRICTION * normal, file)
    return report.finish("limit")


if __name__ == "__main__":
    sys.exit(main())

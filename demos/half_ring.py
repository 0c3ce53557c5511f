"""Half ring on a block: large sliding with friction, and lift-off (2D).

The ends of an elastic half ring, stiff inside and soft outside, are pushed towards
an elastic block. The ring flattens, slides along the block by a multiple of its
facets, and buckles: its middle comes off the block again. Data of code_aster's
SSNP165, after Yastrebov, and Poulios and Renard (2015), but for the law, which is
neo-Hookean here.
"""

import sys
from functools import partial

from mpi4py import MPI

import common
import drawing
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.half_ring import GAP, MIDDLE, OUTER, scene_of
from raymortar import io, tools

# Lengths in mm, moduli in MPa
E_INNER, E_OUTER, E_BLOCK, NU, PUSH, FRICTION = 1e5, 1e3, 300.0, 0.3, 90.0, 0.5
# Displacement of the block's middle by code_aster, for logarithmic elasticity
TIMES = (0.4, 0.6, 0.8, 0.9, 1.0)
CODE_ASTER = (-2.2315, -0.6803, 0.6690, 1.0114, 1.3408)


def draw(states, t, middle, path):
    """The ring at some load factors, and the middle of the block over all of them."""
    from matplotlib.colors import LogNorm

    look = {"figsize": (10, 6.4), "layout": "constrained"}
    figure, panels = drawing.pyplot().subplots(2, 2, **look)
    for axes, (factor, (x, u, mises)) in zip(panels.flat, states):
        # The stress spans decades between the layers
        at, mises = x[..., :2] + u, np.maximum(mises, 1.0)
        colours = drawing.draw_field(axes, at, mises, norm=LogNorm(1.0, 1e4))
        axes.set(xlim=(-135, 135), ylim=(-55, 125), title=f"t = {factor:.2f}")
        axes.axis("off")
    label = "von Mises stress (MPa)"
    figure.colorbar(colours, ax=panels[:, 0], label=label, shrink=0.7)
    axes = panels[1, 1]
    axes.plot(t, middle, color=drawing.COMPUTED, label="raymortar")
    axes.plot(TIMES, CODE_ASTER, "o", color=drawing.EXACT, label="code_aster")
    axes.set(xlabel="load factor t", ylabel="middle of the block, u_y (mm)")
    axes.legend(loc="upper left")
    figure.savefig(path)


def main(arguments=None):
    """Run the demo; 0 if it agrees with code_aster."""
    parser = common.options("half_ring", __doc__)
    parser.add_argument("--size", type=int, default=32, help="cells along the ring")
    parser.add_argument("--steps", type=int, default=50)
    args = parser.parse_args(arguments)
    comm, size = MPI.COMM_WORLD, args.size * (2 if args.fine else 1)
    args.output.mkdir(parents=True, exist_ok=True)

    scene = scene_of(comm, size)
    mesh, V = scene.mesh, tools.vector_space(scene.mesh, 2)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)

    x = ufl.SpatialCoordinate(mesh)
    r = ufl.sqrt(x[0] ** 2 + (x[1] - OUTER - GAP) ** 2)
    E = ufl.conditional(r < MIDDLE, E_INNER, E_OUTER)
    E = ufl.conditional(x[1] < 0, E_BLOCK, E)
    mu, lmbda = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
    H = ufl.grad(u)
    I = ufl.Identity(3)
    F = I + ufl.as_tensor([[H[0, 0], H[0, 1], 0], [H[1, 0], H[1, 1], 0], [0, 0, 0]])
    J = ufl.det(F)
    energy = mu * (ufl.inner(F, F) - 3 - 2 * ufl.ln(J)) + lmbda * ufl.ln(J) ** 2
    residual = ufl.derivative(0.5 * energy * ufl.dx(degree=4), u, v)
    stress = tools.von_mises(mu / J * (F * F.T - I) + lmbda * ufl.ln(J) / J * I)

    ends = fem.Constant(mesh, (0.0, 0.0))
    bcs = [tools.prescribe(V, scene.find("bottom"))]
    bcs.append(tools.prescribe(V, scene.find("ends"), ends))
    pair, law = (scene.tags["slave"], scene.tags["master"]), raymortar.Coulomb(FRICTION)
    contact = raymortar.Contact(u, scene.facet_tags, [pair], friction=law)
    problem = raymortar.NonlinearProblem(residual, contact, bcs)
    # Residuals go up and down where points hop between stick and slip
    solver = raymortar.SNESSolver(problem, {"snes_linesearch_type": "l2"})
    file = args.output / "half_ring.csv"
    middle = partial(common.value_at_origin, u, scene, "master")
    more = {f"middle_{x}": partial(middle, k) for k, x in enumerate("xy")}
    history = raymortar.History(problem, file, more=more)

    def push(t):
        ends.value[1] = -PUSH * t

    states, keep = [], [0.3, 0.7, 1.0]
    path = raymortar.LoadSteps(solver, push, args.steps, history=history)
    for step in path:
        if step.factor >= keep[0] - 1e-9:
            mises = tools.nodal_field(stress, mesh, "mises", quadrature_degree=2)
            states.append((keep.pop(0), drawing.gather_cells(mesh, u, mises)))
    io.write_xdmf(file.with_suffix(".xdmf"), mesh, [u, contact.multiplier, mises])

    report, t, below = common.Report(comm), history["time"], history["middle_y"]
    report.effort(contact, history["iterations"], path.halvings)
    report.say("Against code_aster, another law and mesh:")
    aside = np.abs(history["middle_x"]).max()
    report.say(f"displacement of the middle to the side: {aside:.1e} mm")
    for at, ours, theirs in zip(TIMES, np.interp(TIMES, t, below), CODE_ASTER):
        report.add(f"middle of the block at t = {at}", ours, theirs, 0.08, "mm")
    if comm.rank == 0:
        draw(states, t, below, file.with_suffix(".png"))
    return int(report.finish("code_aster") or aside > 1e-8 * OUTER)


if __name__ == "__main__":
    sys.exit(main())

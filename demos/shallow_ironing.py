"""Shallow ironing: a stiff indenter is pressed into a soft block and dragged along.

Large sliding with Coulomb friction (2D, plane strain, finite strain), the problem of
Fischer and Wriggers (2006). The reactions on the indenter are drawn beside those of the
same method in code_aster (its test SSNP153b), and compared with them on its mesh, ``--fine``.
"""

import sys

from mpi4py import MPI

import common
import drawing
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.ironing import scene_of
from raymortar import io, tools

# Lengths in mm, stresses in MPa, forces in N per mm of thickness
E_INDENTER, E_BLOCK, NU, FRICTION, PRESSED, SLID = 6896.0, 689.6, 0.32, 0.3, 1.0, 10.0
# In MPa/mm; from 300 to 30000 forces change by less than 0.5 %
GAMMA = 1000.0
# Reactions of code_aster, vertical and horizontal: (time, force)
V_ASTER = (0.5, 93.863), (1.0, 330.67), (1.1, 402.763), (1.2, 416.287)
H_ASTER = (1.0, 63.646), (1.1, 126.993), (1.2, 127.587)


def main(arguments=None):
    """Run the demo; 0 if forces balance, and on the fine mesh agree with code_aster."""
    parser = common.options("shallow_ironing", __doc__)
    parser.add_argument("--size", type=int, help="block's elements along (60, 120)")
    parser.add_argument("--until", type=float, default=2.0, help="last time, 1.2 to 2")
    args = parser.parse_args(arguments)
    comm, size = MPI.COMM_WORLD, args.size or (120 if args.fine else 60)
    press, slide = (2, 120) if args.fine else (10, 100)
    args.output.mkdir(parents=True, exist_ok=True)

    # code_aster's law of Simo and Miehe without yield
    scene = scene_of(comm, size)
    mesh, V = scene.mesh, tools.vector_space(scene.mesh, 1)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    E = tools.by_body(mesh, scene.cell_tags, {1: E_BLOCK, 2: E_INDENTER})
    mu, K, H = E / (2 * (1 + NU)), E / (3 * (1 - 2 * NU)), ufl.grad(u)
    H = ufl.as_tensor([[H[0, 0], H[0, 1], 0], [H[1, 0], H[1, 1], 0], [0, 0, 0]])
    F = ufl.Identity(3) + H
    J, F_inv_T = ufl.det(F), ufl.inv(F).T
    P = mu * J ** (-2 / 3) * (F - ufl.inner(F, F) / 3 * F_inv_T)
    P = P + K / 2 * (J**2 - 1) * F_inv_T
    in_plane = ufl.as_tensor([[P[i, j] for j in range(2)] for i in range(2)])
    residual = ufl.inner(in_plane, ufl.grad(v)) * ufl.dx(degree=2)

    motion = fem.Constant(mesh, (0.0, 0.0))
    top = tools.prescribe(V, scene.find("top"), motion)
    bcs = [tools.prescribe(V, scene.find("bottom")), top]
    pair, law = (scene.tags["slave"], scene.tags["master"]), raymortar.Coulomb(FRICTION)
    contact = raymortar.Contact(
        u, scene.facet_tags, [pair], raymortar.AugmentedLagrangian(GAMMA), law,
        # Many points on a segment, some of which the edge of the contact cuts, and a
        # search as deep as the first iterate of a large step
        quadrature_degree=9, search=raymortar.Search(reach=1.0, depth=1.0),
    )  # fmt: skip
    problem = raymortar.NonlinearProblem(residual, contact, bcs)
    # Extrapolated steps start from small residuals
    solver = raymortar.SNESSolver(problem, {"snes_atol": 1e-10 * E_BLOCK})
    file = args.output / "shallow_ironing.csv"
    history, halvings = raymortar.History(problem, file, {"top": top}), 0

    def move(t):
        motion.value[:] = (SLID * max(t - 1.0, 0.0), -PRESSED * min(t, 1.0))

    for begin, end, rate in ((0.0, 1.0, press), (1.0, args.until, slide)):
        steps, options = round(rate * (end - begin)), {"extrapolate": True}
        options |= {"path": (begin, end), "history": history}
        path = raymortar.LoadSteps(solver, move, steps, **options)
        path.run()
        halvings += path.halvings

    t, V, H = history["time"], -history["reaction_top_y"], history["reaction_top_x"]
    force = np.array([history["force_0_y"], -history["force_0_x"]])
    report = common.Report(comm)
    report.effort(contact, history["iterations"], halvings)
    off = np.abs(force - [V, H]).max() / np.abs(force).max()
    report.add("contact force / reaction", 1.0 + off, 1.0, 1e-7)
    # Away from the free ends
    inner = np.argmin(np.abs(t - min(args.until, 1.7)))
    ratio = 1.0 + H[inner] / V[inner] - FRICTION
    report.add(f"1 + H / V - mu at {t[inner]:.4g}", ratio, 1.0, 0.1 * FRICTION)
    allowed = 0.005 if size >= 120 else None
    curves = ("V", V, V_ASTER), ("H", H, H_ASTER)
    for name, found, known in curves:
        for at, value in known:
            report.add(f"{name}({at})", np.interp(at, t, found), value, allowed, "N/mm")

    mises = tools.von_mises(P * F.T / J)
    mises = tools.nodal_field(mises, mesh, "von Mises stress", quadrature_degree=2)
    io.write_xdmf(file.with_suffix(".xdmf"), mesh, [u, mises, contact.traction()])
    x, moved, values = drawing.gather_cells(mesh, u, mises)
    if comm.rank == 0:
        look = {"figsize": (10, 5.5), "layout": "constrained"}
        places = [["bodies"] * 2, ["V", "H"]]
        figure, panels = drawing.pyplot().subplot_mosaic(places, **look)
        axes, top = panels["bodies"], np.quantile(values, 0.995)
        colours = drawing.draw_field(axes, x[..., :2] + moved, values, top=top)
        axes.axis("off")
        figure.colorbar(colours, ax=axes, label="von Mises stress (MPa)")
        for name, found, known in curves:
            one = panels[name]
            one.plot(t, found, color=drawing.COMPUTED, label="raymortar")
            one.plot(*zip(*known), "o", color=drawing.EXACT, label="code_aster")
            one.set(xlabel="time", ylabel=f"reaction {name} (N/mm)", ylim=(0, None))
        panels["H"].legend()
        figure.savefig(file.with_suffix(".png"))
    return report.finish("reference")


if __name__ == "__main__":
    sys.exit(main())

"""Ironing in 3D: a stiff half pipe is pressed into a slab and dragged along it.

The geometry of Puso and Laursen (2004): a slab of 9 x 4 x 3, a die of radius 3,
thickness 0.2 and length 5.2 that reaches over both sides of the slab, pushed down by
1.4 and then along by 4. One half of the symmetric scene is meshed. No numbers are
published: forces must balance, and friction must carry what Coulomb's law says. The
slide begins as far from one end of the slab as it ends from the other, so that without
friction (``--friction 0``) the forces at both must be mirror images of each other.
"""

import sys
from types import SimpleNamespace

from mpi4py import MPI

import bodies
import common
import drawing
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.half_pipe import scene_of
from raymortar import io, tools

DOWN, ALONG = 1.4, 4.0
E_SLAB, E_DIE, NU, FRICTION = 1.0, 1000.0, 0.3, 0.3
OPTIONS = {"snes_linesearch_type": "l2", "snes_max_it": 40}


def solve(comm, size=4, steps=(10, 20), friction=FRICTION, file=None):
    """Press, then slide; forces on the slab at each accepted step."""
    scene = scene_of(comm, size)
    mesh, V = scene.mesh, tools.vector_space(scene.mesh, 1)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    moduli = {"slab": E_SLAB, "die": E_DIE}
    E, I = tools.by_body(mesh, scene.cell_tags, moduli, scene.bodies), ufl.Identity(3)
    mu, lmbda = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
    F = I + ufl.grad(u)
    J = ufl.det(F)
    energy = mu * (ufl.inner(F, F) - 3 - 2 * ufl.ln(J)) + lmbda * ufl.ln(J) ** 2
    residual = ufl.derivative(0.5 * energy * ufl.dx(degree=2), u, v)
    stress = tools.von_mises(mu / J * (F * F.T - I) + lmbda * ufl.ln(J) / J * I)

    down, along = (fem.Constant(mesh, 0.0) for _ in range(2))
    support = tools.prescribe(V, scene.find("bottom"))
    bcs = [support, tools.prescribe(V, scene.find("symmetry"), component=1)]
    bcs.append(tools.prescribe(V, scene.find("grips"), along, 0))
    bcs.append(tools.prescribe(V, scene.find("grips"), down, 2))
    contact = raymortar.Contact(
        u, scene.facet_tags, [("slave", "master")], names=scene.tags,
        friction=raymortar.Coulomb(friction) if friction else None,
        search=raymortar.Search(reach=1.0, depth=1.0),
    )  # fmt: skip
    problem = raymortar.NonlinearProblem(residual, contact, bcs)
    solver = raymortar.SNESSolver(problem, OPTIONS)
    # What friction would carry with a coefficient of 1, and what it carries
    more = {"normal": lambda: bodies.sliding(contact, 0)[0]}
    more["along"] = lambda: bodies.sliding(contact, 0)[1]
    history = raymortar.History(problem, file, {"bottom": support}, more=more)

    def move(t):
        down.value, along.value = -DOWN * min(t, 1.0), ALONG * max(t - 1.0, 0.0)

    for n, ends in zip(steps, ((0.0, 1.0), (1.0, 2.0))):
        raymortar.LoadSteps(solver, move, n, path=ends, history=history).run()
    found = SimpleNamespace(u=u, contact=contact, stress=stress, history=history)
    found.iterations = history["iterations"]
    return found


def main(arguments=None):
    """Run the demo; 0 if forces balance and friction carries what it can."""
    parser = common.options("ironing_3d", __doc__)
    parser.add_argument("--size", type=int, default=4, help="cells over half the width")
    parser.add_argument("--steps", type=int, default=20, help="of the slide")
    parser.add_argument("--friction", type=float, default=FRICTION, help="0: none")
    args = parser.parse_args(arguments)
    comm, factor = MPI.COMM_WORLD, 2 if args.fine else 1
    steps = (max(args.steps * factor // 2, 1), args.steps * factor)
    args.output.mkdir(parents=True, exist_ok=True)
    file = args.output / "ironing_3d.csv"
    found = solve(comm, args.size * factor, steps, args.friction, file)

    report, history, u = common.Report(comm), found.history, found.u
    report.effort(found.contact, found.iterations)
    force = history.vectors("force_slave_master")
    off = np.abs(force + history.vectors("reaction_bottom"))[:, [0, 2]].max()
    off /= np.abs(force[:, 2]).max()
    report.add("1 + contact force - support", 1.0 + off, 1.0, 1e-7)
    if args.friction:
        limit = args.friction * history["normal"][-1]
        report.add("friction at the end", history["along"][-1], limit, 0.02)
    else:
        # The slide ends where the scene is the mirror image of its beginning
        first, last = force[steps[0] - 1], force[-1]
        report.add("H, end of the slide", -last[0], first[0], 1e-6)
        report.add("V, end of the slide", last[2], first[2], 1e-6)

    mesh = u.function_space.mesh
    mises = tools.nodal_field(found.stress, mesh, "mises", quadrature_degree=2)
    io.write_xdmf(file.with_suffix(".xdmf"), mesh, [u, found.contact.multiplier, mises])
    x, moved, values = drawing.gather_boundary(mesh, u, mises)
    if comm.rank == 0:
        # The plane of symmetry, and the forces on the whole slab
        cut = np.abs(x[..., 1]).max(axis=1) < 1e-9
        t, at = history["time"], (x + moved)[cut][..., [0, 2]]
        curves = (t, -2.0 * force[:, 2], "down"), (t, 2.0 * force[:, 0], "along")
        axes = {
            "xlabel": "pressed until 1, then dragged",
            "ylabel": "force on the slab",
        }
        parts = at, values[cut], "von Mises stress", *curves, axes | {"size": 3}
        drawing.polygons_and_curve(file.with_suffix(".png"), *parts)
    return report.finish("balance")


if __name__ == "__main__":
    sys.exit(main())

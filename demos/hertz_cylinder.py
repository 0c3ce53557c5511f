"""Hertz: an elastic cylinder pressed on an elastic block (2D, plane strain).

One half of the symmetric scene is meshed. The contact pressure and the half-width
are compared with Hertz's formulas for the force that was found.
"""

import sys

from mpi4py import MPI

import common
import drawing
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.scenes import cylinder_on_block
from raymortar import io, tools

# Steel on aluminium. Lengths in mm, stresses in MPa, forces in N per mm of length
E_CYLINDER, E_BLOCK, NU = 210e3, 70e3, 0.3
RADIUS, BLOCK, HALF_WIDTH = 10.0, (60.0, 30.0), 0.4
E_STAR = 1.0 / ((1.0 - NU**2) * (1.0 / E_CYLINDER + 1.0 / E_BLOCK))
# Displacement of the cylinder's cut that makes about this half-width (Johnson 1985, 5.6)
FORCE = np.pi * E_STAR * HALF_WIDTH**2 / (4.0 * RADIUS)
OF_CYLINDER = (2.0 * np.log(4.0 * RADIUS / HALF_WIDTH) - 1.0) / E_CYLINDER
OF_BLOCK = (2.0 * np.log(2.0 * BLOCK[1] / HALF_WIDTH) - NU / (1.0 - NU)) / E_BLOCK
PUSH = FORCE * (1.0 - NU**2) / np.pi * (OF_CYLINDER + OF_BLOCK)


def strain(w):
    """Plane strain, 3 x 3."""
    e = ufl.sym(ufl.grad(w))
    return ufl.as_tensor([[e[0, 0], e[0, 1], 0], [e[1, 0], e[1, 1], 0], [0, 0, 0]])


def main(arguments=None):
    """Run the demo; 0 if it agrees with Hertz."""
    parser = common.options("hertz_cylinder", __doc__)
    parser.add_argument("--size", type=int, default=20, help="facets across")
    parser.add_argument("--degree", type=int, choices=(1, 2), default=1)
    args = parser.parse_args(arguments)
    comm, size = MPI.COMM_WORLD, args.size * (2 if args.fine else 1)
    args.output.mkdir(parents=True, exist_ok=True)

    # The slave, the cylinder, has the larger facets: a finer one would feel the edges of
    # the block's, and pressures at its nodes would zigzag by 7 % of the peak
    scene = cylinder_on_block(
        comm, geometry_degree=args.degree, radius=RADIUS, block_size=BLOCK,
        contact_half_width=HALF_WIDTH, facets_across=size, master_ratio=0.8, growth=1.2,
    )  # fmt: skip
    mesh, V = scene.mesh, tools.vector_space(scene.mesh, args.degree)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    moduli = {"upper": E_CYLINDER, "lower": E_BLOCK}
    E = tools.by_body(mesh, scene.cell_tags, moduli, scene.bodies)
    mu, lmbda = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
    stress = 2 * mu * strain(u) + lmbda * ufl.div(u) * ufl.Identity(3)
    residual = ufl.inner(stress, strain(v)) * ufl.dx

    top = fem.Constant(mesh, 0.0)
    bcs = [tools.prescribe(V, scene.find("symmetry_x"), component=0)]
    bcs += [tools.prescribe(V, scene.find("bottom"))]
    bcs += [tools.prescribe(V, scene.find("top"), top, 1)]
    pair = scene.tags["slave"], scene.tags["master"]
    contact = raymortar.Contact(u, scene.facet_tags, [pair], smooth=True)
    problem = raymortar.NonlinearProblem(residual, contact, bcs)

    def press(factor):
        # The square, so that the contact grows evenly from step to step
        top.value = -(factor**2) * PUSH

    solver = raymortar.SNESSolver(problem)
    steps = raymortar.LoadSteps(solver, press, steps=4).run()

    # Hertz for twice the force: half of the scene is meshed
    force = 2.0 * contact.resultant(0).force[1]
    a = np.sqrt(4.0 * force * RADIUS / (np.pi * E_STAR))
    p0 = 2.0 * force / (np.pi * a)
    pressure = common.pressure_field(contact)
    peak = comm.allreduce(pressure.x.array.max(initial=0.0), op=MPI.MAX)
    # The second moment of Hertz's pressure is force times a^2 / 4
    ds = ufl.Measure("ds", mesh, subdomain_data=scene.facet_tags)(pair[0])
    x = ufl.SpatialCoordinate(mesh)[0]
    moment, total = (tools.integral(pressure * f * ds, mesh) for f in (x**2, 1))
    points = contact.points()
    closed = points["x"][points["status"] >= 2, 0].max(initial=0.0)

    report = common.Report(comm)
    report.effort(contact)
    report.newton("load steps", [s.iterations for s in steps], list(problem.history))
    report.add("peak pressure", peak, p0, 0.03, "MPa")
    half_width = 2.0 * np.sqrt(moment / total)
    report.add("half-width (second moment)", half_width, a, 0.03, "mm")
    edge = comm.allreduce(closed, op=MPI.MAX)  # known to one facet only
    report.add("edge of the contact", edge, a, 2.0 / size, "mm")

    # The stress in both halves, and the pressure at the nodes on Hertz's half ellipse
    mises = tools.nodal_field(tools.von_mises(stress), mesh, "von Mises stress")
    file = args.output / "hertz_cylinder"
    io.write_xdmf(file.with_suffix(".xdmf"), mesh, [u, pressure, mises])
    at, p = common.gather_nodes(pressure, scene)
    s = a * np.sin(np.linspace(0.0, 0.5 * np.pi, 200))
    hertz = s, p0 * np.sqrt(1.0 - (s / a) ** 2), "Hertz"
    if comm.rank == 0:
        near = at[:, 0] < 1.6 * a
        at, p = at[near, 0], p[near, 0]
    axes = {"xlabel": "x (mm)", "ylabel": "contact pressure (MPa)"}
    drawing.field_and_curve(
        file.with_suffix(".png"), u, mises, "von Mises stress (MPa)", hertz,
        (at, p, "raymortar, at the nodes"), axes, (-3 * a, 3 * a, -3 * a, 3 * a), [-1, 1],
    )  # fmt: skip
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())

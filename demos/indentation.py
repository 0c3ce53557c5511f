"""Indentation: a rigid ball and a rigid cone press an elastic half-space (3D, a quarter).

The tools are analytic: no mesh, no tags. Closed forms, for small strains: Hertz's
extension to a true ball (Sneddon 1965) and Sneddon's blunt cone. The half-space is a
box of two hundred contact radii, held at its far sides.
"""

import sys
from types import SimpleNamespace

from mpi4py import MPI

import common
import drawing
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.blocks import mirrored
from meshes.graded import PoleGrid, box_blocks
from meshes.meshing import Scene, assemble_blocks
from raymortar import io, rigid, tools

# Any consistent units: radius R of the ball and a of the contact, slope of the cone
E, NU, R, a, SLOPE = 1000.0, 0.3, 1.0, 0.04, np.tan(np.radians(1.5))
E_STAR, LOG = E / (1.0 - NU**2), np.log((R + a) / (R - a))
TAGS = {"slave": 1, "bottom": 2, "symmetry_x": 3, "symmetry_y": 4, "side": 5}
# Where the contact has its radius: depth, force, pressure at r
TOOLS = {
    "ball": SimpleNamespace(
        shape=rigid.Sphere((0.0, 0.0, R), R),
        depth=0.5 * a * LOG,
        force=E_STAR * (0.5 * (R**2 + a**2) * LOG - a * R),
        # Of the paraboloid, which differs by (a / R)^2 / 8
        pressure=lambda r: 2.0 * E_STAR / (np.pi * R) * np.sqrt(a**2 - r**2),
    ),
    "cone": SimpleNamespace(
        shape=rigid.Cone(
            (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.5 * np.pi - np.arctan(SLOPE)
        ),
        depth=0.5 * np.pi * a * SLOPE,
        force=0.5 * np.pi * E_STAR * a**2 * SLOPE,
        pressure=lambda r: 0.5 * E_STAR * SLOPE * np.arccosh(a / r),
    ),
}


def solve(comm, name, facets_across, by_force=False):
    """Press a tool in, to its depth or, where it is free, by its force. Collective."""
    # A quarter of the half-space, with facets that grow from the contact on
    grid = PoleGrid(a, 2.0 * a / facets_across, 1.3)
    sides = {"surface": "slave", "far": "bottom", "side": "side"}
    sides |= {"left": "symmetry_x", "front": "symmetry_y"}
    tags = {place: TAGS[side] for place, side in sides.items()}
    blocks = box_blocks((200.0 * a,) * 3, grid, tags, "half-space")
    made = assemble_blocks(comm, [mirrored(b, 2) for b in blocks], "hexahedron", 1)
    scene, tool = Scene(*made, TAGS), TOOLS[name]

    V = tools.vector_space(scene.mesh, 2)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    strain, mu = ufl.sym(ufl.grad(u)), E / (2.0 * (1.0 + NU))
    lmbda = E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU))
    stress = 2.0 * mu * strain + lmbda * ufl.tr(strain) * ufl.Identity(3)
    residual = ufl.inner(stress, ufl.grad(v)) * ufl.dx(degree=4)
    bcs = [tools.prescribe(V, scene.find(side)) for side in ("bottom", "side")]
    bcs += [tools.prescribe(V, scene.find("symmetry_x"), component=0)]
    bcs += [tools.prescribe(V, scene.find("symmetry_y"), component=1)]

    body = rigid.Body(tool.shape, free=("z",) if by_force else ())
    contact = raymortar.Contact(u, scene.facet_tags, [(TAGS["slave"], body)])
    problem = raymortar.NonlinearProblem(residual, contact, bcs)

    def press(t):
        if by_force:
            body.force = (0.0, 0.0, -0.25 * tool.force * t)
        else:
            body.move((0.0, 0.0, -tool.depth * t))

    raymortar.LoadSteps(problem.snes_solver, press, steps=2).run()
    force = -4.0 * contact.resultant().force[2]
    depth, made = -body.translation[2], {"scene": scene, "u": u, "contact": contact}
    return SimpleNamespace(tool=tool, force=force, depth=depth, **made)


def main(arguments=None):
    """Run the demo; 0 if it agrees with the closed forms."""
    parser = common.options("indentation", __doc__)
    parser.add_argument("--size", type=int, default=8, help="facets across")
    args = parser.parse_args(arguments)
    comm, report = MPI.COMM_WORLD, common.Report(MPI.COMM_WORLD)
    args.output.mkdir(parents=True, exist_ok=True)
    figure, both = drawing.pyplot().subplots(1, 2, figsize=(9.0, 3.6))
    for axes, name in zip(both, TOOLS):
        found = solve(comm, name, args.size + (4 if args.fine else 0))
        report.effort(found.contact)
        report.add(f"{name}: force", found.force, found.tool.force, 0.02)
        pressure = common.pressure_field(found.contact)
        file = args.output / "indentation.xdmf"
        io.write_xdmf(file, found.scene.mesh, [found.u, pressure])
        x, p = common.gather_nodes(pressure, found.scene)
        if comm.rank == 0:
            r, line = np.hypot(x[:, 0], x[:, 1]), np.linspace(0.01, 0.999, 300) * a
            near, exact = r < 1.4 * a, found.tool.pressure(line)
            style = {"color": drawing.COMPUTED, "ms": 3.5, "mfc": "none"}
            axes.plot(line, exact, color=drawing.EXACT, label="closed form")
            axes.plot(r[near], p[near], "o", **style, label="raymortar, at the nodes")
            axes.set(title=f"rigid {name}", xlabel="distance from the axis")
            axes.set(xlim=(0.0, None), ylim=(0.0, 1.3 * p.max()))
    if comm.rank == 0:
        both[0].set(ylabel="contact pressure")
        both[0].legend()
        figure.tight_layout()
        figure.savefig(file.with_suffix(".png"))
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())

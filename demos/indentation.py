"""Indentation: a rigid ball and a rigid cone press an elastic half-space (3D, a quarter).

The tools are analytic: no mesh, no tags. Closed forms, for small strains: Hertz's
extension to a true ball (Sneddon 1965) and Sneddon's blunt cone. The half-space is a
box of two hundred contact radii, held at its far sides.
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
from meshes.blocks import mirrored
from meshes.graded import PoleGrid, box_blocks
from meshes.meshing import Scene, assemble_blocks
from raymortar import io, rigid, tools

# Any consistent units
E, NU, RADIUS, CONTACT, HALF_ANGLE = 1000.0, 0.3, 1.0, 0.04, np.radians(88.5)
E_STAR = E / (1.0 - NU**2)
TAGS = {"slave": 1, "bottom": 2, "symmetry_x": 3, "symmetry_y": 4, "side": 5}


def ball():
    """Tool, the depth at which the contact has its radius, force, pressure at r."""
    a, R = CONTACT, RADIUS
    log = np.log((R + a) / (R - a))
    return SimpleNamespace(
        shape=rigid.Sphere((0.0, 0.0, R), R),
        depth=0.5 * a * log,
        force=E_STAR * (0.5 * (R**2 + a**2) * log - a * R),
        # Of the paraboloid, which differs by (a / R)^2 / 8
        pressure=lambda r: 2.0 * E_STAR / (np.pi * R) * np.sqrt(a**2 - r**2),
    )


def cone():
    """The same of a blunt cone."""
    a, slope = CONTACT, 1.0 / np.tan(HALF_ANGLE)
    return SimpleNamespace(
        shape=rigid.Cone((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), HALF_ANGLE),
        depth=0.5 * np.pi * a * slope,
        force=0.5 * np.pi * E_STAR * a**2 * slope,
        pressure=lambda r: 0.5 * E_STAR * slope * np.arccosh(a / np.maximum(r, 1e-9)),
    )


TOOLS = {"ball": ball, "cone": cone}


def scene_of(comm, facets_across):
    """A quarter of the half-space around the origin, fine at the contact. Collective."""
    grid = PoleGrid(CONTACT, 2.0 * CONTACT / facets_across, 1.3)
    names = {"surface": "slave", "left": "symmetry_x", "front": "symmetry_y"}
    names |= {"far": "bottom", "side": "side"}
    tags = {place: TAGS[name] for place, name in names.items()}
    blocks = box_blocks((200.0 * CONTACT,) * 3, grid, tags, "half-space")
    made = assemble_blocks(comm, [mirrored(b, 2) for b in blocks], "hexahedron", 1)
    return Scene(*made, TAGS)


def solve(comm, name, facets_across=8, degree=2, steps=2, by_force=False, **options):
    """Press a tool of `TOOLS` in, to its depth or, where it is free, by its force.
    `options` are those of `raymortar.Contact`."""
    scene, tool = scene_of(comm, facets_across), TOOLS[name]()
    mesh = scene.mesh
    V = tools.vector_space(mesh, degree)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    dx = ufl.dx(metadata={"quadrature_degree": 2 * degree})
    F = ufl.inner(bodies.hooke(u, E, NU), bodies.small_strain(v)) * dx
    supports = {"symmetry_x": (0,), "symmetry_y": (1,), "bottom": (0, 1, 2)}
    supports["side"] = (0, 1, 2)
    bcs = [
        tools.prescribe(V, scene.find(name), component=i)
        for name, axes in supports.items()
        for i in axes
    ]

    body = rigid.Body(tool.shape, free=("z",) if by_force else ())
    contact = raymortar.Contact(u, scene.facet_tags, [(TAGS["slave"], body)], **options)
    problem = raymortar.NonlinearProblem(F, contact, bcs)

    def apply(t):
        if by_force:
            body.force = (0.0, 0.0, -0.25 * tool.force * t)
        else:
            body.move((0.0, 0.0, -tool.depth * t))

    path = raymortar.LoadSteps(raymortar.SNESSolver(problem), apply, steps).run()
    return SimpleNamespace(
        scene=scene,
        u=u,
        contact=contact,
        tool=tool,
        force=-4.0 * contact.resultant().force[2],
        depth=-body.translation[2],
        iterations=[step.iterations for step in path],
        history=list(problem.history),
    )


def mean_deviation(r, p, exact):
    """Of pressures at nodes within 0.2 to 0.8 of the contact, over their mean."""
    inner = (r > 0.2 * CONTACT) & (r < 0.8 * CONTACT)
    return np.abs(p[inner] - exact(r[inner])).mean() / exact(r[inner]).mean()


def draw(results, nodes, path):
    """Pressures over the distance from the axis."""
    plt = drawing.pyplot()
    figure, both = plt.subplots(1, len(results), figsize=(9.0, 3.6))
    for axes, (name, result) in zip(both, results.items()):
        r, p = nodes[name]
        line = np.linspace(0.01 * CONTACT, 0.999 * CONTACT, 300)
        axes.plot(
            line, result.tool.pressure(line), color=drawing.EXACT, label="closed form"
        )
        near = r < 1.4 * CONTACT
        axes.plot(
            r[near],
            p[near],
            "o",
            ms=3.5,
            mfc="none",
            color=drawing.COMPUTED,
            label="raymortar, at the nodes",
        )
        axes.set(title=f"rigid {name}", xlabel="distance from the axis", xlim=(0, None))
        axes.set(ylim=(0.0, 1.3 * p.max()))
    both[0].set(ylabel="contact pressure")
    both[0].legend()
    figure.tight_layout()
    figure.savefig(path)


def main(arguments=None):
    """Run the demo; 0 if it agrees with the closed forms."""
    parser = common.options("indentation", __doc__)
    parser.add_argument("--size", type=int, default=8, help="facets across")
    parser.add_argument("--degree", type=int, choices=(1, 2), default=2)
    args = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    report, results, nodes = common.Report(comm), {}, {}
    args.output.mkdir(parents=True, exist_ok=True)
    for name in TOOLS:
        result = solve(comm, name, args.size + (4 if args.fine else 0), args.degree)
        report.effort(result.contact)
        report.newton(f"{name}, load steps", result.iterations, result.history)
        pressure = common.pressure_field(result.contact)
        x, p = common.gather_nodes(pressure, result.scene)
        report.add(f"{name}: force", result.force, result.tool.force, 0.02)
        io.write_xdmf(
            args.output / "indentation.xdmf", result.scene.mesh, [result.u, pressure]
        )
        if comm.rank > 0:
            continue  # nodes are gathered on the first
        r, p = np.hypot(x[:, 0], x[:, 1]), p[:, 0]
        off = mean_deviation(r, p, result.tool.pressure)
        report.say(f"{name}: pressures deviate by {off:.1%} in the mean")
        results[name], nodes[name] = result, (r, p)
    if comm.rank == 0:
        draw(results, nodes, args.output / "indentation.png")
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())

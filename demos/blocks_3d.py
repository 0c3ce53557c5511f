"""Two hyperelastic blocks (3D) whose meshes do not match, compressed by 20 %.

First equal blocks of tetrahedra: frictionless, they must shorten like a single one,
with uniform pressure to rounding (the patch test). Then a narrow block of hexahedra
sinks into a wide one: its force must pass through the contact undiminished.
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
from meshes.scenes import two_blocks
from raymortar import io, tools

E, NU, STRETCH = 10.0, 0.3, 0.8
MU, LAMBDA = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
# What keeps each block in its place: symmetry planes, the floor
FIXED = {"lower_left": 0, "upper_left": 0, "lower_front": 1, "upper_front": 1}


def lateral_stretch():
    """Stretch across the load for which the lateral faces are free."""
    low, high = 1.0, 1.0 / STRETCH
    for _ in range(100):
        alpha = 0.5 * (low + high)
        stress = MU * (alpha**2 - 1.0) + LAMBDA * np.log(STRETCH * alpha**2)
        low, high = (alpha, high) if stress < 0.0 else (low, alpha)
    return alpha


def nominal_pressure(alpha):
    """Normal traction per reference area of the uniform state, negative."""
    log_J = np.log(STRETCH * alpha**2)
    return MU * (STRETCH - 1.0 / STRETCH) + LAMBDA * log_J / STRETCH


def solve(scene, degree=1, steps=4):
    """Push the top of two blocks of height 1 down by a fifth of 2."""
    mesh, tags = scene.mesh, scene.tags

    V = tools.vector_space(mesh, degree)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    gradient = ufl.Identity(3) + ufl.grad(u)
    J = ufl.det(gradient)
    energy = MU / 2 * (ufl.tr(gradient.T * gradient) - 3 - 2 * ufl.ln(J))
    energy += LAMBDA / 2 * ufl.ln(J) ** 2
    dx = ufl.dx(metadata={"quadrature_degree": 2 * degree})
    F = ufl.derivative(energy * dx, u, v)

    top = fem.Constant(mesh, 0.0)
    bcs = [
        tools.prescribe(V, scene.find(name), component=component)
        for name, component in FIXED.items()
    ]
    bcs += [
        tools.prescribe(V, scene.find("bottom"), component=2),
        tools.prescribe(V, scene.find("top"), top, 2),
    ]

    pair = (tags["slave"], tags["master"])
    contact = raymortar.Contact(u, scene.facet_tags, [pair])
    problem = raymortar.NonlinearProblem(F, contact, bcs)
    solver = raymortar.SNESSolver(problem)

    def apply(factor):
        top.value = -factor * (1.0 - STRETCH) * 2.0

    path = raymortar.LoadSteps(solver, apply, steps).run()
    return SimpleNamespace(
        scene=scene,
        u=u,
        contact=contact,
        support=problem.reactions({"top": bcs[-1]})["top"],
        iterations=[step.iterations for step in path],
        history=list(problem.history),
    )


def patch(comm, n, degree):
    """Equal blocks of shaken tetrahedra: flat triangles need no regular mesh."""
    shaken = {"perturb": 0.25, "perturb_sides": 0.25, "seed": 1}
    scene = two_blocks(comm, 3, "tetrahedron", n + 1, n, **shaken)
    return solve(scene, degree)


def punch(comm, n, degree):
    """A narrower block on a wider one, hexahedra, both cut at symmetry planes."""
    scene = two_blocks(
        comm,
        3,
        "hexahedron",
        (2 * n, 2 * n, n),
        n + 1,
        upper_size=(0.5, 0.5, 1.0),
        overhang=(-0.25, -0.25),
    )
    return solve(scene, degree)


def extremes(function, scene, name):
    """Smallest and largest value at the nodes of a named surface. Collective."""
    values = common.gather_nodes(function, scene, name)[1]
    local = None if values is None else (values.min(axis=0), values.max(axis=0))
    return scene.mesh.comm.bcast(local, root=0)


def compare(result, report):
    """Lateral stretch and traction of the patch against the uniform state."""
    alpha, scene = lateral_stretch(), result.scene
    _, widest = extremes(result.u, scene, "slave")
    low, high = extremes(result.contact.multiplier, scene, "slave")
    report.add("lateral stretch", 1.0 + widest[0], alpha, 1e-9)
    report.add("largest pressure", -low[0], -nominal_pressure(alpha), 1e-8)
    report.add("smallest pressure", -high[0], -nominal_pressure(alpha), 1e-8)


def draw(uniform, indented, path):
    """Both pairs of blocks, deformed, and the pressure under the narrow one."""
    parts = []
    for result, suffix in ((uniform, ""), (indented, "_punch")):
        scene = result.scene
        pressure = common.pressure_field(result.contact)
        name = path.with_name(f"{path.stem}{suffix}.xdmf")
        io.write_xdmf(name, scene.mesh, [result.u, pressure])
        parts.append(drawing.gather_boundary(scene.mesh, result.u))
    slave = scene.facet_tags.find(scene.tags["slave"])
    footprint = drawing.gather_boundary(scene.mesh, result.u, pressure, facets=slave)
    if scene.mesh.comm.rank > 0:
        return
    plt = drawing.pyplot()
    fig = plt.figure(figsize=(12, 4.4))
    titles = ("Equal blocks: uniform", "A narrow block, cut at its symmetry planes")
    for i, (x, u) in enumerate(parts):
        axes = fig.add_axes((0.28 * i, 0.0, 0.33, 0.93), projection="3d")
        sunk = -u[..., 2].mean(axis=1)
        colours = drawing.draw_surface(axes, x + u, sunk, (-60, -135)[i])
        fig.text(0.165 + 0.28 * i, 0.9, titles[i], ha="center")
    bar = fig.add_axes((0.6, 0.2, 0.01, 0.6))
    fig.colorbar(colours, cax=bar, label="downward displacement")
    axes = fig.add_axes((0.72, 0.16, 0.28, 0.68))
    fig.text(0.84, 0.9, "Nominal pressure under it", ha="center")
    draw_pressure(fig, axes, *footprint)
    fig.savefig(path)


def draw_pressure(fig, axes, x, u, pressure):
    """Contact pressure under the narrow block, its symmetric parts completed."""
    images = [(1, 1), (-1, 1), (1, -1), (-1, -1)]
    at = (x + u)[..., :2]
    colours = drawing.draw_field(axes, at, pressure, images, cmap=drawing.PRESSURE_MAP)
    axes.set(xlabel="x", ylabel="y")
    fig.colorbar(colours, ax=axes, shrink=0.88)


def main(arguments=None):
    """Run the demo; 0 if the patch is uniform and the punch in equilibrium."""
    parser = common.options("blocks_3d", __doc__)
    parser.add_argument("--size", type=int, default=5, help="cells along an edge")
    parser.add_argument("--degree", type=int, choices=(1, 2), default=1)
    args = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    size = args.size * (2 if args.fine else 1)
    report = common.Report(comm)

    uniform = patch(comm, size, args.degree)
    report.newton("equal blocks", uniform.iterations, uniform.history)
    compare(uniform, report)
    indented = punch(comm, size, args.degree)
    report.newton("narrow block", indented.iterations, indented.history)
    force = indented.contact.resultant(0).force[2]
    report.add("narrow block: force", force, -indented.support[2], 1e-8)

    args.output.mkdir(parents=True, exist_ok=True)
    draw(uniform, indented, args.output / "blocks_3d.png")
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())

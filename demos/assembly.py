"""A clamp of three bodies from Gmsh, with three pairs of surfaces named there (2D).

A round pin lies in a groove of the base; a jaw with the same groove is pressed down
on it. When the pin has been squeezed by 0.3 mm the jaw also sits down on the base
beside it: from there on the stop takes most of the load. Friction acts everywhere.
One half of the symmetric clamp is modelled by the Gmsh kernel, and every surface is
known to contact by the name of its physical group.
"""

import sys
from types import SimpleNamespace

from mpi4py import MPI

import bodies
import common
import drawing
import numpy as np
from dolfinx import fem

import raymortar
from meshes.meshing import Scene
from raymortar import io, tools

# Lengths in mm, stresses in MPa, forces in N per mm of thickness of the half
RADIUS, WIDTH, HEIGHT, STOP, SLOT = 12.0, 45.0, 25.0, 30.0, 0.3
E_PIN, E_JAWS, NU, FRICTION, CLOSING = 2000.0, 6000.0, 0.35, 0.2, 0.6
PAIRS = {
    "pin on base": ("pin below", "groove of the base"),
    "jaw on pin": ("pin above", "groove of the jaw"),
    "jaw on base": ("stop of the jaw", "stop of the base"),
}
# The groove's flanks, at 45 degrees, touch the pin in the middle of its quadrants
FLANK = RADIUS * np.sqrt(2.0)
OPENING = 12.0  # of half the groove
MOUTH = FLANK - OPENING  # height of the jaws' faces from the pin's centre


def outline(kernel, points, sizes):
    """Plane surface of a polygon; its lines are numbered in the order of the points."""
    tags = [kernel.addPoint(x, y, 0.0, h) for (x, y), h in zip(points, sizes)]
    lines = [
        kernel.addLine(a, b) for a, b in zip(tags, [*tags[1:], tags[0]], strict=True)
    ]
    return kernel.addPlaneSurface([kernel.addCurveLoop(lines)]), lines


def jaw_points(sign):
    """Half a jaw: groove, face, step up to the stop, stop, outer sides."""
    gap = 0.5 * SLOT
    step, far = MOUTH, MOUTH + HEIGHT
    points = [
        (0.0, FLANK), (OPENING, step), (STOP, step), (STOP, gap), (WIDTH, gap),
        (WIDTH, far), (0.0, far),
    ]  # fmt: skip
    return [(x, sign * y) for x, y in points]


def name_group(gmsh, dim, entities, name):
    """Physical group with a name; Gmsh 4.8 takes it separately."""
    group = gmsh.model.addPhysicalGroup(dim, entities)
    gmsh.model.setPhysicalName(dim, group, name)


def model(gmsh, size):
    """Build the clamp in Gmsh, with a name for every surface that is needed."""
    kernel, fine = gmsh.model.occ, RADIUS * 0.25 * np.pi / size
    sizes = [fine, fine, 2 * fine, 2 * fine, 3 * fine, 4 * fine, 4 * fine]
    base, base_lines = outline(kernel, jaw_points(-1), sizes)
    jaw, jaw_lines = outline(kernel, jaw_points(1), sizes)
    corner = RADIUS * np.sqrt(0.5)
    at = [(0, -RADIUS), (corner, -corner), (RADIUS, 0), (corner, corner), (0, RADIUS)]
    points = [kernel.addPoint(x, y, 0.0, fine) for x, y in at]
    centre = kernel.addPoint(0.0, 0.0, 0.0, 2 * fine)
    arcs = [kernel.addCircleArc(a, centre, b) for a, b in zip(points, points[1:])]
    cuts = [kernel.addLine(points[-1], centre), kernel.addLine(centre, points[0])]
    pin = kernel.addPlaneSurface([kernel.addCurveLoop(arcs + cuts)])
    kernel.synchronize()
    for name, surface in {"base": base, "pin": pin, "jaw": jaw}.items():
        name_group(gmsh, 2, [surface], name)
    for name, lines in {
        "pin below": arcs[:2],
        "pin above": arcs[2:],
        "groove of the base": base_lines[:1],
        "groove of the jaw": jaw_lines[:1],
        "stop of the base": base_lines[3:4],
        "stop of the jaw": jaw_lines[3:4],
        "held": base_lines[5:6],
        "moved": jaw_lines[5:6],
        "symmetry": cuts + base_lines[6:] + jaw_lines[6:],
    }.items():
        name_group(gmsh, 1, lines, name)
    gmsh.model.mesh.generate(2)


def scene_of(comm, size):
    """Mesh of the clamp with Gmsh's names as tags. Collective."""
    if comm.rank > 0:
        read = io.read_gmsh(None, comm, gdim=2)
    else:
        import gmsh

        gmsh.initialize(["", "-v", "1"])
        try:
            model(gmsh, size)
            read = io.read_gmsh(gmsh.model, comm, gdim=2)
        finally:
            gmsh.finalize()
    tags = {name: tag for name, (dim, tag) in read.names.items() if dim == 1}
    parts = {name: tag for name, (dim, tag) in read.names.items() if dim == 2}
    return Scene(read.mesh, read.cell_tags, read.facet_tags, tags, parts)


def solve(comm, size=10, steps=12, report=None, file=None):
    """Close the clamp; forces of the three pairs at each accepted step."""
    scene = scene_of(comm, size)
    V = tools.vector_space(scene.mesh, 1)
    u = fem.Function(V, name="displacement")
    E = tools.by_body(
        scene.mesh,
        scene.cell_tags,
        {"pin": E_PIN, "base": E_JAWS, "jaw": E_JAWS},
        scene.bodies,
    )
    material = bodies.NeoHookean(E, NU)
    form = material.residual(u, 2)
    down = fem.Constant(scene.mesh, 0.0)
    held = tools.prescribe(V, scene.find("held"))
    moved = scene.find("moved")
    bcs = [held, tools.prescribe(V, moved, component=0)]
    bcs.append(tools.prescribe(V, moved, down, component=1))
    bcs.append(tools.prescribe(V, scene.find("symmetry"), component=0))
    contact = raymortar.Contact(
        u,
        scene.facet_tags,
        list(PAIRS.values()),
        friction=raymortar.Coulomb(FRICTION),
        search=raymortar.Search(reach=4.0, depth=2.0),
        names=scene.tags,
    )
    problem = raymortar.NonlinearProblem(form, contact, bcs)
    solver = raymortar.SNESSolver(problem, {"snes_linesearch_type": "l2"})

    def apply(factor):
        down.value = -CLOSING * factor

    history = raymortar.History(problem, file, {"support": held})
    path = raymortar.LoadSteps(solver, apply, steps, history=history)
    for step in path:
        if report is not None:
            row = history.rows[-1]
            forces = (getattr(row, f"force_{i}_y") for i in range(len(PAIRS)))
            vertical = ", ".join(f"{force:9.2f}" for force in forces)
            report.say(
                f"closed by {CLOSING * row.time:.3f} mm: {step.iterations:2} "
                f"iterations, forces {vertical} N/mm"
            )
    forces = [history.vectors(f"force_{i}") for i in range(len(PAIRS))]
    return SimpleNamespace(
        scene=scene,
        u=u,
        contact=contact,
        material=material,
        closing=CLOSING * history["time"],
        iterations=history["iterations"],
        support=history["reaction_support_y"],
        forces=np.stack(forces, axis=1),
        halvings=path.halvings,
    )


def draw(result, path):
    """The closed clamp, completed, and the share of each pair in the load."""
    mesh, u = result.scene.mesh, result.u
    lam, mises = result.contact.multiplier, result.material.mises(u)
    io.write_xdmf(path.with_suffix(".xdmf"), mesh, [u, lam, mises])
    cells = drawing.gather_cells(mesh, u, mises)
    if mesh.comm.rank > 0:
        return
    plt = drawing.pyplot()
    fig, (left, right) = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
    x, displacement, values = cells
    # Both halves; the corners' peaks would leave the rest dark
    at, images = x[..., :2] + displacement, [(1, 1), (-1, 1)]
    colours = drawing.draw_field(left, at, values, images, np.quantile(values, 0.995))
    left.axis("off")
    fig.colorbar(colours, ax=left, label="von Mises stress [MPa]", shrink=0.8)
    draw_forces(right, result)
    fig.savefig(path)


def draw_forces(axes, result):
    """Vertical forces of the pairs over the closing."""
    for i, (name, style) in enumerate(zip(PAIRS, ("-", "--", "-"))):
        colour = (drawing.EXACT, "#2980b9", drawing.COMPUTED)[i]
        force = 2e-3 * np.abs(result.forces[:, i, 1])
        axes.plot(
            np.append(0.0, result.closing), np.append(0.0, force), style, color=colour,
            label=name,
        )  # fmt: skip
    axes.axvline(SLOT, color="0.75", lw=0.8, zorder=0)
    axes.set(xlabel="closing [mm]", ylabel="force of both halves [kN/mm]")
    axes.set(xlim=(0.0, CLOSING), ylim=(0.0, None))
    axes.legend(loc="upper left")


def main(arguments=None):
    """Run the demo; 0 if pin, jaw and base are in equilibrium."""
    parser = common.options("assembly", __doc__)
    parser.add_argument("--size", type=int, default=10, help="cells along 1/8 circle")
    parser.add_argument("--steps", type=int, default=12)
    args = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    report = common.Report(comm)
    size = args.size * (2 if args.fine else 1)
    args.output.mkdir(parents=True, exist_ok=True)
    result = solve(comm, size, args.steps, report, args.output / "assembly.csv")
    report.effort(result.contact, result.iterations, result.halvings)
    below, above, stop = np.abs(result.forces[-1, :, 1])
    report.add("above the pin / below it", above, below, 1e-7, "N/mm")
    report.add("pin and stop / support", above + stop, result.support[-1], 1e-7, "N/mm")
    open_until = result.closing[np.argmax(np.abs(result.forces[:, 2, 1]) > 0.0)]
    report.add("stop closes after the slot", open_until, SLOT, unit="mm")
    draw(result, args.output / "assembly.png")
    return report.finish("balance")


if __name__ == "__main__":
    sys.exit(main())

"""Two concentric spherical shells squeezed between plates (3D, one eighth).

The shells touch each other all over, the outer one two smooth stiff plates; closing
the gap between these by up to 10 flattens the poles and, later, buckles them. The
scene is after Puso and Laursen (2004), without friction. The poles are alike, so that
one eighth of it is meshed. All of it is symmetric about the axis through the poles:
the same scene in the plane of a meridian is solved on a fine mesh, for comparison.
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
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import io, tools

INNER, MIDDLE, OUTER, NU = 10.0, 12.0, 14.0, 0.3
SHELLS = ((INNER, MIDDLE), (MIDDLE, OUTER))
PLATE = 1000.0  # modulus of the plates; the shells' is 1
# From here on the shells buckle, as the meshes have it
SMOOTH = 5.0
BODIES = {"inner": 1, "outer": 2, "plate": 3}
# Cells of the meridian from pole to equator
MERIDIAN = 24
TAGS = {
    "x": 1, "y": 2, "z": 3, "inner": 4, "outer": 5, "roof": 6, "plate": 7, "moved": 8
}  # fmt: skip


def shell(n, layers, radii, body, tags):
    """An eighth of a shell: three patches of n x n cells around the diagonal."""

    def patch(axis):
        def on_sphere(p):
            direction = np.ones((len(p), 3))
            # Equal angles, as on a cubed sphere
            direction[:, (axis + 1) % 3] = np.tan(p[:, 0])
            direction[:, (axis + 2) % 3] = np.tan(p[:, 1])
            length = np.linalg.norm(direction, axis=1)
            return direction * (p[:, 2] / length)[:, None]

        planes = {"left": "xyz"[(axis + 1) % 3], "front": "xyz"[(axis + 2) % 3]}
        return Block(
            (n, n, layers),
            (0.0, 0.0, radii[0]),
            (0.25 * np.pi, 0.25 * np.pi, radii[1]),
            mapping=on_sphere,
            tags={side: TAGS[name] for side, name in planes.items()} | tags,
            body=body,
        )

    return [patch(axis) for axis in range(3)]


def scene_of(comm, size, layers):
    """Both shells, quadratic, and the plate over them. Collective."""
    blocks = shell(size, layers, (INNER, MIDDLE), "inner", {"top": TAGS["inner"]})
    blocks += shell(
        size + 1,
        layers,
        (MIDDLE, OUTER),
        "outer",
        {"bottom": TAGS["outer"], "top": TAGS["roof"]},
    )
    width = 1.5 * OUTER
    blocks.append(
        Block(
            (6, 6, 1),
            (0.0, 0.0, OUTER),
            (width, width, OUTER + 1.0),
            tags={"bottom": TAGS["plate"], "top": TAGS["moved"]},
        )
    )
    mesh, cells, facets = assemble_blocks(comm, blocks, "hexahedron", 2)
    return Scene(mesh, cells, facets, TAGS, BODIES)


def meridian_of(comm, size, layers, shells=SHELLS, plate=OUTER):
    """The same in the plane of a meridian: x is the distance from the axis.

    `shells` are the radii of both shells, `plate` is the height of the plate.
    """

    def in_plane(p):
        return p[:, 1:] * np.stack([np.sin(p[:, 0]), np.cos(p[:, 0])], axis=1)

    def half(n, radii, body, tags):
        tags = {"left": TAGS["x"], "right": TAGS["z"]} | tags
        low, high = (0.0, radii[0]), (0.5 * np.pi, radii[1])
        return Block((n, layers), low, high, mapping=in_plane, tags=tags, body=body)

    blocks = [
        half(size, shells[0], "inner", {"top": TAGS["inner"]}),
        half(
            size + 1,
            shells[1],
            "outer",
            {"bottom": TAGS["outer"], "top": TAGS["roof"]},
        ),
        Block(
            (8, 1),
            (0.0, plate),
            (1.5 * OUTER, plate + 1.0),
            tags={"left": TAGS["x"], "bottom": TAGS["plate"], "top": TAGS["moved"]},
        ),
    ]
    mesh, cells, facets = assemble_blocks(comm, blocks, "quadrilateral", 2)
    return Scene(mesh, cells, facets, TAGS, BODIES)


class Turned(bodies.NeoHookean):
    """The same material where a plane figure turns about the axis x = 0.

    Without friction nothing else has to know of the turn: a multiplier in this
    balance is the pressure times the length 2 pi x of the circle it acts on.
    """

    def energy(self, u, quadrature_degree):
        x, H = ufl.SpatialCoordinate(u.function_space.mesh), ufl.grad(u)
        hoop = 1 + u[0] / x[0]
        F = ufl.as_tensor(
            [[1 + H[0, 0], H[0, 1], 0], [H[1, 0], 1 + H[1, 1], 0], [0, 0, hoop]]
        )
        metadata = {"quadrature_degree": quadrature_degree}
        return 2 * np.pi * x[0] * self.density(F) * ufl.dx(metadata=metadata)

    def residual(self, u, quadrature_degree):
        v = ufl.TestFunction(u.function_space)
        return ufl.derivative(self.energy(u, quadrature_degree), u, v)


def solve(comm, size=3, layers=1, steps=10, closing=SMOOTH, report=None, file=None):
    """Close the plates; their force at each accepted step."""
    planes = dict(enumerate("xyz"))
    found = model(scene_of(comm, size, layers), planes, bodies.NeoHookean)
    # The mesh has a quarter of the plate
    return squeeze(found, 4.0, steps, closing, report, file)


def meridian(comm, steps=10, closing=SMOOTH, shells=SHELLS, plate=OUTER):
    """The same of bodies of revolution, for comparison."""
    scene = meridian_of(comm, MERIDIAN, 2, shells, plate)
    found = model(scene, {0: "x", 1: "z"}, Turned)
    return squeeze(found, 1.0, steps, closing)


def model(scene, planes, law):
    """Bodies, supports and contact.

    `planes` are those of symmetry, by the component that is at rest there.
    """
    V = tools.vector_space(scene.mesh, 2)
    u = fem.Function(V, name="displacement")
    E = tools.by_body(
        scene.mesh,
        scene.cell_tags,
        {"inner": 1.0, "outer": 1.0, "plate": PLATE},
        scene.bodies,
    )
    material = law(E, NU)
    down = fem.Constant(scene.mesh, 0.0)
    values, moved = [*[0.0] * (len(u) - 1), down], scene.find("moved")
    grip = [tools.prescribe(V, moved, value, i) for i, value in enumerate(values)]
    bcs = grip + [
        tools.prescribe(V, scene.find(name), component=i) for i, name in planes.items()
    ]
    contact = raymortar.Contact(
        u,
        scene.facet_tags,
        [("inner", "outer"), ("roof", "plate")],
        search=raymortar.Search(reach=3.0, depth=2.0),
        names=TAGS,
    )
    problem = raymortar.NonlinearProblem(material.residual(u, 4), contact, bcs)
    return SimpleNamespace(
        scene=scene,
        u=u,
        material=material,
        contact=contact,
        problem=problem,
        grip=grip,
        down=down,
    )


def squeeze(found, parts, steps, closing, report=None, file=None):
    """Close the plates over a model that has one of `parts` of the upper half."""
    solver = raymortar.SNESSolver(found.problem, {"snes_linesearch_type": "l2"})

    def apply(factor):
        found.down.value = -0.5 * closing * factor

    energy = found.material.energy(found.u, 4)
    history = raymortar.History(
        found.problem, file, {"grip": found.grip}, energy=energy
    )
    # Meshes that approximate the same sphere overlap a little
    history.record(0.0, solver.solve()[0])
    found.contact.advance()
    path = raymortar.LoadSteps(solver, apply, steps, history=history)
    up = "xyz"[len(found.u) - 1]
    for step in path:
        if report is not None:
            row = history.rows[-1]
            report.say(
                f"closed by {closing * row.time:5.2f}: {step.iterations:2} iterations, "
                f"force {-parts * history[f'force_1_{up}'][-1]:8.5f}"
            )
    found.halvings = path.halvings
    found.iterations = history["iterations"]
    found.closing = closing * history["time"]
    # Of the whole plate, in contact and where it is held
    found.force = -parts * history[f"force_1_{up}"]
    found.held = -parts * history[f"reaction_grip_{up}"]
    # Of both halves
    found.energy = 2.0 * parts * history["energy"]
    return found


def work(result):
    """Work of the plates by a cubic through the steps, which are few."""
    from scipy.interpolate import CubicSpline

    return float(
        CubicSpline(result.closing, result.force).integrate(0, result.closing[-1])
    )


def draw(result, plane, path):
    """The deformed shells, cut open, and the force over the closing."""
    mesh, u = result.scene.mesh, result.u
    lam, material = result.contact.multiplier, result.material
    mises, linear = (material.mises(u, degree, 4) for degree in (2, 1))
    io.write_xdmf(path.with_suffix(".xdmf"), mesh, [u, lam, linear])
    parts = drawing.gather_boundary(mesh, u, mises, is_curved=True)
    if mesh.comm.rank > 0:
        return
    drawing.space_and_curve(
        path,
        lambda axes: draw_bodies(axes, *parts),
        "von Mises stress / E",
        lambda axes: draw_force(axes, result, plane),
    )


def draw_bodies(axes, x, u, mises):
    """A half of both shells: the quarter that is meshed and mirror images."""
    shells = x[..., 2].max(axis=1) < OUTER * (1.0 + 1e-9)
    shells &= ~(np.abs(x[..., 2] - OUTER).max(axis=1) < 1e-9)
    # Planes in which the images meet are inside
    for i in (0, 2):
        shells &= ~(np.abs(x[..., i]).max(axis=1) < 1e-9)
    at, value = (x + u)[shells], mises.mean(axis=(1, 2))[shells]
    images = [at * np.array([a, 1.0, c]) for a in (1.0, -1.0) for c in (1.0, -1.0)]
    return drawing.draw_surface(
        axes, np.concatenate(images), np.tile(value, 4), -75, 18
    )


def draw_force(axes, result, plane):
    """In space and in the plane of a meridian."""
    axes.plot(
        result.closing, result.force, color=drawing.COMPUTED, label="one eighth, 3D"
    )
    axes.plot(
        plane.closing,
        plane.force,
        "o",
        mfc="none",
        color=drawing.EXACT,
        clip_on=False,
        label="bodies of revolution",
    )
    axes.set(
        xlabel="closing of the plates",
        ylabel="force",
        xlim=(0, result.closing[-1]),
        ylim=(0, None),
    )
    axes.legend(loc="upper left")


def compare(report, result, plane, size):
    """Rows of the force where the shells have not buckled."""
    for at in np.unique([*np.arange(1.0, SMOOTH + 1.0), plane.closing[-1]]):
        if at <= plane.closing[-1]:
            ours, theirs = (
                np.interp(at, run.closing, run.force) for run in (result, plane)
            )
            report.add(f"force, closed by {at:g}", ours, theirs, 0.15 / size)


def main(arguments=None):
    """Run the demo; 0 if force and energy are right."""
    parser = common.options("shells", __doc__)
    parser.add_argument("--size", type=int, default=4, help="cells along an edge")
    parser.add_argument("--steps", type=int, default=10)
    parser.add_argument("--closing", type=float, help="at most 10 (5; 8 with --fine)")
    args = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    report = common.Report(comm)
    closing = args.closing or (8.0 if args.fine else SMOOTH)
    factor = 2 if args.fine else 1
    size, steps = args.size * factor, args.steps * factor
    args.output.mkdir(parents=True, exist_ok=True)
    file = args.output / "shells.csv"
    result = solve(comm, size, 1, steps, closing, report, file)
    report.effort(result.contact, result.iterations, result.halvings)
    report.add("force, reaction", result.force[-1], result.held[-1], 1e-6)
    stored = result.energy[-1] - result.energy[0]
    report.add("work of the plates, energy", work(result), stored, 0.01)
    plane = meridian(comm, steps, min(closing, SMOOTH))
    compare(report, result, plane, size)
    draw(result, plane, args.output / "shells.png")
    return report.finish("reference")


if __name__ == "__main__":
    sys.exit(main())

"""Two concentric spherical shells squeezed between plates (3D, one eighth).

The shells touch each other all over, the outer one two smooth stiff plates; closing
the gap between these by up to 10 flattens the poles and, later, buckles them. The
problem is that of Puso and Laursen (2004), without friction; their force and FEBio's
stand beside ours. The poles are alike, so that one eighth of the scene is meshed.
"""

import sys
from types import SimpleNamespace

import bodies
import common
import drawing
import numpy as np
from dolfinx import fem

from mpi4py import MPI

import raymortar
from raymortar import compat
from raymortar.blocks import Block
from raymortar.meshing import Scene, assemble_blocks

INNER, MIDDLE, OUTER, NU = 10.0, 12.0, 14.0, 0.3
PLATE = 1000.0  # modulus of the plates; the shells' is 1
CLOSING = 10.0
# Closing over 10 and force; beyond 0.5 the shells buckle, as the meshes have it
PUSO = np.array(
    [(0.0970, 0.144), (0.191, 0.626), (0.283, 1.112), (0.380, 1.738), (0.479, 2.221),
     (0.588, 2.813), (0.677, 2.851), (0.773, 3.926), (0.852, 4.373)]
)  # fmt: skip
FEBIO = np.array(
    [(0.218, 0.837), (0.390, 1.751), (0.519, 2.543), (0.604, 2.745), (0.733, 3.559),
     (0.862, 4.448)]
)  # fmt: skip
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
    return Scene(mesh, cells, facets, TAGS, {"inner": 1, "outer": 2, "plate": 3})


def solve(
    comm, size=3, layers=1, steps=10, closing=0.5 * CLOSING, report=None, file=None
):
    """Close the plates; their force at each accepted step."""
    scene = scene_of(comm, size, layers)
    V = compat.vector_space(scene.mesh, 2)
    u = fem.Function(V, name="displacement")
    E = bodies.by_body(scene, {"inner": 1.0, "outer": 1.0, "plate": PLATE})
    material = bodies.NeoHookean(E, NU)
    form = material.residual(u, 4)
    down = fem.Constant(scene.mesh, 0.0)
    grip = bodies.hold(V, scene, ["moved"], [0.0, 0.0, down])
    bcs = grip + [common.clamp(V, scene, name, i) for i, name in enumerate("xyz")]
    contact = raymortar.Contact(
        u,
        scene.facet_tags,
        [("inner", "outer"), ("roof", "plate")],
        search=raymortar.Search(reach=3.0, depth=2.0),
        names=TAGS,
    )
    problem = raymortar.NonlinearProblem(form, contact, bcs)
    solver = raymortar.SNESSolver(problem, {"snes_linesearch_type": "l2"})

    def apply(factor):
        down.value = -0.5 * closing * factor

    history = raymortar.History(
        problem, file, {"grip": grip}, energy=material.energy(u, 4)
    )
    # Meshes that approximate the same sphere overlap a little
    history.record(0.0, solver.solve()[0])
    contact.advance()
    path = raymortar.LoadSteps(solver, apply, steps, history=history)
    for step in path:
        if report is not None:
            row = history.rows[-1]
            report.say(
                f"closed by {closing * row.time:5.2f}: {step.iterations:2} iterations, "
                f"force {-4.0 * row.force_1_z:8.5f}"
            )
    return SimpleNamespace(
        scene=scene,
        u=u,
        contact=contact,
        material=material,
        halvings=path.halvings,
        iterations=history["iterations"],
        closing=closing * history["time"],
        # A quarter of the plate's force, in contact and where the plate is held
        force=-4.0 * history["force_1_z"],
        held=-4.0 * history["reaction_grip_z"],
        energy=8.0 * history["energy"],
    )


def work(result):
    """Work of the plates by a cubic through the steps, which are few."""
    from scipy.interpolate import CubicSpline

    return float(
        CubicSpline(result.closing, result.force).integrate(0, result.closing[-1])
    )


def draw(result, path):
    """The deformed shells, cut open, and the force over the closing."""
    mesh, u = result.scene.mesh, result.u
    lam, material = result.contact.multiplier, result.material
    mises, linear = (material.mises(u, degree, 4) for degree in (2, 1))
    compat.write_xdmf(path.with_suffix(".xdmf"), mesh, [u, lam, linear])
    parts = drawing.gather_boundary(mesh, u, mises)
    if mesh.comm.rank > 0:
        return
    drawing.space_and_curve(
        path,
        lambda axes: draw_bodies(axes, *parts),
        "von Mises stress / E",
        lambda axes: draw_force(axes, result),
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


def draw_force(axes, result):
    """Ours and the published ones."""
    axes.plot(result.closing, result.force, color=drawing.COMPUTED, label="raymortar")
    axes.plot(
        *(PUSO * [CLOSING, 1]).T,
        "o",
        mfc="none",
        color=drawing.EXACT,
        label="Puso, Laursen",
    )
    axes.plot(*(FEBIO * [CLOSING, 1]).T, "x", color="0.5", label="FEBio")
    axes.set(
        xlabel="closing of the plates", ylabel="force", xlim=(0, 10), ylim=(0, None)
    )
    axes.legend(loc="upper left")


def main(arguments=None):
    """Run the demo; 0 if the force is balanced and as published."""
    parser = common.options("shells", __doc__)
    parser.add_argument("--size", type=int, default=4, help="cells along an edge")
    parser.add_argument("--steps", type=int, default=10)
    parser.add_argument("--closing", type=float, help="at most 10 (5; 8 with --fine)")
    args = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    report = common.Report(comm)
    closing = args.closing or (8.0 if args.fine else 5.0)
    factor = 2 if args.fine else 1
    steps = args.steps * factor
    args.output.mkdir(parents=True, exist_ok=True)
    file = args.output / "shells.csv"
    result = solve(comm, args.size * factor, 1, steps, closing, report, file)
    report.effort(result.contact, result.iterations, result.halvings)
    report.add("force, reaction", result.force[-1], result.held[-1], 1e-6)
    stored = result.energy[-1] - result.energy[0]
    report.add("work of the plates, energy", work(result), stored, 0.01)
    for name, table in (("Puso, Laursen", PUSO), ("FEBio", FEBIO)):
        for share, force in table:
            if share * CLOSING <= min(closing, 5.2):
                ours = np.interp(share * CLOSING, result.closing, result.force)
                report.add(f"{name}, closed by {share * CLOSING:.2f}", ours, force)
    draw(result, args.output / "shells.png")
    return report.finish("published")


if __name__ == "__main__":
    sys.exit(main())

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
from dolfinx import fem

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import io, tools

SLAB = (9.0, 2.0, 3.0)  # half of it in y
RADIUS, THICKNESS, REACH = 3.0, 0.2, 2.6
START, DOWN, ALONG = 2.5, 1.4, 4.0  # of the die's axis in x, and its path
E_SLAB, E_DIE, NU, FRICTION = 1.0, 1000.0, 0.3, 0.3
TAGS = {"bottom": 1, "slave": 2, "master": 3, "symmetry": 4, "grips": 5}
OPTIONS = {"snes_linesearch_type": "l2", "snes_max_it": 40}


def scene_of(comm, size):
    """Slab of `size` cells across its half width, die above it. Collective."""

    def bent(x):
        angle = x[:, 0]
        r = RADIUS - x[:, 2]
        along, up = START + r * np.sin(angle), RADIUS - r * np.cos(angle)
        return np.column_stack([along, x[:, 1], SLAB[2] + up])

    slab = Block(
        (9 * size // 2, size, 3 * size // 2),
        (0.0, 0.0, 0.0),
        SLAB,
        # Finer where the die presses
        grading=(None, None, lambda t: 1.0 - (1.0 - t) ** 1.3),
        tags={
            "bottom": TAGS["bottom"],
            "top": TAGS["slave"],
            "front": TAGS["symmetry"],
        },
    )
    die = Block(
        (6 * size, size + 1, 1),
        (-0.5 * np.pi, 0.0, 0.0),
        (0.5 * np.pi, REACH, THICKNESS),
        mapping=bent,
        tags={
            "bottom": TAGS["master"],
            "front": TAGS["symmetry"],
            "left": TAGS["grips"],
            "right": TAGS["grips"],
        },
    )
    mesh, cells, facets = assemble_blocks(comm, [slab, die], "hexahedron")
    return Scene(mesh, cells, facets, TAGS, {"slab": 1, "die": 2})


def solve(comm, size=4, steps=(10, 20), friction=FRICTION, report=None, file=None):
    """Press, then slide; forces on the slab at each accepted step."""
    scene = scene_of(comm, size)
    V = tools.vector_space(scene.mesh, 1)
    u = fem.Function(V, name="displacement")
    material = bodies.NeoHookean(
        tools.by_body(
            scene.mesh, scene.cell_tags, {"slab": E_SLAB, "die": E_DIE}, scene.bodies
        ),
        NU,
    )
    form = material.residual(u, 2)
    down, along = (fem.Constant(scene.mesh, 0.0) for _ in range(2))
    support = tools.prescribe(V, scene.find("bottom"))
    bcs = [support, tools.prescribe(V, scene.find("symmetry"), component=1)]
    bcs += [
        tools.prescribe(V, scene.find("grips"), along, 0),
        tools.prescribe(V, scene.find("grips"), down, 2),
    ]
    contact = raymortar.Contact(
        u,
        scene.facet_tags,
        [("slave", "master")],
        friction=raymortar.Coulomb(friction) if friction else None,
        search=raymortar.Search(reach=1.0, depth=1.0),
        names=TAGS,
    )
    problem = raymortar.NonlinearProblem(form, contact, bcs)
    solver = raymortar.SNESSolver(problem, OPTIONS)
    history = raymortar.History(
        problem,
        file,
        {"bottom": support},
        more={
            "normal": lambda: bodies.sliding(contact, 0)[0],
            "along": lambda: bodies.sliding(contact, 0)[1],
        },
    )

    def apply(t):
        down.value = -DOWN * min(t, 1.0)
        along.value = ALONG * max(t - 1.0, 0.0)

    for n, path in zip(steps, ((0.0, 1.0), (1.0, 2.0))):
        for step in raymortar.LoadSteps(solver, apply, n, path=path, history=history):
            if report is not None:
                row = history.rows[-1]
                report.say(
                    f"t = {row.time:5.3f}: {step.iterations:2} iterations, "
                    f"H {row.force_0_x:8.5f}, V {row.force_0_z:8.5f}"
                )
    return SimpleNamespace(
        scene=scene,
        u=u,
        contact=contact,
        material=material,
        t=history["time"],
        iterations=history["iterations"],
        H=history["force_0_x"],
        V=history["force_0_z"],
        normal=history["normal"],
        along=history["along"],
        support=history.vectors("reaction_bottom"),
    )


def imbalance(result):
    """Largest difference of contact and the slab's support, over the largest force."""
    off = [result.H + result.support[:, 0], result.V + result.support[:, 2]]
    return np.abs(off).max() / np.abs(result.V).max()


def draw(result, path):
    """Slab and die at the end, mirrored, and the forces over the path."""
    mesh, u, contact = result.scene.mesh, result.u, result.contact
    lam, mises = contact.multiplier, result.material.mises(u)
    io.write_xdmf(path.with_suffix(".xdmf"), mesh, [u, lam, mises])
    parts = drawing.gather_boundary(mesh, u, mises)
    if mesh.comm.rank > 0:
        return
    drawing.space_and_curve(
        path,
        lambda axes: draw_bodies(axes, *parts),
        "von Mises stress",
        lambda axes: draw_forces(axes, result),
    )


def draw_bodies(axes, x, u, mises):
    """Both halves of the slab, and the die's farther half to see under the other."""
    at, value = x + u, mises.mean(axis=(1, 2))
    # Cells of the symmetry plane would hide the inside of the mirrored scene
    inside = np.abs(x[..., 1]).max(axis=1) < 1e-9
    of_die = x[..., 2].mean(axis=1) > SLAB[2] - 1e-9
    of_die &= ~(np.abs(x[..., 2] - SLAB[2]).max(axis=1) < 1e-9)
    slab, die = ~inside & ~of_die, ~inside & of_die
    mirror = np.array([1.0, -1.0, 1.0])
    bodies_of = np.concatenate([at[slab], (at * mirror)[slab]])
    # What is drawn last hides the rest: the die lies on the slab
    axes.computed_zorder = False
    colours = drawing.draw_surface(axes, bodies_of, np.tile(value[slab], 2), -62, 24)
    draw_die(axes, at[die])
    return colours


def draw_die(axes, polygons):
    """The die in grey, facets away from the eye first; room for it above the slab."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    axes.add_collection3d(
        Poly3DCollection(polygons, facecolors="0.82", edgecolors="0.35", lw=0.3)
    )
    top = polygons[..., 2].max()
    axes.set_zlim(0.0, top)
    axes.set_box_aspect((SLAB[0], 2 * SLAB[1], top))


def draw_forces(axes, result):
    """Forces of the whole slab over time."""
    axes.plot(result.t, -2 * result.V, color=drawing.EXACT, label="down, V")
    axes.plot(result.t, 2 * result.H, color=drawing.COMPUTED, label="along, H")
    axes.axvline(1.0, color="0.75", lw=0.8, zorder=0)
    axes.set(xlabel="pressed until 1, then dragged", ylabel="force on the slab")
    axes.set(xlim=(0.0, 2.0), ylim=(min(0.0, 2.2 * result.H.min()), None))
    axes.legend(loc="upper left")


def main(arguments=None):
    """Run the demo; 0 if forces balance and friction carries what it can."""
    parser = common.options("ironing_3d", __doc__)
    parser.add_argument("--size", type=int, default=4, help="cells over half the width")
    parser.add_argument("--steps", type=int, default=20, help="of the slide")
    parser.add_argument("--friction", type=float, default=FRICTION, help="0: none")
    args = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    report = common.Report(comm)
    factor = 2 if args.fine else 1
    steps = (max(args.steps * factor // 2, 1), args.steps * factor)
    args.output.mkdir(parents=True, exist_ok=True)
    file = args.output / "ironing_3d.csv"
    result = solve(comm, args.size * factor, steps, args.friction, report, file)
    report.effort(result.contact, result.iterations)
    report.add("1 + contact force - support", 1.0 + imbalance(result), 1.0, 1e-7)
    if args.friction:
        limit = args.friction * result.normal[-1]
        report.add("friction at the end", result.along[-1], limit, 0.02)
    else:
        # The slide ends where the scene is the mirror image of its beginning
        pressed = steps[0] - 1
        report.add("H, end of the slide", -result.H[-1], result.H[pressed], 1e-6)
        report.add("V, end of the slide", result.V[-1], result.V[pressed], 1e-6)
    draw(result, args.output / "ironing_3d.png")
    return report.finish("balance")


if __name__ == "__main__":
    sys.exit(main())

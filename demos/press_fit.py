"""Press fit: a soft block is pushed into a channel that narrows (2D, plane strain).

The block overlaps the walls by 1 mm when the path begins, slides by more than twice
its length with Coulomb friction, and loses a quarter of its height on the way. The
data are those of Fischer and Wriggers (2006), who give the force as a curve only: it
rises while the block enters, and falls to a plateau when all of it is in the narrow
part. There the walls are parallel, so that friction carries mu times what presses.
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

# Lengths in mm, stresses in MPa, forces in N per mm of thickness; the upper half
LENGTH, HEIGHT, START = 450.0, 200.0, 330.0
WIDE, NARROW, WALL = 199.0, 149.0, 150.0
ENTRANCE, TAPER, EXIT = 800.0, 200.0, 900.0
E_BLOCK, E_WALL, NU, FRICTION = 689.6, 6896.0, 0.32, 0.1
PUSH = 1000.0
TAGS = {"pushed": 1, "symmetry": 2, "slave": 3, "master": 4, "outside": 5}
# Points hop between stick and slip where the wall bends
OPTIONS = {"snes_linesearch_type": "l2", "snes_max_it": 40}


def opening(x):
    """Half of the channel's width at places along it."""
    share = np.clip((x - ENTRANCE) / TAPER, 0.0, 1.0)
    return WIDE - (WIDE - NARROW) * share


def scene_of(comm, size):
    """Block of `size` cells along its height and the wall above it. Collective."""
    end = ENTRANCE + TAPER + EXIT

    def wall(x):
        share = x[:, 1] / WALL
        y = (1.0 - share) * opening(x[:, 0]) + share * (WIDE + WALL)
        return np.column_stack([x[:, 0], y])

    block = Block(
        (9 * size // 4, size),
        (START, 0.0),
        (START + LENGTH, HEIGHT),
        tags={"left": TAGS["pushed"], "bottom": TAGS["symmetry"], "top": TAGS["slave"]},
    )
    # Nodes of the wall where it bends: 19 cells to 1900 mm, times a whole number
    channel = Block(
        (19 * max(size // 3, 1), max(size // 2, 1)),
        (0.0, 0.0),
        (end, WALL),
        mapping=wall,
        tags={"bottom": TAGS["master"], "top": TAGS["outside"]},
    )
    mesh, cells, facets = assemble_blocks(comm, [block, channel], "quadrilateral")
    return Scene(mesh, cells, facets, TAGS, {"block": 1, "channel": 2})


def solve(comm, size=12, steps=50, report=None, file=None, keep=(0.0, 0.45, 1.0)):
    """Push the block through; forces and displacements along the path."""
    scene = scene_of(comm, size)
    V = tools.vector_space(scene.mesh, 1)
    u = fem.Function(V, name="displacement")
    E = tools.by_body(
        scene.mesh, scene.cell_tags, {"block": E_BLOCK, "channel": E_WALL}, scene.bodies
    )
    material = bodies.NeoHookean(E, NU)
    form = material.residual(u, 2)
    pushed = fem.Constant(scene.mesh, 0.0)
    support = tools.prescribe(V, scene.find("outside"))
    bcs = [tools.prescribe(V, scene.find("pushed"), pushed, 0), support]
    bcs.append(tools.prescribe(V, scene.find("symmetry"), component=1))
    contact = raymortar.Contact(
        u, scene.facet_tags, [(TAGS["slave"], TAGS["master"])],
        friction=raymortar.Coulomb(FRICTION),
    )  # fmt: skip
    problem = raymortar.NonlinearProblem(form, contact, bcs)
    solver = raymortar.SNESSolver(problem, OPTIONS)
    # The overlap is pushed out first, with the block held where it is
    solver.solve()
    contact.advance()
    history, kept = raymortar.History(problem, file, {"support": support}), []

    def keep_state(factor):
        if len(kept) < len(keep) and factor >= keep[len(kept)] - 1e-9:
            kept.append((factor, u.x.array.copy()))

    history.record(0.0)
    keep_state(0.0)

    def apply(factor):
        pushed.value = PUSH * factor

    path = raymortar.LoadSteps(solver, apply, steps, history=history)
    for step in path:
        keep_state(step.factor)
        if report is not None:
            row = history.rows[-1]
            report.say(
                f"{PUSH * row.time:7.1f} mm: {step.iterations:2} iterations, "
                f"H {-row.force_0_x:9.2f}, V {-row.force_0_y:9.2f}"
            )
    normal, along = (history.vectors(part) for part in ("normal_0", "tangential_0"))
    return SimpleNamespace(
        scene=scene,
        u=u,
        contact=contact,
        material=material,
        kept=kept,
        halvings=path.halvings,
        factor=history["time"],
        iterations=history["iterations"],
        H=-history["force_0_x"],
        normal=np.linalg.norm(normal, axis=1),
        along=np.linalg.norm(along, axis=1),
        support=history["reaction_support_x"],
    )


def imbalance(result):
    """Largest difference of the push and what the wall's support takes, over the push."""
    return np.abs(result.H + result.support).max() / np.abs(result.H).max()


def draw(result, path):
    """The block on its way, and the forces along it."""
    scene, u = result.scene, result.u
    pictures = drawing.gather_states(u, result.kept, lambda: result.material.mises(u))
    lam, mises = result.contact.multiplier, result.material.mises(u)
    io.write_xdmf(path.with_suffix(".xdmf"), scene.mesh, [u, lam, mises])
    if scene.mesh.comm.rank > 0:
        return
    plt = drawing.pyplot()
    fig, panels = plt.subplot_mosaic(
        [["0", "forces"], ["1", "forces"], ["2", "forces"]],
        figsize=(11, 4.8),
        layout="constrained",
        width_ratios=[1.15, 1.0],
    )
    for name, (factor, cells) in zip("012", pictures):
        colours = draw_bodies(panels[name], *cells)
        panels[name].set_title(f"pushed by {PUSH * factor:.0f} mm", loc="left")
    fig.colorbar(
        colours,
        ax=[panels[name] for name in "012"],
        label="von Mises stress [MPa]",
        shrink=0.7,
    )
    draw_forces(panels["forces"], result)
    fig.savefig(path)


def draw_bodies(axes, x, u, mises):
    """Both halves, deformed."""
    at = x[..., :2] + u
    colours = drawing.draw_field(axes, at, mises, [(1, 1), (1, -1)], top=300.0)
    axes.set(xlim=(-2, 1902), ylim=(-351, 351))
    axes.axis("off")
    return colours


def draw_forces(axes, result):
    """Push and friction's limit over the path."""
    way = PUSH * result.factor
    axes.plot(way, 2e-3 * result.H, color=drawing.COMPUTED, label="push H")
    limit = 2e-3 * FRICTION * result.normal
    axes.plot(way, limit, "--", color=drawing.EXACT, label=r"friction's limit $\mu N$")
    for place, text in (
        (ENTRANCE - START - LENGTH, "front enters the taper"),
        (ENTRANCE + TAPER - START, "tail leaves the taper"),
    ):
        axes.axvline(place, color="0.75", lw=0.8, zorder=0)
        axes.text(place + 10, 33.0, text, color="0.4", fontsize=8)
    axes.set(xlabel="push [mm]", ylabel="force of both halves [kN/mm]")
    axes.set(xlim=(0.0, PUSH), ylim=(0.0, 35.0))
    axes.legend(loc="lower right")


def main(arguments=None):
    """Run the demo; 0 if forces balance and friction carries what it can."""
    parser = common.options("press_fit", __doc__)
    parser.add_argument("--size", type=int, default=12, help="cells over half a height")
    parser.add_argument("--steps", type=int, default=50)
    args = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    report = common.Report(comm)
    size = args.size * (2 if args.fine else 1)
    steps = args.steps * (2 if args.fine else 1)
    args.output.mkdir(parents=True, exist_ok=True)
    result = solve(comm, size, steps, report, args.output / "press_fit.csv")
    report.effort(result.contact, result.iterations, result.halvings)
    report.add("1 + push - support of the wall", 1.0 + imbalance(result), 1.0, 1e-7)
    friction, normal = result.along[-1], FRICTION * result.normal[-1]
    report.add("friction at the end", friction, normal, 0.02, "N/mm")
    report.add("push at the end", result.H[-1], normal, 0.05, "N/mm")
    report.add("largest push", result.H.max(), normal, unit="N/mm")
    draw(result, args.output / "press_fit.png")
    return report.finish("limit")


if __name__ == "__main__":
    sys.exit(main())

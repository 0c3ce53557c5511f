"""A cantilever of two tied halves, bent into a quarter circle (2D, large rotation).

The cut is inclined, and the meshes of the halves do not match. The end is turned by a
right angle and led around, so that the beam is in pure bending. Closed form: moment
E' I / R, and the circle that the axis becomes. What goes through the tie is in balance
with the wall.
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
from raymortar import compat, io

# Any consistent units. The cut is inclined against the axis
E, NU, LENGTH, HEIGHT, SLOPE = 1000.0, 0.3, 24.0, 1.0, 0.7
ANGLE = 0.5 * np.pi
RADIUS = LENGTH / ANGLE
TAGS = {"wall": 1, "end": 2, "slave": 3, "master": 4}
BENDING = E / (1.0 - NU**2) * HEIGHT**3 / 12.0


def cut_at(y):
    """Where the halves meet."""
    return 0.5 * LENGTH + SLOPE * y


def half(first, last, divisions, tags, body):
    """A block between two lines x(y) across the beam."""

    def place(points):
        t, y = points[:, 0], points[:, 1]
        return np.stack([(1.0 - t) * first(y) + t * last(y), y], axis=1)

    low, high = (0.0, -0.5 * HEIGHT), (1.0, 0.5 * HEIGHT)
    return Block(divisions, low, high, mapping=place, tags=tags, body=body)


def scene_of(comm, size):
    """Both halves, `size` and half as many again cells high. Collective."""
    fine, long = 3 * size // 2, int(0.5 * LENGTH)
    root = {"left": TAGS["wall"], "right": TAGS["master"]}
    tip = {"left": TAGS["slave"], "right": TAGS["end"]}
    blocks = [
        half(lambda y: 0.0 * y, cut_at, (long * size, size), root, "root"),
        half(cut_at, lambda y: LENGTH + 0.0 * y, (long * fine, fine), tip, "tip"),
    ]
    return Scene(*assemble_blocks(comm, blocks, "quadrilateral", 1), TAGS)


def on_circle(x, share):
    """Displacement of points at the end, the beam bent by a share of the angle."""
    angle = share * ANGLE
    radius = LENGTH / angle if angle else np.inf
    along = radius * np.sin(angle) if angle else LENGTH
    up = radius * (1.0 - np.cos(angle)) if angle else 0.0
    y = x[1]
    return np.stack([along - y * np.sin(angle) - x[0], up + y * np.cos(angle) - y])


def solve(comm, size=2, degree=2, steps=8, **options):
    """Bend the beam. `options` are those of `raymortar.Tie`."""
    scene = scene_of(comm, size)
    V = compat.vector_space(scene.mesh, degree)
    u, led = fem.Function(V, name="displacement"), fem.Function(V)
    material = bodies.NeoHookean(E, NU)
    F = material.residual(u, 2 * degree)
    wall, end = (
        fem.locate_dofs_topological(V, 1, scene.facet_tags.find(TAGS[name]))
        for name in ("wall", "end")
    )
    bcs = [fem.dirichletbc(fem.Function(V), wall), fem.dirichletbc(led, end)]

    pair = (TAGS["slave"], TAGS["master"])
    tie = raymortar.Tie(u, scene.facet_tags, [pair], **options)
    problem = raymortar.NonlinearProblem(F, tie, bcs)

    def apply(t):
        led.interpolate(lambda x: on_circle(x[:2], t))

    path = raymortar.LoadSteps(raymortar.SNESSolver(problem), apply, steps).run()
    force, moment = reaction(comm, u, F, wall)
    return SimpleNamespace(
        scene=scene,
        u=u,
        material=material,
        contact=tie,
        wall=force,
        wall_moment=moment,
        through=tie.resultant(),
        iterations=[step.iterations for step in path],
        history=list(problem.history),
    )


def reaction(comm, u, F, dofs):
    """Force (2,) and moment about the origin of what holds some nodes."""
    V = u.function_space
    b = compat.create_la_vector(V.dofmap.index_map, 2)
    compat.assemble_residual(b.array, compat.form(F))
    compat.scatter_reverse_add(b)
    own = dofs[dofs < V.dofmap.index_map.size_local]
    forces = b.array.reshape(-1, 2)[own]
    x = V.tabulate_dof_coordinates()[own, :2] + u.x.array.reshape(-1, 2)[own]
    moment = (x[:, 0] * forces[:, 1] - x[:, 1] * forces[:, 0]).sum()
    return comm.allreduce(forces.sum(axis=0)), comm.allreduce(moment)


def axis_deviation(comm, result):
    """Largest distance of the cut's middle nodes from the circle."""
    surface = result.contact.zones[0].facets.slave_surface
    X = surface.X
    x = X + result.u.x.array.reshape(-1, 2)[surface.dofs]
    middle = np.abs(X[:, 1]) < 1e-9
    centre = np.array([0.0, RADIUS])
    off = np.abs(np.linalg.norm(x[middle] - centre, axis=1) - RADIUS)
    return comm.allreduce(float(off.max(initial=0.0)), op=MPI.MAX)


def draw(result, path):
    """The bent beam with its von Mises stress, the circle, tractions of the tie."""
    u, mises = result.u, result.material.mises(result.u)
    traction = result.contact.multiplier
    io.write_xdmf(path.with_suffix(".xdmf"), result.scene.mesh, [u, traction, mises])
    cells = drawing.gather_cells(result.scene.mesh, u, mises)
    if result.scene.mesh.comm.rank > 0:
        return
    plt = drawing.pyplot()
    figure, axes = plt.subplots(figsize=(6.0, 5.2), layout="constrained")
    x, moved, values = cells
    colours = drawing.draw_field(axes, x[..., :2] + moved, values)
    angle = np.linspace(0.0, ANGLE, 200)
    circle = RADIUS * np.sin(angle), RADIUS * (1.0 - np.cos(angle))
    axes.plot(*circle, "--", color=drawing.COMPUTED, lw=1.5, label="quarter circle")
    axes.set(aspect="equal")
    axes.axis("off")
    axes.legend(loc="upper left")
    figure.colorbar(colours, ax=axes, label="von Mises stress", shrink=0.7)
    figure.savefig(path)


def main(arguments=None):
    """Run the demo; 0 if it agrees with the closed forms."""
    parser = common.options("tied_cantilever", __doc__)
    parser.add_argument("--size", type=int, default=3, help="cells across the root")
    parser.add_argument("--degree", type=int, choices=(1, 2), default=2)
    args = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    result = solve(comm, args.size * (2 if args.fine else 1), args.degree)
    report, through = common.Report(comm), result.through
    report.effort(result.contact, result.iterations)
    report.newton("load steps", result.iterations, result.history)
    # The wall holds the master, which holds the slave: both act against the bending
    report.add("moment through the tie", -through.moment, BENDING / RADIUS, 0.02)
    report.add("the same at the wall", -result.wall_moment, -through.moment, 1e-8)
    off = np.linalg.norm(result.wall - through.force) * LENGTH
    report.add("forces in balance", 1.0 + off / BENDING * RADIUS, 1.0, 1e-8)
    deviation = axis_deviation(comm, result) / RADIUS
    report.add("radius of the axis at the cut", 1.0 + deviation, 1.0, 0.005)
    args.output.mkdir(parents=True, exist_ok=True)
    draw(result, args.output / "tied_cantilever.png")
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())

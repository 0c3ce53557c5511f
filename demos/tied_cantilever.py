"""A cantilever of two tied halves, bent into a quarter circle (2D, large rotation).

The cut is inclined, and the meshes of the halves do not match. The end is turned by a
right angle and led around, so that the beam is in pure bending. Closed form: moment
E' I / R, and the circle that the axis becomes; the wall balances the tie.
"""

import sys

from mpi4py import MPI

import common
import drawing
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from raymortar import io, tools

# Any consistent units. The cut is inclined against the axis
E, NU, LENGTH, HEIGHT, SLOPE, ANGLE = 1000.0, 0.3, 24.0, 1.0, 0.7, 0.5 * np.pi
RADIUS = LENGTH / ANGLE
MOMENT = E / (1.0 - NU**2) * HEIGHT**3 / 12.0 / RADIUS
WALL, END, SLAVE, MASTER = 1, 2, 3, 4


def half(first, n):
    """The half before the cut, or the one behind it, n cells across."""

    def place(x):
        t, y = x[:, 0], x[:, 1]
        cut = 0.5 * LENGTH + SLOPE * y
        along = t * cut if first else (1.0 - t) * cut + t * LENGTH
        return np.stack([along, y], axis=1)

    tags = {"left": WALL, "right": MASTER} if first else {"left": SLAVE, "right": END}
    corners, cells = ((0.0, -0.5 * HEIGHT), (1.0, 0.5 * HEIGHT)), int(0.5 * LENGTH) * n
    return Block((cells, n), *corners, mapping=place, tags=tags, body=str(first))


def on_circle(x, angle):
    """Displacement of points at the end of a beam that is bent by an angle."""
    radius, y = LENGTH / angle, x[1]
    along, up = radius * np.sin(angle), radius * (1.0 - np.cos(angle))
    return np.stack([along - y * np.sin(angle) - x[0], up + y * np.cos(angle) - y])


def main(arguments=None):
    """Run the demo; 0 if it agrees with the closed forms."""
    parser = common.options("tied_cantilever", __doc__)
    parser.add_argument("--size", type=int, default=3, help="cells across the root")
    args = parser.parse_args(arguments)
    comm, size = MPI.COMM_WORLD, args.size * (2 if args.fine else 1)

    # Two halves, the second one with half as many cells again across the beam
    blocks = [half(True, size), half(False, 3 * size // 2)]
    mesh, _, facet_tags = assemble_blocks(comm, blocks, "quadrilateral")

    # Neo-Hookean, plane strain
    V = tools.vector_space(mesh, 2)
    u, led = fem.Function(V, name="displacement"), fem.Function(V)
    v, F = ufl.TestFunction(V), ufl.Identity(2) + ufl.grad(u)
    mu, lmbda = E / (2.0 * (1.0 + NU)), E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU))
    log_J = ufl.ln(ufl.det(F))
    energy = 0.5 * mu * (ufl.inner(F, F) - 2 - 2 * log_J) + 0.5 * lmbda * log_J**2
    residual = ufl.derivative(energy * ufl.dx(degree=4), u, v)
    end = fem.locate_dofs_topological(V, 1, facet_tags.find(END))
    bcs = [tools.prescribe(V, facet_tags.find(WALL)), fem.dirichletbc(led, end)]

    tie = raymortar.Tie(u, facet_tags, [(SLAVE, MASTER)])
    problem = raymortar.NonlinearProblem(residual, tie, bcs)

    def bend(t):
        led.interpolate(lambda x: on_circle(x, t * ANGLE))

    path = raymortar.LoadSteps(problem.snes_solver, bend, steps=8).run()

    # The wall holds the master, which holds the slave: both act against the bending
    report, through = common.Report(comm), tie.resultant()
    report.effort(tie, [step.iterations for step in path])
    report.add("moment through the tie", -through.moment, MOMENT, 0.02)
    own = fem.locate_dofs_topological(V, 1, facet_tags.find(WALL))
    own = own[own < V.dofmap.index_map.size_local]
    force, at = problem.forces().reshape(-1, 2)[own], V.tabulate_dof_coordinates()[own]
    about = comm.allreduce((at[:, 0] * force[:, 1] - at[:, 1] * force[:, 0]).sum())
    report.add("the same at the wall", -about, -through.moment, 1e-8)
    off = np.linalg.norm(comm.allreduce(force.sum(axis=0)) - through.force)
    report.add("forces in balance", 1.0 + off * LENGTH / MOMENT, 1.0, 1e-8)
    cut = fem.locate_dofs_topological(V, 1, facet_tags.find(SLAVE))
    x = V.tabulate_dof_coordinates()[cut, :2]
    at = (x + u.x.array.reshape(-1, 2)[cut])[np.abs(x[:, 1]) < 1e-9]
    off = np.abs(np.linalg.norm(at - [0.0, RADIUS], axis=1) - RADIUS)
    off = comm.allreduce(float(off.max(initial=0.0)), op=MPI.MAX) / RADIUS
    report.add("radius of the axis at the cut", 1.0 + off, 1.0, 0.005)

    # A file for ParaView, and a picture: the beam on the circle
    args.output.mkdir(parents=True, exist_ok=True)
    density = tools.nodal_field(energy, mesh, "energy", quadrature_degree=4)
    file = args.output / "tied_cantilever.xdmf"
    io.write_xdmf(file, mesh, [u, tie.multiplier, density])
    cells = drawing.gather_cells(mesh, u, density)
    if comm.rank == 0:
        figure, axes = drawing.pyplot().subplots(figsize=(6, 5.2), layout="constrained")
        at = cells[0][..., :2] + cells[1]
        colours = drawing.draw_field(axes, at, cells[2])
        angle = np.linspace(0.0, ANGLE, 200)
        circle = RADIUS * np.sin(angle), RADIUS * (1.0 - np.cos(angle))
        axes.plot(*circle, "--", color=drawing.COMPUTED, lw=1.5, label="quarter circle")
        axes.axis("off")
        axes.legend(loc="upper left")
        figure.colorbar(colours, ax=axes, label="stored energy", shrink=0.7)
        figure.savefig(file.with_suffix(".png"))
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())

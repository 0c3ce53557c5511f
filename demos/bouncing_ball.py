"""Bouncing ball: a disc of rubber falls on a rigid floor and jumps (2D, plane strain).

Nothing takes energy: what the ball has in all, motion, height and stress, stays what it
was, and goes to and fro between them. Nodes of its surface have no mass
(dynamics.Inertia), or each impact would multiply the energy.
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
from meshes.discs import disc_blocks
from meshes.meshing import Scene, assemble_blocks
from raymortar import dynamics, io, rigid, tools

# Any consistent units
E, NU, DENSITY, GRAVITY, RADIUS, HEIGHT = 1000.0, 0.3, 1.0, 10.0, 0.5, 0.5
SURFACE = 1
FRAMES, TOP = 40, 300.0
# Shares of the time: the first falls and jumps
SHOWN = 0.0, 0.125, 0.175, 0.35, 0.525, 0.675


def fall(comm, n, end, dt, scheme=None, file=None, mass="nearest"):
    """Let the ball fall from a height above the floor."""
    blocks = disc_blocks(n, RADIUS, SURFACE, (0.0, RADIUS + HEIGHT))
    mesh, cells, facets = assemble_blocks(comm, blocks, "quadrilateral")
    V = tools.vector_space(mesh, 1)
    u, v, a = fem.Function(V, name="u"), ufl.TestFunction(V), ufl.TrialFunction(V)
    material = bodies.NeoHookean(E, NU)
    energy = material.energy(u, 2)
    weight = fem.Constant(mesh, np.array([0.0, -DENSITY * GRAVITY]))
    residual = material.residual(u, 2) - ufl.inner(weight, v) * ufl.dx

    floor = rigid.Plane((0.0, 0.0), (0.0, 1.0))
    contact = raymortar.Contact(u, facets, [(SURFACE, floor)])
    problem = raymortar.NonlinearProblem(residual, contact)
    inertia = dynamics.Inertia(DENSITY * ufl.inner(a, v) * ufl.dx, contact, mass)
    history = raymortar.History(problem, file)
    steps = dynamics.TimeSteps(
        problem.snes_solver, inertia, end=end, dt=dt, energy=energy, history=history,
        scheme=scheme or dynamics.Newmark(),
    )  # fmt: skip
    kept, iterations = common.follow(steps, u, FRAMES)
    return SimpleNamespace(
        scene=Scene(mesh, cells, facets, {}, {}), u=u, contact=contact, kept=kept,
        history=history, steps=steps, material=material, iterations=iterations,
    )  # fmt: skip


def balance(history):
    """Time, and kinetic, elastic and potential energy, over the first height's."""
    whole = DENSITY * np.pi * RADIUS**2 * GRAVITY * HEIGHT
    parts = history["kinetic"], history["elastic"], whole - history["external_work"]
    return history["time"], np.array(parts) / whole


def draw(result, path):
    """The ball at a few times, its energies, and an animation."""
    cells = drawing.gather_states(
        result.u, result.kept, lambda: result.material.mises(result.u)
    )
    fields = [result.u, result.steps.velocity]
    io.write_xdmf(path.with_suffix(".xdmf"), result.scene.mesh, fields)
    if result.scene.mesh.comm.rank > 0:
        return
    time, (kinetic, elastic, potential) = balance(result.history)
    figure, (left, right) = drawing.pyplot().subplots(
        1, 2, figsize=(10.0, 3.6), layout="constrained", width_ratios=[1.3, 1.0]
    )
    colours = drawing.side_by_side(left, cells, SHOWN, 1.1, TOP)
    figure.colorbar(colours, ax=left, label="von Mises stress", shrink=0.6)
    for values, label in ((kinetic, "kinetic"), (elastic, "elastic"),
                          (potential, "potential")):  # fmt: skip
        right.plot(time, values, label=label)
    whole = kinetic + elastic + potential
    right.plot(time, whole, color=drawing.EXACT, label="all")
    right.set(xlabel="time", ylabel="energy over the first one")
    right.legend(fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4)
    figure.savefig(path)
    frames = [(at, (x[..., :2] + u, mises)) for at, (x, u, mises) in cells]
    drawing.animate(path.with_suffix(".gif"), frames, (-0.7, 0.7, -0.1, 1.2), TOP)


def main(arguments=None):
    """Run the demo; 0 if the energy stays."""
    parser = common.options("bouncing_ball", __doc__)
    parser.add_argument("--size", type=int, default=6, help="facets of a quarter")
    parser.add_argument("--end", type=float, default=2.0, help="last time")
    parser.add_argument("--dt", type=float, default=1e-3, help="time step")
    args = parser.parse_args(arguments)
    report, refined = common.Report(MPI.COMM_WORLD), 2 if args.fine else 1
    args.output.mkdir(parents=True, exist_ok=True)
    file = args.output / "bouncing_ball.csv"
    result = fall(
        MPI.COMM_WORLD, refined * args.size, args.end, args.dt / refined, file=file
    )
    report.effort(result.contact, result.iterations, result.steps.halvings)
    whole = balance(result.history)[1].sum(axis=0)
    report.add("largest energy over the first", whole.max(), 1.0, 0.01)
    report.add("least energy over the first", whole.min(), 1.0, 0.01)
    draw(result, args.output / "bouncing_ball.png")
    return report.finish("exact")


if __name__ == "__main__":
    sys.exit(main())

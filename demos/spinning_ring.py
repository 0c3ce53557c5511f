"""Spinning ring: a ring of rubber hits a rigid floor, and friction takes its spin (2D).

Friction turns spin into speed along the floor, as with a ball that has topspin. What the
ring loses in moment of momentum is what contact exerts: the midpoint rule keeps it.
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
from meshes.discs import ring_blocks
from meshes.meshing import assemble_blocks
from raymortar import dynamics, io, rigid, tools

# Any consistent units
E, NU, DENSITY, FRICTION, DT = 2000.0, 0.3, 1.0, 0.4, 1e-3
RADII, HEIGHT, SPEED, SPIN = (0.35, 0.5), 0.6, 6.0, -15.0
SURFACE, FRAMES, TOP = 1, 40, 400.0
PARTS = "kinetic", "elastic", "friction_work"
GAINED = "momentum_x", "momentum_y", "moment_of_momentum"
EXERTED = "force_0_x", "force_0_y", "torque_origin_0"


def throw(comm, n, end, dt, file=None):
    """Throw the ring at the floor."""
    blocks = ring_blocks(n, RADII, 2, SURFACE, (0.0, HEIGHT))
    mesh, _, facets = assemble_blocks(comm, blocks, "quadrilateral")
    V = tools.vector_space(mesh, 1)
    u, v, a = fem.Function(V, name="u"), ufl.TestFunction(V), ufl.TrialFunction(V)
    material = bodies.NeoHookean(E, NU)
    floor = rigid.Plane((0.0, 0.0), (0.0, 1.0))
    contact = raymortar.Contact(
        u, facets, [(SURFACE, floor)], friction=raymortar.Coulomb(FRICTION)
    )
    problem = raymortar.NonlinearProblem(material.residual(u, 2), contact)
    inertia = dynamics.Inertia(DENSITY * ufl.inner(a, v) * ufl.dx, contact)
    history = raymortar.History(problem, file, axes={"origin": (0.0, 0.0)})
    start = fem.Function(V)
    at_rest = np.array([[SPEED / SPIN], [HEIGHT]])
    start.interpolate(lambda x: SPIN * ((x[:2] - at_rest) * [[1.0], [-1.0]])[::-1])
    steps = dynamics.TimeSteps(
        problem.snes_solver, inertia, end=end, dt=dt, scheme=dynamics.Midpoint(),
        velocity=start, energy=material.energy(u, 2), history=history,
    )  # fmt: skip
    kept, iterations = common.follow(steps, u, FRAMES)
    return SimpleNamespace(
        mesh=mesh, u=u, contact=contact, kept=kept, history=history, steps=steps,
        material=material, iterations=iterations,
    )  # fmt: skip


def missing(history):
    """Largest change of momentum, and of its moment, beside contact's, over the largest."""
    found, dt = [], np.diff(history["time"])
    for gained, exerted in zip(GAINED, EXERTED):
        change = np.diff(history[gained]) - dt * history[exerted][1:]
        found.append(np.abs(change).max() / np.abs(history[gained]).max())
    return found


def draw(result, path):
    """The ring at a few times, its spin and energies, and an animation."""
    u, h = result.u, result.history
    cells = drawing.gather_states(u, result.kept, lambda: result.material.mises(u))
    io.write_xdmf(path.with_suffix(".xdmf"), result.mesh, [u, result.steps.velocity])
    if result.mesh.comm.rank > 0:
        return
    options = {"figsize": (11.0, 3.2), "layout": "constrained"}
    options["width_ratios"] = [1.6, 1.0, 1.0]
    figure, (left, middle, right) = drawing.pyplot().subplots(1, 3, **options)
    shares = np.arange(5) / 5.0
    colours = drawing.side_by_side(left, cells, shares, 1.3, TOP)
    left.set(yticks=[0, 1])
    figure.colorbar(colours, ax=left, label="von Mises stress", shrink=0.6)
    for name in GAINED:
        middle.plot(h["time"], h[name], label=name.replace("_", " "))
    for name in PARTS:
        right.plot(h["time"], h[name], label=name.replace("_", " "))
    right.plot(h["time"], sum(map(h.__getitem__, PARTS)), color="k", label="all")
    for one, name in ((middle, "momentum"), (right, "energy")):
        one.set(xlabel="time", ylabel=name)
        one.legend(fontsize=7, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    figure.savefig(path)
    frames = [(at, (x[..., :2] + moved, mises)) for at, (x, moved, mises) in cells]
    drawing.animate(path.with_suffix(".gif"), frames, (-0.8, 1.6, -0.1, 1.4), TOP)


def main(arguments=None):
    """Run the demo; 0 if momentum and its moment are balanced."""
    parser = common.options("spinning_ring", __doc__)
    parser.add_argument("--size", type=int, default=10, help="facets of a quarter")
    parser.add_argument("--end", type=float, default=0.3, help="last time")
    args = parser.parse_args(arguments)
    report, refined = common.Report(MPI.COMM_WORLD), 2 if args.fine else 1
    args.output.mkdir(parents=True, exist_ok=True)
    n, dt = refined * args.size, DT / refined
    result = throw(MPI.COMM_WORLD, n, args.end, dt, args.output / "spinning_ring.csv")
    report.effort(result.contact, result.iterations, result.steps.halvings)
    for name, lack in zip(GAINED, missing(result.history)):
        report.add(f"1 + missing {name}", 1.0 + lack, 1.0, 1e-7)
    whole = sum(result.history[name] for name in PARTS)
    report.add("energy with that of friction", whole[-1], whole[0], 0.03)
    draw(result, args.output / "spinning_ring.png")
    return report.finish("exact")


if __name__ == "__main__":
    sys.exit(main())

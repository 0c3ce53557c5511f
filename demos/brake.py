"""A brake: a pad runs along a steel plate, heats it, expands and wears (2D).

Friction heats both sides, heat flows between them the better the larger the pressure is,
and the pad expands where it is warm. What friction does is what both bodies gain.
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
from meshes.meshing import Scene, assemble_blocks
from raymortar import io, tools

# mm, N, s, K: stresses in MPa, heat in N mm
LENGTHS, HEIGHTS, RUN, PUSH, TIME = (90.0, 20.0), (12.0, 10.0), 60.0, 0.3, 0.2
MU, WEAR, NU = 0.4, 1e-9, 0.3  # depth per pressure and slide
TAGS = {"held": 1, "master": 2, "slave": 3, "pushed": 4}
BODIES = {"plate": 1, "pad": 2}
E = {"plate": 2.1e5, "pad": 500.0}
CONDUCTIVITY, CAPACITY = {"plate": 50.0, "pad": 1.5}, {"plate": 3.8, "pad": 2.0}
EXPANSION = {"plate": 1.2e-5, "pad": 2e-5}


def conductance(T_s, T_m, p, g, v):
    """Heat from the pad to the plate, per area and time."""
    return 5.0 * (p + 1e-3) ** 0.95 * (T_s - T_m)


def scene_of(comm, size):
    """Plate and pad, with `size` cells along the pad, finer where they meet."""

    def block(k, x, sign, tags):
        def graded(x):
            return np.column_stack([x[:, 0], sign * HEIGHTS[k] * x[:, 1] ** 2])

        cells = int(size * LENGTHS[k] / LENGTHS[1]), size // 2
        ends = (x, min(sign, 0)), (x + LENGTHS[k], max(sign, 0))
        return Block(cells, *ends, mapping=graded, tags=tags)

    plate = block(0, 0.0, -1, {"bottom": TAGS["held"], "top": TAGS["master"]})
    pad = block(1, 5.0, 1, {"bottom": TAGS["slave"], "top": TAGS["pushed"]})
    return Scene(*assemble_blocks(comm, [plate, pad], "quadrilateral"), TAGS, BODIES)


def solve(comm, size, steps, report):
    """Press the pad and let it run; what is gained at each step."""
    scene = scene_of(comm, size)
    mesh, W = scene.mesh, tools.scalar_space(scene.mesh, 1)
    V = tools.vector_space(mesh, 1)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    T, s = fem.Function(W, name="temperature"), ufl.TestFunction(W)
    old = fem.Function(W)
    mu, alpha, k, c = (
        tools.by_body(mesh, scene.cell_tags, values, BODIES)
        for values in (E, EXPANSION, CONDUCTIVITY, CAPACITY)
    )
    mu, one = mu / (2.0 * (1.0 + NU)), ufl.Identity(2)
    strain = ufl.sym(ufl.grad(u)) - (1.0 + NU) * alpha * T * one
    stress = 2.0 * mu * (strain + NU / (1.0 - 2.0 * NU) * ufl.tr(strain) * one)
    dt, move = (fem.Constant(mesh, x) for x in (TIME / steps, np.array([0.0, -PUSH])))
    F_u = ufl.inner(stress, ufl.grad(v)) * ufl.dx
    F_T = (ufl.inner(k * ufl.grad(T), ufl.grad(s)) + c / dt * (T - old) * s) * ufl.dx
    ends = {"held": 0.0, "pushed": move}
    bcs = [tools.prescribe(V, scene.find(name), x) for name, x in ends.items()]
    pair, law = (TAGS["slave"], TAGS["master"]), raymortar.Coulomb(MU)
    contact = raymortar.Contact(u, scene.facet_tags, [pair], friction=law)
    flux = raymortar.fluxes.Flux(contact, T, conductance)
    wear = raymortar.fluxes.Wear(contact, raymortar.fluxes.Archard(WEAR))
    problem = raymortar.NonlinearProblem([F_u, F_T], [contact, flux], bcs, u=[u, T])
    problem.solve()  # no slide yet, and no heat
    contact.advance()
    rows, work = [], 0.0

    def apply(time, step):
        move.value[0], dt.value = RUN * time / TIME, step

    def accept():
        old.x.array[:] = T.x.array
        wear.accept()

    solver, more = problem.snes_solver, {"path": (0.0, TIME), "on_accept": accept}
    for step in raymortar.LoadSteps(solver, apply, steps, **more):
        work += contact.friction_work()
        gained = tools.integral(c * T * ufl.dx, mesh)
        rows.append((step.factor, gained, work, wear.volume()))
        report.say(f"{step.factor:.4f} s: {step.iterations} iterations, {work:.1f} N")
    return u, T, wear, np.array(rows)


def main(arguments=None):
    """Run the demo; 0 if heat and wear are what friction has done."""
    parser = common.options("brake", __doc__)
    parser.add_argument("--size", type=int, default=12, help="cells along the pad")
    parser.add_argument("--steps", type=int, default=30)
    args = parser.parse_args(arguments)
    report, size = common.Report(MPI.COMM_WORLD), args.size * (2 if args.fine else 1)
    args.output.mkdir(parents=True, exist_ok=True)
    u, T, wear, rows = solve(MPI.COMM_WORLD, size, args.steps, report)
    _, gained, work, volume = rows[-1]
    report.add("heat of both bodies", gained, work, 1e-8, "N")
    report.add("worn volume", volume, WEAR * work / MU, 0.01, "mm2")
    io.write_xdmf(args.output / "brake.xdmf", T.function_space.mesh, [u, T, wear.depth])
    time, gained, work, _ = rows.T
    curves = (time, work, "work of friction"), (time, gained, "heat of both bodies")
    axes = {"xlabel": "time (s)", "ylabel": "work, heat (N mm/mm)", "xlim": (0, None)}
    path, label = args.output / "brake.png", "temperature (K)"
    drawing.field_and_curve(path, u, T, label, *curves, axes)
    return report.finish("friction")


if __name__ == "__main__":
    sys.exit(main())

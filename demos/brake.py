"""A brake: a pad runs along a steel plate, heats it, expands and wears (2D).

Friction heats both sides, and heat flows from one to the other by a conductance that
grows with the pressure. The pad expands where it is warm, so pressure, heat and wear
depend on each other: displacement and temperature are solved for together. All else is
insulated: what friction does is what both bodies gain, and what is worn follows Archard.
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
        rows, height = size // 2, sign * HEIGHTS[k]
        cells = (int(size * LENGTHS[k] / LENGTHS[1]), rows)
        low, high = sorted((0.0, sign * 1.0))

        def graded(x):
            return np.column_stack([x[:, 0], height * np.abs(x[:, 1]) ** 2])

        ends = (x, low), (x + LENGTHS[k], high)
        return Block(cells, *ends, mapping=graded, tags=tags)

    plate = block(0, 0.0, -1, {"bottom": TAGS["held"], "top": TAGS["master"]})
    pad = block(1, 5.0, 1, {"bottom": TAGS["slave"], "top": TAGS["pushed"]})
    made = assemble_blocks(comm, [plate, pad], "quadrilateral")
    return Scene(*made, TAGS, BODIES)


def solve(comm, size, steps, report):
    """Press the pad and let it run; what is gained at each step."""
    scene = scene_of(comm, size)
    mesh = scene.mesh
    V, W = tools.vector_space(mesh, 1), tools.scalar_space(mesh, 1)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    T, old, s = (
        fem.Function(W, name="temperature"),
        fem.Function(W),
        ufl.TestFunction(W),
    )
    mu, alpha, k, c = (
        tools.by_body(mesh, scene.cell_tags, values, BODIES)
        for values in (E, EXPANSION, CONDUCTIVITY, CAPACITY)
    )
    mu, one = mu / (2.0 * (1.0 + NU)), ufl.Identity(2)
    strain = ufl.sym(ufl.grad(u)) - (1.0 + NU) * alpha * T * one
    stress = 2.0 * mu * (strain + NU / (1.0 - 2.0 * NU) * ufl.tr(strain) * one)
    dt, move = fem.Constant(mesh, TIME / steps), fem.Constant(mesh, np.zeros(2))
    F_u = ufl.inner(stress, ufl.grad(v)) * ufl.dx
    F_T = (ufl.inner(k * ufl.grad(T), ufl.grad(s)) + c / dt * (T - old) * s) * ufl.dx
    bcs = [tools.prescribe(V, scene.find("held"))]
    bcs.append(tools.prescribe(V, scene.find("pushed"), move))
    pairs, friction = [(TAGS["slave"], TAGS["master"])], raymortar.Coulomb(MU)
    contact = raymortar.Contact(u, scene.facet_tags, pairs, friction=friction)
    flux = raymortar.Flux(contact, T, conductance)
    wear = raymortar.Wear(contact, raymortar.Archard(WEAR))
    problem = raymortar.NonlinearProblem([F_u, F_T], [contact, flux], bcs, u=[u, T])
    move.value[1] = -PUSH
    problem.solve()  # no slide yet, and no heat
    contact.advance()
    rows, work = [], 0.0

    def apply(time, step):
        move.value[0], dt.value = RUN * time / TIME, step

    def accept():
        old.x.array[:] = T.x.array
        wear.accept()

    solver, path = problem.snes_solver, (0.0, TIME)
    for step in raymortar.LoadSteps(solver, apply, steps, path=path, on_accept=accept):
        work += contact.friction_work()
        gained = tools.integral(c * T * ufl.dx, mesh)
        peak = comm.allreduce(T.x.array.max(), op=MPI.MAX)
        rows.append((step.factor, gained, work, peak, wear.volume()))
        report.say(
            f"{step.factor:.4f} s: {step.iterations:2} iterations, force "
            f"{contact.resultant().force[1]:.2f} N/mm, peak {peak:.1f} K"
        )
    return scene, u, T, wear, np.array(rows)


def draw(scene, u, T, wear, rows, path):
    """The temperature at the end, and work and heat over time."""
    io.write_xdmf(path.with_suffix(".xdmf"), scene.mesh, [u, T, wear.depth])
    cells = drawing.gather_cells(scene.mesh, u, T)
    if scene.mesh.comm.rank > 0:
        return
    plt = drawing.pyplot()
    fig, (left, right) = plt.subplots(1, 2, figsize=(11, 3.4), layout="constrained")
    colours = drawing.draw_field(left, cells[0][..., :2] + cells[1], cells[2])
    left.axis("off")
    fig.colorbar(colours, ax=left, label="temperature [K]", shrink=0.8)
    time, gained, work, peak, _ = rows.T
    right.plot(time, work, color=drawing.EXACT, label="work of friction")
    right.plot(time, gained, "o", color=drawing.COMPUTED, label="heat of both bodies")
    right.set(xlabel="time [s]", ylabel="N mm / mm", xlim=(0, None), ylim=(0, None))
    right.legend(loc="upper left")
    fig.savefig(path)


def main(arguments=None):
    """Run the demo; 0 if heat and wear are what friction has done."""
    parser = common.options("brake", __doc__)
    parser.add_argument("--size", type=int, default=12, help="cells along the pad")
    parser.add_argument("--steps", type=int, default=30)
    args = parser.parse_args(arguments)
    report = common.Report(MPI.COMM_WORLD)
    args.output.mkdir(parents=True, exist_ok=True)
    size = args.size * (2 if args.fine else 1)
    result = solve(MPI.COMM_WORLD, size, args.steps, report)
    _, gained, work, _, volume = result[-1][-1]
    report.add("heat of both bodies", gained, work, 1e-8, "N")
    report.add("worn volume", volume, WEAR * work / MU, 0.01, "mm2")
    draw(*result, args.output / "brake.png")
    return report.finish("friction")


if __name__ == "__main__":
    sys.exit(main())

"""A brake: a pad is pressed on a steel plate that runs below it, heats it and wears (2D).

The plate's motion is that of the pad, seen from the plate. Friction heats both sides, and
heat flows from one to the other by a conductance that grows with the pressure. The pad
expands as it warms up, so pressure, heat and wear all depend on each other: displacement
and temperature are solved for together. All else is insulated, so that what friction
does is what both bodies have gained, and Archard's law wears k times force times slide.
"""

import sys
from types import SimpleNamespace

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
PAD, PLATE, RUN, PUSH, TIME = (20.0, 10.0), (90.0, 12.0), 60.0, 0.04, 6e-3
MU, WEAR = 0.4, 1e-9  # mm of depth per MPa and mm of slide
TAGS = {"held": 1, "master": 2, "slave": 3, "pushed": 4}
BODIES = {"plate": 1, "pad": 2}
E, NU = {"plate": 2.1e5, "pad": 500.0}, 0.3
CONDUCTIVITY, CAPACITY = {"plate": 50.0, "pad": 1.5}, {"plate": 3.8, "pad": 2.0}
EXPANSION = {"plate": 1.2e-5, "pad": 2e-5}


def conductance(T_s, T_m, p, g, v):
    """Heat from the pad to the plate, per area and time."""
    return 200.0 * (p + 1e-3) ** 0.95 * (T_s - T_m)


def scene_of(comm, size):
    """Plate and pad, with `size` cells along the pad. Collective."""
    plate = Block(
        (4 * size, size // 2),
        (0.0, -PLATE[1]),
        (PLATE[0], 0.0),
        tags={"bottom": TAGS["held"], "top": TAGS["master"]},
    )
    pad = Block(
        (size, size // 2),
        (5.0, 0.0),
        (5.0 + PAD[0], PAD[1]),
        tags={"bottom": TAGS["slave"], "top": TAGS["pushed"]},
    )
    mesh, cells, facets = assemble_blocks(comm, [plate, pad], "quadrilateral")
    return Scene(mesh, cells, facets, TAGS, BODIES)


def solve(comm, size=12, steps=30, report=None):
    """Press the pad and let it run; what is gained at each step."""
    scene = scene_of(comm, size)
    mesh = scene.mesh
    V, W = tools.vector_space(mesh, 1), tools.scalar_space(mesh, 1)
    u, T = fem.Function(V, name="displacement"), fem.Function(W, name="temperature")
    old, v, s = fem.Function(W), ufl.TestFunction(V), ufl.TestFunction(W)
    by_body = lambda values: tools.by_body(mesh, scene.cell_tags, values, BODIES)
    mu = by_body({name: one / (2.0 * (1.0 + NU)) for name, one in E.items()})
    strain = ufl.sym(ufl.grad(u)) - (1.0 + NU) * by_body(EXPANSION) * T * ufl.Identity(
        2
    )
    bulk = 2.0 * NU / (1.0 - 2.0 * NU) * ufl.tr(strain)
    stress = mu * (2.0 * strain + bulk * ufl.Identity(2))
    k, c, dt = (
        by_body(CONDUCTIVITY),
        by_body(CAPACITY),
        fem.Constant(mesh, TIME / steps),
    )
    F_u = ufl.inner(stress, ufl.grad(v)) * ufl.dx
    F_T = (ufl.inner(k * ufl.grad(T), ufl.grad(s)) + c / dt * (T - old) * s) * ufl.dx
    move = fem.Constant(mesh, np.zeros(2))
    bcs = [tools.prescribe(V, scene.find("held"))]
    bcs += [tools.prescribe(V, scene.find("pushed"), move)]
    contact = raymortar.Contact(
        u,
        scene.facet_tags,
        [(TAGS["slave"], TAGS["master"])],
        friction=raymortar.Coulomb(MU),
    )
    flux = raymortar.Flux(contact, T, conductance)
    wear = raymortar.Wear(contact, raymortar.Archard(WEAR))
    problem = raymortar.NonlinearProblem([F_u, F_T], [contact, flux], bcs, u=[u, T])
    move.value[1] = -PUSH
    problem.solve()  # no slide yet, and no heat
    contact.advance()
    rows, pressed = [], SimpleNamespace(work=0.0, slid=0.0)

    def apply(time, step):
        move.value[0], dt.value = RUN * time / TIME, step

    def accept():
        old.x.array[:] = T.x.array
        wear.accept()

    path = raymortar.LoadSteps(
        problem.snes_solver, apply, steps, path=(0.0, TIME), on_accept=accept
    )
    for step in path:
        force = -contact.resultant().normal[1]
        pressed.work += contact.friction_work()
        pressed.slid += abs(contact.resultant().tangential[0]) / MU * RUN / steps
        gained = tools.integral(c * T * ufl.dx, mesh)
        peak = comm.allreduce(T.x.array.max(), op=MPI.MAX)
        rows.append((1e3 * step.factor, gained, pressed.work, peak, wear.volume()))
        if report is not None:
            report.say(
                f"{rows[-1][0]:6.3f} ms: {step.iterations:2} iterations, force {force:8.2f}"
                f" N/mm, heat {gained:9.1f} N, peak {peak:6.1f} K"
            )
    return SimpleNamespace(
        scene=scene, u=u, T=T, contact=contact, wear=wear, rows=np.array(rows),
        worn=WEAR * pressed.slid,
    )  # fmt: skip


def draw(result, path):
    """The temperature at the end, and heat and peak over time."""
    mesh, u, T = result.scene.mesh, result.u, result.T
    io.write_xdmf(path.with_suffix(".xdmf"), mesh, [u, T, result.wear.depth])
    cells = drawing.gather_cells(mesh, u, T)
    if mesh.comm.rank > 0:
        return
    plt = drawing.pyplot()
    fig, (left, right) = plt.subplots(1, 2, figsize=(11, 3.4), layout="constrained")
    x, displacement, values = cells
    colours = drawing.draw_field(left, x[..., :2] + displacement, values)
    left.axis("off")
    fig.colorbar(colours, ax=left, label="temperature [K]", shrink=0.8)
    time, gained, work, peak, _ = result.rows.T
    right.plot(time, work, "--", color=drawing.EXACT, label="work of friction")
    right.plot(
        time, gained, ":", color=drawing.COMPUTED, lw=3, label="heat of both bodies"
    )
    right.set(
        xlabel="time [ms]", ylabel="N mm per mm", xlim=(0.0, None), ylim=(0.0, None)
    )
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
    report.effort(result.contact)
    _, gained, work, peak, volume = result.rows[-1]
    report.add("heat of both bodies", gained, work, 1e-8, "N")
    report.add("worn volume", volume, result.worn, 1e-3, "mm2")
    report.add("peak temperature", peak, peak, unit="K")
    draw(result, args.output / "brake.png")
    return report.finish("friction")


if __name__ == "__main__":
    sys.exit(main())

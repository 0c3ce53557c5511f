"""Self-contact: the upper arm of a C is pressed down until it lies on the lower arm.

Nobody names what meets: all facets of the mesh may meet. The box is that of papers on
third media (Wriggers et al. 2025, doi:10.1016/j.cma.2025.117740). Beside it: the same
box with two named sides and a multiplier, and before contact the bending of a beam.
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
from meshes.meshing import assemble_blocks
from raymortar import io, tools

L, H, WALL, K, MU, WAY = 1.0, 0.5, 0.1, 5 / 3, 5 / 14, 0.9
LEFT, UPPER, LOWER = 1, 2, 3
# Force over displacement of a beam: E = 1, nu = 0.4
BEAM = 3 / (1 - 0.4**2) * WALL**3 / 12 / (L - WALL) ** 3


def box(comm, n):
    """The C with n cells through its walls. Collective."""
    x, y = (0.0, WALL, L), (0.0, WALL, H - WALL, H)
    cells = (n, round(n * (L / WALL - 1))), (n, round(n * (H / WALL - 2)), n)
    blocks = []
    for i, j in ((0, 0), (0, 1), (0, 2), (1, 0), (1, 2)):
        sides = {"left": LEFT} if i == 0 else {}
        if i == 1:  # the inner sides of the arms, and the end of the upper one
            sides = {"top": LOWER} if j == 0 else {"bottom": UPPER, "right": UPPER}
        at = (x[i], y[j]), (x[i + 1], y[j + 1])
        blocks.append(Block((cells[0][i], cells[1][j]), *at, tags=sides, body="C"))
    return assemble_blocks(comm, blocks, "quadrilateral")


def press(comm, n, steps, pairs, method=None, frame="automatic"):
    """Move the corner down. Collective."""
    mesh, _, facets = box(comm, n)
    V = tools.vector_space(mesh, 2)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    F = ufl.Identity(2) + ufl.grad(u)
    J = ufl.det(F)
    shear = J ** (-2 / 3) * (ufl.inner(F, F) + 1) - 3
    energy = K / 2 * ufl.ln(J) ** 2 + MU / 2 * shear
    residual = ufl.derivative(energy * ufl.dx(degree=4), u, v)
    moved = fem.Function(V.sub(1).collapse()[0])
    corner = lambda x: np.isclose(x[0], L) & np.isclose(x[1], H)
    at = fem.locate_dofs_geometrical((V.sub(1), moved.function_space), corner)
    push = fem.dirichletbc(moved, at, V.sub(1))
    bcs = [tools.prescribe(V, facets.find(LEFT)), push]

    contact = raymortar.Contact(u, facets, pairs, method, frame=frame)
    problem = raymortar.NonlinearProblem(residual, contact, bcs)
    history = raymortar.History(problem, reactions={"corner": [push]})

    def move(t):
        moved.x.array[:] = -WAY * t

    path = raymortar.LoadSteps(problem.snes_solver, move, steps, history=history)
    return SimpleNamespace(
        u=u,
        contact=contact,
        steps=list(path),
        way=WAY / H * np.array(history["time"]),
        force=-np.array(history["reaction_corner_y"]),
    )


def draw(found, named, path, parts):
    """The box, and its force over the way of the corner."""
    figure, (left, right) = drawing.pyplot().subplots(1, 2, figsize=(10, 4))
    x, u = parts
    at, size = x[..., :2] + u, np.linalg.norm(u, axis=-1, keepdims=True)
    colours = drawing.draw_field(left, at, size)
    left.set(xticks=[0.0, 0.5])
    figure.colorbar(colours, ax=left, label="displacement")
    right.plot(named.way, named.force, color=drawing.EXACT, label="two named sides")
    right.plot(found.way, found.force, "o", color=drawing.COMPUTED, label='"all"')
    right.plot(found.way, BEAM * H * found.way, "--", color="0.5", label="beam")
    right.set(xlabel="way of the corner / H", ylabel="force on the corner")
    right.legend()
    figure.savefig(path, bbox_inches="tight")


def main(arguments=None):
    """Run the demo; 0 if the force is that of named sides."""
    parser = common.options("c_box", __doc__)
    parser.add_argument("--size", type=int, default=2, help="cells through the wall")
    parser.add_argument("--steps", type=int, default=18, help="load steps")
    args = parser.parse_args(arguments)
    comm, report = MPI.COMM_WORLD, common.Report(MPI.COMM_WORLD)
    args.output.mkdir(parents=True, exist_ok=True)
    size = args.size * (1 + args.fine)
    # The sharp corner of one arm slides on the flat side of the other: its normal counts
    found = press(comm, size, args.steps, "all", raymortar.Penalty(), "master")
    named = press(comm, size, args.steps, [(LOWER, UPPER)])
    report.effort(found.contact, [s.iterations for s in found.steps])
    report.say(", ".join(map(str, found.contact.results.meetings())))
    middle = (np.interp(1.0, one.way, one.force) for one in (found, named))
    report.add("force where way = H", *middle, 0.03)
    report.add("force at the end", found.force[-1], named.force[-1], 0.01)
    report.add("first step, of a beam", found.force[0], BEAM * H * found.way[0], 0.2)
    mesh = found.u.function_space.mesh
    io.write_xdmf(args.output / "c_box.xdmf", mesh, [found.u, found.contact.pressure()])
    parts = drawing.gather_cells(mesh, found.u)
    if comm.rank == 0:
        draw(found, named, args.output / "c_box.png", parts)
    return report.finish("named sides")


if __name__ == "__main__":
    sys.exit(main())

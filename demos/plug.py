"""A rubber stopper is pushed into a conical hole, with friction: axisymmetric and in 3D.

The stopper has a bore for a tube. Its section in (r, z) with `axisymmetric=True`
against a slice of 30 degrees in 3D. The hole is rigid: a `Line` of the half plane is a
cone in a full turn, and in 3D a hollow `Cone`. Both have a penalty of one stiffness:
multipliers are of another degree in 3D than in the plane.
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
from raymortar import io, rigid, tools

# Lengths in cm, stresses in N/cm^2, forces in N
BORE, FOOT, HEIGHT, SLOPE, PUSH = 0.4, 1.0, 2.0, np.tan(np.radians(8.0)), 0.6
ROUND = 0.6  # height of the rounded foot
E, NU, FRICTION, STIFFNESS = 200.0, 0.45, 0.3, 5e4
ANGLE = np.radians(30.0)
TAGS = {"slave": 1, "top": 2, "cut": 3, "far_cut": 4}
MATERIAL = bodies.NeoHookean(E, NU)


def shaped(x):
    """(r, z) of the stopper from the unit square."""
    z = HEIGHT * x[:, 1]
    outside = FOOT + SLOPE * z - 0.4 * np.maximum(ROUND - z, 0.0) ** 2
    return np.column_stack([BORE + x[:, 0] * (outside - BORE), z])


def section(comm, size):
    """The stopper in the half plane. Collective."""
    tags = {"right": TAGS["slave"], "top": TAGS["top"]}
    block = Block(
        (size, 2 * size), (0.0, 0.0), (1.0, 1.0), mapping=shaped, tags=tags, body="plug"
    )
    made = assemble_blocks(comm, [block], "quadrilateral", geometry_degree=2)
    return Scene(*made, TAGS, {"plug": 1})


def slice_of(comm, size):
    """A slice of the stopper around the z axis. Collective."""

    def turned(x):
        r, z = shaped(x[:, [0, 2]]).T
        angle = ANGLE * x[:, 1]
        return np.column_stack([r * np.cos(angle), r * np.sin(angle), z])

    tags = {"right": TAGS["slave"], "top": TAGS["top"]}
    block = Block(
        (size, max(size // 2, 1), 2 * size),
        (0.0, 0.0, 0.0),
        (1.0, 1.0, 1.0),
        mapping=turned,
        tags={**tags, "front": TAGS["cut"], "back": TAGS["far_cut"]},
        body="plug",
    )
    made = assemble_blocks(comm, [block], "hexahedron", geometry_degree=2)
    return Scene(*made, TAGS, {"plug": 1})


def slice_form(u, scene):
    """That of the slice, whose far cut slides on its plane: held by stiff springs."""
    v = ufl.TestFunction(u.function_space)
    dx = ufl.dx(metadata={"quadrature_degree": 6})
    energy = MATERIAL.density(ufl.Identity(3) + ufl.grad(u))
    normal = ufl.as_vector([-np.sin(ANGLE), np.cos(ANGLE), 0.0])
    ds = ufl.ds(
        domain=scene.mesh,
        subdomain_data=scene.facet_tags,
        metadata={"quadrature_degree": 6},
    )
    springs = 1e5 * E * ufl.dot(u, normal) * ufl.dot(v, normal) * ds(TAGS["far_cut"])
    return ufl.derivative(energy * dx, u, v) + springs


def problem_of(comm, turns, size):
    """Displacement, form, conditions and hole. Collective."""
    scene = section(comm, size) if turns else slice_of(comm, size)
    V = tools.vector_space(scene.mesh, 2)
    u = fem.Function(V, name="displacement")
    down = fem.Constant(scene.mesh, 0.0)
    bcs = [tools.prescribe(V, scene.find("top"), down, 1 if turns else 2)]
    if turns:
        hole = rigid.Line((FOOT, 0.0), (-1.0, SLOPE))
        return scene, u, MATERIAL.turned_residual(u, 6), bcs, hole, down
    bcs.append(tools.prescribe(V, scene.find("cut"), component=1))
    tip, angle = (0.0, 0.0, -FOOT / SLOPE), np.arctan(SLOPE)
    hole = rigid.Cone(tip, (0.0, 0.0, 1.0), angle, hollow=True)
    return scene, u, slice_form(u, scene), bcs, hole, down


def solve(comm, turns, size=6, steps=6):
    """Push the stopper in, as a section or as a slice in 3D. Collective."""
    scene, u, F, bcs, hole, down = problem_of(comm, turns, size)
    contact = raymortar.Contact(
        u,
        scene.facet_tags,
        [(TAGS["slave"], hole)],
        raymortar.Penalty(STIFFNESS),
        friction=raymortar.Coulomb(FRICTION),
        axisymmetric=turns,
    )
    problem = raymortar.NonlinearProblem(F, contact, bcs)
    history = raymortar.History(problem, reactions={"top": bcs[0]})

    def apply(t):
        down.value = -PUSH * t

    path = raymortar.LoadSteps(
        raymortar.SNESSolver(problem), apply, steps, history=history
    )
    iterations = [step.iterations for step in path.run()]
    # Of the whole stopper, at the ends of the steps that were asked for
    part, axis = (1.0, 1) if turns else (2.0 * np.pi / ANGLE, 2)
    time = history["time"]
    at = [np.argmin(abs(time - k / steps)) for k in range(1, steps + 1)]
    normal, along, support = (
        part * history.vectors(name)[at, axis]
        for name in ("normal_0", "tangential_0", "reaction_top")
    )
    return SimpleNamespace(
        scene=scene,
        u=u,
        contact=contact,
        iterations=iterations,
        residuals=list(problem.history),
        push=PUSH * time[at],
        normal=normal,
        friction=along,
        support=support,
    )


def draw(section, space, path):
    """The section with its pressure in the rubber, and the forces over the push."""
    field = tools.nodal_field(
        von_mises_of_revolution(section.u), section.scene.mesh, "mises", 1, 4
    )
    cells = drawing.gather_cells(section.scene.mesh, section.u, field)
    if section.scene.mesh.comm.rank > 0:
        return
    plt = drawing.pyplot()
    figure, (left, right) = plt.subplots(
        1, 2, figsize=(9.5, 4.2), layout="constrained", width_ratios=[1.0, 1.3]
    )
    x, u, mises = cells
    colours = drawing.draw_field(left, x[..., :2] + u, mises, [(1, 1), (-1, 1)])
    ends = np.array([-PUSH - 0.2, HEIGHT - 0.2])
    for side in (1.0, -1.0):
        left.plot(side * (FOOT + SLOPE * ends), ends, color=drawing.EXACT, lw=2)
    left.set(aspect="equal")
    left.axis("off")
    figure.colorbar(colours, ax=left, label="von Mises stress [N/cm²]", shrink=0.7)
    for name, one, style in (
        ("axisymmetric", section, "-"),
        ("slice in 3D", space, "o"),
    ):
        for part, values in (
            ("push", one.normal + one.friction),
            ("friction", one.friction),
        ):
            right.plot(
                one.push,
                values,
                style,
                mfc="none",
                color=drawing.COMPUTED if part == "push" else drawing.EXACT,
                label=f"{part}, {name}",
            )
    right.set(xlabel="push [cm]", ylabel="force [N]", xlim=(0, None), ylim=(0, None))
    right.legend()
    figure.savefig(path)


def von_mises_of_revolution(u):
    """Equivalent Cauchy stress with the hoops."""
    r = ufl.SpatialCoordinate(u.function_space.mesh)[0]
    H = ufl.grad(u)
    F = ufl.Identity(3) + ufl.as_tensor(
        [[H[0, 0], H[0, 1], 0], [H[1, 0], H[1, 1], 0], [0, 0, u[0] / r]]
    )
    J, one = ufl.det(F), ufl.Identity(3)
    stress = MATERIAL.mu / J * (F * F.T - one) + MATERIAL.lmbda * ufl.ln(J) / J * one
    return tools.von_mises(stress)


def main(arguments=None):
    """Run the demo; 0 if the section agrees with the slice."""
    parser = common.options("plug", __doc__)
    parser.add_argument("--size", type=int, default=6, help="cells across the rubber")
    parser.add_argument("--steps", type=int, default=6)
    args = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    size = args.size * (2 if args.fine else 1)
    report, found = common.Report(comm), {}
    args.output.mkdir(parents=True, exist_ok=True)
    for name, turns in (("axisymmetric", True), ("slice in 3D", False)):
        found[name] = one = solve(comm, turns, size, args.steps)
        report.effort(one.contact)
        report.newton(f"{name}, load steps", one.iterations, one.residuals)
    section, space = found.values()
    ours, other = (one.normal + one.friction for one in (section, space))
    report.add("push at the end", ours[-1], other[-1], 0.01, "N")
    worst = np.abs(ours - other).max() / other.max()
    report.add("1 + largest difference of pushes", 1.0 + worst, 1.0, 0.01)
    for part in ("normal", "friction"):
        ours, other = (getattr(one, part)[-1] for one in (section, space))
        report.add(f"{part} tractions' share", ours, other, 0.01, "N")
    off = np.abs(section.support + section.normal + section.friction).max()
    report.add("1 + imbalance", 1.0 + off / np.abs(section.support).max(), 1.0, 1e-7)
    traction = section.contact.traction("normal")
    io.write_xdmf(args.output / "plug.xdmf", section.scene.mesh, [section.u, traction])
    draw(section, space, args.output / "plug.png")
    return report.finish("slice")


if __name__ == "__main__":
    sys.exit(main())

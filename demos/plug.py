"""A rubber stopper is pushed into a conical hole, with friction: axisymmetric and in 3D.

The stopper has a bore for a tube. Its section in (r, z) with `axisymmetric=True`
against a slice of 30 degrees in 3D. The hole is rigid: a `Line` of the half plane is a
cone in a full turn, and in 3D a hollow `Cone`. Both have a penalty of one stiffness:
multipliers are of another degree in 3D than in the plane.
"""

import sys

from mpi4py import MPI

import common
import drawing
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.stopper import ANGLE, FOOT, SLOPE, section, slice_of
from raymortar import io, rigid, tools

# Lengths in cm, stresses in N/cm^2, forces in N
PUSH, E, NU, FRICTION, STIFFNESS = 0.6, 200.0, 0.45, 0.3, 5e4
MU, LAMBDA = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))


def push_in(comm, turns, size, steps):
    """Push the stopper in, as a section or as a slice in 3D; forces on the whole of it at
    the ends of the steps. Collective."""
    scene = section(comm, size) if turns else slice_of(comm, size)
    mesh, V = scene.mesh, tools.vector_space(scene.mesh, 2)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    rule, H = {"quadrature_degree": 6}, ufl.grad(u)
    if turns:
        # Hoops stretch by u_r / r, and 2 pi r is a weight
        r, axis = ufl.SpatialCoordinate(mesh)[0], 1
        plane = [[H[0, 0], H[0, 1], 0], [H[1, 0], H[1, 1], 0]]
        H = ufl.as_tensor([*plane, [0, 0, u[0] / r]])
        weight, hole = 2 * ufl.pi * r, rigid.Line((FOOT, 0.0), (-1.0, SLOPE))
    else:
        tip, angle = (0.0, 0.0, -FOOT / SLOPE), np.arctan(SLOPE)
        hole = rigid.Cone(tip, (0.0, 0.0, 1.0), angle, hollow=True)
        weight, axis = 1, 2
    I, F = ufl.Identity(3), ufl.Identity(3) + H
    J = ufl.det(F)
    energy = MU * (ufl.inner(F, F) - 3 - 2 * ufl.ln(J)) + LAMBDA * ufl.ln(J) ** 2
    residual = ufl.derivative(0.5 * weight * energy * ufl.dx(metadata=rule), u, v)
    stress = MU / J * (F * F.T - I) + LAMBDA * ufl.ln(J) / J * I
    down = fem.Constant(mesh, 0.0)
    bcs = [tools.prescribe(V, scene.find("top"), down, axis)]
    if not turns:
        bcs.append(tools.prescribe(V, scene.find("cut"), component=1))
        # The far cut slides on its plane: stiff springs hold it there
        n = ufl.as_vector([-np.sin(ANGLE), np.cos(ANGLE), 0.0])
        ds = ufl.Measure("ds", mesh, subdomain_data=scene.facet_tags, metadata=rule)
        far = ds(scene.tags["far_cut"])
        residual += 1e5 * E * ufl.dot(u, n) * ufl.dot(v, n) * far

    contact = raymortar.Contact(
        u, scene.facet_tags, [(scene.tags["slave"], hole)], raymortar.Penalty(STIFFNESS),
        friction=raymortar.Coulomb(FRICTION), axisymmetric=turns,
    )  # fmt: skip
    problem = raymortar.NonlinearProblem(residual, contact, bcs)
    history = raymortar.History(problem, reactions={"top": bcs[0]})

    def push(t):
        down.value = -PUSH * t

    path = raymortar.LoadSteps(problem.snes_solver, push, steps, history=history).run()
    at = [np.argmin(abs(history["time"] - k / steps)) for k in range(1, steps + 1)]
    part = 1.0 if turns else 2.0 * np.pi / ANGLE
    names = "normal_0", "tangential_0", "reaction_top"
    forces = [part * history.vectors(name)[at, axis] for name in names]
    iterations = [step.iterations for step in path], list(problem.history)
    return u, contact, stress, iterations, PUSH * history["time"][at], *forces


def main(arguments=None):
    """Run the demo; 0 if the section agrees with the slice."""
    parser = common.options("plug", __doc__)
    parser.add_argument("--size", type=int, default=6, help="cells across the rubber")
    parser.add_argument("--steps", type=int, default=12)
    args = parser.parse_args(arguments)
    comm, size = MPI.COMM_WORLD, args.size * (2 if args.fine else 1)
    args.output.mkdir(parents=True, exist_ok=True)
    report, found = common.Report(comm), []
    for name, turns in (("axisymmetric", True), ("slice in 3D", False)):
        found.append(push_in(comm, turns, size, args.steps))
        report.effort(found[-1][1])
        report.newton(f"{name}, load steps", *found[-1][3])
    (u, contact, stress, _, way, *parts), (*_, other, along, _) = found
    normal, friction, support = parts
    ours, theirs = normal + friction, other + along
    report.add("push at the end", ours[-1], theirs[-1], 0.01, "N")
    worst = np.abs(ours - theirs).max() / theirs.max()
    report.add("1 + largest difference of pushes", 1.0 + worst, 1.0, 0.01)
    report.add("normal tractions' share", normal[-1], other[-1], 0.01, "N")
    report.add("friction tractions' share", friction[-1], along[-1], 0.01, "N")
    off = np.abs(support + ours).max() / np.abs(support).max()
    report.add("1 + imbalance", 1.0 + off, 1.0, 1e-7)

    mesh, file = u.function_space.mesh, args.output / "plug.png"
    io.write_xdmf(file.with_suffix(".xdmf"), mesh, [u, contact.traction("normal")])
    mises = tools.nodal_field(tools.von_mises(stress), mesh, "mises", 1, 4)
    axes = {"xlabel": "push (cm)", "ylabel": "force, below it friction's part (N)"}
    label, gap = "von Mises stress (N/cm²)", [np.nan]
    way = np.concatenate([way, gap, way])
    forces = [
        np.concatenate([f, gap, g]) for f, g in ((ours, friction), (theirs, along))
    ]
    curves = (way, forces[1], "slice in 3D"), (way, forces[0], "axisymmetric")
    drawing.field_and_curve(file, u, mises, label, *curves, axes, sides=(-1, 1))
    return report.finish("slice")


if __name__ == "__main__":
    sys.exit(main())

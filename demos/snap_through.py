"""Snap-through: a punch presses a shallow arch through, by a force that falls (2D).

The arch is clamped, the punch free but for the plane of symmetry and for contact, from
a gap on. The force on it rises until the arch gives way, falls to a third while that
snaps, and rises again where it hangs. Steps of the force cannot follow that. Steps of
the punch's displacement do (`DisplacementControl`), with the force as an unknown. It is
the reaction where that displacement is prescribed.
"""

import sys

from mpi4py import MPI

import common
import drawing
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.arch import NODE, scene_of
from raymortar import io, tools

# Lengths in mm, moduli in MPa, forces in N per mm of thickness; half of the arch
E_ARCH, E_PUNCH, NU, PUSH, FORCE = 1000.0, 1e5, 0.3, 2.0, 0.3


def is_node(x):
    """Whether points are the loaded node of the punch."""
    return np.linalg.norm(x[:2].T - NODE, axis=1) < 1e-9


def main(arguments=None):
    """Run the demo; 0 if the forces are those of the prescribed displacements."""
    parser = common.options("snap_through", __doc__)
    parser.add_argument("--size", type=int, default=20, help="cells along a half")
    parser.add_argument("--steps", type=int, default=40)
    args = parser.parse_args(arguments)
    comm, size = MPI.COMM_WORLD, args.size * (2 if args.fine else 1)
    args.output.mkdir(parents=True, exist_ok=True)

    # Neo-Hookean, plane strain
    scene = scene_of(comm, size)
    mesh, V = scene.mesh, tools.vector_space(scene.mesh, 2)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    moduli = {"arch": E_ARCH, "punch": E_PUNCH}
    E, I = tools.by_body(mesh, scene.cell_tags, moduli, scene.bodies), ufl.Identity(3)
    mu, lmbda = E / (2.0 * (1.0 + NU)), E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU))
    H = ufl.grad(u)
    F = I + ufl.as_tensor([[H[0, 0], H[0, 1], 0], [H[1, 0], H[1, 1], 0], [0, 0, 0]])
    J = ufl.det(F)
    energy = mu * (ufl.inner(F, F) - 3 - 2 * ufl.ln(J)) + lmbda * ufl.ln(J) ** 2
    residual = ufl.derivative(0.5 * energy * ufl.dx(degree=4), u, v)
    stress = tools.von_mises(mu / J * (F * F.T - I) + lmbda * ufl.ln(J) / J * I)

    # A force at the node: the load, by a rule at vertices, of a field that is 1 there
    field, force = fem.Function(tools.scalar_space(mesh, 1)), fem.Constant(mesh, 0.0)
    field.interpolate(lambda x: is_node(x).astype(float))
    vertices = ufl.dx(mesh, degree=1, scheme="vertex")
    load = force / tools.integral(field * vertices, mesh) * field * v[1] * vertices

    held = [tools.prescribe(V, scene.find("clamped"))]
    held.append(tools.prescribe(V, scene.find("axis"), component=0))
    pair = scene.tags["slave"], scene.tags["master"]
    contact = raymortar.Contact(u, scene.facet_tags, [pair])

    # Its displacement is prescribed, and its reaction is the force
    down, (W, _) = fem.Constant(mesh, 0.0), V.sub(1).collapse()
    at = fem.locate_dofs_geometrical((V.sub(1), W), is_node)
    pushed = fem.dirichletbc(down, at[0], V.sub(1))
    problem = raymortar.NonlinearProblem(residual, contact, [*held, pushed])
    history = raymortar.History(problem, reactions={"node": pushed})
    start, solver = contact.state(), raymortar.SNESSolver(problem)

    def push(t):
        down.value = -PUSH * t

    raymortar.LoadSteps(solver, push, args.steps, history=history).run()
    expected = -history["reaction_node_y"]

    # The force is an unknown that the displacement leads
    contact.restore(start)
    problem = raymortar.NonlinearProblem(residual + load, contact, held)
    file = args.output / "snap_through.csv"
    history = raymortar.History(problem, file)

    def press(t):
        force.value = FORCE * t

    control = raymortar.paths.DisplacementControl(NODE, direction=1, by=-PUSH)
    options = {"history": history, "control": control}
    solver, states = raymortar.SNESSolver(problem), []
    for _ in raymortar.LoadSteps(solver, press, args.steps, **options):
        if len(history) in [round(share * args.steps) for share in (0.25, 0.55, 1.0)]:
            mises = tools.nodal_field(stress, mesh, "mises", quadrature_degree=2)
            title = f"punch at {abs(history['controlled'][-1]):.2f} mm"
            states.append((title, drawing.gather_cells(mesh, u, mises)))
    found, sinks = FORCE * history["load_factor"], np.abs(history["controlled"])
    io.write_xdmf(file.with_suffix(".xdmf"), mesh, [u, contact.multiplier, mises])
    report = common.Report(comm)
    report.effort(contact, history["iterations"])
    error = np.abs(found - expected).max() / expected.max()
    report.add("1 + difference of forces", 1.0 + error, 1.0, 1e-8)
    top = np.argmax(expected[: args.steps // 2])
    low = top + np.argmin(expected[top:])
    for name, k in (("first limit of the force", top), ("second limit", low)):
        report.add(name, found[k], expected[k], 1e-8, "N/mm")
    if comm.rank == 0:
        axes = {"xlabel": "punch's displacement (mm)", "xlim": (0.0, 1.1 * PUSH)}
        axes["ylabel"] = "half of the force (N/mm)"
        drawing.states_and_curve(
            file.with_suffix(".png"), states, "von Mises stress (MPa)", 25.0,
            [(1, 1), (-1, 1)], (sinks, expected, "displacement prescribed"),
            (sinks, found, "led by the displacement"), axes, (-10.2, 10.2, -1.1, 2.4),
        )  # fmt: skip
    return report.finish("prescribed")


if __name__ == "__main__":
    sys.exit(main())

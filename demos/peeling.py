"""Peeling: a tape is lifted off a plate at its end (2D, plane strain, large rotation).

The lift peels the tape, which bends to ever larger angles. Closed form: an elastica whose
end is drawn across the plate by a force P and has turned by an angle t has the energy
release rate P sin t, whatever its length. While the crack grows this is the toughness.
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

# Lengths over the thickness of the tape; any unit of stress
E, NU, STIFFER, STRENGTH, TOUGHNESS = 1200.0, 0.3, 20.0, 11.0, 0.5
LENGTH, FREE, LIFT = 40.0, 6.0, 20.0
TAPE, PLATE, END, FOOT = 1, 2, 3, 4


def elastica(angles):
    """Lifts and forces of a tape that peels, by the angle at its end."""
    bending, force = E / (1.0 - NU**2) / 12.0, TOUGHNESS / np.sin(angles)
    # The sine of the angle on the way is top - w^2, which has no pole at the end
    top = np.sin(angles)
    w = np.sqrt(top) * (np.arange(400)[:, None] + 0.5) / 400
    slope = top - w**2
    mean = (2.0 * slope / np.sqrt(1.0 - slope**2)).mean(axis=0)
    return np.sqrt(0.5 * bending / force) * mean * np.sqrt(top), force


def main(arguments=None):
    """Run the demo; 0 if force and energies agree with the closed form."""
    parser = common.options("peeling", __doc__)
    parser.add_argument("--size", type=int, default=2, help="facets per thickness")
    args = parser.parse_args(arguments)
    comm, n = MPI.COMM_WORLD, args.size * (2 if args.fine else 1)

    # The end of the tape, without glue, is left out of the pair
    glued, whole = round((LENGTH - FREE) * n), round(LENGTH * n)
    foot, side = {"top": PLATE, "bottom": FOOT}, {"bottom": TAPE}
    bodies = [
        Block((whole - glued, 1), (0, 0), (FREE, 1), tags={"left": END}, body="tape"),
        Block((glued, 1), (FREE, 0), (LENGTH, 1), tags=side, body="tape"),
        Block((whole, 1), (0, -1), (LENGTH, 0), tags=foot, body="plate"),
    ]
    mesh, _, facet_tags = assemble_blocks(comm, bodies, "quadrilateral")

    # Neo-Hookean, a plate that is stiffer
    V = tools.vector_space(mesh, 2)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    is_tape = ufl.gt(ufl.SpatialCoordinate(mesh)[1], 0.0)
    modulus = ufl.conditional(is_tape, E, STIFFER * E)
    mu, lmbda = modulus / (2 * (1 + NU)), modulus * NU / ((1 + NU) * (1 - 2 * NU))
    F = ufl.Identity(2) + ufl.grad(u)
    log_J = ufl.ln(ufl.det(F))
    density = 0.5 * mu * (ufl.inner(F, F) - 2 - 2 * log_J) + 0.5 * lmbda * log_J**2
    energy = density * ufl.dx(degree=4)

    # The end is lifted at its middle, and free to turn and to move along the plate
    lift, (W, _) = fem.Constant(mesh, 0.0), V.sub(1).collapse()
    at = fem.locate_dofs_geometrical(
        (V.sub(1), W), lambda x: np.isclose(x[0], 0.0) & np.isclose(x[1], 0.5)
    )
    lifted = fem.dirichletbc(lift, at[0], V.sub(1))
    bcs = [tools.prescribe(V, facet_tags.find(FOOT)), lifted]
    glue = raymortar.Cohesive(STRENGTH, TOUGHNESS)
    contact = raymortar.Contact(u, facet_tags, [(TAPE, PLATE)], adhesion=glue)
    problem = raymortar.NonlinearProblem(ufl.derivative(energy, u, v), contact, bcs)

    # The end's face from one edge to the other gives its angle
    ds = ufl.Measure("ds", mesh, subdomain_data=facet_tags)
    across = [fem.form(F[k, 1] * ds(END)) for k in (0, 1)]

    def angle():
        return np.arctan2(*(comm.allreduce(fem.assemble_scalar(f)) for f in across))

    def apply(t):
        lift.value = LIFT * t

    of = {"end": lifted}
    history = raymortar.History(problem, None, of, energy, {"angle": angle}, works=of)
    steps = round(2.0 * LIFT)
    path = raymortar.LoadSteps(problem.snes_solver, apply, steps, history=history).run()

    # Energies and force where the crack has grown; work is by the mean of each step
    report = common.Report(comm)
    report.effort(contact, [step.iterations for step in path])
    work, force = history["work_end"], history["reaction_end_y"]
    rate = force * np.sin(history["angle"])
    kept = history["energy"] + history["adhesion_work"] + history["stored_adhesion"]
    peels = history["time"] > 2.0 / 3.0
    report.add("mean energy release rate", rate[peels].mean(), TOUGHNESS, 0.01)
    report.add("the largest", rate[peels].max(), TOUGHNESS, 0.02)
    report.add("the least", rate[peels].min(), TOUGHNESS, 0.02)
    lifts, forces = elastica(np.linspace(0.35, 1.4, 200))
    report.add("last force", force[-1], np.interp(LIFT, lifts, forces), 0.02)
    report.add("energy kept and taken", kept[-1], work[-1], 0.005)

    # A file for ParaView, and a picture: the tape, and its force on the elastica's
    args.output.mkdir(parents=True, exist_ok=True)
    tape = tools.nodal_field(density, mesh, "stored energy", quadrature_degree=4)
    io.write_xdmf(args.output / "peeling.xdmf", mesh, [u, tape, *contact.fields()])
    axes = dict(xlabel="lift", ylabel="force", ylim=(0.0, 1.5), xlim=(0.0, LIFT))
    found = LIFT * history["time"], force, "tape"
    parts = "stored energy density", (lifts, forces, "elastica"), found, axes
    drawing.field_and_curve(args.output / "peeling.png", u, tape, *parts)
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())

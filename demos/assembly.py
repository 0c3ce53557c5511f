"""A clamp of three bodies from Gmsh, with three pairs of surfaces named there (2D).

A round pin lies in a groove of the base; a jaw with the same groove is pressed down on
it, and after 0.3 mm sits down on the base beside it, too: the stop takes most of the load.
Friction acts everywhere. Half of the clamp is modelled in Gmsh (`meshes/clamp.py`);
surfaces go by the names of their physical groups.
"""

import sys

from mpi4py import MPI

import common
import drawing
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes import clamp
from raymortar import io, tools

# Lengths in mm, stresses in MPa, forces in N per mm of thickness of the half
E_PIN, E_JAWS, NU, FRICTION, CLOSING = 2000.0, 6000.0, 0.35, 0.2, 0.6
PAIRS = {
    "pin on base": ("pin below", "groove of the base"),
    "jaw on pin": ("pin above", "groove of the jaw"),
    "jaw on base": ("stop of the jaw", "stop of the base"),
}


def read(comm, size):
    """Mesh of the clamp with Gmsh's names. Collective."""
    if comm.rank > 0:
        return io.read_gmsh(None, comm, gdim=2)
    import gmsh

    gmsh.initialize(["", "-v", "1"])
    clamp.model(gmsh, size)
    bodies = io.read_gmsh(gmsh.model, comm, gdim=2)
    gmsh.finalize()
    return bodies


def main(arguments=None):
    """Run the demo; 0 if pin, jaw and base are in equilibrium."""
    parser = common.options("assembly", __doc__)
    parser.add_argument("--size", type=int, default=10, help="cells along 1/8 circle")
    parser.add_argument("--steps", type=int, default=12)
    args = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    args.output.mkdir(parents=True, exist_ok=True)

    # Neo-Hookean, plane strain
    bodies = read(comm, args.size * (2 if args.fine else 1))
    mesh, V = bodies.mesh, tools.vector_space(bodies.mesh, 1)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    moduli = {"pin": E_PIN, "base": E_JAWS, "jaw": E_JAWS}
    parts = {name: tag for name, (dim, tag) in bodies.names.items() if dim == 2}
    E, I = tools.by_body(mesh, bodies.cell_tags, moduli, parts), ufl.Identity(3)
    mu, lmbda = E / (2.0 * (1.0 + NU)), E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU))
    H = ufl.grad(u)
    F = I + ufl.as_tensor([[H[0, 0], H[0, 1], 0], [H[1, 0], H[1, 1], 0], [0, 0, 0]])
    J = ufl.det(F)
    energy = mu * (ufl.inner(F, F) - 3 - 2 * ufl.ln(J)) + lmbda * ufl.ln(J) ** 2
    residual = ufl.derivative(0.5 * energy * ufl.dx(degree=2), u, v)
    down = fem.Constant(mesh, 0.0)
    held, moved = tools.prescribe(V, bodies.find("held")), bodies.find("moved")
    sides = bodies.find("symmetry"), moved
    bcs = [held, tools.prescribe(V, moved, down, component=1)]
    bcs += [tools.prescribe(V, side, component=0) for side in sides]

    pairs, law = list(PAIRS.values()), {"friction": raymortar.Coulomb(FRICTION)}
    law |= {"names": bodies.names, "search": raymortar.Search(reach=4.0, depth=2.0)}
    contact = raymortar.Contact(u, bodies.facet_tags, pairs, **law)
    problem = raymortar.NonlinearProblem(residual, contact, bcs)
    solver = raymortar.SNESSolver(problem, {"snes_linesearch_type": "l2"})
    file = args.output / "assembly.csv"
    history = raymortar.History(problem, file, {"support": held})

    def close(t):
        down.value = -CLOSING * t

    raymortar.LoadSteps(solver, close, args.steps, history=history).run()

    # The pin is held by contact alone, the base by its support
    report, closing = common.Report(comm), CLOSING * history["time"]
    report.effort(contact, history["iterations"])
    labels = [pair.label for pair in contact.pairs]
    forces = [np.abs(history[f"force_{label}_y"]) for label in labels]
    below, above, stop, up = (f[-1] for f in (*forces, history["reaction_support_y"]))
    report.add("above the pin / below it", above, below, 1e-7, "N/mm")
    report.add("pin and stop / support", above + stop, up, 1e-7, "N/mm")

    stress = tools.von_mises(mu / J * (F * F.T - I) + lmbda * ufl.ln(J) / J * I)
    mises = tools.nodal_field(stress, mesh, "mises", quadrature_degree=2)
    io.write_xdmf(file.with_suffix(".xdmf"), mesh, [u, contact.multiplier, mises])
    cells = drawing.gather_cells(mesh, u, mises)
    if comm.rank == 0:
        draw(cells, closing, forces, file.with_suffix(".png"))
    return report.finish("balance")


def draw(cells, closing, forces, path):
    """The closed clamp, in colours without the corners' peaks; the force of each pair."""
    figure, (left, right) = drawing.pyplot().subplots(1, 2, figsize=(11, 4.6))
    x, moved, values = cells
    top, images = np.quantile(values, 0.995), [(1, 1), (-1, 1)]
    colours = drawing.draw_field(left, x[..., :2] + moved, values, images, top)
    left.axis("off")
    figure.colorbar(colours, ax=left, label="von Mises stress (MPa)", shrink=0.8)
    for name, force, style in zip(PAIRS, forces, ("-", "--", "-")):
        right.plot([0.0, *closing], 2e-3 * np.array([0.0, *force]), style, label=name)
    right.axvline(clamp.SLOT, color="0.75", lw=0.8, zorder=0)
    right.set(xlabel="closing (mm)", ylabel="force of both halves (kN/mm)")
    right.legend(loc="upper left")
    figure.savefig(path)


if __name__ == "__main__":
    sys.exit(main())

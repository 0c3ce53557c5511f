"""Contact inside DOLFINx's own Newton solver (3D, neo-Hookean, friction).

Two blocks are pressed together and sheared. Multipliers are condensed: any solver of
the displacement serves.
"""

import sys
from pathlib import Path

from mpi4py import MPI

import common
import ufl
from dolfinx import fem
from dolfinx.nls.petsc import NewtonSolver

import raymortar
from raymortar import io, tools

MESH = Path(__file__).parents[1] / "meshes" / "two_blocks.msh"


def main(arguments=None):
    """Run the demo; 0 if contact balances the support."""
    args = common.options("newton_of_dolfinx", __doc__).parse_args(arguments)
    read = io.read_gmsh(MESH, MPI.COMM_WORLD)
    V = tools.vector_space(read.mesh, 1)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    F = ufl.Identity(3) + ufl.grad(u)
    log_J = ufl.ln(ufl.det(F))
    energy = 0.5 * ufl.inner(F, F) - log_J + log_J**2
    residual = ufl.derivative(energy * ufl.dx(degree=3), u, v)
    moved = fem.Constant(read.mesh, (0.0, 0.0, 0.0))
    held = tools.prescribe(V, read.find("bottom"))
    bcs = [held, tools.prescribe(V, read.find("top"), moved)]
    # Contact, in a problem of u alone; DOLFINx's solver knows nothing of it
    method = raymortar.AugmentedLagrangian(condition="nodes", multiplier="dual")
    given = read.facet_tags, [("upper_bottom", "lower_top")], method
    more = {"friction": raymortar.Coulomb(0.2), "names": read.names}
    contact = raymortar.Contact(u, *given, **more)
    problem = raymortar.CondensedProblem(residual, u, contact, bcs)
    solver, report = NewtonSolver(problem.comm, problem), common.Report(problem.comm)
    # Increments are lengths; the blocks' size is 1
    solver.convergence_criterion, solver.rtol, solver.atol = "incremental", 1e-9, 1e-12
    for t in (0.25, 0.5, 0.75, 1.0):
        moved.value[:] = 0.1 * t, 0.0, -0.3 * t
        report.say(f"{t}: {solver.solve(u)[0]} Newton iterations")
        contact.advance()
    del solver  # on all ranks together, before one draws
    force, support = contact.resultant().force, problem.reactions({"held": [held]})
    report.add("contact / support", force[2], support["held"][2], 1e-8)
    report.add("the same along x", force[0], support["held"][0], 1e-7)
    args.output.mkdir(parents=True, exist_ok=True)
    io.write_xdmf(args.output / "newton_of_dolfinx.xdmf", read.mesh, [u])
    raymortar.plot(contact, args.output / "newton_of_dolfinx.png")
    return report.finish("balance")


if __name__ == "__main__":
    sys.exit(main())

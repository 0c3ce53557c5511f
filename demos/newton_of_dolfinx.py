"""Contact inside DOLFINx's own Newton solver (3D, neo-Hookean, friction).

Two blocks whose meshes do not match are pressed together and sheared. Multipliers are
condensed: the unknowns are the displacement's, and any solver of them serves.
"""

import sys
from pathlib import Path

from mpi4py import MPI
from petsc4py import PETSc

import common
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from raymortar import io, tools

MESH = Path(__file__).parents[1] / "meshes" / "two_blocks.msh"


def solver_of(problem):
    """Solver that knows nothing of contact: a call with u gives its iterations."""
    try:
        from dolfinx.nls.petsc import NewtonSolver

        newton = NewtonSolver(problem.comm, problem)
        newton.convergence_criterion, newton.rtol = "incremental", 1e-9
        return lambda u: newton.solve(u)[0]
    except ImportError:  # newer versions leave it to PETSc
        snes = PETSc.SNES().create(problem.comm)
        problem.attach(snes)
        snes.setTolerances(rtol=1e-9, atol=1e-12)
        snes.setErrorIfNotConverged(True)
        snes.ksp.setType("preonly")
        snes.ksp.pc.setType("lu")
        snes.ksp.pc.setFactorSolverType("mumps")
        return lambda u: snes.solve(None, u.x.petsc_vec) or snes.getIterationNumber()


def main(arguments=None):
    """Run the demo; 0 if contact balances the support."""
    parser = common.options("newton_of_dolfinx", __doc__)
    parser.add_argument("--steps", type=int, default=4)
    args = parser.parse_args(arguments)
    report = common.Report(MPI.COMM_WORLD)
    args.output.mkdir(parents=True, exist_ok=True)

    # A problem of DOLFINx
    read = io.read_gmsh(MESH, MPI.COMM_WORLD)
    V = tools.vector_space(read.mesh, 1)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    F = ufl.Identity(3) + ufl.grad(u)
    log_J = ufl.ln(ufl.det(F))
    energy = 0.5 * (ufl.inner(F, F) - 3) - log_J + log_J**2
    residual = ufl.derivative(energy * ufl.dx(degree=3), u, v)
    moved = fem.Constant(read.mesh, np.zeros(3))
    held = tools.prescribe(V, read.find("bottom"))
    bcs = [held, tools.prescribe(V, read.find("top"), moved)]

    # Contact, and the problem with it: `residual`, `u`, `bcs` as ever
    method = raymortar.AugmentedLagrangian(condition="nodes", multiplier="dual")
    pairs, friction = [("upper_bottom", "lower_top")], raymortar.Coulomb(0.2)
    contact = raymortar.Contact(
        u, read.facet_tags, pairs, method, friction, names=read.names
    )
    problem = raymortar.CondensedProblem(residual, u, contact, bcs)
    solve, iterations = solver_of(problem), []
    for t in np.arange(1, args.steps + 1) / args.steps:
        moved.value[:] = 0.1 * t, 0.0, -0.3 * t
        iterations.append(solve(u))
        contact.advance()
    del solve  # ranks destroy DOLFINx's solver together, and one alone draws

    force, support = contact.resultant().force, problem.reactions({"held": [held]})
    report.say(f"{V.dofmap.index_map.size_global * 3} unknowns, those of u")
    report.say(f"{', '.join(map(str, iterations))} Newton iterations")
    report.add("contact / support", force[2], support["held"][2], 1e-8)
    report.add("the same along x", force[0], support["held"][0], 1e-7)
    io.write_xdmf(args.output / "newton_of_dolfinx.xdmf", read.mesh, [u])
    raymortar.plot(contact, args.output / "newton_of_dolfinx.png")
    return report.finish("balance")


if __name__ == "__main__":
    sys.exit(main())

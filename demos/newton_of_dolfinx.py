"""Contact inside DOLFINx's own Newton solver (3D, neo-Hookean, friction).

Two blocks whose meshes do not match are pressed together and sheared. The multipliers
are condensed: what is solved has the unknowns of the displacement alone, and
``dolfinx.nls.petsc.NewtonSolver`` (PETSc's SNES in versions without it) solves it.
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
from raymortar import compat, io, tools

MESH = Path(__file__).parents[1] / "meshes" / "two_blocks.msh"
DIRECT = {"ksp_type": "preonly", "pc_type": "lu", "pc_factor_mat_solver_type": "mumps"}


def solver_of(problem):
    """A solver that knows nothing of contact, as a function of u."""
    comm, options = problem.comm, PETSc.Options()
    for name, value in DIRECT.items():
        options[f"bodies_{name}"] = value
    if compat.newton_solver_class() is not None:
        from dolfinx.nls.petsc import NewtonSolver

        newton = NewtonSolver(comm, problem)
        newton.convergence_criterion, newton.rtol = "incremental", 1e-9
        newton.krylov_solver.setOptionsPrefix("bodies_")
        newton.krylov_solver.setFromOptions()
        return lambda u: newton.solve(u)[0]
    snes = PETSc.SNES().create(comm)
    snes.setOptionsPrefix("bodies_")
    snes.setTolerances(rtol=1e-9, atol=1e-12)
    problem.attach(snes)
    snes.setFromOptions()

    def solve(u):
        snes.solve(None, u.x.petsc_vec)
        assert snes.getConvergedReason() > 0, snes.getConvergedReason()
        return snes.getIterationNumber()

    return solve


def main(arguments=None):
    """Run the demo; 0 if contact balances the support, and friction its bound."""
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
    contact = raymortar.Contact(
        u,
        read.facet_tags,
        [("upper_bottom", "lower_top")],
        raymortar.AugmentedLagrangian(condition="nodes", multiplier="dual"),
        raymortar.Coulomb(0.2),
        names=read.names,
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

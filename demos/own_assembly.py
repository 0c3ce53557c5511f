"""Contact in a user's own assembly: matrices and vectors of DOLFINx (2D, friction)."""

import sys
from pathlib import Path

from mpi4py import MPI
from petsc4py import PETSc

import common
import ufl
from bodies import NeoHookean
from dolfinx import fem
from dolfinx.fem import petsc

from raymortar import Contact, Coulomb, Penalty, io, plot, tools

MESH = Path(__file__).parents[1] / "meshes" / "two_blocks_2d.msh"


def main(arguments=None):
    """Run the demo; 0 if all nodes are in balance."""
    args = common.options("own_assembly", __doc__).parse_args(arguments)
    msh = io.read_gmsh(MESH, MPI.COMM_WORLD, gdim=2)
    V, pairs = tools.vector_space(msh.mesh, 1), [("upper_bottom", "lower_top")]
    u, moved = fem.Function(V), fem.Constant(msh.mesh, (0.04, -0.1))
    bcs = [tools.prescribe(V, msh.find("bottom"))]
    bcs += [tools.prescribe(V, msh.find("top"), moved)]
    F = NeoHookean(1.0, 0.3).residual(u, 3)
    L, a = fem.form(F), fem.form(ufl.derivative(F, u, ufl.TrialFunction(V)))
    contact = Contact(
        u, msh.facet_tags, pairs, Penalty(), Coulomb(0.3), names=msh.names
    )
    x, dx = contact.create_vector(L), contact.create_vector(L)
    for _ in range(6):  # iterations of Newton's method
        contact.from_vector(x)  # to u, with ghosts of both
        contact.update()  # pairs
        A, b = contact.create_matrix(a), contact.create_vector(L)
        petsc.assemble_matrix(A, a, bcs)
        contact.assemble_matrix(A, bcs)
        A.assemble()
        petsc.assemble_vector(b, L)
        contact.assemble_vector(b, bcs)
        petsc.apply_lifting(b, [a], [bcs], [x], -1.0)
        contact.apply_lifting(b, bcs, u.x.array, -1.0)
        b.ghostUpdate(PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE)
        petsc.set_bc(b, bcs, x, -1.0)
        PETSc.Sys.Print(f"residual {b.norm():.1e}")
        ksp = PETSc.KSP().create(msh.mesh.comm)
        ksp.getPC().setType("lu")
        ksp.setOperators(A)
        ksp.solve(b, dx)
        x.axpy(-1.0, dx)
    args.output.mkdir(parents=True, exist_ok=True)
    io.write_xdmf(args.output / "own_assembly.xdmf", msh.mesh, [u])
    plot(contact, args.output / "own_assembly.png")
    return int(b.norm() > 1e-12)


if __name__ == "__main__":
    sys.exit(main())

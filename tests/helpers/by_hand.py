"""Contact that is assembled by hand, line by line as docs/your_own_assembly.md does."""

from functools import lru_cache
from pathlib import Path

from petsc4py import PETSc

import dolfinx.fem.petsc as fem_petsc
import numpy as np
import ufl
from dolfinx import fem
from problems import COMM

import raymortar
from raymortar import io, tools

MESH = Path(__file__).parents[2] / "meshes" / "two_blocks_2d.msh"
ADD, REVERSE = PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE
INSERT, FORWARD = PETSc.InsertMode.INSERT, PETSc.ScatterMode.FORWARD
PENALTY, POINTS = raymortar.Penalty(), raymortar.AugmentedLagrangian()
DUAL = raymortar.AugmentedLagrangian(condition="nodes", multiplier="dual")
SLIDING = raymortar.Coulomb(0.3)
METHODS = [(PENALTY, SLIDING), (POINTS, SLIDING), (POINTS, None), (DUAL, SLIDING)]


@lru_cache(maxsize=None)
def bodies(length):
    """The mesh, on the same ranks for all scenes of a test."""
    read = io.read_gmsh(MESH, COMM, gdim=2)
    read.mesh.geometry.x[:] *= length
    return read


class Blocks:
    """Two blocks, pressed and sheared: a form, conditions and contact, and no problem."""

    def __init__(self, method, friction, scale=1.0, length=1.0, **options):
        read = bodies(length)
        V, self.length = tools.vector_space(read.mesh, 1), length
        self.u = fem.Function(V, name="u")
        v, du = ufl.TestFunction(V), ufl.TrialFunction(V)
        F = ufl.Identity(2) + ufl.grad(self.u)
        log_J = ufl.ln(ufl.det(F))
        energy = scale * (2 * (ufl.inner(F, F) - 2 - 2 * log_J) + 3 * log_J**2)
        self.residual = ufl.derivative(energy * ufl.dx(degree=3), self.u, v)
        self.L = fem.form(self.residual)
        self.a = fem.form(ufl.derivative(self.residual, self.u, du))
        self.down = fem.Constant(read.mesh, np.zeros(2))
        self.bcs = [
            tools.prescribe(V, read.find("bottom")),
            tools.prescribe(V, read.find("top"), self.down),
        ]
        pairs = [("upper_bottom", "lower_top")]
        self.contact = raymortar.Contact(
            self.u,
            read.facet_tags,
            pairs,
            method,
            friction,
            names=read.names,
            **options,
        )

    def load(self, t):
        self.down.value[:] = 0.04 * t * self.length, -0.1 * t * self.length


class ByHand(Blocks):
    """Residual and tangent by the lines that docs/your_own_assembly.md shows."""

    pair = True

    def __init__(self, *given, **options):
        super().__init__(*given, **options)
        self.begin()

    def begin(self):
        self.contact.update()
        self.A = self.contact.create_matrix(self.a)
        self.b = self.contact.create_vector(self.L)
        self.x = self.contact.create_vector(self.L)
        self.has_multiplier = self.contact.layout.more_than_forms

    def F(self, x, b):
        contact, bcs = self.contact, self.bcs
        contact.from_vector(x)
        contact.update(pair=self.pair)
        b.set(0.0)
        with contact.form_block(b) as b_u, contact.form_block(x) as x_u:
            x_u.ghostUpdate(INSERT, FORWARD)
            fem_petsc.assemble_vector(b_u, self.L)
            fem_petsc.apply_lifting(b_u, [self.a], [bcs], [x_u], -1.0)
            b_u.ghostUpdate(ADD, REVERSE)
            fem_petsc.set_bc(b_u, bcs, x_u, -1.0)
        contact.assemble_vector(b, bcs)
        contact.apply_lifting(b, bcs, self.u.x.array, -1.0)

    def J(self, x, A):
        renewed = self.contact.make_room(A)
        A.zeroEntries()
        assemble_form(A, self.a, self.bcs, self.has_multiplier)
        self.contact.assemble_matrix(A, self.bcs)
        A.assemble()
        return renewed

    def solve(self, tolerance=1e-12):
        ksp, dx = direct(self.A), self.b.duplicate()
        for _ in range(25):
            self.F(self.x, self.b)
            if self.b.norm() < tolerance:
                return
            if self.J(self.x, self.A):
                ksp.reset()
                ksp.setOperators(self.A)
            ksp.solve(self.b, dx)
            self.x.axpy(-1.0, dx)
        raise AssertionError(f"residual {self.b.norm()}")


def assemble_form(A, a, bcs, has_multiplier):
    """A block beside the multiplier's is one of DOLFINx's blocks."""
    blocks = getattr(fem_petsc, "assemble_matrix_block", fem_petsc.assemble_matrix)
    if has_multiplier:
        blocks(A, [[a]], bcs)
    else:
        fem_petsc.assemble_matrix(A, a, bcs)


def direct(A):
    ksp = PETSc.KSP().create(COMM)
    ksp.setType("preonly")
    ksp.getPC().setType("lu")
    ksp.getPC().setFactorSolverType("mumps")
    ksp.setOperators(A)
    return ksp

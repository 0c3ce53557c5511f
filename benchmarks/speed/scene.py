"""Blocks with a wavy interface and unrelated nodes, as problems in DOLFINx."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from meshes.scenes import two_blocks
from raymortar import rigid
from raymortar.core import compat

CELLS = {"quadrilateral": 2, "tetrahedron": 3, "hexahedron": 3}
MU, LMBDA = 770.0, 1150.0


def layers(cell, n, height=None):
    """Two blocks over the unit square, n and n - 1 cells wide; one cell high by default."""
    dim = CELLS[cell]
    high = 1 if height is None else height
    thick = 1.0 / n if height is None else 1.0

    def interface(x):
        return thick * (1.0 + 0.1 * np.sin(3.0 * x[:, 0]) * np.cos(2.0 * x[:, -1]))

    return two_blocks(
        MPI.COMM_SELF,
        dim,
        cell,
        (max(n - 1, 1),) * (dim - 1) + (high,),
        (n,) * (dim - 1) + (high,),
        lower_size=(1.0,) * (dim - 1) + (thick,),
        upper_size=(1.0,) * (dim - 1) + (thick,),
        interface=interface,
    )


def one_block(cell, n):
    """A block of n cells per direction whose lower side is a slave."""
    dim, tags = CELLS[cell], {"slave": 1, "top": 2}
    sides = {"bottom": tags["slave"], "top": tags["top"]}
    block = Block((n,) * dim, (0.0,) * dim, (1.0,) * dim, tags=sides)
    return Scene(*assemble_blocks(MPI.COMM_SELF, [block], cell), tags)


def plane(dim):
    """A rigid plane below the unit block."""
    shape = rigid.Line if dim == 2 else rigid.Plane
    return shape((0.0,) * dim, (0.0,) * (dim - 1) + (1.0,))


def neo_hookean(u):
    """Residual of a compressible block."""
    d = u.function_space.mesh.geometry.dim
    F = ufl.variable(ufl.Identity(d) + ufl.grad(u))
    log = ufl.ln(ufl.det(F))
    energy = MU / 2 * (ufl.tr(F.T * F) - d - 2 * log) + LMBDA / 2 * log**2
    v = ufl.TestFunction(u.function_space)
    dx = ufl.dx(metadata={"quadrature_degree": 2})
    return ufl.inner(ufl.diff(energy, F), ufl.grad(v)) * dx


class Blocks:
    """Contact problem of such blocks, pressed into each other a little.

    Parameters
    ----------
    cell, degree, n, height
        See `layers`.
    multiplier, tangent, friction
        Options of contact.
    on_plane
        One block on a rigid plane in place of two.

    Attributes
    ----------
    scene, u, contact, problem
        See raymortar.
    """

    def __init__(
        self,
        cell,
        degree,
        n,
        height=None,
        multiplier=None,
        tangent="full",
        friction=None,
        on_plane=False,
    ):
        dim = CELLS[cell]
        self.scene = one_block(cell, n) if on_plane else layers(cell, n, height)
        V = compat.vector_space(self.scene.mesh, degree)
        self.u = fem.Function(V)
        tags = self.scene.tags
        self.contact = raymortar.Contact(
            self.u,
            self.scene.facet_tags,
            [(tags["slave"], plane(dim) if on_plane else tags["master"])],
            raymortar.AugmentedLagrangian(1.0, multiplier=multiplier),
            friction,
            tangent=tangent,
        )
        lam = self.contact.multiplier
        components = self.contact.layout.components
        # Compression: along the axis, or the normal component
        lam.x.array.reshape(-1, components)[:, -1] = 1.0 if components > 1 else -1.0
        bcs = []
        for name, value in (("bottom", 0.0), ("top", -0.01 / n)):
            if name not in tags:
                continue
            facets = self.scene.facet_tags.find(tags[name])
            dofs = fem.locate_dofs_topological(V, dim - 1, facets)
            g = np.zeros(dim)
            g[-1] = value
            bcs.append(fem.dirichletbc(fem.Constant(self.scene.mesh, g), dofs, V))
        self.problem = raymortar.NonlinearProblem(
            neo_hookean(self.u), self.contact, bcs
        )
        self._by = 1e-10

    def move(self):
        """A new configuration, so that pairing has something to do."""
        self._by *= -1.1
        self.u.x.array[:] += self._by

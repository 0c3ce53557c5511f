"""Cells whose left and right sides have one displacement, pressed on a plane."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np
import scipy.sparse as sparse
import ufl
from dolfinx import fem

from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from raymortar import Contact, Coulomb, LoadSteps, NonlinearProblem, rigid, tools

COMM = MPI.COMM_WORLD
FOOT, TOP, LEFT, RIGHT = 1, 2, 3, 4
DEPTH, WAVE = 0.08, 0.02


class Cell:
    """A block of the unit width with a wavy foot above a plane.

    Parameters
    ----------
    cell, degree
        Shape of cells, and degree of the displacement.
    method, mu
        Of contact.
    held
        ``"periodic"``: T u in place of u; ``"symmetric"``: no displacement across the
        sides; None: neither.
    shift
        Where the wave begins, over the width.
    """

    def __init__(self, cell, degree, method, mu, held="periodic", shift=0.0, n=8):
        dim = 2 if cell in ("triangle", "quadrilateral") else 3
        upper = (1.0,) * (dim - 1) + (0.5,)
        tags = {"bottom": FOOT, "top": TOP, "left": LEFT, "right": RIGHT}
        cells = (n,) + (2,) * (dim - 2) + (max(n // 2, 2),)
        block = Block(cells, (0.0,) * dim, upper, tags=tags, body="cell")
        self.mesh, _, self.tags = assemble_blocks(COMM, [block], cell)
        self.V = V = tools.vector_space(self.mesh, degree)
        self.u, v = fem.Function(V), ufl.TestFunction(V)
        F = ufl.Identity(dim) + ufl.grad(self.u)
        log_J = ufl.ln(ufl.det(F))
        density = 0.5 * (ufl.inner(F, F) - dim - 2.0 * log_J) + 0.75 * log_J**2
        self.residual = ufl.derivative(density * ufl.dx(degree=4), self.u, v)
        self.way = fem.Constant(self.mesh, np.zeros(dim))
        self.bcs = [tools.prescribe(V, self.tags.find(TOP), self.way)]
        if held == "symmetric":
            self.bcs += [
                tools.prescribe(V, self.tags.find(side), component=0)
                for side in (LEFT, RIGHT)
            ]
        plane = rigid.Line((0.0, 0.0), (0.0, 1.0))
        if dim == 3:
            plane = rigid.Plane((0.0,) * 3, (0.0, 0.0, 1.0))
        self.contact = Contact(
            self.u,
            self.tags,
            [(FOOT, plane)],
            method,
            friction=Coulomb(mu) if mu else None,
            offset=lambda x: WAVE * (1.0 + np.cos(2.0 * np.pi * (x[0] - shift))),
        )
        self.remake(self.matrix() if held == "periodic" else None)

    def remake(self, constraints):
        """Make the problem, with constraints or without."""
        self.problem = NonlinearProblem(
            self.residual, self.contact, self.bcs, constraints=constraints
        )

    def matrix(self):
        """T of all ranks, (dofs, dofs): the right side has the dofs of the left one."""
        V, d = self.V, self.mesh.geometry.dim
        index_map = V.dofmap.index_map
        n, begin = index_map.size_local, index_map.local_range[0]
        held = np.zeros(n, dtype=bool)
        nodes = self.bcs[0].dof_indices()[0] // d
        held[nodes[nodes < n]] = True
        x = V.tabulate_dof_coordinates()[:n]
        own = np.column_stack([x, begin + np.arange(n), held])
        every = np.concatenate(COMM.allgather(own))
        left = every[np.isclose(every[:, 0], 0.0)]
        T = sparse.eye(d * len(every), format="lil")
        for x, y, z, i, is_held in every[np.isclose(every[:, 0], 1.0)]:
            if is_held:
                continue
            j = left[np.hypot(left[:, 1] - y, left[:, 2] - z).argmin(), 3]
            for k in range(d):
                T[d * int(i) + k, d * int(i) + k] = 0.0
                T[d * int(i) + k, d * int(j) + k] = 1.0
        return T.tocsr()

    def press(self, sideways=0.0, steps=4):
        """Press the top down, and sideways; return the iterations."""

        def apply(t):
            self.way.value[-1] = -DEPTH * t
            self.way.value[0] = sideways * t

        path = LoadSteps(self.problem.snes_solver, apply, steps)
        return [step.iterations for step in path]

    def norm(self):
        """Norm of the displacement of all nodes but those on the right."""
        n = self.V.dofmap.index_map.size_local
        x = self.V.tabulate_dof_coordinates()[:n]
        u = self.u.x.array.reshape(-1, self.mesh.geometry.dim)[:n]
        u = u[~np.isclose(x[:, 0], 1.0)]
        return float(np.sqrt(COMM.allreduce(np.sum(u**2))))

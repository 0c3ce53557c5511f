"""Blocks in contact whose displacement is solved for beside other unknowns.

The same problem in several ways: the displacement alone, as a part of a mixed Function,
and as one of several Functions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from petsc4py import PETSc

import raymortar
from raymortar import compat

from problems import COMM, fix, quadrature_degree, stack

MU = 10.0
WAYS = ("mixed", "blocked")


@dataclass
class Hosted:
    """A problem, and where its unknowns are."""

    scene: Any
    contact: Any
    problem: Any
    functions: list[Any]  # one for each part, of a mixed Function collapsed copies
    move: Any  # Constants of the top's displacement

    def parts(self):
        """Values of each part on a space of its own, owned dofs of all ranks, by
        place."""
        return [by_place(f) for f in self.collapsed()]

    def collapsed(self):
        """The parts as Functions of their own."""
        if len(self.functions) > 1 or self.contact.host.component is None:
            return self.functions
        (w,) = self.functions
        n = compat.num_parts(w.function_space)
        return [w.sub(i).collapse() for i in range(n)]

    def push(self, *values):
        """Displacement of the top."""
        for constant, value in zip(self.move, values):
            constant.value = value


def by_place(f):
    """Values of all ranks, (nodes, components), sorted by place."""
    V = f.function_space
    bs, n = V.dofmap.index_map_bs, V.dofmap.index_map.size_local
    dim = V.mesh.geometry.dim
    x = V.tabulate_dof_coordinates()[:n, :dim]
    values = f.x.array[: n * bs].reshape(-1, bs)
    rows = np.concatenate(COMM.allgather(np.hstack([x, values])))
    # A node of two bodies has the same place twice: their values tell them apart
    keys = np.round(rows, 6)
    return rows[np.lexsort(keys.T[::-1])][:, dim:]


def neo_hookean(u, p, kappa):
    """Nominal stress and constraint of a nearly incompressible body in plane strain."""
    d = len(u)
    F = ufl.Identity(d) + ufl.grad(u)
    J, inverse = ufl.det(F), ufl.inv(F).T
    isochoric = MU * (F - inverse)
    return isochoric + p * J * inverse, (J - 1.0) - p / kappa


def residuals(mesh, u, p, v, q, kappa, p_degree=2):
    """Of displacement and pressure."""
    dx = ufl.dx(metadata={"quadrature_degree": quadrature_degree(mesh, p_degree)})
    stress, constraint = neo_hookean(u, p, kappa)
    return ufl.inner(stress, ufl.grad(v)) * dx, constraint * q * dx


def blocks(cell="triangle", divisions=(4, 3), **options):
    """Two blocks on each other, the upper one narrower than the lower."""
    return stack(cell, divisions, widths=[1.0, 0.6], **options)


def conditions(V, scene, top):
    """Bottom held, the top moved, on a displacement's space or a part of a mixed one.

    Component by component, which both take alike.
    """
    held = [fix(V, scene, "bottom", i) for i in range(scene.mesh.geometry.dim)]
    return held + [fix(V, scene, "top", i, value) for i, value in enumerate(top)]


def taylor_hood(way, kappa=2000.0 * MU, scene=None, **options):
    """Two nearly incompressible blocks, the upper pressed on the lower and sheared.

    Parameters
    ----------
    way
        ``"mixed"`` or ``"blocked"``.
    kappa
        Bulk modulus.
    options
        Of `Contact`.
    """
    scene = blocks() if scene is None else scene
    mesh = scene.mesh
    dim = mesh.geometry.dim
    u_part, p_part = ("Lagrange", 2, (dim,)), ("Lagrange", 1, ())
    top = [fem.Constant(mesh, PETSc.ScalarType(0.0)) for _ in range(dim)]
    pairs = [(scene.tags["slave"], scene.tags["master"])]
    if way == "mixed":
        w = fem.Function(compat.mixed_space(mesh, u_part, p_part), name="w")
        given, functions = w.sub(0), [w]
        u, p = ufl.split(w)
        v, q = ufl.split(ufl.TestFunction(w.function_space))
    else:
        functions = [
            fem.Function(compat.space(mesh, *part), name=name)
            for part, name in ((u_part, "u"), (p_part, "p"))
        ]
        u, p = functions
        given = u
        v, q = (ufl.TestFunction(f.function_space) for f in functions)
    F = residuals(mesh, u, p, v, q, kappa)
    contact = raymortar.Contact(given, scene.facet_tags, pairs, **options)
    bcs = conditions(given.function_space, scene, top)
    if way == "mixed":
        problem = raymortar.NonlinearProblem(sum(F), contact, bcs)
    else:
        problem = raymortar.NonlinearProblem(list(F), contact, bcs, u=functions)
    return Hosted(scene, contact, problem, functions, top)

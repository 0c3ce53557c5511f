"""Fields that are tied across surfaces: flat stacks, a bent interface, four squares."""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem
from fluxes import field_space
from problems import COMM, DIMENSION, cellwise

from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar.core import compat
from raymortar.fluxes import FieldProblem, FieldTie

# Of the bent bodies
TAGS = {"master": 1, "slave": 2, "outer": 3}
CONDUCTIVITY = {"lower": 4.0, "upper": 1.0}


def level(x, sine):
    """Height above the bent interface of positions by component."""
    height = x[-1] - 0.15 * sine(2.0 * x[0])
    return height if len(x) == 2 else height - 0.1 * x[1] ** 2


def bent(cell, divisions, degree):
    """Two blocks with a bent interface and unrelated nodes, all else tagged outer."""
    dim = DIMENSION[cell]

    def bend(x):
        x = x.copy()
        x[:, -1] -= level(x.T, np.sin) - x[:, -1]
        return x

    names = ["bottom", "top", "left", "right", "front", "back"][: 2 * dim]
    blocks = [
        Block(
            (n,) * dim,
            (0.0,) * (dim - 1) + (low,),
            (1.0,) * (dim - 1) + (low + 1.0,),
            mapping=bend,
            tags=dict.fromkeys(names, TAGS["outer"]) | own,
        )
        for n, low, own in zip(
            divisions, (-1.0, 0.0), ({"top": TAGS["master"]}, {"bottom": TAGS["slave"]})
        )
    ]
    made = assemble_blocks(COMM, blocks, cell, degree)
    return Scene(*made, TAGS, {"lower": 1, "upper": 2})


def manufactured(cell, divisions, degree):
    """Errors of a field with a jump of conductivity, and of its gradient, in L2.

    k T = exp(x) cos(z) s with the level s above the interface: T and the flux are
    continuous, and T is prescribed on all else, ends of the interface included.
    """
    scene = bent(cell, divisions, degree)
    mesh, W = scene.mesh, field_space(scene.mesh, degree)
    T, s, dim = fem.Function(W, name="T"), ufl.TestFunction(W), DIMENSION[cell]
    x, k = ufl.SpatialCoordinate(mesh), cellwise(scene, CONDUCTIVITY)
    kT = (
        ufl.exp(x[0]) * ufl.cos(x[dim - 1]) * level([x[i] for i in range(dim)], ufl.sin)
    )
    dx = ufl.dx(metadata={"quadrature_degree": 2 * degree + 3})
    F = (ufl.inner(k * ufl.grad(T), ufl.grad(s)) + ufl.div(ufl.grad(kT)) * s) * dx
    ends = fem.Function(W)
    at = W.tabulate_dof_coordinates()[:, :dim].T
    lower = np.unique(compat.dofmap_array(W)[scene.cell_tags.find(1)])
    ends.x.array[:] = np.exp(at[0]) * np.cos(at[-1]) * level(at, np.sin)
    ends.x.array[lower] /= CONDUCTIVITY["lower"]
    outer = scene.facet_tags.find(TAGS["outer"])
    dofs = fem.locate_dofs_topological(W, dim - 1, outer)
    tie = FieldTie(T, scene.facet_tags, [(TAGS["slave"], TAGS["master"])])
    FieldProblem(F, T, tie, [fem.dirichletbc(ends, dofs)]).solve()
    # One form for both norms: it is compiled once
    error, weight = T - kT / k, fem.Constant(mesh, np.zeros(2))
    square = ufl.inner(ufl.grad(error), ufl.grad(error))
    norm = compat.form((weight[0] * error**2 + weight[1] * square) * dx)
    found = []
    for weight.value in np.eye(2):
        found.append(np.sqrt(COMM.allreduce(fem.assemble_scalar(norm))))
    return np.array(found)


def four_squares(divisions=(3, 4, 5, 3)):
    """Four unit squares that meet in a point, with unrelated nodes.

    Square i has sides 10 i + 1 (bottom), 2 (top), 3 (left) and 4 (right).
    """
    names = ("bottom", "top", "left", "right")
    corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
    blocks = [
        Block(
            (n, n),
            low,
            (low[0] + 1.0, low[1] + 1.0),
            tags={name: 10 * i + k for k, name in enumerate(names, 1)},
        )
        for i, (n, low) in enumerate(zip(divisions, corners), 1)
    ]
    mesh, _, facets = assemble_blocks(COMM, blocks, "triangle", 1)
    return mesh, facets

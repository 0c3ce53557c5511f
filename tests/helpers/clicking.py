"""Linear bodies on a path with a limit point: one clicks over the other."""

from __future__ import annotations

import dataclasses
from typing import Any

from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem
from materials import MATERIALS, lame
from problems import COMM, DIMENSION, fix

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar.core import compat

# Height of a crest, its width, and how far the upper one starts behind the lower one
HEIGHT, WIDTH, BEHIND = 0.15, 0.35, 0.2
# How much the crests overlap, and the spring that pulls the upper one back: force per
# area and length
OVERLAP, SPRING = 0.03, 0.1
TAGS = {"bottom": 1, "master": 2, "slave": 3, "top": 4}


@dataclasses.dataclass
class Clicking:
    """A block with a crest below, pushed along over the crest of another."""

    scene: Any
    u: Any
    problem: Any
    push: Any

    def apply(self, t):
        self.push.value = t

    @property
    def top(self):
        """Dofs of the top."""
        V, dim = self.u.function_space, self.scene.mesh.geometry.dim
        facets = self.scene.facet_tags.find(TAGS["top"])
        return fem.locate_dofs_topological(V, dim - 1, facets)


def _crest(x):
    return HEIGHT * np.exp(-((x / WIDTH) ** 2))


def _lower(x):
    x = x.copy()
    x[:, -1] += x[:, -1] * _crest(x[:, 0])
    return x


def _upper(x):
    x = x.copy()
    up = x[:, -1] - 1.0
    x[:, -1] += 2.0 * HEIGHT - OVERLAP - (1.0 - up) * _crest(x[:, 0] + BEHIND)
    return x


def clicking(cell="triangle", n=(20, 16), spring=SPRING, **options):
    """Two such blocks, which touch; the load factor is the force on the upper one's
    top along x, whose height stays."""
    dim = DIMENSION[cell]
    across = [0.0] * (dim - 2), [0.3] * (dim - 2)
    few = [2] * (dim - 2)
    lower = Block(
        (n[0], *few, n[0] // 3),
        (-1.0, *across[0], 0.0),
        (1.0, *across[1], 1.0),
        mapping=_lower,
        tags={"bottom": TAGS["bottom"], "top": TAGS["master"]},
    )
    upper = Block(
        (n[1], *few, n[1] // 3),
        (-BEHIND - 0.6, *across[0], 1.0),
        (-BEHIND + 0.6, *across[1], 2.0),
        mapping=_upper,
        tags={"bottom": TAGS["slave"], "top": TAGS["top"]},
    )
    mesh, cells, facets = assemble_blocks(COMM, [lower, upper], cell)
    scene = Scene(mesh, cells, facets, TAGS, {"lower": 1, "upper": 2})
    V = compat.vector_space(mesh, 1)
    u, v = fem.Function(V), ufl.TestFunction(V)
    push = fem.Constant(mesh, PETSc.ScalarType(0.0))
    P = MATERIALS["linear"][0](ufl.grad(u), *lame(100.0, 0.3))
    F = ufl.inner(P, ufl.grad(v)) * ufl.dx(metadata={"quadrature_degree": 2})
    ds = ufl.Measure("ds", mesh, subdomain_data=facets)
    spring = fem.Constant(mesh, PETSc.ScalarType(spring))
    F -= (push - spring * u[0]) * v[0] * ds(TAGS["top"])
    bcs = [fix(V, scene, "bottom"), fix(V, scene, "top", dim - 1)]
    if dim == 3:
        bcs.append(fix(V, scene, "top", 1))
    pair = [(TAGS["slave"], TAGS["master"])]
    contact = raymortar.Contact(u, facets, pair, **options)
    problem = raymortar.NonlinearProblem(F, contact, bcs)
    return Clicking(scene, u, problem, push)

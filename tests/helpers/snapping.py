"""Bodies whose path of equilibria turns back: blocks on a bed that gives way."""

from __future__ import annotations

import dataclasses
from typing import Any

from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx import fem
from problems import COMM, DIMENSION, SOLVERS, cellwise, fix

import raymortar
from meshes.scenes import two_blocks
from raymortar.core import compat

# Pressure of the bed at a depth w: rises to 5, falls to 1, rises again
BED = np.array([1.0, -9.0, 24.0, 0.0]) * 0.25
# Young's modulus of either block; without lateral strain
E = {"lower": 40.0, "upper": 25.0}


def pressure(w):
    """Of the bed. Force per area."""
    return np.polyval(BED, w)


def top_sinks(w):
    """Displacement of the loaded top, down, where the bed is w deep, exactly."""
    return w + pressure(w) * sum(1.0 / e for e in E.values())


@dataclasses.dataclass
class OnBed:
    """A block on another on the bed, pressed at its top."""

    scene: Any
    u: Any
    problem: Any
    solver: Any
    apply: Any
    load: Any

    @property
    def top(self):
        """Dofs of the top."""
        V, dim = self.u.function_space, self.scene.mesh.geometry.dim
        facets = self.scene.facet_tags.find(self.scene.tags["top"])
        return fem.locate_dofs_topological(V, dim - 1, facets)


def on_bed(
    cell, degree=1, solver=SOLVERS[0], method=None, gap=0.0, prescribed=False, **options
):
    """Equilibria of a uniform state in closed form: nu = 0, linear elastic.

    Parameters
    ----------
    prescribed
        The load factor is the displacement of the top, down, in place of the pressure
        there.
    """
    dim = DIMENSION[cell]
    n = ((4, 2), (3, 2)) if dim == 2 else (2, 3)
    scene = two_blocks(COMM, dim, cell, *n, gap=gap)
    V = compat.vector_space(scene.mesh, degree)
    u = fem.Function(V)
    ds = ufl.Measure("ds", scene.mesh, subdomain_data=scene.facet_tags)
    w, v = -u[dim - 1], ufl.TestFunction(V)
    load = fem.Constant(scene.mesh, PETSc.ScalarType(0.0))
    form = cellwise(scene, E) * ufl.inner(ufl.sym(ufl.grad(u)), ufl.grad(v)) * ufl.dx
    bed = sum(c * w ** (3 - i) for i, c in enumerate(BED))
    form -= bed * v[dim - 1] * ds(scene.tags["bottom"])
    form += load * v[dim - 1] * ds(scene.tags["top"])
    sides = ("left", "front")[: dim - 1]
    bcs = [
        fix(V, scene, f"{body}_{side}", k)
        for k, side in enumerate(sides)
        for body in ("lower", "upper")
    ]
    down = fem.Constant(scene.mesh, PETSc.ScalarType(0.0))
    if prescribed:
        bcs.append(fix(V, scene, "top", dim - 1, down))
    pairs = [(scene.tags["slave"], scene.tags["master"])]
    contact = raymortar.Contact(u, scene.facet_tags, pairs, method, **options)
    problem = raymortar.NonlinearProblem(form, contact, bcs)

    def apply(t):
        down.value = -t
        load.value = 0.0 if prescribed else t

    return OnBed(scene, u, problem, solver(problem), apply, load)

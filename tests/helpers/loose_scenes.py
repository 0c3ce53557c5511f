"""A path of a body that nothing but contact holds: a disc that falls."""

from __future__ import annotations

from petsc4py import PETSc

import first_tries
import numpy as np
import ufl
from dolfinx import fem
from materials import lame
from pathing import Path
from slender import problem_of

from raymortar import rigid


def disc(gap=0.1, size=1.0, mu=0.3, steps=10, radius=5.0, **options):
    """An unstructured disc of degree 2 that falls on a rigid line under its weight.

    Its result is the displacement of its middle.
    """

    def draw(occ):
        body = occ.addDisk(0, radius + gap, 0, radius, radius)
        return {"disc": body}, {"rim": ("disc", lambda x, y: True)}

    mesh = first_tries.read(draw, size)
    tag = mesh.names["rim"][1]
    weight = fem.Constant(mesh.mesh, PETSc.ScalarType(0.0))
    floor = rigid.Body(rigid.Line((0.0, 0.0), (0.0, 1.0)))
    problem = problem_of(
        mesh.mesh,
        mesh.facet_tags,
        lame(10.0, 0.3),
        [(tag, floor)],
        lambda V: [],
        mu,
        lambda v: -weight * v[1] * ufl.dx,
        **options,
    )

    def apply(t):
        weight.value = 5.0 * t / (np.pi * radius**2)

    u = problem.u
    X = u.function_space.tabulate_dof_coordinates()[:, :2] - [0.0, radius + gap]
    middle = int(np.argmin(np.linalg.norm(X, axis=1)))
    return Path(problem, apply, steps, lambda: u.x.array.reshape(-1, 2)[middle])

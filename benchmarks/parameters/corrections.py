"""Load steps with and without corrections by the same tangent."""

from __future__ import annotations

import statistics
import time
from contextlib import contextmanager, nullcontext
from unittest import mock

from petsc4py import PETSc

import numpy as np
from dolfinx import fem
from problems import COMM, build, fix

import raymortar
from meshes.scenes import two_blocks
from raymortar.solvers import correcting

# Cell, degree, size, friction and linear solver; by default the one that suits the size
BLOCKS = (
    ("triangle", 1, 4, 0.3, None),
    ("triangle", 1, 25, 0.3, None),
    ("triangle", 1, 50, 0.3, None),
    ("triangle", 2, 3, 0.3, None),
    ("triangle", 2, 20, 0.3, None),
    ("tetrahedron", 2, 1, 0.3, None),
    ("hexahedron", 1, 3, 0.3, "direct"),
    ("tetrahedron", 2, 2, 0.0, "direct"),
    ("tetrahedron", 2, 2, 0.3, "direct"),
)
STEPS, RUNS = 4, 3


def sheared(cell, degree, size, mu, linear):
    """A block that is pressed on another one and drawn along, in load steps; `linear` may
    give the options of a problem."""
    dim = 2 if cell == "triangle" else 3
    scene = two_blocks(
        COMM,
        dim,
        cell,
        lower_divisions=(4 * size,) * (dim - 1) + (2 * size,),
        upper_divisions=(3 * size,) * (dim - 1) + (2 * size,),
        lower_size=(1.0,) * (dim - 1) + (0.5,),
        upper_size=(0.8,) * (dim - 1) + (0.5,),
    )
    top = fem.Constant(scene.mesh, np.zeros(dim, PETSc.ScalarType))

    def conditions(V, scene):
        return [fix(V, scene, "bottom"), fix(V, scene, "top", None, top)]

    options = {"friction": raymortar.Coulomb(mu)} if mu else {}
    problem = build(
        scene, degree, material="neo-hookean", bcs=conditions, **options
    ).problem
    given = linear(problem) if callable(linear) else None
    if linear == "direct":
        given = raymortar.solvers.direct()
    solver = raymortar.SNESSolver(problem, given)

    def apply(t):
        top.value[-1] = -0.1 * t
        top.value[0] = 0.05 * t if mu else 0.0

    return problem, raymortar.LoadSteps(solver, apply, STEPS, progress=False)


@contextmanager
def without():
    """No iterate is corrected."""
    with mock.patch.object(correcting, "has_own_factors", lambda ksp: False):
        yield


def measured(case, corrected):
    """Unknowns, tangents and CPU seconds of a path."""
    problem, load = sheared(*case)
    start = time.process_time()
    with nullcontext() if corrected else without():
        steps = load.run()
    seconds = time.process_time() - start
    return (
        problem.contact.layout.size_global,
        sum(step.tangents for step in steps),
        seconds,
    )


def corrections():
    """Tangents and seconds, with and without by turns, medians."""
    for case in BLOCKS:
        found = {True: [], False: []}
        for _ in range(RUNS):
            for corrected, runs in found.items():
                runs.append(measured(case, corrected))
        cell, degree, _, mu, linear = case
        row = {"cell": cell, "degree": degree, "mu": mu, "linear": linear or "default"}
        row["unknowns"] = found[True][0][0]
        for name, corrected in (("plain", False), ("corrected", True)):
            row[f"{name}_tangents"] = found[corrected][0][1]
            seconds = statistics.median(run[2] for run in found[corrected])
            row[f"{name}_seconds"] = f"{seconds:.2f}"
        yield row

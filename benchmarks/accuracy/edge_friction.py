"""Friction where contact ends somewhere, with known answers: partial slip, a wedge, and
shallow ironing beside a finer mesh.

Each scene is solved by the laws of `edge_scenes`.
"""

from __future__ import annotations

import bodies
import numpy as np
import ufl
from dolfinx import fem
from edge_scenes import COMM, METHODS
from models import cattaneo_mindlin, shallow_ironing

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import AugmentedLagrangian, tools


def solve_partial_slip(n, degree, law):
    """Cattaneo and Mindlin's cylinders: error of the tangential traction in L2."""
    method = AugmentedLagrangian(**METHODS[law])
    result = cattaneo_mindlin.solve(COMM, n, degree, method=method)

    def error():
        return cattaneo_mindlin.measure(result).tangential_off

    return result.contact, error, sum(result.iterations)


SLOPE, FRICTION, WEIGHT, E_WEDGE = 0.1, 0.2, 0.4, 1100.0


def solve_wedge(n, degree, law):
    """A block that is pushed up a wedge (CGS-4): error of the push over the weight."""

    def between(floor, roof):
        """Of the unit square's heights."""

        def mapping(x):
            low, high = floor(x[:, 0]), roof(x[:, 0])
            return np.column_stack([x[:, 0], low + (high - low) * x[:, 1]])

        return mapping

    def incline(x):
        return 0.7 + SLOPE * x

    tags = {"bottom": 1, "master": 2, "slave": 3, "top": 4, "left": 5}
    wedge = Block(
        (6 * n, max(1, 3 * n // 2)), (0.0, 0.0), (6.0, 1.0),
        mapping=between(lambda x: 0.0 * x, incline),
        tags={"bottom": 1, "top": 2}, body="wedge",
    )  # fmt: skip
    block = Block(
        (9 * n // 2, max(1, 3 * n // 2)), (1.0, 0.0), (5.0, 1.0),
        mapping=between(incline, lambda x: 2.0 + 0.0 * x),
        tags={"bottom": 3, "top": 4, "left": 5}, body="block",
    )  # fmt: skip
    scene = Scene(*assemble_blocks(COMM, [wedge, block], "quadrilateral", 1), tags)
    V = tools.vector_space(scene.mesh, degree)
    u, v = fem.Function(V), ufl.TestFunction(V)
    load, way = fem.Constant(scene.mesh, 0.0), fem.Constant(scene.mesh, 0.0)
    ds = ufl.Measure("ds", domain=scene.mesh, subdomain_data=scene.facet_tags)
    form = bodies.NeoHookean(E_WEDGE, 0.0).residual(u, 2 * degree)
    form += load * v[1] * ds(tags["top"])
    contact = raymortar.Contact(
        u,
        scene.facet_tags,
        [(tags["slave"], tags["master"])],
        AugmentedLagrangian(**METHODS[law]),
        raymortar.Coulomb(FRICTION),
    )
    bcs = [
        tools.prescribe(V, scene.find("bottom")),
        tools.prescribe(V, scene.find("left"), way, 0),
    ]
    problem = raymortar.NonlinearProblem(form, contact, bcs)
    solver = raymortar.SNESSolver(problem)

    def apply(t):
        load.value, way.value = WEIGHT / 4.0 * min(t, 1.0), 0.2 * max(t - 1.0, 0.0)

    steps = []
    for path, count in (((0.0, 1.0), 1), ((1.0, 2.0), 10)):
        steps += raymortar.LoadSteps(solver, apply, count, path=path).run()

    def error():
        along, up = contact.resultant(0).force[:2]
        exact = (SLOPE + FRICTION) / (1.0 - FRICTION * SLOPE)
        return abs(-along / up / exact - 1.0)

    return contact, error, sum(step.iterations for step in steps)


IRONING = (10, 50, 1.2)  # steps down, along for a unit of time, last time


def iron(n, law):
    """Model, and its reactions (V, H) in the steps along, (steps, 2)."""
    model = shallow_ironing.Ironing(
        COMM,
        n,
        "neo-hookean",
        extrapolate=False,
        quadrature_degree=None,
        across=n // 5,
        method=AugmentedLagrangian(shallow_ironing.GAMMA, **METHODS[law]),
    )
    rows = list(model.path(0.0, *IRONING))
    along = np.array([(row.V, row.H) for row in rows if row.t > 1.0 + 1e-9])
    return model, along, sum(row.iterations for row in rows)


def solve_ironing(reference, n, degree, law):
    """Shallow ironing: error of both reactions along, against those of a finer mesh."""
    model, found, iterations = iron(n, law)
    return model.contact, lambda: relative(found, reference), iterations


def relative(found, exact):
    """Norm of the difference over that of the exact values."""
    return np.linalg.norm(found - exact) / np.linalg.norm(exact)

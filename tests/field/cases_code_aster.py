"""code_aster: its validation manual (V6) and tests `astest`, NAFEMS's set among them."""

from __future__ import annotations

import sys
from pathlib import Path

import greco
import numpy as np
from dolfinx import fem
from field_scenes import (
    at,
    displacement,
    follow,
    half_width,
    law_of,
    part,
    scene_of,
    touching,
)
from materials import lame
from problems import COMM, build, cellwise, fix
from registry import Figure, Outcome, case
from revolution import residual as residual_of_revolution

import raymortar
from meshes.scenes import two_cylinders

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from models import hertz_cylinder  # noqa: E402

PATCH = dict(
    code="code_aster",
    source="astest/ssnp121a, V6.03.121",
    scene="two blocks of unlike meshes under a displacement: uniform pressure",
    figures=[
        Figure("height of the contact", -0.05, 1e-9),
        Figure("least pressure", 1e5, 1e-9),
        Figure("largest", 1e5, 1e-9),
    ],
)


@case(**PATCH, law="points")
@case(**PATCH, law="dual")
def unlike_blocks(law):
    scene = scene_of(
        "quadrilateral",
        lower=part((5, 3), (0, 0), (1, 1), {"bottom": "bottom", "top": "master"}),
        upper=part((7, 4), (0, 1), (1, 2), {"bottom": "slave", "top": "top"}),
    )
    down = fem.Constant(scene.mesh, 0.0)
    problem = build(
        scene,
        E=2e6,
        nu=0.0,
        method=law_of(law),
        bcs=lambda V, scene: [
            fix(V, scene, "bottom"),
            fix(V, scene, "top", 0),
            fix(V, scene, "top", 1, down),
        ],
    )

    def apply(factor):
        down.value = -0.1 * factor

    iterations = follow(problem, apply)
    traction = problem.contact.traction()
    along = [at(traction, (k / 7, 1), scene, "upper")[1] for k in range(8)]
    height = at(problem.u, (3 / 7, 1), scene, "upper")[1]
    return Outcome([height, min(along), max(along)], iterations)


CUBES = dict(
    code="code_aster",
    source="V6.04.167, modelling A",
    scene="a cube of 4 x 4 facets on one of 3 x 3, top down by 0.2",
    figures=[
        Figure("height of the contact", -0.1, 1e-9),
        Figure("spread of it", 0.0, 1e-9, scale=0.1),
    ],
)


@case(**CUBES, law="points")
@case(**CUBES, law="dual")
def cubes(law):
    scene = scene_of(
        "hexahedron",
        lower=part((3, 3, 2), (0, 0, 0), (1, 1, 1), {"bottom": "bottom", "top": "master"}),
        upper=part((4, 4, 2), (0, 0, 1), (1, 1, 2), {"bottom": "slave", "top": "top"}),
    )  # fmt: skip
    down = fem.Constant(scene.mesh, 0.0)
    problem = build(
        scene,
        E=2e6,
        nu=0.0,
        method=law_of(law),
        bcs=lambda V, scene: [
            fix(V, scene, "bottom"),
            fix(V, scene, "top", 0),
            fix(V, scene, "top", 1),
            fix(V, scene, "top", 2, down),
        ],
    )

    def apply(factor):
        down.value = -0.2 * factor

    iterations = follow(problem, apply)
    nodes = problem.slave_displacement_nodes()
    heights = [at(problem.u, x, scene, "upper")[2] for x in nodes]
    return Outcome([np.mean(heights), np.ptp(heights)], iterations)


@case(
    "code_aster",
    "astest/ssnv128a, V6.04.128 (GRECO)",
    "a plate pressed and pushed along a rigid plane, mu 1: opens, slips and sticks",
    [
        Figure("u_x at A, m", 2.86e-5, 0.01),
        Figure("at B", 2.72e-5, 0.01),
        Figure("at C", 2.28e-5, 0.01),
        Figure("at D", 1.98e-5, 0.01),
        Figure("at E", 1.5e-5, 0.03),
    ],
    law="points",
    verdict="two digits are printed",
)
def plate_of_greco(_):
    found, steps = greco.solve("quadrilateral", 1)
    dofs = found.contact.zones[0].facets.slave_surface.dofs
    x = found.u.function_space.tabulate_dof_coordinates()[dofs, 0]
    order = np.argsort(x)
    along = found.u.x.array.reshape(-1, 2)[dofs[order], 0]
    places = 1e-3 * np.array([0.0, 1.25, 5.0, 7.5, 11.25])
    return Outcome(np.interp(places, x[order], along), [s.iterations for s in steps])


ROLLER = dict(
    code="NAFEMS",
    source="R0094 (Konter 2006) benchmark 1; code_aster V6.03.154, cont008a",
    scene="a steel roller of 50 mm on aluminium, 35 kN/mm",
    figures=[
        Figure("peak pressure, MPa", 3585.37, 0.01),
        Figure("half width, mm", 6.2146, 0.01),
        Figure("settling, mm", -1.2727, 0.003),
    ],
)


@case(**ROLLER, law="points")
@case(**ROLLER, law="dual")
def roller(law):
    model = hertz_cylinder
    result = model.solve(COMM, model.NAFEMS, 20, force=35e3, method=law_of(law))
    peak = at(result.contact.pressure(), (0, 0), result.scene, "upper")
    width = half_width(result.contact)
    return Outcome([peak, width, model.settling(result)], result.iterations)


SPHERES = dict(
    code="code_aster",
    source="V6.04.104, ssnv104",
    scene="two half balls pressed together by 4 mm, axisymmetric",
    figures=[Figure("pressure at the pole, MPa", 2798.3, 0.02)],
    verdict="the contact is a fifth of the radius wide, and the balls are no half spaces",
)


@case(**SPHERES, law="points")
@case(**SPHERES, law="dual")
def spheres(law):
    scene = two_cylinders(
        COMM, radius=50.0, contact_half_width=10.0, facets_across=24, sector="half"
    )
    u = displacement(scene)
    V = u.function_space
    down, up = (fem.Constant(scene.mesh, 0.0) for _ in range(2))
    mu, lmbda = (cellwise(scene, value) for value in lame(20e3, 0.3))
    bcs = [
        fix(V, scene, "symmetry_x", 0),
        fix(V, scene, "top", 1, down),
        fix(V, scene, "bottom", 1, up),
    ]
    F = residual_of_revolution(u, mu, lmbda)
    contact, problem = touching(scene, u, F, law_of(law), bcs, axisymmetric=True)

    def apply(factor):
        down.value, up.value = -2.0 * factor, 2.0 * factor

    iterations = follow(problem, apply, 3)
    return Outcome([at(contact.pressure(), (0, 0), scene, "upper")], iterations)

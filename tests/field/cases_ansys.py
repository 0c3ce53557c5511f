"""Ansys: its verification manual and a tutorial, of Hertz's, Cattaneo's and Mindlin's."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from dolfinx import fem
from field_scenes import at, displacement, follow, half_width, law_of, loaded, touching
from materials import lame
from problems import COMM, cellwise, fix, residual
from registry import Figure, Outcome, case
from revolution import residual as residual_of_revolution

import raymortar
from meshes.graded import PoleGrid, ball_blocks
from meshes.meshing import Scene, assemble_blocks
from meshes.scenes import two_cylinders

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from models import cattaneo_mindlin  # noqa: E402

LINE = dict(
    code="Ansys",
    source="verification manual, VM191 (Chandrasekaran 1987)",
    scene="cylinders of 10 and 13 mm, E 30000 and 29120, 3200 N/mm",
    figures=[
        Figure("half width, mm", 1.20, 0.02),
        Figure("peak pressure by Hertz, MPa", 2 * 3200 / np.pi / 1.1997, 0.02),
    ],
    verdict="Ansys has 1.1609 in plane stress; the target is Hertz's of plane strain",
)


@case(**LINE, law="points")
@case(**LINE, law="dual")
def unlike_cylinders(law):
    scene = two_cylinders(
        COMM,
        radius=10.0,
        lower_radius=13.0,
        contact_half_width=1.2,
        facets_across=24,
        master_ratio=0.8,
        sector="half",
    )
    u, down = displacement(scene), fem.Constant(scene.mesh, 0.0)
    V = u.function_space
    E, nu = {"upper": 30000.0, "lower": 29120.0}, {"upper": 0.25, "lower": 0.3}
    F, _, load = residual(scene, u, E=E, nu=nu, loaded=["top"])
    held = [fix(V, scene, "symmetry_x", 0), fix(V, scene, "bottom", 1)]
    push = fix(V, scene, "top", 1, down)
    contact, problem = touching(scene, u, F, law_of(law), [*held, push])

    def press(factor):
        down.value = -0.38 * factor

    iterations = follow(problem, press, 2)
    # A force cannot hold bodies that only just touch: it takes over here
    load.value[1, 1] = -3200.0 / 20.0
    loose = raymortar.NonlinearProblem(F, contact, held)
    iterations += follow(loose, lambda factor: None)
    peak = at(contact.pressure(), (0, 0), scene, "upper")
    return Outcome([half_width(contact), peak], iterations)


PARTIAL = dict(
    code="Ansys",
    source="verification manual, VM272 (Yang, Laursen and Meng 2005)",
    scene="cylinders of 8 mm, E 200, pressed by 10 N and sheared by 0.93622 N, mu 0.2",
    figures=[
        Figure("deviation of the pressure in L2", 0.0, 0.03, scale=1.0),
        Figure("of the friction", 0.0, 0.06, scale=1.0),
        Figure("half width, mm", 0.68078, 0.01),
        Figure("force, N", 10.0, 1e-3),
        Figure("shear, N", 0.93616, 1e-9),
    ],
    verdict="closed forms of half spaces; 16 mm times 0.05851 are 0.93616 N",
)


@case(**PARTIAL, law="points")
@case(**PARTIAL, law="dual")
def sheared_cylinders(law):
    model = cattaneo_mindlin
    result = model.solve(COMM, degree=1, facets_across=40, method=law_of(law))
    found = model.measure(result)
    values = [
        found.normal_off,
        found.tangential_off,
        found.half_width,
        found.final_force,
        found.shear_force,
    ]
    return Outcome(values, result.iterations)


BALL = dict(
    code="Ansys",
    source="Cornell's tutorial, confluence.cornell.edu/x/V4g9Dg, Hertz's formula",
    scene="a ball of 8 mm, E 1000, on a rigid plane, 60 pi N, axisymmetric",
    figures=[
        Figure("radius of the contact, mm", 1.010, 0.01),
        Figure("peak, MPa", 88.3, 0.03),
    ],
)


@case(**BALL, law="points")
@case(**BALL, law="dual")
def ball_on_plane(law):
    grid = PoleGrid(1.01, 1.01 / 16)
    tags = {"surface": 1, "left": 2, "cut": 3}
    mesh, cells, facets = assemble_blocks(
        COMM, ball_blocks(2, 8.0, grid, tags, "ball"), "quadrilateral"
    )
    names = {"slave": 1, "axis": 2, "top": 3}
    scene = Scene(mesh, cells, facets, names, {"ball": 1})
    u, down = displacement(scene), fem.Constant(mesh, 0.0)
    V = u.function_space
    mu, lmbda = (cellwise(scene, value) for value in lame(1000.0, 0.3))
    F = residual_of_revolution(u, mu, lmbda)
    floor = raymortar.rigid.Line((0.0, 0.0), (0.0, 1.0))
    axis, push = fix(V, scene, "axis", 0), fix(V, scene, "top", 1, down)
    contact, problem = touching(
        scene, u, F, law_of(law), [axis, push], [("slave", floor)], axisymmetric=True
    )
    force, aim = 60 * np.pi, 0.12
    # The force of the tutorial by the secant of the displacement's
    iterations, last = [], 0.0
    for _ in range(6):
        start = last

        def press(factor, start=start, aim=aim):
            down.value = -(start + factor * (aim - start))

        iterations += follow(problem, press)
        found, last = contact.resultant(0).force[1], aim
        if abs(found / force - 1) < 1e-6:
            break
        # Of Hertz's law
        aim *= (force / found) ** (2 / 3)
    points = contact.points(0)
    share = points["pressure"] * points["weight"]
    radius = np.sqrt(2.5 * (share @ points["X"][:, 0] ** 2) / share.sum())
    return Outcome([radius, at(contact.pressure(), (0, 0))], iterations)

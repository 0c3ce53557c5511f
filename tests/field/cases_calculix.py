"""CalculiX: tests of contact in its folder `test` (Dhondtguido/CalculiX)."""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem
from field_scenes import (
    at,
    displacement,
    follow,
    law_of,
    load_of,
    loaded,
    mean_dilatation,
    part,
    scene_of,
    touching,
)
from fluxes import conduction, field_space, prescribe
from problems import build, fix, residual
from registry import Figure, Outcome, case

import raymortar
from raymortar import tools

STEEL = 210000.0
# Half the diagonal and half the side of the small cube, as its file rounds them
RIM = 0.141421
SIDE = RIM / np.sqrt(2.0)
# Spring of its contact elements, pressure over overlap
SPRING = 1e7


def turned(x):
    """Points turned by an eighth about the axis of the unit cube."""
    local = x[:, :2] - 0.5
    plane = np.column_stack([local[:, 0] - local[:, 1], local[:, 0] + local[:, 1]])
    return np.column_stack([0.5 + plane / np.sqrt(2.0), x[:, 2]])


def two_cubes(overlap=0.0):
    """A small cube, turned, on a unit cube, each of one hexahedron; and its load."""
    near, far = 0.5 - SIDE, 0.5 + SIDE
    low, high = (near, near, 1.0 - overlap), (far, far, 1.2 - overlap)
    scene = scene_of(
        "hexahedron",
        lower=part((1, 1, 1), (0, 0, 0), (1, 1, 1), {"bottom": "bottom", "top": "master"}),
        upper=part((1, 1, 1), low, high, {"bottom": "slave", "top": "top"}, mapping=turned),
    )  # fmt: skip
    return scene, -np.diag([0.0, 0.0, 1.0 / SIDE**2])


@case(
    "CalculiX",
    "test/contactenergy.inp, .dat.ref",
    "two hexahedra, force 4 on top, penalty 1e7, frictionless",
    [
        Figure("height of the lower cube", -1.904762e-5, 1e-6),
        Figure("of the slave", -2.904767e-5, 1e-6),
        Figure("of the top", -1.242862e-4, 1e-6),
        Figure("elastic energy", 2.285724e-4, 1e-6),
        Figure("energy of the springs", 2.000010e-5, 1e-5),
    ],
    law="penalty",
)
def contact_energy(_):
    scene, load = two_cubes()
    problem = build(
        scene,
        E=STEEL,
        nu=0.0,
        method=raymortar.Penalty(SPRING),
        bcs=lambda V, scene: [
            fix(V, scene, "bottom"),
            *(fix(V, scene, "slave", k) for k in (0, 1)),
        ],
        loaded=["top"],
    )
    iterations = follow(problem, load_of(problem, load))
    u = problem.u
    strain = ufl.sym(ufl.grad(u))
    elastic = tools.integral(
        0.5 * STEEL * ufl.inner(strain, strain) * ufl.dx, scene.mesh
    )
    found = problem.contact.points(0)
    springs = 0.5 * np.sum(found["weight"] * found["pressure"] ** 2) / SPRING
    rim = 0.5 + RIM
    heights = [at(u, p)[2] for p in ((0, 0, 1), (rim, 0.5, 1), (rim, 0.5, 1.2))]
    return Outcome([*heights, elastic, springs], iterations)


OVERLAPPING = dict(
    code="CalculiX",
    source="test/contact6.inp, .dat.ref",
    scene="two hexahedra that overlap by 1e-4, faces kept flat, force 4",
    figures=[
        Figure("height of the lower cube", -1.414996e-5, 1e-6),
        Figure("of the slave", 8.571368e-5, 2e-3),
        Figure("of the top", -1.011036e-6, 2e-3, scale=8.571368e-5),
    ],
    verdict="its springs (1e9 at nodes) leave an overlap of 1.4e-7; a multiplier none",
)


@case(**OVERLAPPING, law="points")
@case(**OVERLAPPING, law="dual")
def overlapping_cubes(law):
    scene, load = two_cubes(overlap=1e-4)
    problem = build(
        scene,
        material="svk",
        E=STEEL,
        nu=0.3,
        method=law_of(law),
        bcs=lambda V, scene: [
            fix(V, scene, "bottom"),
            *(fix(V, scene, side, k) for side in ("slave", "master") for k in (0, 1)),
        ],
        loaded=["top"],
    )
    iterations = follow(problem, load_of(problem, load))
    rim = 0.5 + RIM
    points = (0, 0, 1), (rim, 0.5, 1 - 1e-4), (rim, 0.5, 1.2 - 1e-4)
    return Outcome([at(problem.u, p)[2] for p in points], iterations)


# Ends of its ten increments, s
ENDS = 1e-3 * np.array(
    [0.1, 0.2, 0.35, 0.575, 0.9125, 1.41875, 2.178125, 3.317188, 5.025781, 6.0]
)


@case(
    "CalculiX",
    "test/contact7.inp, .dat.ref",
    "heat through contact, ten given increments, conductance 1 of the whole face",
    [
        Figure("lower temperature after 3.3 ms", 164.2856, 2e-5),
        Figure("upper temperature then", 177.9858, 2e-5),
        Figure("lower temperature at the end", 164.3808, 1e-6),
        Figure("upper temperature at the end", 178.0795, 1e-6),
    ],
    verdict="the reference counts three times the area: with the true one 160 and 200",
)
def transient_heat():
    scene, _ = two_cubes()
    u = displacement(scene)
    T = fem.Function(field_space(scene.mesh, 1))
    T_old, dt = fem.Function(T.function_space), fem.Constant(scene.mesh, 1.0)
    s = ufl.TestFunction(T.function_space)
    F = conduction(scene, T, 1e-2) + 7.8e-9 * 1e3 * (T - T_old) / dt * s * ufl.dx
    contact = raymortar.Contact(
        u, scene.facet_tags, [("slave", "master")], law_of("points"), names=scene.tags
    )
    flux = raymortar.fluxes.Flux(contact, T, lambda T_s, T_m, *_: 3.0 * (T_s - T_m))
    ends = [
        prescribe(T.function_space, scene, name, value)
        for name, value in (("bottom", 0.0), ("top", 1000.0))
    ]
    problem = raymortar.fluxes.FieldProblem(F, T, flux, ends)
    iterations, values, start = [], [], 0.0
    for end in ENDS:
        dt.value, start = end - start, end
        problem.solve()
        iterations.append(problem.iterations)
        T_old.x.array[:] = T.x.array
        values.append([at(T, (0, 0, 1)), at(T, (0.5 + RIM, 0.5, 1))])
    return Outcome([*values[7], *values[9]], iterations)


@case(
    "CalculiX",
    "test/friction1.inp, .dat.ref",
    "4 x 4 x 4 hexahedra on 4 x 4 x 4, pressure 100, stick slope 47000, mu 0.2",
    [
        Figure("pressure at a corner", 133.35, 0.02),
        Figure("on a side, next to it", 119.98, 0.02),
        Figure("on a diagonal", 102.36, 0.02),
        Figure("in the middle of a side", 101.31, 0.03),
        Figure("next to the centre", 79.92, 0.01),
        Figure("at the centre", 54.46, 0.02),
        Figure("force", 25.0, 1e-9),
    ],
    law="dual",
    verdict="node to face: its nodes carry other shares of the area",
)
def regularised_friction(law):
    scene = scene_of(
        "hexahedron",
        lower=part((4, 4, 4), (0, 0, 0), (1, 1, 1), {"bottom": "bottom", "top": "master"}),
        upper=part(
            (4, 4, 4), (0.25, 0.25, 1), (0.75, 0.75, 1.5), {"bottom": "slave", "top": "top"}
        ),
    )  # fmt: skip
    u = displacement(scene)
    V = u.function_space
    work, load = loaded(scene, u, "top")
    F, J = mean_dilatation(scene, u, STEEL, 0.3)
    contact, problem = touching(
        scene,
        u,
        F - work,
        law_of(law),
        [fix(V, scene, "bottom"), *(fix(V, scene, "top", k) for k in (0, 1))],
        J=J,
        friction=raymortar.Friction(
            lambda p, v, dt: np.minimum(0.2 * p, 47e3 * v * dt)
        ),
    )

    def apply(factor):
        load.value[2] = -100.0 * factor

    iterations = follow(problem, apply)
    traction = contact.traction()
    spots = (
        (0.75, 0.75),
        (0.75, 0.625),
        (0.625, 0.625),
        (0.5, 0.75),
        (0.5, 0.625),
        (0.5, 0.5),
    )
    values = [at(traction, (*spot, 1.0), scene, "upper")[2] for spot in spots]
    return Outcome([*values, contact.resultant(0).force[2]], iterations)


SLIDES = [
    Figure("friction, mu 0.2", 20.00252, 2e-4),
    Figure("turned round", -20.00252, 2e-4),
    Figure("after mu has become 0.1", 10.00126, 2e-4),
    Figure("pressure", 100.0126, 2e-4),
]
SLID = dict(
    code="CalculiX",
    source="test/friction2.inp, .dat.ref",
    scene="one hexahedron under pressure 100 slid by 1, -1 and 1 over a held plate",
    verdict="the reference takes the area as it is deformed under its springs",
)


@case(**SLID, figures=SLIDES, law="points")
@case(**SLID, figures=SLIDES, law="dual")
@case(**SLID, figures=SLIDES, law="penalty")
def slid_cube(law):
    scene = scene_of(
        "hexahedron",
        lower=part((1, 1, 1), (-1, -1, -1), (2, 2, 0), {"bottom": "plate", "top": "master"}),
        upper=part((1, 1, 1), (0, 0, 0), (1, 1, 1), {"bottom": "slave", "top": "top"}),
    )  # fmt: skip
    u, slide = displacement(scene), fem.Constant(scene.mesh, 0.0)
    V = u.function_space
    F, _, load = residual(scene, u, "svk", STEEL, 0.3, ["top"])
    plate = [fix(V, scene, name) for name in ("plate", "master")]
    pressed = [fix(V, scene, "top", k) for k in (0, 1)]
    slid = [fix(V, scene, "slave", 1, slide)]
    method = raymortar.Penalty(SPRING) if law == "penalty" else law_of(law)
    iterations, values, state = [], [], None

    def stage(mu, bcs, apply):
        nonlocal state
        bcs, mu = [*plate, *bcs], raymortar.Coulomb(mu)
        contact, problem = touching(scene, u, F, method, bcs, friction=mu)
        if state is not None:
            contact.restore(state)
        iterations.extend(follow(problem, apply))
        state = contact.state()
        return contact.resultant(0).force

    def press(factor):
        load.value[2, 2] = -100.0 * factor

    def slide_to(end, start):
        def apply(factor):
            slide.value = start + factor * (end - start)

        return apply

    stage(0.2, pressed, press)
    for mu, start, end in ((0.2, 0.0, 1.0), (0.2, 1.0, -1.0), (0.1, -1.0, 1.0)):
        force = stage(mu, slid, slide_to(end, start))
        values.append(-force[1])
    return Outcome([*values, force[2]], iterations)

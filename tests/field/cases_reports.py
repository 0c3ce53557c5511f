"""Public reports about contact codes, rebuilt: forums, issues, and papers' references."""

from __future__ import annotations

import moving
import numpy as np
import ufl
from dolfinx import fem
from field_scenes import (
    at,
    displacement,
    follow,
    held_at,
    law_of,
    load_of,
    part,
    scene_of,
    touching,
)
from materials import lame
from press_fits import SHAFT
from press_fits import pressure as pressure_of_lame
from press_fits import scene_of as quarters
from problems import build, cellwise, fix, residual
from registry import Figure, Outcome, case

import raymortar
from raymortar import tools

HEAT = dict(
    code="NGSolve",
    source="forum.ngsolve.org/t/contact-problems/2636",
)
EXPANSION, HOTTER, PARTICLE, MATRIX, NU = 2e-6, 300.0, 100e9, 10e9, 0.3
# Of the radius, by the strain that a long particle has across
GROWTH = EXPANSION * HOTTER * (1 + NU)
PLANE = [E / (1 - NU**2) for E in (PARTICLE, MATRIX)]
LAME = pressure_of_lame(GROWTH * SHAFT, *PLANE, *[NU / (1 - NU)] * 2)


def particle(law, change):
    """A particle in a matrix, held by nothing but contact, after a change of its
    temperature."""
    scene = quarters(16, 22)
    u, heat = displacement(scene, 2), fem.Constant(scene.mesh, 0.0)
    V = u.function_space
    F, _, _ = residual(scene, u, E={"shaft": PARTICLE, "hub": MATRIX}, nu=NU)
    stress = cellwise(scene, {"shaft": PARTICLE / (1 - 2 * NU), "hub": 0.0})
    F -= stress * EXPANSION * heat * ufl.div(ufl.TestFunction(V)) * ufl.dx
    bcs = [fix(V, scene, "bottom", 1), fix(V, scene, "left", 0)]
    contact, problem = touching(scene, u, F, law_of(law), bcs)

    def apply(factor):
        heat.value = change * factor

    iterations = follow(problem, apply, 3)
    return scene, u, contact, iterations


WARM = HEAT | dict(
    scene="a particle of degree 2 heated by 300 K in a softer matrix",
    figures=[
        Figure("mean pressure by Lame, Pa", LAME, 1e-3),
        Figure("largest deviation of it", 0.0, 0.02, scale=LAME),
    ],
)
COLD = HEAT | dict(
    scene="the same cooled by 300 K: the complaint is a matrix that is dragged along",
    figures=[
        Figure("gap, over the shrinkage", 1.0, 2e-3),
        Figure("largest pressure, over Lame's", 0.0, 1e-12, scale=1.0),
    ],
)


@case(**WARM, law="points")
@case(**WARM, law="dual")
def heated_particle(law):
    _, _, contact, iterations = particle(law, HOTTER)
    points = contact.points(0)
    closed = points["status"] == raymortar.results.Status.SLIP
    pressure, weight = points["pressure"][closed], points["weight"][closed]
    mean = weight @ pressure / weight.sum()
    return Outcome([mean, np.abs(pressure - mean).max()], iterations)


@case(**COLD, law="points")
@case(**COLD, law="dual")
def cooled_particle(law):
    _, _, contact, iterations = particle(law, -HOTTER)
    points = contact.points(0)
    gap = np.average(points["gap"], weights=points["weight"]) / (GROWTH * SHAFT)
    return Outcome([gap, np.abs(points["pressure"]).max() / LAME], iterations)


SHARED = dict(
    code="MOOSE",
    source="github.com/idaholab/moose/issues/33493",
    scene="two pairs whose slaves share a node, mu 0.3: uniform pressure",
    figures=[Figure("least pressure", 0.2, 1e-9), Figure("largest", 0.2, 1e-9)],
)


@case(**SHARED, law="points")
@case(**SHARED, law="dual")
def shared_node(law):
    scene = scene_of(
        "quadrilateral",
        lower=[
            part((3, 2), (0, 0), (1, 1), {"bottom": "bottom", "top": "master"}),
            part((2, 2), (1, 0), (2, 1), {"bottom": "bottom", "top": "other master"}),
        ],
        upper=[
            part((4, 3), (0, 1), (1, 2), {"bottom": "slave", "top": "top"}),
            part((3, 3), (1, 1), (2, 2), {"bottom": "other slave", "top": "top"}),
        ],
    )
    u, down = displacement(scene), fem.Constant(scene.mesh, 0.0)
    V = u.function_space
    F, _, _ = residual(scene, u, E=20.0, nu=0.0)
    bcs = [
        fix(V, scene, "bottom"),
        fix(V, scene, "top", 0),
        fix(V, scene, "top", 1, down),
    ]
    pairs = [("slave", "master"), ("other slave", "other master")]
    contact, problem = touching(
        scene, u, F, law_of(law), bcs, pairs, friction=raymortar.Coulomb(0.3)
    )

    def apply(factor):
        down.value = -0.02 * factor

    iterations = follow(problem, apply)
    found = np.concatenate([contact.points(k)["pressure"] for k in (0, 1)])
    return Outcome([found.min(), found.max()], iterations)


PLANK = dict(
    code="MOOSE",
    source="github.com/idaholab/moose/pull/14241",
    scene="a block pushed on a plank and off it while it slides, mu 0.4, 45 steps",
    figures=[
        Figure("least friction over pressure", 0.4, 0.02),
        Figure("largest", 0.4, 0.02),
        Figure("steps by other ways or halved", 0.0, 1e-9, scale=1.0),
    ],
    verdict="the report: the active set goes to and fro, steps are cut",
)


@case(**PLANK, law="points")
@case(**PLANK, law="dual")
def block_on_a_plank(law):
    scene = scene_of(
        "quadrilateral",
        plank=part(
            (2, 67), (-0.3, -10), (0.3, 10), {"left": "wall", "right": "master"}
        ),
        block=part(
            (3, 4), (0.31, 7.7), (0.91, 8.5), {"left": "slave", "right": "grip"}
        ),
    )
    u = displacement(scene)
    V = u.function_space
    push, down = (fem.Constant(scene.mesh, 0.0) for _ in range(2))
    F, _, _ = residual(scene, u, "neo-hookean", 1e9, 0.3)
    bcs = [
        fix(V, scene, "wall"),
        fix(V, scene, "grip", 0, push),
        fix(V, scene, "grip", 1, down),
    ]
    contact, problem = touching(
        scene, u, F, law_of(law), bcs, friction=raymortar.Coulomb(0.4)
    )

    def apply(time):
        push.value, down.value = -0.04 * np.sin(4 * time), -time

    iterations, ratios, others = [], [], 0
    path = raymortar.LoadSteps(problem.snes_solver, apply, steps=45, path=(0.0, 4.5))
    for step in path:
        iterations.append(step.iterations)
        others += step.strategy != "full" or step.halvings > 0
        force = contact.resultant(0).force
        if force[0] > 1e3:
            ratios.append(force[1] / force[0])
    return Outcome([min(ratios), max(ratios), others], iterations)


ARCH = dict(
    code="Solfec",
    source="parmes.github.io/solfec, masonry arch (Milankovitch's limit)",
    scene="14 voussoirs of degree 2 held by contact alone, thickness 0.115 of the radius",
    figures=[
        Figure("reactions over the weight", 1.0, 1e-9),
        Figure("thrust line over the half thickness", 0.1075 / 0.115, 0.07),
    ],
    verdict="the limit, of rigid voussoirs, is a thickness of 0.1075; a joint has four cells",
)


@case(**ARCH, law="points")
@case(**ARCH, law="dual")
def masonry_arch(law):
    count, radius, share = 14, 5.0, 0.115
    thickness, weight = share * radius, 25e3
    ends = np.r_[-0.1, np.linspace(0, np.pi, count + 1), np.pi + 0.1]
    low, high = radius - thickness / 2, radius + thickness / 2

    def polar(x):
        return np.column_stack([-x[:, 1] * np.cos(x[:, 0]), x[:, 1] * np.sin(x[:, 0])])

    names = {
        f"b{k}": {"left": f"from {k}", "right": f"to {k}"} for k in range(count + 2)
    }
    scene = scene_of(
        "quadrilateral",
        **{
            name: part(
                (2, 4), (ends[k], low), (ends[k + 1], high), sides, mapping=polar
            )
            for k, (name, sides) in enumerate(names.items())
        },
    )
    u, gravity = displacement(scene, 2), fem.Constant(scene.mesh, 0.0)
    V, v = u.function_space, ufl.TestFunction(u.function_space)
    F, _, _ = residual(scene, u, "svk", 10e9, 0.2)
    F += gravity * v[1] * ufl.dx(degree=3)
    pairs = [(f"to {k}", f"from {k + 1}") for k in range(count + 1)]
    bcs = [fix(V, scene, "from 0"), fix(V, scene, f"to {count + 1}")]
    contact, problem = touching(
        scene, u, F, law_of(law), bcs, pairs, friction=raymortar.Coulomb(0.6)
    )

    def apply(factor):
        gravity.value = weight * factor

    iterations = follow(problem, apply, 4)
    reactions = problem.reactions({"ends": bcs})["ends"]
    area = tools.integral(1.0 * ufl.dx(domain=scene.mesh), scene.mesh)
    off = []
    for k in range(len(pairs)):
        points = contact.points(k)
        force = points["pressure"] * points["weight"]
        away = np.hypot(*points["X"].T)
        off.append((force @ away / force.sum() - radius) / (thickness / 2))
    return Outcome([reactions[1] / (weight * area), np.abs(off).max()], iterations)


CRACK = dict(
    code="PyLith",
    source="github.com/geodynamics/pylith/issues/578, GEOS-DEV/GEOS/pull/3217",
    scene="a crack at 30 degrees closed by compression, mu 0.2, tied beside it",
    figures=[Figure("slide in the middle, of an infinite plate", 1.0, 0.01)],
    verdict="the plate is twelve crack lengths wide",
)


@case(**CRACK, law="points")
@case(**CRACK, law="dual")
def closed_crack(law):
    half, side, E, nu, mu, angle = 1.0, 12.0, 1000.0, 0.25, 0.2, np.pi / 6
    fine = np.linspace(0, 1, 25)
    coarse = (1.4 ** np.arange(13) - 1) / (1.4**12 - 1)

    def row(y, sides):
        spans = [(-side, -half), (-half, half), (half, side)]
        grading = [1 - coarse[::-1], fine, coarse]
        up = coarse if y[0] >= 0 else 1 - coarse[::-1]
        edge = "bottom" if y[0] >= 0 else "top"
        far = "top" if y[0] >= 0 else "bottom"
        outer = ({"left": "far"}, {}, {"right": "far"})
        return [
            part(
                (len(g) - 1, len(up) - 1),
                (a, y[0]),
                (b, y[1]),
                {edge: name, far: "far"} | more,
                grading=[g, up],
            )
            for (a, b), g, name, more in zip(spans, grading, sides, outer)
        ]

    scene = scene_of(
        "quadrilateral",
        below=row((-side, 0.0), ("tied master", "master", "tied master")),
        above=row((0.0, side), ("tied slave", "slave", "tied slave")),
    )
    u = displacement(scene, 2)
    V = u.function_space
    F, _, load = residual(scene, u, "linear", E, nu, ["far"])
    direction = np.array([np.sin(angle), np.cos(angle)])
    stress = -np.outer(direction, direction)
    held = [
        held_at(V, (-side, -side), 0),
        held_at(V, (-side, -side), 1),
        held_at(V, (side, -side), 1),
    ]
    crack = raymortar.Contact(
        u,
        scene.facet_tags,
        [("slave", "master")],
        law_of(law),
        friction=raymortar.Coulomb(mu),
        names=scene.tags,
    )
    tie = raymortar.Tie(
        u, scene.facet_tags, [("tied slave", "tied master")], names=scene.tags
    )
    problem = raymortar.NonlinearProblem(F, [crack, tie], held)

    def apply(factor):
        load.value[:] = factor * stress

    iterations = follow(problem, apply, 2)
    slide = at(u, (0, 0), scene, "above") - at(u, (0, 0), scene, "below")
    shear = np.sin(angle) * np.cos(angle) - mu * np.cos(angle) ** 2
    exact = 4 * (1 - nu**2) / E * shear * half
    return Outcome([abs(slide[0]) / exact], iterations)


DROP = dict(
    code="MOOSE",
    source="github.com/idaholab/moose/issues/18419; Doyen, Ern and Piperno (2011)",
    scene="a bar of 10 falls at 10 on a plane, wave speed 30, trapezoidal rule",
    figures=[
        Figure("contact pressure", 300.0, 1e-3),
        Figure("ripple of it", 0.0, 0.01, scale=300.0),
        Figure("impulse", 200.0, 0.02),
        Figure("energy at the end", 1.0, 2e-3),
    ],
    verdict="the report: the force oscillates after impact in Newmark's schemes",
)


@case(**DROP, law="points")
def dropped_bar(_):
    found = moving.dropped(raymortar.dynamics.Newmark(), "nearest")
    force = found.force / found.scene.area
    # Between arrival and the return of the wave
    pressed = force[(found.time > 0.6) & (found.time < 1.1)]
    values = [
        pressed.mean(),
        pressed.std(),
        found.impulse[-1] / found.scene.area,
        found.energy[-1] / found.energy[0],
    ]
    return Outcome(values, [step.iterations for step in found.done])


BARS = dict(
    code="Papers",
    source="Carpenter, Taylor and Katona (1991), two bars",
    scene="two equal bars meet, Courant number 1, trapezoidal rule",
    figures=[
        Figure("contact stress over rho c v", 1.0, 1e-3),
        Figure("impulse over 2 rho v L", 1.0, 0.02),
        Figure("energy at the end", 1.0, 2e-3),
    ],
)


@case(**BARS, law="points")
def bars_that_meet(_):
    found = moving.two_bars(raymortar.dynamics.Newmark(), "nearest")
    pressed = found.stress[(found.time > 0.2) & (found.time < 1.8)]
    values = [pressed.mean(), found.impulse[-1], found.energy[-1]]
    return Outcome(values, [step.iterations for step in found.done])

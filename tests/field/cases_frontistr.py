"""FrontISTR: contact in its folder `tests/analysis` (FrontISTR/FrontISTR).

Its hexahedra have a mean dilatation (F-bar); ours are integrated fully, or of degree 2.
"""

from __future__ import annotations

import ufl
from dolfinx import fem
from field_scenes import (
    at,
    displacement,
    follow,
    law_of,
    loaded,
    mean_dilatation,
    part,
    scene_of,
    touching,
)
from problems import build, fix
from registry import Figure, Outcome, case

import raymortar
from raymortar import dynamics

MODULUS = 1000.0


def two_boxes():
    """A box of eight hexahedra on one hexahedron, a quarter of each."""
    return scene_of(
        "hexahedron",
        lower=part(
            (1, 1, 1),
            (0, 0, 0),
            (1, 1, 1),
            {"bottom": "bottom", "top": "master", "left": "left", "front": "front"},
        ),
        upper=part(
            (2, 2, 2),
            (0, 0, 1),
            (0.9, 0.9, 2),
            {"bottom": "slave", "top": "top", "left": "left", "front": "front"},
        ),
    )


def pressed_boxes(law, mu):
    """Reaction and height of the middle of the slave after a displacement of a tenth."""
    scene = two_boxes()
    down = fem.Constant(scene.mesh, 0.0)
    problem = build(
        scene,
        material="svk",
        E=MODULUS,
        method=law_of(law),
        bcs=lambda V, scene: [
            fix(V, scene, "left", 0),
            fix(V, scene, "front", 1),
            fix(V, scene, "bottom", 2),
            fix(V, scene, "top", 2, down),
        ],
        friction=raymortar.Coulomb(mu) if mu else None,
    )

    def apply(factor):
        down.value = -0.1 * factor

    iterations = follow(problem, apply)
    middle = at(problem.u, (0, 0, 1), scene, "upper")
    return Outcome([problem.contact.resultant(0).force[2], middle[2]], iterations)


STICKS = dict(
    code="FrontISTR",
    source="tests/analysis/interaction/contact_slag_iter/2box_hex_fric_iter",
    scene="a box on a wider one, pressed by a tenth in one step, mu 0.3",
    figures=[
        Figure("reaction", 41.17928, 0.003),
        Figure("height of the middle", -0.0523078, 0.05),
    ],
    verdict="its elements have a mean dilatation",
)
SLIPS = STICKS | dict(
    source="tests/analysis/interaction/contact_slag_iter/2box_hex_nofric_iter",
    scene="the same without friction",
    figures=[
        Figure("reaction", 41.04929, 0.003),
        Figure("height of the middle", -0.0537236, 0.05),
    ],
)


@case(**STICKS, law="points")
@case(**STICKS, law="dual")
def box_that_sticks(law):
    return pressed_boxes(law, 0.3)


@case(**SLIPS, law="points")
@case(**SLIPS, law="dual")
def box_that_slips(law):
    return pressed_boxes(law, 0.0)


DRAGGED = dict(
    code="FrontISTR",
    source="tests/analysis/interaction/contact_slag_fslid_xbnd/fslid_xbnd",
    scene="a block dragged by 4.5 along a plate over five facets, mu 0.3, nine steps",
    figures=[
        Figure("normal force", 35.06609, 0.015),
        Figure("drag over it", 0.288701, 0.02),
    ],
    verdict="its elements have a mean dilatation, ours are of degree 2",
)


@case(**DRAGGED, law="points")
@case(**DRAGGED, law="dual")
def dragged_block(law):
    scene = scene_of(
        "hexahedron",
        lower=part((8, 1, 1), (0, 0, 0), (8, 1, 1), {"bottom": "bottom", "top": "master"}),
        upper=part((2, 1, 2), (1.37, 0, 1), (3.37, 1, 3), {"bottom": "slave", "top": "top"}),
    )  # fmt: skip
    along, down = (fem.Constant(scene.mesh, 0.0) for _ in range(2))
    problem = build(
        scene,
        2,
        material="svk",
        E=MODULUS,
        method=law_of(law),
        bcs=lambda V, scene: [
            fix(V, scene, "bottom"),
            fix(V, scene, "top", 0, along),
            fix(V, scene, "top", 1),
            fix(V, scene, "top", 2, down),
        ],
        friction=raymortar.Coulomb(0.3),
    )

    def apply(factor):
        along.value, down.value = 4.5 * factor, -0.05 * factor

    iterations = follow(problem, apply, 9)
    force = problem.contact.resultant(0).force
    return Outcome([force[2], -force[0] / force[2]], iterations)


BEAMS = dict(
    code="FrontISTR",
    source="tests/analysis/interaction/contact_slag_iter/2beam_fslid_iter",
    scene="a cantilever slides over the end of another by 3, approach 0.5, mu 0.2",
    figures=[
        Figure("tip of the lower beam", -0.2423, 0.13),
        Figure("bend of the upper beam", 0.2577, 0.13),
    ],
    verdict="node to face does not see the corner of the master: the half turn that takes "
    "one beam to the other gives about 0.27 of each",
)


@case(**BEAMS, law="points")
@case(**BEAMS, law="dual")
def beams_that_slide(law):
    scene = scene_of(
        "hexahedron",
        lower=part((5, 1, 1), (0, 0, 0), (5, 1, 1), {"left": "wall", "back": "master"}),
        upper=part(
            (5, 1, 1), (1.5, 1, 0.01), (6.5, 2, 0.99), {"right": "moved", "front": "slave"}
        ),
    )  # fmt: skip
    along, down = (fem.Constant(scene.mesh, 0.0) for _ in range(2))
    problem = build(
        scene,
        2,
        material="svk",
        E=MODULUS,
        method=law_of(law),
        bcs=lambda V, scene: [
            fix(V, scene, "wall"),
            fix(V, scene, "moved", 0, along),
            fix(V, scene, "moved", 1, down),
            fix(V, scene, "moved", 2),
        ],
        friction=raymortar.Coulomb(0.2),
    )

    def apply(factor):
        along.value, down.value = 3.0 * factor, -0.5 * factor

    iterations = follow(problem, apply, 5)
    lower = at(problem.u, (5, 1, 1), scene, "lower")[1]
    upper = at(problem.u, (1.5, 1, 0.99), scene, "upper")[1] + 0.5
    return Outcome([lower, upper], iterations)


MOVED = dict(
    code="FrontISTR",
    source="tests/analysis/dynamic/implicit_contact/2box_hex_press",
    scene="the boxes under a pressure that grows in 0.5 s, Rayleigh damping, five steps",
    figures=[
        Figure("contact force", 1.60863, 0.002),
        Figure("height of the top", -2.62678e-3, 0.1),
    ],
    verdict="its mass is lumped",
)


@case(**MOVED, law="points")
@case(**MOVED, law="dual")
def boxes_in_motion(law):
    scene = two_boxes()
    u = displacement(scene)
    V = u.function_space
    work, load = loaded(scene, u, "top")
    v, a = ufl.TestFunction(V), ufl.TrialFunction(V)
    stiff, stiff_of = mean_dilatation(scene, u, MODULUS, 0.3)
    mass = ufl.inner(a, v) * ufl.dx
    bcs = [fix(V, scene, "bottom"), *(fix(V, scene, "top", k) for k in (0, 1))]
    contact, problem = touching(scene, u, stiff - work, law_of(law), bcs, J=stiff_of)
    inertia = dynamics.Inertia(
        mass, contact, "consistent", damping=20 * mass + 0.1 * stiff_of
    )

    def apply(time):
        load.value[2] = -min(4.0 * time, 2.0)

    steps = dynamics.TimeSteps(
        problem.snes_solver, inertia, apply, end=1.0, dt=0.2, scheme=dynamics.Newmark()
    )
    iterations = [taken.iterations for taken in steps]
    top = at(u, (0.9, 0.9, 2))[2]
    return Outcome([contact.resultant(0).force[2], top], iterations)

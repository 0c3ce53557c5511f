"""MFEM, Tribol and Smith (once Serac): patch tests; 4C: a tie in a plate with a hole."""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem
from field_scenes import at, displacement, follow, law_of, part, scene_of
from problems import build, fix, symmetry
from registry import Figure, Outcome, case

import raymortar


def cubes(overlap, law, push, material, moduli):
    """Two cubes, of which the upper one goes down by `push` and may overlap at first."""
    low = 1.0 - overlap
    scene = scene_of(
        "hexahedron",
        lower=part(
            (4, 4, 4),
            (0, 0, 0),
            (1, 1, 1),
            {"bottom": "bottom", "top": "master", "left": "left", "front": "front"},
        ),
        upper=part(
            (4, 4, 4),
            (0, 0, low),
            (1, 1, low + 1),
            {"bottom": "slave", "top": "top", "left": "left", "front": "front"},
        ),
    )
    down = fem.Constant(scene.mesh, 0.0)
    mu, lmbda = moduli
    problem = build(
        scene,
        material=material,
        E=mu * (3 * lmbda + 2 * mu) / (lmbda + mu),
        nu=lmbda / 2 / (lmbda + mu),
        method=law_of(law),
        bcs=lambda V, scene: [
            *symmetry(V, scene),
            fix(V, scene, "bottom", 2),
            fix(V, scene, "top", 2, down),
        ],
    )

    def apply(factor):
        down.value = -push * factor

    iterations = follow(problem, apply)
    return problem, iterations


OVERLAP = dict(
    code="MFEM",
    source="miniapps/tribol/contact-patch-test.cpp",
    scene="two cubes of 4 x 4 x 4 that overlap by 0.01, Lame's moduli 50",
    figures=[
        Figure("height of the contact", -0.005, 1e-9),
        Figure("bulge", 0.00125, 1e-9),
        Figure("pressure", 0.625, 1e-9),
    ],
)


@case(**OVERLAP, law="points")
@case(**OVERLAP, law="dual")
def overlapping_patch(law):
    problem, iterations = cubes(0.01, law, 0.0, "linear", (50.0, 50.0))
    corner = at(problem.u, (1, 1, 1), problem.scene, "lower")
    pressure = problem.contact.resultant(0).force[2]
    return Outcome([corner[2], corner[0], pressure], iterations)


TOUCHING = dict(
    code="Smith",
    source="src/serac/physics/tests/contact_patch.cpp (LLNL/serac)",
    scene="two nearly incompressible neo-Hookean cubes, top down by 0.01",
    figures=[
        Figure("height of the contact", -0.005, 0.002),
        Figure("bulge", 0.0025 * 29.5 / 30.25, 0.01),
    ],
    verdict="the reference is of small strains",
)


@case(**TOUCHING, law="points")
@case(**TOUCHING, law="dual")
def nearly_incompressible_patch(law):
    shear, bulk = 0.25, 10.0
    moduli = shear, bulk - 2 * shear / 3
    problem, iterations = cubes(0.0, law, 0.01, "neo-hookean", moduli)
    corner = at(problem.u, (1, 1, 1), problem.scene, "lower")
    return Outcome([corner[2], corner[0]], iterations)


HOLE, SIDE, YOUNG, POISSON = 2.0, 10.0, 100.0, 0.3


def kirsch(x):
    """Plane stresses about a round hole under tension along x, in UFL."""
    r2 = x[0] ** 2 + x[1] ** 2
    a2 = HOLE**2 / r2
    cos2, sin2 = (x[0] ** 2 - x[1] ** 2) / r2, 2 * x[0] * x[1] / r2
    cos4, sin4 = cos2**2 - sin2**2, 2 * sin2 * cos2
    xx = 1 - a2 * (1.5 * cos2 + cos4) + 1.5 * a2**2 * cos4
    yy = -a2 * (0.5 * cos2 - cos4) - 1.5 * a2**2 * cos4
    xy = -a2 * (0.5 * sin2 + sin4) + 1.5 * a2**2 * sin4
    return ufl.as_matrix([[xx, xy], [xy, yy]])


def sector(first):
    """From the unit square, along the arc and outwards, to an eighth of the plate."""

    def mapping(x):
        share, out = x[:, :1], x[:, 1:]
        if first:
            angle, outer = np.pi / 4 * share, np.hstack(
                [SIDE + 0 * share, SIDE * share]
            )
        else:
            angle = np.pi / 4 * (1 + share)
            outer = np.hstack([SIDE * (1 - share), SIDE + 0 * share])
        inner = HOLE * np.hstack([np.cos(angle), np.sin(angle)])
        return (1 - out) * inner + out * outer

    # The square is to keep its orientation
    return lambda x: mapping(np.column_stack([1 - x[:, 0], x[:, 1]]))


@case(
    "4C",
    "tests/input_files/meshtying2D_inf_plate.dat",
    "a plate with a hole tied along its diagonal, 2 x 4 and 3 x 6 curved cells",
    [
        Figure("u_x at the corner, mean of both", 0.10288295, 2e-5),
        Figure("u_y", -0.03030109, 1e-4),
        Figure("u_x of the exact solution", 0.10272600, 2e-3),
    ],
    law="tie",
)
def plate_with_a_hole(_):
    scene = scene_of(
        "quadrilateral",
        geometry_degree=2,
        below=part(
            (2, 4),
            (0, 0),
            (1, 1),
            {"left": "slave", "right": "level", "top": "right"},
            mapping=sector(True),
        ),
        above=part(
            (3, 6),
            (0, 0),
            (1, 1),
            {"left": "upright", "right": "master", "top": "over"},
            mapping=sector(False),
        ),
    )
    u = displacement(scene, 2)
    V, v = u.function_space, ufl.TestFunction(u.function_space)
    mu = YOUNG / 2 / (1 + POISSON)
    # Of plane stress
    lmbda = YOUNG * POISSON / (1 - POISSON**2)
    strain = ufl.sym(ufl.grad(u))
    stress = 2 * mu * strain + lmbda * ufl.tr(strain) * ufl.Identity(2)
    ds = ufl.Measure(
        "ds",
        domain=scene.mesh,
        subdomain_data=scene.facet_tags,
        metadata={"quadrature_degree": 8},
    )
    outside = ds(scene.tags["right"]) + ds(scene.tags["over"])
    traction = kirsch(ufl.SpatialCoordinate(scene.mesh)) * ufl.FacetNormal(scene.mesh)
    F = (
        ufl.inner(stress, ufl.grad(v)) * ufl.dx(degree=6)
        - ufl.inner(traction, v) * outside
    )
    tie = raymortar.Tie(u, scene.facet_tags, [("slave", "master")], names=scene.tags)
    bcs = [fix(V, scene, "level", 1), fix(V, scene, "upright", 0)]
    problem = raymortar.NonlinearProblem(F, tie, bcs)
    iterations = follow(problem, lambda factor: None)
    corner = np.mean(
        [at(u, (SIDE, SIDE), scene, body) for body in scene.bodies], axis=0
    )
    return Outcome([corner[0], corner[1], corner[0]], iterations)

"""MOOSE: tests of contact and of heat through it (idaholab/moose), by their gold files."""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem
from field_scenes import (
    at,
    displacement,
    follow,
    law_of,
    mean_dilatation,
    part,
    scene_of,
    touching,
)
from fluxes import conduction, field_space, prescribe
from materials import MATERIALS, lame
from problems import cellwise, fix
from registry import Figure, Outcome, case
from revolution import gradient

import raymortar


@case(
    "MOOSE",
    "modules/heat_conduction/test/tests/gap_heat_transfer_mortar/closed_gap_prescribed_pressure",
    "steel beside aluminium, conductance proportional to a given pressure",
    [
        Figure("temperature of the steel", 349.87541194439, 1e-12),
        Figure("of the aluminium", 284.72389679287, 1e-12),
        Figure("flux", 7292.0183265015, 1e-12),
    ],
    law="points",
)
def closed_gap(law):
    scene = scene_of(
        "quadrilateral",
        steel=part((4, 3), (0, 0), (1, 0.5), {"left": "hot", "right": "master"}),
        aluminium=part((4, 2), (1, 0), (2, 0.5), {"left": "slave", "right": "cold"}),
    )
    conductivity, hardness = {"steel": 16.2, "aluminium": 210.0}, (129.0, 15.0)

    def harmonic(a, b):
        return 2 * a * b / (a + b)

    conductance = harmonic(*conductivity.values()) * 100.0 / harmonic(*hardness)
    T = fem.Function(field_space(scene.mesh, 1))
    contact = raymortar.Contact(
        displacement(scene),
        scene.facet_tags,
        [("slave", "master")],
        law_of(law),
        names=scene.tags,
    )
    flux = raymortar.fluxes.Flux(
        contact, T, lambda T_s, T_m, *_: conductance * (T_s - T_m)
    )
    ends = [
        prescribe(T.function_space, scene, name, value)
        for name, value in (("hot", 800.0), ("cold", 250.0))
    ]
    problem = raymortar.fluxes.FieldProblem(
        conduction(scene, T, conductivity), T, flux, ends
    )
    problem.solve()
    steel, aluminium = (at(T, (1, 0), scene, body) for body in conductivity)
    rate = 16.2 * (800.0 - steel)
    return Outcome([steel, aluminium, rate], [problem.iterations])


@case(
    "MOOSE",
    "modules/heat_transfer/test/tests/gap_heat_transfer_mortar/large_gap_heat_transfer_test_rz_cylinder_mortar",
    "a core within a vessel, conduction and radiation over a gap of a tenth of the radius",
    [
        Figure("temperature of the vessel", 4595.5948606845, 1e-10),
        Figure("of the core", 4598.9463932894, 2e-9),
        Figure("rate over the gap", 628318.5307179586, 1e-10),
    ],
    law="points",
)
def cylindrical_gap(law):
    core, inner, outer = 2.0, 2.2, 2.7
    scene = scene_of(
        "quadrilateral",
        core=part((400, 2), (0, 0), (core, 1), {"right": "master"}),
        vessel=part(
            (100, 3), (inner, 0), (outer, 1), {"left": "slave", "right": "air"}
        ),
    )
    T = fem.Function(field_space(scene.mesh, 1))
    T.x.array[:] = 500.0
    s, turn = (
        ufl.TestFunction(T.function_space),
        2 * ufl.pi * ufl.SpatialCoordinate(scene.mesh)[0],
    )
    source = cellwise(scene, {"core": 50e3, "vessel": 0.0})
    ds = ufl.Measure("ds", domain=scene.mesh, subdomain_data=scene.facet_tags)
    F = conduction(scene, T, 34.6, source, turn)
    F += 10.0 * (T - 300.0) * s * turn * ds(scene.tags["air"])

    def law_of_gap(T_s, T_m, p, g, v, x):
        r_s, r_m = x[0], x[0] - g
        conducted = 0.1 / (r_s * np.log(r_s / r_m)) * (T_s - T_m)
        emissivity = r_m / r_s / (1 / 0.8 + r_m / r_s * (1 / 0.8 - 1))
        return conducted + 5.670367e-8 * emissivity * (T_s**4 - T_m**4)

    contact = raymortar.Contact(
        displacement(scene),
        scene.facet_tags,
        [("slave", "master")],
        law_of(law),
        names=scene.tags,
        axisymmetric=True,
        search=raymortar.Search(reach=0.5),
    )
    flux = raymortar.fluxes.Flux(contact, T, law_of_gap)
    problem = raymortar.fluxes.FieldProblem(F, T, flux, [])
    problem.solve()
    ends = [at(T, (inner, 0)), at(T, (core, 0))]
    return Outcome([*ends, abs(flux.rates().through)], [problem.iterations])


@case(
    "MOOSE",
    "modules/contact/test/tests/3d-mortar-contact/frictional-mortar-3d",
    "3 x 3 x 3 hexahedra of mean dilatation on a thin plate, mu 0.4, one step",
    [
        # Of friction, which is at its bound there
        Figure("pressure on an edge", 7.5066, 0.001),
        Figure("inside", 0.0, 1e-9, scale=7.5066),
        Figure("friction at a corner, along a side", 4.8750, 0.005),
        Figure("friction on an edge, along it", 0.85521, 0.01),
        Figure("across it", 2.87824, 0.005),
    ],
    law="dual",
)
def block_on_plate(law):
    sides = dict.fromkeys(("left", "right", "front", "back"), "rim")
    half, top = 0.25, 0.25 * np.sin(2 * np.pi / 40 * 0.025)
    scene = scene_of(
        "hexahedron",
        lower=part((10, 10, 2), (-0.5, -0.5, -0.3), (0.5, 0.5, -half), sides | {"top": "master"}),
        upper=part((3, 3, 3), (-half,) * 3, (half,) * 3, {"bottom": "slave", "top": "top"}),
    )  # fmt: skip
    u, down = displacement(scene), fem.Constant(scene.mesh, 0.0)
    V = u.function_space
    F, J = mean_dilatation(scene, u, {"lower": 1e5, "upper": 1e4}, 0.0)
    bcs = [
        fix(V, scene, "rim"),
        fix(V, scene, "top", 0),
        fix(V, scene, "top", 1),
        fix(V, scene, "top", 2, down),
    ]
    contact, problem = touching(
        scene, u, F, law_of(law, degree=1), bcs, J=J, friction=raymortar.Coulomb(0.4)
    )

    def apply(factor):
        down.value = -top * factor

    iterations = follow(problem, apply)
    traction, edge = contact.traction(), half / 3
    corner, on_edge, inside = (
        at(traction, (*place, -half), scene, "upper")
        for place in ((half, half), (half, edge), (edge, edge))
    )
    return Outcome(
        [
            on_edge[2],
            inside[2],
            abs(corner[0]),
            abs(on_edge[1]),
            abs(on_edge[0]),
        ],
        iterations,
    )


AREA = dict(
    code="MOOSE",
    source="modules/contact/test/tests/mortar_contact_area/2drz",
    scene="a ring slides down a cylinder that swells and shrinks, 15 steps",
    figures=[
        Figure("least area in steps 3 to 13", 3.0661944299036, 1e-12),
        Figure("largest", 3.0661944299036, 1e-12),
        Figure("largest in the others", 0.0, 1e-12, scale=3.0),
    ],
)


@case(**AREA, law="points")
@case(**AREA, law="dual")
def swelling_cylinder(law):
    scene = scene_of(
        "quadrilateral",
        plank=part(
            (2, 67), (0, -10), (0.6, 10), {"left": "axis", "bottom": "bottom", "right": "master"}
        ),
        ring=part((3, 4), (0.61, 9.2), (1.21, 10), {"left": "slave", "right": "grip"}),
    )  # fmt: skip
    u = displacement(scene)
    V = u.function_space
    swell, down = (fem.Constant(scene.mesh, 0.0) for _ in range(2))
    swells = cellwise(scene, {"plank": 1.0, "ring": 0.0})
    v, r = ufl.TestFunction(V), ufl.SpatialCoordinate(scene.mesh)[0]
    identity, grown = ufl.Identity(3), 1 + swells * swell
    growth = ufl.as_matrix([[grown, 0, 0], [0, 1, 0], [0, 0, 1]])
    elastic = (identity + gradient(u, r)) * ufl.inv(growth) - identity
    P = grown * MATERIALS["neo-hookean"][0](elastic, *lame(1e7, 0.3)) * ufl.inv(growth)
    F = ufl.inner(P, gradient(v, r)) * 2 * ufl.pi * r * ufl.dx(degree=4)
    bcs = [
        fix(V, scene, "axis", 0),
        fix(V, scene, "bottom", 1),
        fix(V, scene, "grip", 0),
        fix(V, scene, "grip", 1, down),
    ]
    contact, problem = touching(scene, u, F, law_of(law), bcs, axisymmetric=True)

    def apply(time):
        down.value, swell.value = -time, 7e-2 * (1 - np.cos(4 * time))

    iterations, areas = [], []
    path = raymortar.LoadSteps(problem.snes_solver, apply, steps=15, path=(0.0, 1.5))
    for step in path:
        points = contact.points(0)
        areas.append(
            points["weight"][points["status"] == raymortar.results.Status.SLIP].sum()
        )
        iterations.append(step.iterations)
    within, others = areas[2:13], areas[:2] + areas[13:]
    return Outcome([min(within), max(within), max(others)], iterations)


# Pressures at eleven nodes from the rear, and frictions to the rear
PRESSURES = np.array(
    [161.49863939186, 109.95784246581, 110.15583833591, 115.338715561, 119.71308270928,
     123.3578328855, 126.72566574513, 131.09249208954, 138.51794407024, 162.85236802642,
     294.51242589152]
)  # fmt: skip
FRICTIONS = np.array(
    [-59.323994134489, -17.720392400334, -12.022978102894, -3.8876032144149,
     3.2460503661366, 9.854281880372, 15.955898786817, 21.528153290068, 27.65187268276,
     27.139878265446, 92.791250617463]
)  # fmt: skip
# Shares of the nodes in the length
SHARES = 0.1 * np.array([0.5, *[1.0] * 9, 0.5])
BOUNCE = dict(
    code="MOOSE",
    source="modules/contact/test/tests/pdass_problems/frictional_bouncing_block",
    scene="a soft block falls on a stiff one and slides, mu 0.4, 28 steps",
)


def bouncing(inside, ends, dragged):
    """Figures of some nodes and of all, by what is allowed."""
    pressed = 0.4 * PRESSURES
    return [
        Figure("pressure at the rear corner", PRESSURES[0], ends),
        Figure("pressure in the middle", PRESSURES[5], inside),
        Figure("pressure at the front corner", PRESSURES[10], ends),
        Figure("friction at the rear corner", FRICTIONS[0], dragged, scale=pressed[0]),
        Figure("friction in the middle", FRICTIONS[5], dragged, scale=pressed[5]),
        Figure(
            "friction at the front corner", FRICTIONS[10], dragged, scale=pressed[10]
        ),
        Figure("largest deviation of 11 pressures", 0.0, ends, scale=1.0),
        Figure("of 11 frictions, over mu p", 0.0, dragged, scale=1.0),
        Figure("force", SHARES @ PRESSURES, 1e-3),
    ]


@case(**BOUNCE, figures=bouncing(1e-3, 2e-3, 5e-3), law="dual")
@case(
    **BOUNCE,
    figures=bouncing(0.01, 0.09, 0.15),
    law="points",
    verdict="nodal values of a law at points zigzag about those of a law at nodes",
)
def bouncing_block(law):
    scene = scene_of(
        "quadrilateral",
        upper=part((10, 10), (-2, 0), (-1, 1), {"bottom": "slave", "top": "top"}),
        lower=part(
            (49, 10), (-2.5, -1), (2.5, 0), {"top": "master", "bottom": "bottom"}
        ),
    )
    u = displacement(scene)
    V, v = u.function_space, ufl.TestFunction(u.function_space)
    E = cellwise(scene, {"upper": 1e3, "lower": 1e6})
    mu, lmbda = lame(E, 0.3)
    # Cauchy's stress is linear in ln V, as what finite strain increments sum up to
    deformation = ufl.Identity(2) + ufl.grad(u)
    B = deformation * deformation.T
    half = ufl.tr(B) / 2
    apart = ufl.sqrt(((B[0, 0] - B[1, 1]) / 2) ** 2 + B[0, 1] ** 2 + 1e-16)
    most, least = ufl.ln(half + apart) / 2, ufl.ln(half - apart) / 2
    mean = (most + least) / 2 * ufl.Identity(2)
    log = mean + (most - least) / 2 / apart * (B - half * ufl.Identity(2))
    stress = 2 * mu * log + lmbda * ufl.tr(log) * ufl.Identity(2)
    P = ufl.det(deformation) * stress * ufl.inv(deformation).T
    F = ufl.inner(P, ufl.grad(v)) * ufl.dx(degree=4)
    u.x.array[2 * fem.locate_dofs_topological(V, 2, scene.cell_tags.find(1)) + 1] = 0.21
    along, down = fem.Constant(scene.mesh, 0.0), fem.Constant(scene.mesh, 0.21)
    bcs = [
        fix(V, scene, "bottom"),
        fix(V, scene, "top", 0, along),
        fix(V, scene, "top", 1, down),
    ]
    contact, problem = touching(
        scene,
        u,
        F,
        law_of(law),
        bcs,
        friction=raymortar.Coulomb(0.4),
        measure="current",
    )

    def apply(time):
        down.value = 0.2 * np.cos(np.pi / 10 * time) + 0.01
        along.value = 0.02 * time

    iterations = follow(problem, apply, 28, path=(0.0, 7.0))
    traction = contact.traction()
    at_nodes = np.array([at(traction, (-2 + 0.1 * k, 0)) for k in range(11)])
    pressure, friction = at_nodes[:, 1], -at_nodes[:, 0]
    worst = np.abs(pressure / PRESSURES - 1).max()
    worst_friction = np.abs((friction - FRICTIONS) / (0.4 * PRESSURES)).max()
    ends = [*pressure[[0, 5, 10]], *friction[[0, 5, 10]]]
    force = contact.resultant(0).force[1]
    return Outcome([*ends, worst, worst_friction, force], iterations)

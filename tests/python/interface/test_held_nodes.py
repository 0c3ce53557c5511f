"""Slave nodes whose displacement is held, up to which the multiplier is damped.

The facets up to them have one multiplier more than displacements. Where the master is
held there too, the tangent would be singular: its least singular value, rows and columns
scaled, was 1e-16 in all the problems of `SINGULAR`.
"""

import gathered
import numpy as np
import pytest
from dolfinx import fem
from materials import MATERIALS, lame
from problems import CELLS_2D, COMM, DIMENSION, build, fix, worst

from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, Coulomb, Penalty, Stick
from raymortar.core import compat
from raymortar.core.discretization.facets import normals, shape_functions

WALL = ["lower_left", "upper_left"]
# Facets along an edge of the master and of the slave
MESHES = {"matching": (3, 3), "nested": (2, 4), "other": (4, 3)}


def blocks(cell, mesh="matching", width=1.0, share=1):
    """Two blocks with a wall at x = 0, `share` times as wide and as finely divided."""
    dim = DIMENSION[cell]
    counts = [(share * n,) + (n,) * (dim - 2) + (2,) for n in MESHES[mesh]]
    size = (share * width,) + (1.0,) * (dim - 1)
    return two_blocks(COMM, dim, cell, *counts, lower_size=size, upper_size=size)


def wall(V, scene, friction, sides=WALL):
    """Rollers with friction, else clamped; the bottom and the top are held as well."""
    component = None if friction is None else 0
    ends = [fix(V, scene, name) for name in ("bottom", "top")]
    return [*ends, *(fix(V, scene, name, component) for name in sides)]


def at_wall(cell, degree, mesh, friction, sides=WALL, **options):
    return build(
        blocks(cell, mesh),
        degree,
        bcs=lambda V, scene: wall(V, scene, friction, sides),
        friction=friction,
        **options,
    )


def tangent(problem):
    """Dense tangent at the start, PETSc's order, on every rank."""
    x, A = problem.problem.start(), problem.problem.create_matrix()
    problem.problem.J(x, A)
    return gathered.dense(A)


def least_singular_value(problem):
    K = tangent(problem)
    scale = 1.0 / np.sqrt(np.abs(K).max(axis=1))
    return np.linalg.svd(scale[:, None] * K * scale, compute_uv=False)[-1]


def damped(contact):
    """Number of damped facets, on all ranks, once something has been assembled."""
    return COMM.allreduce(sum(len(z.cpp.held_facets()) for z in contact.zones))


PLANE = [(cell, degree) for cell in CELLS_2D for degree in (1, 2)]
KINDS = [*PLANE, ("tetrahedron", 1), ("hexahedron", 1)]
SOME = [("triangle", 2), ("hexahedron", 1)]  # on several ranks
SINGULAR = [
    (*kind, mesh, friction)
    for kind in KINDS
    for mesh in ("matching", "nested")
    for friction in (None, Stick())
]


def few(cell, degree, mesh, friction):
    """Of a family, members for several ranks."""
    law = {("triangle", 2): Stick(), ("hexahedron", 1): None}
    return mesh == "nested" and law.get((cell, degree), mesh) == friction


@pytest.mark.mpi(where=few)
@pytest.mark.parametrize("cell, degree, mesh, friction", SINGULAR)
def test_tangent_is_regular_where_both_bodies_are_held(
    cell, degree, mesh, friction, record_property
):
    """At least as regular as where the wall holds the master alone."""
    free = least_singular_value(at_wall(cell, degree, mesh, friction, WALL[:1]))
    problem = at_wall(cell, degree, mesh, friction)
    found = least_singular_value(problem)
    problem.contact.zones[0].cpp.set_modulus(1e30)
    without = least_singular_value(problem)
    record_property("singular values", [found, free, without])
    assert found > 0.99 * free
    assert without < 1e-12


@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_vector_multiplier_without_friction_is_regular_too(angle):
    """Its part along the surface is none of the damping's, wherever the axes point."""
    held = {}
    for sides in (WALL, WALL[:1]):
        scene = two_blocks(COMM, 2, "quadrilateral", 3, 3, rotation=angle)
        held[len(sides)] = build(
            scene,
            bcs=lambda V, s: wall(V, s, None, sides),
            method=AugmentedLagrangian(multiplier="vector"),
        )
    found, free = (least_singular_value(held[n]) for n in (2, 1))
    assert damped(held[2].contact) == 1
    assert found > 0.99 * free


def test_degree_2_in_space_is_regular_as_it_is():
    """The multiplier has degree 1: the nodes amid the edges balance it."""
    problem = at_wall("tetrahedron", 2, "matching", Stick())
    assert least_singular_value(problem) > 1e-3
    assert damped(problem.contact) == 0


# Nothing changes elsewhere


def fix_body(V, scene, name):
    cells = scene.cell_tags.find(scene.bodies[name])
    dofs = fem.locate_dofs_topological(V, scene.mesh.topology.dim, cells)
    return fem.dirichletbc(fem.Function(V), dofs)


def bowed(x):
    """A surface with a horizontal tangent at the symmetry."""
    return 1.0 - 0.1 * x[:, 0] ** 2


UNTOUCHED = {
    "nothing held": dict(bcs=lambda V, s: wall(V, s, None, WALL[:1])),
    "the master is free": dict(bcs=lambda V, s: wall(V, s, None, WALL[1:])),
    "rollers along the surface": dict(bcs=lambda V, s: wall(V, s, Stick())),
    "rollers, vector multiplier": dict(
        bcs=lambda V, s: wall(V, s, Stick()),
        method=AugmentedLagrangian(multiplier="vector"),
    ),
    "rigid slave": dict(bcs=lambda V, s: [fix_body(V, s, "upper")], friction=Stick()),
    "penalty": dict(bcs=lambda V, s: wall(V, s, None), method=Penalty()),
}


@pytest.mark.quick
@pytest.mark.mpi(where=lambda name, interface: interface and "master" in name)
@pytest.mark.parametrize("interface", [None, bowed])
@pytest.mark.parametrize("name", UNTOUCHED)
def test_is_left_alone(name, interface):
    scene = two_blocks(COMM, 2, "quadrilateral", (4, 2), (4, 2), interface=interface)
    problem = build(scene, **UNTOUCHED[name])
    tangent(problem)
    assert damped(problem.contact) == 0


# What is added


def roughness(contact, modulus):
    """h / E times the integral of what projection takes off the multiplier, squared, on
    the facets at the wall: (5.5) with both factors lambda, by quadrature."""
    zone, total = contact.zones[0], 0.0
    surface, degree = (
        zone.facets.slave_surface,
        compat.element_info(contact.multiplier.function_space).degree,
    )
    points, weights = compat.quadrature(surface.shape, 8)
    N, dN = shape_functions(surface.shape, surface.node_degree, points)
    M, _ = shape_functions(surface.shape, degree, points)
    lower = np.column_stack([points**k for k in range(degree)])
    lower = lower[:, np.unique(lower, axis=1, return_index=True)[1]]
    lam = contact.multiplier.x.array.reshape(-1, surface.gdim)[zone.multiplier_table]
    for nodes, values in zip(surface.X[surface.facet_nodes], lam):
        if nodes[:, 0].min() > 1e-9:
            continue
        area = np.linalg.norm(
            normals(np.einsum("iqa,ad->iqd", dN, nodes)[:, None]), axis=-1
        )
        w = np.sqrt(area[0] * weights)[:, None]
        rough = w * (M @ values)
        rough -= w * lower @ np.linalg.lstsq(w * lower, rough, rcond=None)[0]
        total += (
            (w**2).sum() ** (1.0 / (surface.gdim - 1)) / modulus * (rough**2).sum()
        )
    return COMM.allreduce(total)


@pytest.mark.quick
@pytest.mark.mpi(where=lambda cell, degree: (cell, degree) in SOME)
@pytest.mark.parametrize("cell, degree", KINDS)
def test_damping_does_the_work_of_the_formula_once(cell, degree):
    """On a rigid master, where all weights are 1, and whatever gamma is."""
    scene = blocks(cell, "other")
    problem = build(
        scene,
        degree,
        bcs=lambda V, s: [*wall(V, s, None, WALL[1:]), fix_body(V, s, "lower")],
        friction=Stick(),
        method=AugmentedLagrangian(1.0),
    )
    rigid = build(scene, degree, bcs=lambda V, s: [fix_body(V, s, "lower")])
    contact = problem.contact
    contact.multiplier.interpolate(
        lambda x: np.sin(9.0 * x[: problem.dim] ** 2 + 7.0 * x[0])
    )
    x, b = problem.problem.start(), problem.problem.create_vector()
    work = []
    # The slave has three facets along an edge; triangles are half as large
    size = (1.0 / 3.0) / (2.0 ** (cell == "tetrahedron")) ** 0.5
    modulus = rigid.contact.gamma * size
    for _ in range(2):
        problem.problem.F(x, b)
        for zone in contact.zones:
            zone.cpp.set_modulus(1e30)
        work.append(x.dot(b))
    assert damped(contact) > 0
    expected = roughness(contact, modulus)
    assert work[1] - work[0] == pytest.approx(expected, rel=1e-9)


@pytest.mark.quick
@pytest.mark.mpi
def test_tangent_is_the_derivative_of_the_residual():
    """Pressed and sheared, some points slip; to rounding in the multiplier, in which
    the damping is linear."""
    problem = at_wall("quadrilateral", 1, "nested", Coulomb(0.3)).problem
    x, A, b = problem.start(), problem.create_matrix(), problem.create_vector()
    contact = problem.contact
    draws = np.random.default_rng(1).normal(size=(2, x.getSize()))
    n = gathered.size_u(contact)
    draws[:, :n] *= 1e-3
    free = gathered.concatenated(
        ~contact.system.constrained(problem.bcs)[: contact.layout.n_u]
    )
    free = np.concatenate([free, np.ones(draws.shape[1] - n, dtype=bool)])
    draws[:, ~free] = 0.0  # else lifted: no part of the tangent
    draws[0, n + 1 :: 2] = -np.abs(draws[0, n + 1 :: 2]) - 1.0
    gathered.set_vector(contact, x, draws[0])
    problem.J(x, A)
    assert damped(contact) == 1
    y, direction = x.copy(), x.copy()
    gathered.set_vector(contact, direction, draws[1])
    expected, ends = A * direction, []
    for step in (1e-6, -1e-6):
        x.copy(y)
        y.axpy(step, direction)
        problem.F(y, b)
        ends.append(gathered.vector(contact, b))
    found = (ends[0] - ends[1]) / 2e-6
    expected = gathered.vector(contact, expected)
    difference = np.abs(found - expected)[free].max()
    assert difference < 1e-6 * np.abs(expected[free]).max()


def residuals(places, order):
    """Residuals at states that are drawn from functions of the place, assembled one
    after another in an order; as they are listed."""
    problem = at_wall("quadrilateral", 1, "nested", Stick())
    contact, b = problem.contact, problem.problem.create_vector()
    found = {}
    for k in order:
        problem.u.interpolate(
            lambda x: 0.05 * np.sin((k + 1) * (3.0 * x[:2] + 5.0 * x[1::-1]))
        )
        contact.multiplier.interpolate(lambda x: np.cos(7.0 * x[:2] + places[k]))
        problem.problem.F(problem.problem.start(), b)
        found[k] = gathered.vector(contact, b)
    assert damped(contact) > 0
    return [found[k] for k in sorted(found)]


@pytest.mark.quick
@pytest.mark.mpi
def test_residual_does_not_depend_on_what_was_assembled_before():
    """What lies opposite differs between the states: the weights are those of the step's
    start, not of the state that happens to come first."""
    places = [0.3, 1.1, 2.0]
    expected = residuals(places, [0, 1, 2])
    for order in ([2, 0, 1], [1, 2, 0]):
        for found, value in zip(residuals(places, order), expected):
            gathered.assert_same(found, value)


# Solutions

CORNERS = [("tetrahedron", "matching"), ("quadrilateral", "other")]
SHEARED = np.array([[0.01, 0.02, 0.0], [0.0, -0.03, 0.01], [0.0, 0.0, -0.02]])


@pytest.mark.quick
@pytest.mark.mpi(where=lambda cell, mesh, **_: (cell, mesh) in CORNERS)
@pytest.mark.parametrize("mesh", ["matching", "other"])
@pytest.mark.parametrize("cell, degree", KINDS)
def test_uniform_traction_passes_up_to_held_nodes(cell, degree, mesh):
    """Sheared and pressed uniformly, with the whole boundary held as it moves.

    Of tetrahedra the triangles in two corners are then held throughout, and on matching
    meshes so is the master opposite.
    """
    dim = DIMENSION[cell]
    H = SHEARED[:dim, :dim] if dim == 3 else SHEARED[1:, 1:].T
    scene = blocks(cell, mesh)
    sides = [n for n in scene.tags if n not in ("master", "slave")]
    problem = build(
        scene,
        degree,
        bcs=lambda V, s: [fix(V, s, sides, None, lambda x: x @ H.T)],
        friction=Stick(),
    )
    problem.solve(rtol=1e-14)
    assert damped(problem.contact) > 0
    assert worst(problem.gradient() - H) < 1e-10
    stress = MATERIALS["linear"][1](H, *lame(2000.0, 0.3))
    off = worst(problem.slave_multiplier() + stress[:, -1])
    assert off < 1e-10 * np.abs(stress).max()


def along_surface(function, nodes):
    """Places along x and values (n, 2) at nodes of the slave, of all ranks."""
    x = function.function_space.tabulate_dof_coordinates()[nodes, 0]
    x = gathered.concatenated(x)
    values = function.x.array.reshape(-1, 2)[nodes]
    # Nodes between two ranks are on both
    _, order = np.unique(np.round(x, 9), return_index=True)
    return gathered.concatenated(values)[order]


def pressed(degree, n, share):
    """Displacements and tractions on the right half of a stuck soft block, which is
    itself the problem (share 1, rollers at x = 0) or half of it (share 2)."""
    size = (float(share), 1.0)
    counts = [(share * (n - 1), n), (2 * share * n, n)]
    scene = two_blocks(
        COMM, 2, "quadrilateral", *counts, lower_size=size, upper_size=size
    )

    def bcs(V, s):
        top = fix(V, s, "top", None, lambda x: np.array([0.0, -0.02]) + 0.0 * x)
        rollers = [fix(V, s, WALL, 0)] if share == 1 else []
        return [fix(V, s, "bottom"), top, *rollers]

    moduli = {"lower": 2000.0, "upper": 500.0}
    problem = build(scene, degree, E=moduli, bcs=bcs, friction=Stick())
    problem.solve()
    zone, contact = problem.contact.zones[0], problem.contact
    found = [
        along_surface(problem.u, zone.facets.slave_surface.dofs),
        along_surface(contact.multiplier, zone.multiplier_nodes),
    ]
    return [values[-(2 * degree * n + 1) :] for values in found]


@pytest.mark.mpi(where=lambda degree, **_: degree == 1)
@pytest.mark.parametrize("degree, traction, displacement", [(1, 1.7, 3.5), (2, 4, 8)])
def test_half_a_problem_has_the_solution_of_the_whole(
    degree, traction, displacement, record_property
):
    """But for the shear of the last facet: of first order for linear multipliers, of
    second for quadratic ones. Errors with every halving of the size fall that much."""
    errors = []
    for n in (4, 8):
        half, whole = pressed(degree, n, 1), pressed(degree, n, 2)
        errors.append([worst(a - b) for a, b in zip(half, whole)])
        pressure = np.abs(whole[1][:, 1]).max()
        assert errors[-1][1] < 0.02 * pressure
    record_property("errors", errors)
    assert errors[0][0] > displacement * errors[1][0]
    assert errors[0][1] > traction * errors[1][1]


def test_damping_takes_the_modulus_without_bulk(cell_2d):
    """(5.5): of the same size as at a Poisson's ratio of 0.3."""

    def blocks_of(nu):
        scene = two_blocks(COMM, 2, cell_2d, 3, 3)
        bcs = lambda V, scene: wall(V, scene, None)  # noqa: E731
        method = AugmentedLagrangian(1.0)
        return build(scene, E=2.0 * (1.0 + nu), nu=nu, bcs=bcs, method=method)

    one, other = blocks_of(0.3), blocks_of(0.4999)
    for problem in (one, other):
        problem.problem.F(problem.problem.start(), problem.problem.create_vector())
    moduli = [problem.contact.assembly.moduli([]) for problem in (one, other)]
    assert moduli[1][0] == pytest.approx(moduli[0][0], rel=1e-4)

"""Heat through contact without friction against closed forms: slabs, gaps, ties, a rod."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from dolfinx import fem
from fluxes import (
    CONDUCTIVITY,
    DEPTH,
    conduction,
    constant,
    elastic,
    field_space,
    heated,
    of_pressure,
    prescribe,
    values_on,
)
from problems import COMM, DIMENSION, cellwise, fix, stack, worst

from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from raymortar import (
    Contact,
    LoadSteps,
    NonlinearProblem,
    Penalty,
    SNESSolver,
    Tie,
    rigid,
    versions,
)
from raymortar.core import compat
from raymortar.fluxes import Flux

HOT = 100.0


def turned(dim, angle):
    Q = np.eye(dim)
    c, s = np.cos(angle), np.sin(angle)
    Q[np.ix_([0, dim - 1], [0, dim - 1])] = [[c, -s], [s, c]]
    return Q


def slab_conditions(depth, Q):
    """Both ends held, without lateral motion, and at given temperatures."""

    def conditions(V, W, scene):
        push = -depth * Q[:, -1]
        return [
            fix(V, scene, "bottom"),
            fix(V, scene, "top", None, lambda x: np.tile(push, (len(x), 1))),
            prescribe(W, scene, "top", HOT),
            prescribe(W, scene, "bottom", 0.0),
        ]

    return conditions


def slabs(cell, law, depth=DEPTH, angle=0.0, divisions=(3, 4), **options):
    scene = stack(cell, divisions, rotation=turned(DIMENSION[cell], angle))
    Q = turned(DIMENSION[cell], angle)
    bcs = slab_conditions(depth, Q)
    return heated(scene, law, bcs, conductivity=CONDUCTIVITY, **options)


def check_slabs(case, conductance, tolerance=1e-12):
    """The temperature is linear in both slabs."""
    q = HOT / (1.0 + 0.25 + 1.0 / conductance)
    errors = [
        values_on(case.T, case.scene, "slave") - (HOT - q),
        values_on(case.T, case.scene, "master") - q / 4.0,
    ]
    error = max(worst(one) for one in errors) / HOT
    assert error <= tolerance, error
    rate = case.flux.rates().through
    assert abs(rate / q - 1.0) <= tolerance, rate / q - 1.0
    return error


@pytest.mark.mpi
@pytest.mark.parametrize("angle", [0.0, 0.3])
@pytest.mark.parametrize("law, conductance", [(constant, 2.0), (of_pressure, 3.0)])
def test_two_slabs(cell, law, conductance, angle, record_property):
    """57.142857, 42.857143 and 14.285714 with the constant conductance."""
    case = slabs(cell, law, angle=angle)
    case.problem.solve()
    record_property("error", check_slabs(case, conductance))


@pytest.mark.mpi
@pytest.mark.parametrize(
    "degree, field_degree, method",
    [(1, 2, None), (2, 1, None), (2, 2, None), (1, 1, Penalty(1e3))],
)
def test_degrees_and_penalty(degree, field_degree, method):
    case = slabs(
        "triangle", constant, degree=degree, field_degree=field_degree, method=method
    )
    case.problem.solve()
    check_slabs(case, 2.0)


def test_newton_converges_quadratically():
    """Conductance by pressure, from a cold and free start: few iterations."""
    case = slabs("quadrilateral", of_pressure)
    solver = SNESSolver(case.problem)
    iterations, _ = solver.solve()
    check_slabs(case, 3.0)
    assert iterations <= 5
    history = case.problem.history
    assert history[-1] <= 1e-9 * history[0]


@pytest.mark.mpi
def test_open_gap(cell_2d):
    """Conduction over a gap of 0.02, and radiation."""

    def law(T_s, T_m, p, g, v):
        return 0.02 / (0.01 + g) * (T_s - T_m) + 1e-8 * (T_s**4 - T_m**4)

    case = slabs(cell_2d, law, depth=-0.02)
    case.problem.solve()
    T_s = values_on(case.T, case.scene, "slave")
    T_m = values_on(case.T, case.scene, "master")
    q = HOT - T_s[0]
    assert worst(np.ptp(T_s)) <= 1e-10 * HOT
    assert abs(q - 4.0 * T_m[0]) <= 1e-10 * HOT
    expected = 0.02 / 0.03 * (T_s[0] - T_m[0]) + 1e-8 * (T_s[0] ** 4 - T_m[0] ** 4)
    assert abs(q - expected) <= 1e-9 * HOT
    assert q > 1.0


@pytest.mark.mpi
@pytest.mark.parametrize("way", ["mixed", "meshes"])
def test_mixed_functions_and_several_meshes(way):
    scene = stack("triangle", (3, 4))
    if way == "meshes":
        bodies = [one_body(divisions, low) for divisions, low in ((3, 0.0), (4, 1.0))]
        u = [fem.Function(compat.vector_space(m, 1), name="u") for m, _ in bodies]
        T = [fem.Function(field_space(m, 1), name="T") for m, _ in bodies]
        tags = [facets for _, facets in bodies]
        contact = Contact(u, tags, [(21, 12)])
        flux = Flux(contact, T, constant)
        forms = [elastic(f) for f in u] + [
            k
            * ufl.inner(ufl.grad(f), ufl.grad(ufl.TestFunction(f.function_space)))
            * ufl.dx
            for k, f in zip((4.0, 1.0), T)
        ]
        bcs = [
            held(u[0], tags[0], 11, (0.0, 0.0)),
            held(u[1], tags[1], 22, (0.0, -DEPTH)),
            held(T[0], tags[0], 11, 0.0),
            held(T[1], tags[1], 22, HOT),
        ]
        problem = NonlinearProblem(forms, [contact, flux], bcs, u=[*u, *T])
        problem.solve()
        assert abs(flux.rates().through - HOT / 1.75) <= 1e-10
        return
    mesh = scene.mesh
    W = versions.mixed_space(mesh, ("Lagrange", 1, (2,)), ("Lagrange", 1, ()))
    w = fem.Function(W, name="w")
    u, T = w.sub(0), w.sub(1)
    contact = Contact(
        u, scene.facet_tags, [(scene.tags["slave"], scene.tags["master"])]
    )
    flux = Flux(contact, T, constant)
    a, b = ufl.split(w)
    v, s = ufl.TestFunctions(W)
    k = cellwise(scene, CONDUCTIVITY)
    F = (ufl.inner(ufl.sym(ufl.grad(a)), ufl.grad(v)) * ufl.dx) + (
        ufl.inner(k * ufl.grad(b), ufl.grad(s)) * ufl.dx
    )
    fields, ends = ("bottom", "top"), (0.0, HOT)
    bcs = [fix(W.sub(0), scene, "bottom", i) for i in range(2)]
    bcs += [fix(W.sub(0), scene, "top", i, -DEPTH * i) for i in range(2)]
    for name, value in zip(fields, ends):
        facets = scene.facet_tags.find(scene.tags[name])
        dofs = fem.locate_dofs_topological(W.sub(1), 1, facets)
        bcs.append(fem.dirichletbc(fem.Constant(mesh, value), dofs, W.sub(1)))
    problem = NonlinearProblem(F, [contact, flux], bcs)
    problem.solve()
    assert abs(flux.rates().through - HOT / 1.75) <= 1e-10


def one_body(divisions, low):
    """A unit square with its tags, on a mesh of its own."""
    first = 10 if low == 0.0 else 20
    sides = {"bottom": first + 1, "top": first + 2, "left": 3, "right": 4}
    block = Block((divisions, 2), (0.0, low), (1.0, low + 1.0), tags=sides)
    mesh, _, facets = assemble_blocks(COMM, [block], "triangle", 1)
    return mesh, facets


def held(f, tags, tag, value):
    V = f.function_space
    dofs = fem.locate_dofs_topological(V, 1, tags.find(tag))
    constant = fem.Constant(V.mesh, np.array(value, dtype=np.float64))
    return fem.dirichletbc(constant, dofs, V)


@pytest.mark.mpi
def test_solids_of_revolution():
    scene = stack("quadrilateral", (3, 4))
    mesh = scene.mesh
    V, W = compat.vector_space(mesh, 1), field_space(mesh, 1)
    u, T = fem.Function(V, name="u"), fem.Function(W, name="T")
    r = ufl.SpatialCoordinate(mesh)[0]
    v, turn = ufl.TestFunction(V), 2.0 * np.pi * r
    strain = ufl.inner(ufl.sym(ufl.grad(u)), ufl.grad(v)) + u[0] * v[0] / r**2
    pair = (scene.tags["slave"], scene.tags["master"])
    contact = Contact(u, scene.facet_tags, [pair], axisymmetric=True)
    flux = Flux(contact, T, of_pressure)
    forms = [turn * strain * ufl.dx, conduction(scene, T, CONDUCTIVITY, weight=turn)]
    bcs = slab_conditions(DEPTH, np.eye(2))(V, W, scene)
    NonlinearProblem(forms, [contact, flux], bcs, u=[u, T]).solve()
    q = HOT / (1.25 + 1.0 / 3.0)
    assert worst(values_on(T, scene, "slave") - (HOT - q)) <= 1e-10 * HOT
    assert abs(flux.rates().through / (np.pi * q) - 1.0) <= 1e-10


def test_steps_restore_the_temperature():
    case = slabs("triangle", of_pressure)
    steps = list(LoadSteps(SNESSolver(case.problem), lambda t: None, steps=2))
    assert len(steps) == 2
    check_slabs(case, 3.0)


@pytest.mark.mpi
def test_flux_through_a_tie(cell_2d):
    """Glued slabs with the conductance of the glue; the tie has no pressure to tell."""
    scene = stack(cell_2d, (3, 4))
    V, W = compat.vector_space(scene.mesh, 2), field_space(scene.mesh, 2)
    u, T = fem.Function(V, name="u"), fem.Function(W, name="T")
    glue = Tie(u, scene.facet_tags, [(scene.tags["slave"], scene.tags["master"])])
    flux = Flux(glue, T, constant)
    forms = [elastic(u), conduction(scene, T, CONDUCTIVITY)]
    bcs = slab_conditions(DEPTH, np.eye(2))(V, W, scene)
    NonlinearProblem(forms, [glue, flux], bcs, u=[u, T]).solve()
    q = HOT / 1.75
    assert worst(values_on(T, scene, "slave") - (HOT - q)) <= 1e-10 * HOT
    assert worst(values_on(T, scene, "master") - q / 4.0) <= 1e-10 * HOT
    assert abs(flux.rates().through / q - 1.0) <= 1e-10


# Barber's rod: its end nears a hot wall as it warms up, and warms up as it nears it
GAP, EXPANSION = 0.02, 0.08


def over_gap(T_s, T_m, p, g, v):
    return (0.002 / (np.maximum(g, 0.0) + 0.001) + 100.0 * p) * (T_s - T_m)


def end_of_rod(low, high):
    """Temperature of the end by bisection, cold below and hot above."""

    def leaves(T):
        free = 0.5 * EXPANSION * T - GAP
        gap, p = max(-free, 0.0), max(free, 0.0)
        return T + float(over_gap(T, 1.0, p, gap, 0.0))

    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if leaves(middle) < 0.0 else (low, middle)
    return 0.5 * (low + high)


@pytest.mark.mpi
@pytest.mark.parametrize("start, bounds", [(0.0, (0.0, 0.3)), (1.0, (0.5, 1.0))])
def test_both_states_of_barbers_rod(start, bounds):
    """Apart from the wall and cold, or pressed on it and hot, by where it starts."""
    scene = stack("triangle", (3, 2))
    V, W = compat.vector_space(scene.mesh, 2), field_space(scene.mesh, 1)
    u, T = fem.Function(V, name="u"), fem.Function(W, name="T")
    wall = rigid.Line((0.0, -GAP), (0.0, 1.0))
    contact = Contact(u, scene.facet_tags, [(scene.tags["bottom"], wall)])
    flux = Flux(contact, T, over_gap, tool=1.0)
    v, along = ufl.TestFunction(V), ufl.as_matrix([[0.0, 0.0], [0.0, EXPANSION]])
    strain = ufl.sym(ufl.grad(u)) - T * along
    forms = [ufl.inner(strain, ufl.grad(v)) * ufl.dx, conduction(scene, T, 1.0)]
    bcs = [fix(V, scene, name) for name in ("master", "slave", "top")]
    bcs += [prescribe(W, scene, name, 0.0) for name in ("master", "slave")]
    problem = NonlinearProblem(forms, [contact, flux], bcs, u=[u, T])
    T.interpolate(lambda x: start * np.maximum(1.0 - x[1], 0.0))
    u.interpolate(lambda x: np.array([0.0 * x[0], -GAP * start * (1.0 - x[1])]))
    problem.solve()
    expected = end_of_rod(*bounds)
    assert worst(values_on(T, scene, "bottom") - expected) <= 1e-9
    assert (contact.resultant().force[1] > 0.0) == (start == 1.0)

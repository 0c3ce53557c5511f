"""Fields that are continuous across surfaces whose meshes do not match (V6)."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from dolfinx import fem
from field_ties import four_squares, manufactured
from fluxes import conduction, field_space, prescribe, press, values_on
from problems import residual, stack, worst

import raymortar
from raymortar import Contact, ContactError, LoadSteps
from raymortar.core import compat
from raymortar.fluxes import FieldProblem, FieldTie

CONDUCTIVITY = {"0": 4.0, "1": 1.0}
HOT, Q = 100.0, 80.0  # flux of the slabs, 100 / (1 + 1/4)


def check_slabs(case, T, tie, tolerance=1e-12):
    errors = [
        worst(values_on(T, case, "slave") - (HOT - Q)),
        worst(values_on(T, case, "master") - Q / 4.0),
    ]
    assert max(errors) <= tolerance * HOT, errors
    assert abs(tie.rate() / Q - 1.0) <= tolerance
    return max(errors) / HOT


def tied(cell, degree, **options):
    scene = stack(cell, (3, 4), **options)
    W = field_space(scene.mesh, degree)
    T = fem.Function(W, name="T")
    pair = (scene.tags["slave"], scene.tags["master"])
    tie = FieldTie(T, scene.facet_tags, [pair])
    ends = prescribe(W, scene, "top", HOT), prescribe(W, scene, "bottom", 0.0)
    return scene, T, tie, list(ends)


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
def test_two_slabs_alone(cell, degree, record_property):
    """The field is the only unknown beside the multiplier, and one iteration solves."""
    scene, T, tie, ends = tied(cell, degree)
    F = conduction(scene, T, CONDUCTIVITY)
    problem = FieldProblem(F, T, tie, ends)
    problem.solve()
    assert problem.iterations == 1
    record_property("error", check_slabs(scene, T, tie))


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
def test_two_slabs_beside_a_displacement(cell_2d, degree):
    """Pressed bodies, by load steps that keep the multiplier."""
    scene, T, tie, ends = tied(cell_2d, degree)
    V = compat.vector_space(scene.mesh, 1)
    u = fem.Function(V, name="u")
    pair = (scene.tags["slave"], scene.tags["master"])
    contact = Contact(u, scene.facet_tags, [pair])
    forms = [residual(scene, u, E=1.0, nu=0.0)[0], conduction(scene, T, CONDUCTIVITY)]
    bcs = [*press(V, scene, 0.02), *ends]
    problem = raymortar.NonlinearProblem(forms, [contact, tie], bcs, u=[u, T])
    steps = list(LoadSteps(problem.snes_solver, lambda t: None, steps=2))
    assert len(steps) == 2
    check_slabs(scene, T, tie)
    assert abs(contact.resultant().force[-1] - 0.01) <= 1e-9


@pytest.mark.quick
@pytest.mark.mpi
def test_vectors_that_are_no_displacement():
    """Three components in the plane, each a slab of its own."""
    components = 3
    scene = stack("triangle", (3, 4))
    W = compat.space(scene.mesh, "Lagrange", 1, (components,))
    w, s = fem.Function(W, name="w"), ufl.TestFunction(W)
    pair = (scene.tags["slave"], scene.tags["master"])
    tie = FieldTie(w, scene.facet_tags, [pair])
    ends = fem.Function(W)
    slopes = np.arange(1.0, components + 1)
    ends.interpolate(lambda x: slopes[:, None] * (x[1] + 0.5 * x[0]))
    sides = [scene.facet_tags.find(t) for t in scene.tags.values() if t not in pair]
    dofs = fem.locate_dofs_topological(W, 1, np.unique(np.concatenate(sides)))
    F = ufl.inner(ufl.grad(w), ufl.grad(s)) * ufl.dx
    FieldProblem(F, w, tie, [fem.dirichletbc(ends, dofs)]).solve()
    assert worst(w.x.array - ends.x.array) <= 1e-12
    assert worst(tie.rate() + -slopes) <= 1e-12


@pytest.mark.mpi
def test_solids_of_revolution():
    scene = stack("quadrilateral", (3, 4))
    W = field_space(scene.mesh, 1)
    T = fem.Function(W, name="T")
    pair = (scene.tags["slave"], scene.tags["master"])
    tie = FieldTie(T, scene.facet_tags, [pair], axisymmetric=True)
    turn = 2.0 * np.pi * ufl.SpatialCoordinate(scene.mesh)[0]
    ends = [prescribe(W, scene, "top", HOT), prescribe(W, scene, "bottom", 0.0)]
    F = conduction(scene, T, CONDUCTIVITY, weight=turn)
    FieldProblem(F, T, tie, ends).solve()
    assert worst(values_on(T, scene, "slave") - (HOT - Q)) <= 1e-12 * HOT
    assert abs(tie.rate() / (np.pi * Q) - 1.0) <= 1e-12


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("ends", ["slave master", "master slave"])
def test_one_pair_is_tied_once(ends):
    """Its master may be the other's slave; another field may be tied there too."""
    scene, T, tie, bcs = tied("triangle", 1)
    pair = tuple(scene.tags[name] for name in ends.split())
    again = FieldTie(T, scene.facet_tags, [pair])
    F = conduction(scene, T, CONDUCTIVITY)
    text = rf"FieldTies of T tie the pair \({scene.tags['slave']}, "
    with pytest.raises(ContactError, match=text):
        FieldProblem(F, T, [tie, again], bcs)
    S = fem.Function(T.function_space.clone(), name="S")
    both = [tie, FieldTie(S, scene.facet_tags, [pair])]
    forms = [F, conduction(scene, S, CONDUCTIVITY)]
    FieldProblem(forms, [T, S], both, bcs)


@pytest.mark.quick
@pytest.mark.mpi
def test_surfaces_that_meet_in_a_point():
    """Four squares: the last tie leaves out a node that the others hold."""
    mesh, facets = four_squares()
    W = field_space(mesh, 1)
    T, s = fem.Function(W, name="T"), ufl.TestFunction(W)
    pairs = {"right": (14, 23), "up": (12, 31), "far": (34, 43), "last": (22, 41)}
    ties = [FieldTie(T, facets, [pair]) for pair in pairs.values()]
    exact = fem.Function(W)
    exact.interpolate(lambda x: 1.0 + 2.0 * x[0] - 3.0 * x[1])
    outer = [11, 13, 21, 24, 32, 33, 42, 44]
    at = [facets.find(tag) for tag in outer]
    dofs = fem.locate_dofs_topological(W, 1, np.sort(np.concatenate(at)))
    F = ufl.inner(ufl.grad(T), ufl.grad(s)) * ufl.dx
    FieldProblem(F, T, ties, [fem.dirichletbc(exact, dofs)]).solve()
    assert worst(T.x.array - exact.x.array) <= 1e-12
    assert abs(ties[0].rate() + 2.0) <= 1e-12


RATES = [("triangle", 1, 8), ("quadrilateral", 2, 6), ("tetrahedron", 1, 3)]


@pytest.mark.mpi(where=lambda cell, **_: cell == "triangle")
@pytest.mark.parametrize("cell, degree, n", RATES)
def test_rates_across_a_bent_interface(cell, degree, n, record_property):
    """The field has order p + 1, its gradient p, with the coarser slave."""
    coarse, fine = (
        manufactured(cell, (size, size - size // 4 - 1), degree) for size in (n, 2 * n)
    )
    rates = np.log2(coarse / fine)
    record_property("rates", rates.tolist())
    assert (rates >= np.array([degree + 1.0, degree]) - 0.1).all(), rates

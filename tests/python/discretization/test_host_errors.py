"""Hosts that cannot work: what is refused, and by which words."""

from __future__ import annotations

from petsc4py import PETSc

import hosts
import numpy as np
import pytest
import ufl
from dolfinx import fem

import raymortar
from raymortar import ContactError, versions
from raymortar.core import compat
from raymortar.solvers import iterative

# What cannot work


@pytest.fixture(scope="module")
def scene():
    return hosts.blocks(divisions=(2, 2))


def pairs(scene):
    return [(scene.tags["slave"], scene.tags["master"])]


def refused(pattern):
    return pytest.raises(ContactError, match=pattern)


def mixed(scene):
    parts = ("Lagrange", 2, (2,)), ("Lagrange", 1, ())
    return fem.Function(versions.mixed_space(scene.mesh, *parts), name="w")


def contact_of(scene, u):
    return raymortar.Contact(u, scene.facet_tags, pairs(scene))


def energy(w):
    return (ufl.inner(w, w) + ufl.inner(ufl.grad(w), ufl.grad(w))) * ufl.dx


def residual(w):
    return ufl.derivative(energy(w), w)


def test_another_part_is_no_displacement(scene):
    with refused(r"the displacement has values of shape \(\)"):
        contact_of(scene, mixed(scene).sub(1))


def test_a_part_of_a_part_is_refused(scene):
    with refused("not a part of such a part"):
        contact_of(scene, mixed(scene).sub(0).sub(1))


def test_a_form_in_another_mixed_space_is_refused(scene):
    contact = contact_of(scene, mixed(scene).sub(0))
    with refused("F has a test function in another space than the mixed one"):
        raymortar.NonlinearProblem(residual(mixed(scene)), contact)


def test_a_form_in_another_function_of_the_space_is_refused(scene):
    w = mixed(scene)
    other = fem.Function(w.function_space)
    with refused("F does not depend on the mixed Function that w_0 is a part of|sub"):
        raymortar.NonlinearProblem(residual(other), contact_of(scene, w.sub(0)))


def test_conditions_of_a_foreign_space_are_refused(scene):
    w, other = mixed(scene), mixed(scene)
    V = other.function_space.sub(1)
    zero = fem.Constant(scene.mesh, PETSc.ScalarType(0.0))
    bc = fem.dirichletbc(zero, np.array([0], dtype=np.int32), V)
    with refused("boundary condition 0 is not on a space of the unknowns"):
        raymortar.NonlinearProblem(residual(w), contact_of(scene, w.sub(0)), [bc])


def several(scene):
    u = fem.Function(compat.vector_space(scene.mesh, 1), name="u")
    return u, fem.Function(compat.scalar_space(scene.mesh, 1), name="c")


LISTS = {
    "none": (lambda u, c: dict(u=None), "F must be one UFL form, .* not list"),
    "one": (lambda u, c: dict(u=[u]), "2 forms for 1 unknowns"),
    "number": (lambda u, c: dict(u=[u, 3]), "u must be a list of Functions, not of 3"),
    "order": (lambda u, c: dict(u=[c, u]), r"F\[0\] has a test or trial function"),
    "J": (
        lambda u, c: dict(u=[u, c], J=[[None]]),
        "J must be 2 lists of 2 forms, by test and trial space",
    ),
}


@pytest.mark.parametrize("case", LISTS)
def test_lists_that_do_not_fit_are_refused(scene, case):
    u, c = several(scene)
    options, pattern = LISTS[case]
    forms = [residual(u), residual(c)]
    with refused(pattern):
        raymortar.NonlinearProblem(forms, contact_of(scene, u), **options(u, c))


def test_a_displacement_that_is_none_of_the_unknowns_is_refused(scene):
    (u, c), (other, _) = several(scene), several(scene)
    with refused("the displacement u that Contact was given is none of the unknowns"):
        raymortar.NonlinearProblem(
            [residual(u), residual(c)], contact_of(scene, other), u=[u, c]
        )


def test_two_unknowns_on_one_space_are_refused(scene):
    u, c = several(scene)
    d = fem.Function(c.function_space, name="d")
    forms = [residual(f) for f in (u, c, d)]
    with refused("the unknowns c and d are on one space"):
        raymortar.NonlinearProblem(forms, contact_of(scene, u), u=[u, c, d])


def test_a_contact_keeps_its_unknowns(scene):
    u, c = several(scene)
    contact = contact_of(scene, u)
    raymortar.NonlinearProblem(residual(u), contact)
    with refused("contact is of a problem with other unknowns"):
        raymortar.NonlinearProblem([residual(u), residual(c)], contact, u=[u, c])


def test_one_form_takes_one_unknown(scene):
    u, c = several(scene)
    with refused("u must be the one Function that F is a residual of"):
        raymortar.NonlinearProblem(residual(u), contact_of(scene, u), u=[u, c])


def test_iterative_solvers_say_that_they_are_for_displacements(scene):
    w = mixed(scene)
    problem = raymortar.NonlinearProblem(residual(w), contact_of(scene, w.sub(0)))
    with refused("iterative"):
        raymortar.SNESSolver(problem, iterative())


def test_controls_say_that_they_are_for_displacements(scene):
    w = mixed(scene)
    problem = raymortar.NonlinearProblem(residual(w), contact_of(scene, w.sub(0)))
    with refused("control leads paths of one displacement"):
        raymortar.LoadSteps(
            raymortar.SNESSolver(problem),
            lambda t: None,
            control=raymortar.paths.ArcLength(),
        )

"""Fluxes that cannot work are refused by name, on every rank."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from dolfinx import fem
from fluxes import conduction, field_space, prescribe, press
from problems import stack

from raymortar import (
    AugmentedLagrangian,
    Contact,
    ContactError,
    ContactWarning,
    NonlinearProblem,
    rigid,
)
from raymortar.core import compat
from raymortar.fluxes import Flux, ToolField


def law(T_s, T_m, p, g, v):
    return (1.0 + p) * (T_s - T_m)


def slopes(T_s, T_m, p, g, v):
    return 1.0 + p, -1.0 - p, T_s - T_m, 0.0, 0.0


@pytest.fixture(scope="module")
def scene():
    return stack("triangle", (2, 3))


@pytest.fixture
def contact(scene):
    u = fem.Function(compat.vector_space(scene.mesh, 1), name="u")
    return Contact(u, scene.facet_tags, [(scene.tags["slave"], scene.tags["master"])])


@pytest.fixture
def T(scene):
    return fem.Function(field_space(scene.mesh, 1), name="T")


def solved(scene, contact, T, flux):
    """Solve for both fields, the bodies pressed."""
    u = contact.u
    v = ufl.TestFunction(u.function_space)
    forms = [
        ufl.inner(ufl.sym(ufl.grad(u)), ufl.grad(v)) * ufl.dx,
        conduction(scene, T, 1.0),
    ]
    W = T.function_space
    bcs = [*press(u.function_space, scene, 0.02), prescribe(W, scene, "top", 1.0)]
    bcs.append(prescribe(W, scene, "bottom", 0.0))
    problem = NonlinearProblem(forms, [contact, flux], bcs, u=[u, T])
    problem.solve()
    return problem


def test_tractions_of_dual_multipliers_are_refused(scene, T):
    u = fem.Function(compat.vector_space(scene.mesh, 1), name="u")
    method = AugmentedLagrangian(condition="nodes", multiplier="dual")
    pair = scene.tags["slave"], scene.tags["master"]
    contact = Contact(u, scene.facet_tags, [pair], method)
    with pytest.raises(ContactError, match="take multiplier='vector'"):
        Flux(contact, T, law)


FIELDS = {
    "a Function, not float": lambda mesh: 3.0,
    r"has values of shape \(2,\)": lambda mesh: fem.Function(
        compat.vector_space(mesh, 1)
    ),
    "has degree 3": lambda mesh: fem.Function(compat.space(mesh, "Lagrange", 3)),
    "discontinuous": lambda mesh: fem.Function(compat.space(mesh, "DG", 1)),
    "on another mesh": lambda mesh: fem.Function(
        field_space(stack("triangle", (1, 1)).mesh, 1)
    ),
}


@pytest.mark.mpi
@pytest.mark.parametrize("message", FIELDS)
def test_fields(scene, contact, message):
    with pytest.raises(ContactError, match=message):
        Flux(contact, FIELDS[message](scene.mesh), law)


def test_a_flux_without_its_contact_is_named(scene, contact, T):
    flux = Flux(contact, T, law)
    v = ufl.TestFunction(T.function_space)
    with pytest.raises(ContactError, match="contact has a Flux and no Contact"):
        NonlinearProblem(T * v * ufl.dx, flux)


ARGUMENTS = {
    "Flux.law must be a function": dict(law=3.0),
    "Flux.derivatives must be a function": dict(derivatives=[1.0]),
    "has the argument 'pressure'": dict(law=lambda a, b, c, d, e, pressure: a),
    "argument fields, and there are none": dict(law=lambda a, b, c, d, e, fields: a),
    "friction_heat = 2.0": dict(friction_heat=2.0),
    "tool = nan": dict(tool=np.nan),
    "Flux.law is a function of a, b: it must take 5 arguments, T_s, T_m, p, g and v": (
        dict(law=lambda a, b: a - b)
    ),
    "there are no rigid tools": dict(tool=ToolField(0.0, 1.0)),
    "tool = 20.0 is the field .* there are no rigid tools in": dict(tool=20.0),
    "which is no Function": dict(fields=[3.0]),
}


@pytest.mark.mpi
@pytest.mark.parametrize("message", ARGUMENTS)
def test_arguments(contact, T, message):
    options = {"law": law, **ARGUMENTS[message]}
    with pytest.raises(ContactError, match=message):
        Flux(contact, T, **options)


def test_contacts(scene, contact, T):
    with pytest.raises(ContactError, match="must be a Contact, not int"):
        Flux(3, T, law)
    on_tool = Contact(
        contact.u,
        scene.facet_tags,
        [(scene.tags["bottom"], rigid.Line((0.0, 0.0), (0.0, 1.0)))],
    )
    with pytest.raises(ContactError, match="rigid tools: give the field on them"):
        Flux(on_tool, T, law)


LAWS = {
    r"shape \(1,\) for": dict(law=lambda a, b, c, d, e: np.ones(1)),
    "not finite, at T_s": dict(law=lambda a, b, c, d, e: np.full(len(a), np.nan)),
    "returns 2 arrays": dict(derivatives=lambda a, b, c, d, e: (a, b)),
    "dq/dT_s of Flux.derivatives": dict(
        derivatives=lambda *z: (0.9 * slopes(*z)[0], *slopes(*z)[1:])
    ),
    "dq/dp of Flux.derivatives": dict(
        derivatives=lambda *z: (*slopes(*z)[:2], 0.0, 0.0, 0.0)
    ),
    "dq/dT_s of the complex step": dict(law=lambda a, b, c, d, e: np.abs(a) - b),
    "does not take a complex T_s": dict(
        law=lambda a, b, c, d, e: np.heaviside(a, 0.0) - b
    ),
}


@pytest.mark.mpi
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("message", LAWS)
def test_laws(scene, contact, T, message):
    T.x.array[:] = 1.0
    flux = Flux(contact, T, **{"law": law, **LAWS[message]})
    with pytest.raises(ContactError, match=message):
        solved(scene, contact, T, flux)


@pytest.mark.mpi
def test_a_flux_from_cold_to_hot_is_warned_of_once(scene, contact, T):
    flux = Flux(contact, T, lambda T_s, T_m, p, g, v: 0.1 * (1.0 + p) * (T_m - T_s))
    with pytest.warns(ContactWarning, match="from low to high") as told:
        problem = solved(scene, contact, T, flux)
        problem.solve()
    assert sum("from low to high" in str(one.message) for one in told) == 1


@pytest.mark.parametrize(
    "arguments, message",
    [
        ((np.nan, 1.0), "ToolField.value = nan must be a finite number"),
        ((0.0, -1.0), "ToolField.capacity = -1.0 must not be negative"),
    ],
)
def test_tools(arguments, message):
    with pytest.raises(ContactError, match=message):
        ToolField(*arguments)
    with pytest.raises(ContactError, match="is of no Flux yet"):
        ToolField(0.0, 1.0).accept()


@pytest.mark.mpi
def test_right_derivatives_pass(scene, contact, T):
    flux = Flux(contact, T, law, slopes)
    solved(scene, contact, T, flux)
    assert flux.rates().through > 0.0


@pytest.mark.mpi
def test_problems(scene, contact, T):
    flux = Flux(contact, T, law)
    u, v = contact.u, ufl.TestFunction(contact.u.function_space)
    F = ufl.inner(u, v) * ufl.dx
    with pytest.raises(ContactError, match=r"the field T that Flux was given is none"):
        NonlinearProblem(F, [contact, flux])
    with pytest.raises(ContactError, match="in the list twice"):
        NonlinearProblem(F, [contact, flux, flux])
    with pytest.raises(ContactError, match="give at least one Contact"):
        NonlinearProblem(F, [flux])
    elsewhere = Contact(
        u, scene.facet_tags, [(scene.tags["slave"], scene.tags["master"])]
    )
    with pytest.raises(ContactError, match="a contact that the problem does not have"):
        NonlinearProblem(F, [elsewhere, flux])
    with pytest.raises(ContactError, match="is in no problem"):
        Flux(contact, T, law).rates()
    with pytest.raises(ContactError, match="zone = 3"):
        flux.points(3)

"""The tangent of a flux is the derivative of its residual, in all unknowns (V4)."""

from __future__ import annotations

from functools import partial

import pytest
import states
from dolfinx import fem
from fluxes import field_slopes, massive
from friction_states import FrictionCase, check_regime, law_for, set_both
from states import Case, name_of
from tangents import is_first_order, is_second_order

from raymortar import AugmentedLagrangian, Contact, Coulomb, Penalty, rigid
from raymortar.core import compat
from raymortar.fluxes import ToolField


def smooth_cases():
    for cell in states.CELLS:
        for degrees, method, measure, field in (
            ((1, 1), "normal", "reference", 1),
            ((2, 1), "vector", "current", 1),
            ((1, 2), "penalty", "current", 2),
            ((2, 2), "normal", "current", 2),
        ):
            case = Case(cell, *degrees, method, measure)
            quick = [pytest.mark.quick] if degrees == (1, 1) else []
            name = f"{name_of(case)}-T{field}"
            yield pytest.param(case, field, id=name, marks=quick)


@pytest.mark.mpi(where=lambda case, **_: case.dim == 2 and case.degree == 2)
@pytest.mark.parametrize("regime", ["active", "open"])
@pytest.mark.parametrize("case, field", list(smooth_cases()))
def test_flux_without_friction(case, field, regime, record_property):
    scene = case.scene("overhang")

    def make(seed):
        degree = 2 if case.dim == 3 else None
        return states.make_contact(
            scene, case, tangent="full", quadrature_degree=degree
        )

    def prepare(contact, seed):
        states.set_state(contact, scene, regime, seed)
        return states.in_regime(contact, regime)

    found = field_slopes(make, prepare, partial(massive, field_degree=field))
    record_property("slope", found.tolist())
    assert is_second_order(found), found


def friction_cases():
    for cell in states.CELLS:
        for degrees, method, measure, law, regime in (
            ((1, 1), "augmented", "reference", "coulomb", "slip"),
            ((2, 2), "augmented", "current", "coulomb", "stick"),
            ((1, 2), "elastic", "current", "coulomb", "slip"),
            ((2, 1), "rate", "reference", "tresca", "slip"),
        ):
            case = FrictionCase(cell, *degrees, method, measure, law, regime)
            yield pytest.param(case, id=f"{name_of(case)}-{law}-{regime}")


@pytest.mark.mpi(where=lambda case, **_: case.cell == "quadrilateral")
@pytest.mark.parametrize("case", list(friction_cases()))
def test_flux_and_heat_of_friction(case, record_property):
    """The heat is shared unequally, and the time of the step is not one."""
    scene = case.scene("overhang")

    def make(seed):
        friction = law_for(case, scene, seed)
        if friction is None:
            return None
        contact = case.contact(scene, friction, tangent="full")
        contact.dt = 0.5
        return contact

    def prepare(contact, seed):
        set_both(contact, scene, seed)
        check_regime(contact, case.regime)
        return True

    heat = partial(massive, field_degree=case.degree, friction_heat=0.3)
    found = field_slopes(make, prepare, heat)
    record_property("slope", found.tolist())
    assert is_second_order(found), found


@pytest.mark.mpi(where=lambda cell, **_: cell == "triangle")
def test_fixed_tangent_is_of_first_order(cell):
    """So the slopes above are those of moving segments too."""
    case = Case(cell, 1, 1, "normal", "reference")
    scene = case.scene("overhang")

    def prepare(contact, seed):
        states.set_state(contact, scene, "active", seed)
        return states.in_regime(contact, "active")

    found = field_slopes(lambda seed: states.make_contact(scene, case), prepare)
    assert is_first_order(found), found


TOOLS = {
    # In the frame of the tool, and in that of the slave
    "plane": {2: lambda: rigid.Line((0.0, 0.72), (0.1, 1.0)), 3: None},
    "ball": {2: lambda: rigid.Circle((0.6, -3.26), 4.0), 3: None},
}
TOOLS["plane"][3] = lambda: rigid.Plane((0.0, 0.0, 0.72), (0.1, -0.05, 1.0))
TOOLS["ball"][3] = lambda: rigid.Sphere((0.6, 0.5, -3.26), 4.0)


def check_free_tool(cell, method, friction, kind, tool, record_property):
    """Slopes where a tool is free, at a field on it that is a number or an unknown."""
    case = FrictionCase(cell, 2, 1, method, "current")
    scene, dim = case.scene("overhang"), case.dim

    def make(seed):
        free = ("x", "y", "r") if dim == 2 else ("x", "y", "z", "rx", "ry", "rz")
        body = rigid.Body(TOOLS[kind][dim](), (0.3,) * dim, free=free)
        contact = Contact(
            fem.Function(compat.vector_space(scene.mesh, case.degree)),
            scene.facet_tags,
            [(scene.tags["slave"], body)],
            AugmentedLagrangian(states.GAMMA)
            if method == "augmented"
            else Penalty(50.0),
            friction,
            quadrature_degree=3,
            measure=case.measure,
            offset=0.02,
        )
        contact.update()
        contact.advance()
        return contact

    def prepare(contact, seed):
        states.set_state(contact, scene, "active", seed, amplitude=0.02)
        return states.in_regime(contact, "active") or friction is not None

    def heat(contact):
        return massive(contact, tool=tool(), field_degree=2, friction_heat=0.3)

    found = field_slopes(make, prepare, heat, wanted=lambda contact: True)
    record_property("slope", found.tolist())
    assert is_second_order(found), found


@pytest.mark.filterwarnings("ignore:the straight facets")
@pytest.mark.mpi(where=lambda cell, kind, **_: cell == "triangle" and kind == "ball")
@pytest.mark.parametrize("kind", TOOLS)
@pytest.mark.parametrize("friction", [None, Coulomb(0.1)])
@pytest.mark.parametrize("method", ["augmented", "elastic"])
@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
def test_flux_to_a_free_tool(cell, method, friction, kind, record_property):
    """Columns of the tool's translation and rotation are among those that vary."""
    check_free_tool(cell, method, friction, kind, lambda: 0.7, record_property)


@pytest.mark.quick
@pytest.mark.filterwarnings("ignore:the straight facets")
@pytest.mark.mpi(where=lambda cell, **_: cell == "triangle")
@pytest.mark.parametrize(
    "cell, method, kind",
    [("triangle", "augmented", "ball"), ("hexahedron", "elastic", "plane")],
)
def test_flux_to_a_tool_that_stores_it(cell, method, kind, record_property):
    """The balance of the tool is among the rows, and the field on it among columns."""

    def tool():
        return ToolField(0.7, capacity=2.0)

    check_free_tool(cell, method, Coulomb(0.1), kind, tool, record_property)

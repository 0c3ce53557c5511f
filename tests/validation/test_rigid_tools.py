"""Rigid tools that forces press, and flat punches of facets, against closed forms."""

from __future__ import annotations

import warnings

import gathered
import numpy as np
import pytest
import revolution
import ufl
from dolfinx import fem
from materials import MATERIALS, lame
from problems import fix
from revolution import half_space, on_axis

from raymortar import (
    Contact,
    ContactError,
    ContactWarning,
    History,
    LoadSteps,
    NonlinearProblem,
    SNESSolver,
    rigid,
)
from raymortar.core import compat
from raymortar.core.errors import SetUpError

E, NU = 1000.0, 0.3
E_STAR = E / (1.0 - NU**2)
HELD = ["bottom", "side"]


def on_half_space(a, body, facets=8):
    """A tool above an elastic half-space, of which `a` is the contact radius."""
    return revolution.build(
        half_space(a, facets), 2, E=E, nu=NU, master=body,
        bcs=lambda V, s: [on_axis(V, s), fix(V, s, HELD)],
    )  # fmt: skip


# A ball on which a force acts (H6: the depth of H1)


@pytest.mark.mpi(where=lambda above: above == 0.1)
@pytest.mark.parametrize("above", (1e-3, 0.1))
def test_a_force_presses_a_ball_to_its_depth(above, record_property):
    """From a start without contact; Newton's method ends quadratically."""
    a, depth, force = 0.0316228, 1e-3, 0.0463337
    ball = rigid.Body(
        rigid.Circle((0.0, 1.0 + above), 1.0), free=("y",), force=(0.0, -force)
    )
    found = on_half_space(a, ball)
    assert found.contact.system.axisymmetric
    iterations, _ = SNESSolver(found.problem).solve()
    reached = -ball.translation[1] - above
    record_property("error", reached / depth - 1.0)
    assert reached == pytest.approx(depth, rel=0.02)
    assert iterations <= 12
    *_, before, last, end = np.array(found.problem.history)
    assert last < 10.0 * before**2 and end < max(10.0 * last**2, 1e-12)
    on = found.contact.results.resultant_on(ball)
    assert on.force == pytest.approx([0.0, force], rel=1e-9)
    assert on.moment == 0.0
    assert on.radial == pytest.approx(-found.contact.resultant().radial, rel=1e-12)


@pytest.mark.mpi
@pytest.mark.parametrize("free, told", [(("x", "y"), "x"), (("y", "r"), "r")])
def test_a_solid_of_revolution_is_free_along_its_axis_only(free, told):
    ball = rigid.Body(rigid.Circle((0.0, 1.0), 1.0), free=free)
    with pytest.raises(ContactError, match=f"rigid Circle is free along {told}: "):
        on_half_space(0.1, ball, 2)


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize(
    "motion, told",
    [
        (((2e-3, -1e-3),), "left the axis by 0.002: "),
        (((0.0, -1e-3), 0.1), "turned by 0.1: "),
        ((None, -2.0 * np.pi), "turned by -6.283: "),
    ],
)
def test_a_tool_that_leaves_the_axis_is_refused(motion, told):
    """Off the axis the circle would be a torus."""
    ball = rigid.Body(rigid.Circle((0.0, 2.0), 1.0), name="ball")
    found = on_half_space(0.1, ball, 2)
    solver = SNESSolver(found.problem)
    ball.move((0.0, -1e-3))
    solver.solve()
    ball.move(*motion)
    with pytest.raises(SetUpError, match=f"rigid ball has {told}"):
        solver.solve()


@pytest.mark.quick
@pytest.mark.parametrize("r, leaves", [(0.0, True), (2.0, False)])
def test_what_is_beside_the_axis_may_widen(r, leaves):
    """A ring of facets; half of a disc on the axis may not."""
    arc = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 9)
    points = np.column_stack([r + np.cos(arc), 5.0 + np.sin(arc)])
    facets = [(i, i + 1) for i in range(8)]
    tool = rigid.Body(rigid.Surface(points, facets, closed=False, orient=True))
    found = on_half_space(0.1, tool, 2)
    tool.move((1e-3, 0.0))
    if not leaves:
        return found.contact.update()
    with pytest.raises(SetUpError, match="rigid Surface has left the axis by 0.001"):
        found.contact.update()


def test_a_ring_that_crosses_the_axis_is_refused():
    ring = rigid.Body(rigid.Circle((3.0, 3.0), 1.0), name="ring")
    found = on_half_space(0.1, ring, 2)
    ring.move((-1.5, 0.0))
    found.contact.update()
    ring.move((-2.5, 0.0))
    with pytest.raises(SetUpError, match="rigid ring has crossed the axis by -2.5: "):
        found.contact.update()


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("unit", [1.0, 1e-3])
@pytest.mark.parametrize("r, is_ball", [(0.0, True), (3.0, False), (-3.0, False)])
def test_a_circle_across_the_axis_beside_its_centre_is_no_ball(r, is_ball, unit):
    circle = rigid.Circle((r * unit, 12.0 * unit), 10.0 * unit)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        on_half_space(0.1, rigid.Body(circle, name="ball"), 2)
    told = [str(w.message) for w in caught if w.category is ContactWarning]
    if is_ball:
        assert not told
    else:
        (text,) = told
        assert (
            f"rigid ball crosses the axis r = 0 with its centre at r = {r * unit:.4g}: "
            in text
        )


# A cylinder on a half plane (H4)


def press_cylinder(a, load, facets):
    """Half of a half plane in plane strain below a circle that half the load presses."""
    scene = half_space(a, facets)
    circle = rigid.Body(
        rigid.Circle((0.0, 1.0 + 0.5 * a), 1.0), free=("y",), force=(0.0, -0.5 * load)
    )
    V = compat.vector_space(scene.mesh, 2)
    u, v = fem.Function(V), ufl.TestFunction(V)
    stress = MATERIALS["linear"][0](ufl.grad(u), *lame(E, NU))
    F = ufl.inner(stress, ufl.grad(v)) * ufl.dx
    contact = Contact(u, scene.facet_tags, [(scene.tags["slave"], circle)])
    bcs = [fix(V, scene, "left", 0), fix(V, scene, HELD)]
    problem = NonlinearProblem(F, contact, bcs)
    SNESSolver(problem).solve()
    return contact


@pytest.mark.parametrize("radius", (0.02, 0.1))
def test_a_load_presses_a_cylinder(radius, record_property):
    load = 0.25 * np.pi * E_STAR * radius**2  # R = 1
    contact = press_cylinder(radius, load, 8)
    p = gathered.points(contact)
    x, pressure, weight = p["x"][:, 0], p["pressure"], p["weight"]
    peak = np.sqrt(load * E_STAR / np.pi)
    resultant = contact.resultant()
    assert resultant.force[1] == pytest.approx(-0.5 * load, rel=1e-9)
    exact = peak * np.sqrt(np.maximum(1.0 - (x / radius) ** 2, 0.0))
    off = np.sqrt(weight @ (pressure - exact) ** 2 / (weight @ exact**2))
    # The mean distance under half of an ellipse is 4 a / (3 pi)
    half_width = 0.75 * np.pi * (weight @ (pressure * x)) / (weight @ pressure)
    record_property("peak", pressure.max() / peak - 1.0)
    record_property("width", half_width / radius - 1.0)
    record_property("L2", off)
    assert pressure.max() == pytest.approx(peak, rel=0.02)
    assert half_width == pytest.approx(radius, rel=0.02)
    assert off <= 0.04


# A flat punch with its rim (H3), of facets


@pytest.mark.parametrize("by_force", (False, True))
def test_a_flat_punch_of_facets(by_force, record_property):
    """Its rim ends the contact; it lies at a node of the slave."""
    a, depth = 1.0, 1e-3
    force = 2.0 * E_STAR * a * depth
    points = a * np.array([[-1.0, 0.0], [1.0, 0.0], [1.0, 2.0], [-1.0, 2.0]])
    shape = rigid.Surface(points, [[0, 1], [1, 2], [2, 3], [3, 0]])
    if by_force:
        punch = rigid.Body(shape, free=("y",), force=(0.0, -force))
    else:
        punch = rigid.Body(shape)
        punch.move((0.0, -depth))
    found = on_half_space(a, punch, 24)
    SNESSolver(found.problem).solve()
    p = gathered.points(found.contact)
    inner = p["x"][:, 0] < 0.8 * a
    r, pressure, weight = p["x"][inner, 0], p["pressure"][inner], p["weight"][inner]
    exact = force / (2.0 * np.pi * a * np.sqrt(a**2 - r**2))
    on = found.contact.results.resultant_on(punch)
    record_property("force", on.force[1] / force - 1.0)
    record_property("depth", -punch.translation[1] / depth - 1.0)
    record_property("pressure", weight @ pressure / (weight @ exact) - 1.0)
    assert on.force[1] == pytest.approx(force, rel=1e-9 if by_force else 0.01)
    assert -punch.translation[1] == pytest.approx(depth, rel=0.01)
    assert weight @ pressure == pytest.approx(weight @ exact, rel=0.02)


def test_a_shaft_that_grows_does_the_work_of_the_ring(record_property):
    """Radial tractions cancel in the force of a full turn, and do work all the same."""
    shaft = rigid.Body(rigid.Line((2.0, 0.0), (1.0, 0.0)), name="shaft")
    found = revolution.build(
        revolution.disc("quadrilateral", 4, radius=2.0, slave="left"), 2, E=E, nu=NU,
        bcs=lambda V, s: [fix(V, s, ["bottom", "top"], 1)], master=shaft,
    )  # fmt: skip
    history = History(found.problem)

    def widen(t):
        shaft.move((0.01 * t, 0.0))

    LoadSteps(SNESSolver(found.problem), widen, 2, history=history).run()
    energy = 0.5 * revolution.residual(found.u, *lame(E, NU))
    energy = fem.assemble_scalar(compat.form(ufl.action(energy, found.u)))
    push = history["push_shaft_x"][-1]
    record_property("work", history["work_shaft"][-1] / energy - 1.0)
    assert push == pytest.approx(-2.0 * energy / 0.01, rel=1e-6)
    assert history["work_shaft"][-1] == pytest.approx(energy, rel=1e-6)
    assert found.contact.results.resultant_on(shaft).force == pytest.approx([0.0, 0.0])

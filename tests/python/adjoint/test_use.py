"""Taylor remainders, mixed unknowns, condensed problems, ranks, and what is refused."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import ufl
from adjoints import Parameters, along, blocks, tool
from condensing import newton
from dolfinx import fem
from periodic import Cell
from problems import COMM
from test_gradients import MOTION, STEPS, compare, solve, values

from meshes.scenes import two_blocks
from raymortar import (
    CondensedProblem,
    Contact,
    ContactError,
    NonlinearProblem,
    Penalty,
    adjoint,
    rigid,
    versions,
)
from raymortar.adjoint.functionals import as_functional
from raymortar.core import compat
from raymortar.core.errors import SetUpError

SIZES = {
    "modulus": 2.0, "load": 1.0, "offset": 2e-4, "friction": 5e-4, "gamma": 2.0,
    "radius": 1e-3, "place": np.array([1e-3, 5e-4, 0.0]), "shape": 1e-3,
}  # fmt: skip
REMAINDERS = [
    *((blocks, "points", name) for name in ("modulus", "offset", "friction", "shape")),
    *((blocks, "penalty", name) for name in ("modulus", "load", "shape", "gamma")),
    *((tool, "points", name) for name in ("radius", "place", "offset", "friction")),
    *((tool, "dual", name) for name in ("radius", "place", "shape")),
    (blocks, "nodes", "shape"),
]


@pytest.mark.parametrize("make, method, name", REMAINDERS)
def test_remainder_is_of_second_order(make, method, name):
    """J(m + h d) - J(m) - h dJ falls by four where h halves."""

    def value(by):
        scene = make(method=method, mu=0.2, p=Parameters().changed(name, by))
        solve(scene)
        return scene, values(scene, "form")

    size = SIZES[name]
    scene, start = value(0.0 * size)
    control, direction = scene.directions()[name]
    gradient = adjoint.gradient(scene.functional, scene.problem, control)
    if name == "place":
        slope = float(gradient @ size)
    else:
        slope = size * along(gradient, direction)
    shares = 1.0 / 2.0 ** np.arange(3)
    left = [abs(value(h * size)[1] - start - h * slope) for h in shares]
    rates = np.log2(np.array(left[:-1]) / left[1:])
    assert np.all(np.abs(rates - 2.0) < 0.25), rates


@pytest.mark.mpi
@pytest.mark.parametrize("method", ["points", "dual", "penalty"])
def test_on_ranks(method):
    """Forms and forces on any number of ranks, by parameters of both kinds."""
    names = ["modulus", "load", "offset", "friction", "shape"]
    for which in ("form", "force"):
        compare(lambda **k: blocks(method=method, mu=0.2, **k), names, which)


@pytest.mark.mpi
def test_tool_on_ranks():
    """Radius and place of a tool on any number of ranks."""
    names = ["offset", "friction", "radius", "place", "turn"]
    compare(lambda **k: tool(method="dual", mu=0.1, **k), names)


@pytest.mark.mpi
def test_three_dimensions():
    """Forms in space."""
    compare(
        lambda **k: blocks("tetrahedron", "points", 0.2, n=(3, 2), **k),
        ["modulus", "load"],
    )


def mixed(load, offset=0.0):
    """Displacement and pressure of two blocks, the upper one pressed down."""
    scene = two_blocks(COMM, 2, "triangle", 4, 3, upper_size=(0.7, 0.6))
    mesh = scene.mesh
    W = versions.mixed_space(mesh, ("Lagrange", 2, (2,)), ("Lagrange", 1, ()))
    w, test = fem.Function(W), ufl.TestFunction(W)
    (u, p), (v, q) = ufl.split(w), ufl.split(test)
    f = fem.Constant(mesh, np.array([0.3, load]))
    G = fem.Constant(mesh, 10.0)
    dx = ufl.dx(metadata={"quadrature_degree": 4})
    F = (
        2.0 * G * ufl.inner(ufl.sym(ufl.grad(u)), ufl.grad(v)) * dx
        - p * ufl.div(v) * dx
    )
    F += q * (ufl.div(u) + p / 80.0) * dx - ufl.inner(f, v) * dx
    V, _ = W.sub(0).collapse()
    conditions = []
    for name, value in (("bottom", (0.0, 0.0)), ("top", (0.01, -0.04))):
        g = fem.Function(V)
        g.interpolate(lambda x: np.outer(value, np.ones(x.shape[1])))
        facets = scene.facet_tags.find(scene.tags[name])
        dofs = fem.locate_dofs_topological((W.sub(0), V), 1, facets)
        conditions.append(fem.dirichletbc(g, dofs, W.sub(0)))
    penalty, pairs = Penalty(60.0), [(3, 4)]
    contact = Contact(w.sub(0), scene.facet_tags, pairs, penalty, offset=offset)
    problem = NonlinearProblem(F, contact, conditions)
    problem.solve()
    return problem, f, ufl.inner(u, u) * dx + 0.1 * p * dx


def test_mixed_unknowns():
    """A part of a mixed Function is the displacement."""

    def value(load, offset):
        J = mixed(load, offset)[2]
        return COMM.allreduce(fem.assemble_scalar(compat.form(J)))

    problem, f, J = mixed(-1.0)
    (contact,) = problem.contact.contacts
    by_load, by_offset = adjoint.gradient(J, problem, [f, adjoint.offset(contact)])
    known = value(-1.0 + 1e-3, 0.0) - value(-1.0 - 1e-3, 0.0)
    assert by_load[1] == pytest.approx(known / 2e-3, rel=1e-6)
    known = value(-1.0, 1e-6) - value(-1.0, -1e-6)
    assert by_offset.x.array.sum() == pytest.approx(known / 2e-6, rel=1e-6)


@pytest.mark.mpi
@pytest.mark.parametrize("method", ["points", "vector", "nodes", "dual"])
def test_functional_of_the_multiplier(method):
    """Tractions may be in the functional, as unknowns that they are."""

    def functional(scene):
        t = scene.contact.multiplier
        dx = ufl.dx(domain=t.function_space.mesh, metadata={"quadrature_degree": 2})
        return ufl.inner(t, t) * dx + scene.u[0] * dx

    names, scene = ["load", "offset", "shape"], blocks(method=method)
    solve(scene)
    controls = scene.directions()
    those = [controls[name][0] for name in names]
    found = adjoint.gradient(functional(scene), scene.problem, those)
    for name, gradient in zip(names, found):
        values = []
        for sign in (1.0, -1.0):
            p = Parameters().changed(name, sign * STEPS[name])
            other = blocks(method=method, p=p)
            solve(other)
            values.append(as_functional(functional(other)).value(other.problem))
        known = (values[0] - values[1]) / (2.0 * STEPS[name])
        assert along(gradient, controls[name][1]) == pytest.approx(known, rel=1e-6)


def test_condensed_problem():
    """The gradient of a condensed problem is that of the coupled one."""
    found = []
    for is_condensed in (False, True):
        scene = blocks(method="dual")
        problem = scene.problem
        if is_condensed:
            scene.motion.value[:] = MOTION[2]
            problem = CondensedProblem(
                problem.forms[0], scene.u, scene.contact, problem.bcs
            )
            newton(problem, 1e-13)
        else:
            solve(scene)
        controls = [scene.E, scene.load, adjoint.offset(scene.contact)]
        by_E, by_load, by_gap = adjoint.gradient(scene.functional, problem, controls)
        found.append(np.concatenate([by_E.x.array, by_load, by_gap.x.array]))
    assert found[1] == pytest.approx(found[0], rel=1e-7, abs=1e-12)


def test_refusals():
    """What has no derivative is named."""
    scene = blocks(method="penalty")
    J, problem = scene.functional, scene.problem
    with pytest.raises(ContactError, match="no results yet"):
        adjoint.gradient(J, problem, scene.E)
    solve(scene)
    u = scene.u
    other = fem.Constant(u.function_space.mesh, 1.0)
    v = ufl.TestFunction(u.function_space)
    for wrong, text in [
        ((ufl.inner(u, v) * ufl.dx, problem, scene.E), "J must be a functional"),
        ((J, problem, u), "is an unknown"),
        ((J, problem, other), "neither in the forms"),
        ((J, problem, 3.0), "controls must be"),
        ((J, scene.contact, scene.E), "problem must be"),
    ]:
        with pytest.raises(ContactError, match=text):
            adjoint.gradient(*wrong)
    with pytest.raises(ContactError, match="axis"):
        adjoint.force(scene.contact, 2)
    scene.load.value[1] -= 5.0
    with pytest.raises(SetUpError, match="residual at the present state"):
        adjoint.gradient(J, problem, scene.E)


@pytest.mark.mpi
@pytest.mark.parametrize("method", ["points", "penalty"])
def test_an_accepted_step_with_friction_is_refused(method):
    """Its slips are gone, which no residual shows."""
    scene = blocks(method=method, mu=0.2)
    solve(scene)
    adjoint.gradient(scene.functional, scene.problem, scene.E)
    scene.contact.advance()
    with pytest.raises(SetUpError, match="the step has been accepted"):
        adjoint.gradient(scene.functional, scene.problem, scene.E)


@pytest.mark.mpi
def test_a_prescribed_value_is_refused():
    """It is in the functional, and by a condition in the state, too."""
    scene = blocks(method="penalty")
    solve(scene)
    J = ufl.inner(scene.motion, scene.u) * ufl.dx
    with pytest.raises(ContactError, match="a value of a Dirichlet condition"):
        adjoint.gradient(J, scene.problem, scene.motion)


def test_constraints_are_refused():
    """A gradient would lack what masters take for slaves."""
    cell = Cell("quadrilateral", 1, Penalty(), 0.0, "periodic")
    cell.press(steps=1)
    weight = fem.Constant(cell.mesh, 1.0)
    J = weight * ufl.inner(cell.u, cell.u) * ufl.dx
    with pytest.raises(SetUpError, match="constraints= have no derivative"):
        adjoint.gradient(J, cell.problem, weight)


@pytest.mark.mpi
def test_parameters_that_are_refused():
    """What contact does not have, or has no derivative, is named on all ranks."""
    block, led, other = blocks(method="penalty"), tool(mu=0.2), tool()
    for scene in (block, led):
        solve(scene)
    mesh = led.u.function_space.mesh
    dual = blocks("hexahedron", "dual", n=(2, 1))
    rim = tool("tetrahedron", "dual", n=3)
    for scene in (dual, rim):
        solve(scene)
    free = rigid.Body(rigid.Circle((0.0, 0.0), 1.0), free=("y",))
    for wrong, text in [
        ((block, lambda: adjoint.friction(block.contact)), "no coefficient of Coulomb"),
        ((led, lambda: adjoint.gamma(led.contact)), "gamma: the contact has"),
        ((led, lambda: adjoint.radius(rigid.Body(rigid.Line((0, 0), (0, 1))))), "none"),
        ((led, lambda: adjoint.place(free)), "free, and equilibrium"),
        ((block, lambda: adjoint.place(led.body)), "no contact of the problem meets"),
        ((led, lambda: adjoint.offset(other.contact)), "none of the problem's"),
        ((block, lambda: adjoint.coordinates(mesh)), "no displacement of the problem"),
        (
            (dual, lambda: adjoint.coordinates(dual.u.function_space.mesh)),
            "dual functions depend",
        ),
        (
            (rim, lambda: adjoint.coordinates(rim.u.function_space.mesh)),
            "partly uncovered",
        ),
    ]:
        scene, make = wrong
        with pytest.raises(ContactError, match=text):
            adjoint.gradient(scene.functional, scene.problem, make())


@pytest.mark.mpi
def test_an_offset_that_begins_is_told_once():
    """Couples over gaps begin with a jump where there is no offset."""
    scene = tool(mu=0.2, clearance=0.0)
    solve(scene)
    for expected in (1, 0):
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            adjoint.gradient(
                scene.functional, scene.problem, adjoint.offset(scene.contact)
            )
        found = ["begin with a jump" in str(one.message) for one in told]
        assert COMM.allreduce(sum(found)) in (expected, expected * COMM.size)

"""Taylor remainders, mixed unknowns, condensed problems, ranks, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from adjoints import Parameters, along, blocks
from condensing import newton
from dolfinx import fem
from periodic import Cell
from problems import COMM
from test_gradients import MOTION, compare, solve, values

from meshes.scenes import two_blocks
from raymortar import (
    CondensedProblem,
    Contact,
    ContactError,
    NonlinearProblem,
    Penalty,
    adjoint,
)
from raymortar.core import compat
from raymortar.core.errors import SetUpError


@pytest.mark.parametrize("name, size", [("modulus", 2.0), ("load", 1.0)])
@pytest.mark.parametrize("method", ["points", "penalty"])
def test_remainder_is_of_second_order(method, name, size):
    """J(m + h d) - J(m) - h dJ falls by four where h halves."""

    def value(by):
        scene = blocks(method=method, mu=0.2, p=Parameters().changed(name, by))
        solve(scene)
        return scene, values(scene, "form")

    scene, start = value(0.0)
    control, direction = scene.directions()[name]
    slope = along(adjoint.gradient(scene.functional, scene.problem, control), direction)
    sizes = size / 2.0 ** np.arange(3)
    left = [abs(value(h)[1] - start - h * slope) for h in sizes]
    rates = np.log2(np.array(left[:-1]) / left[1:])
    assert np.all(np.abs(rates - 2.0) < 0.25), rates


@pytest.mark.mpi
@pytest.mark.parametrize("method", ["points", "dual", "penalty"])
def test_on_ranks(method):
    """Forms and forces on any number of ranks."""
    for which in ("form", "force"):
        compare(
            lambda **k: blocks(method=method, mu=0.2, **k), ["modulus", "load"], which
        )


@pytest.mark.mpi
def test_three_dimensions():
    """Forms in space."""
    compare(
        lambda **k: blocks("tetrahedron", "points", 0.2, n=(3, 2), **k),
        ["modulus", "load"],
    )


def mixed(load):
    """Displacement and pressure of two blocks, the upper one pressed down."""
    scene = two_blocks(COMM, 2, "triangle", 4, 3, upper_size=(0.7, 0.6))
    mesh = scene.mesh
    W = compat.mixed_space(mesh, ("Lagrange", 2, (2,)), ("Lagrange", 1, ()))
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
    contact = Contact(w.sub(0), scene.facet_tags, [(3, 4)], Penalty(60.0))
    problem = NonlinearProblem(F, contact, conditions)
    problem.solve()
    return problem, f, ufl.inner(u, u) * dx + 0.1 * p * dx


def test_mixed_unknowns():
    """A part of a mixed Function is the displacement."""
    problem, f, J = mixed(-1.0)
    found = adjoint.gradient(J, problem, f)
    ends = [fem.assemble_scalar(compat.form(mixed(-1.0 + h)[2])) for h in (1e-3, -1e-3)]
    known = COMM.allreduce(ends[0] - ends[1]) / 2e-3
    assert found[1] == pytest.approx(known, rel=1e-6)


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
        controls = [scene.E, scene.load]
        by_E, by_load = adjoint.gradient(scene.functional, problem, controls)
        found.append(np.append(by_E.x.array, by_load))
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

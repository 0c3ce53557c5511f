"""Rigid tools that are given wrongly are told, by name."""

from __future__ import annotations

import boxes
import numpy as np
import pytest
from dolfinx import fem
from rigid_scenes import TOP, press

from raymortar import (
    AugmentedLagrangian,
    Contact,
    ContactError,
    NewtonSolver,
    NonlinearProblem,
    SNESSolver,
    compat,
    rigid,
)
from raymortar.errors import SetUpError

LAW = {"method": AugmentedLagrangian(40.0)}


@pytest.mark.parametrize("hollow", ("no", 1, None))
def test_hollow_is_true_or_false(hollow):
    for make in (
        lambda: rigid.Sphere((0.0, 0.0), 1.0, hollow),
        lambda: rigid.Cylinder((0.0,) * 3, (1.0, 0.0, 0.0), 1.0, hollow),
        lambda: rigid.Cone((0.0,) * 3, (1.0, 0.0, 0.0), 1.0, hollow),
        lambda: rigid.Torus((0.0,) * 3, (1.0, 0.0, 0.0), 1.0, 0.5, hollow),
    ):
        with pytest.raises(ContactError, match="hollow = .* must be True or False"):
            make()


def test_what_is_free_is_named_once():
    line = rigid.Line((0.0, 1.0), (0.0, -1.0))
    with pytest.raises(ContactError, match="has 'y' more than once"):
        rigid.Body(line, free=("y", "x", "y"))


@pytest.mark.parametrize("size", (1e160, 1e-200))
def test_axes_may_have_any_length(size):
    forces = []
    for length in (1.0, size):
        normal = length * np.array([0.1, -1.0])
        found = press("triangle", rigid.Line((0.5, 0.95), normal), **LAW)
        SNESSolver(found.problem).solve()
        forces.append(found.contact.resultant().force)
    assert forces[0] == pytest.approx(forces[1], rel=1e-10)


def test_a_class_is_no_shape():
    mesh = boxes.box("triangle", 2)
    u = fem.Function(compat.vector_space(mesh, 1))
    tags = boxes.tag_sides(mesh, (1, 1.0), (1, 0.0))
    with pytest.raises(ContactError, match="the class rigid.Circle, not a shape"):
        Contact(u, tags, [(TOP, rigid.Circle)])


@pytest.mark.parametrize("wrong", ("gradient", "hessian"))
def test_derivatives_that_are_none_are_noticed(wrong):
    """A parabola, one of whose derivatives has the wrong size."""
    size = {"gradient": 1.0, "hessian": 1.0} | {wrong: 2.0}

    def phi(x):
        return 0.95 + (x[0] - 0.5) ** 2 - x[1]

    def gradient(x):
        return size["gradient"] * np.array([2.0 * (x[0] - 0.5), -np.ones(x.shape[1])])

    def hessian(x):
        bend = np.zeros((2, 2, x.shape[1]))
        bend[0, 0] = 2.0
        return size["hessian"] * bend

    found = press("triangle", rigid.Implicit(phi, gradient, hessian), **LAW)
    with pytest.raises(ContactError, match=f"{wrong} is not the derivative"):
        found.contact.update()


def test_slaves_that_are_held_throughout_are_refused():
    found = press("triangle", rigid.Line((0.5, 0.95), (0.0, -1.0)), **LAW)
    V = found.u.function_space
    everywhere = fem.locate_dofs_geometrical(V, lambda x: np.full(x.shape[1], True))
    bcs = [fem.dirichletbc(np.zeros(2), everywhere, V)]
    F, _ = found.problem.forms
    with pytest.raises(SetUpError, match="tag 1 is prescribed throughout"):
        SNESSolver(NonlinearProblem(F, found.contact, bcs)).solve()


def test_a_held_slave_meets_a_tool_that_is_free():
    """The tool comes to rest on it."""
    body = rigid.Body(
        rigid.Line((0.5, 1.05), (0.0, -1.0)), free=("y",), force=(0.0, -1.0)
    )
    found = press("triangle", body, **LAW)
    V = found.u.function_space
    everywhere = fem.locate_dofs_geometrical(V, lambda x: np.full(x.shape[1], True))
    bcs = [fem.dirichletbc(np.zeros(2), everywhere, V)]
    F, _ = found.problem.forms
    assert NewtonSolver(NonlinearProblem(F, found.contact, bcs)).solve()[1]
    assert body.translation[1] == pytest.approx(-0.05, abs=1e-9)
    assert found.contact.resultant().force[1] == pytest.approx(-1.0, rel=1e-9)

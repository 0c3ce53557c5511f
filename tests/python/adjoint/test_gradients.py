"""Gradients at one state beside central differences and Taylor remainders."""

from __future__ import annotations

import numpy as np
import pytest
from adjoints import Parameters, along, blocks, tool

from raymortar import adjoint
from raymortar.adjoint.functionals import as_functional

MOTION = {2: (0.03, -0.05), 3: (0.03, 0.01, -0.05)}
STEPS = {
    "modulus": 1e-3, "load": 1e-4, "offset": 1e-6, "friction": 1e-5,
    "radius": 1e-6, "shape": 1e-6, "gamma": 1e-3,
}  # fmt: skip


def solve(scene):
    """Press and slide in one step."""
    scene.solve(MOTION[scene.u.function_space.mesh.geometry.dim])


def values(scene, which):
    """The functional of a solved scene."""
    J = scene.functional if which == "form" else adjoint.force(scene.contact, 1)
    return as_functional(J).value(scene.problem)


def differences(make, name, by, which):
    """Central difference of a functional of new scenes."""
    found = []
    for sign in (1.0, -1.0):
        scene = make(p=Parameters().changed(name, sign * by))
        solve(scene)
        found.append(values(scene, which))
    return (found[0] - found[1]) / (2.0 * np.linalg.norm(by))


def compare(make, names, which="form", rtol=1e-6):
    """Compare the gradients by some parameters with differences."""
    scene = make()
    solve(scene)
    controls = scene.directions()
    J = scene.functional if which == "form" else adjoint.force(scene.contact, 1)
    found = adjoint.gradient(J, scene.problem, [controls[name][0] for name in names])
    for name, gradient in zip(names, found):
        if name in ("place", "turn"):
            compare_motions(make, name, gradient, which, rtol)
            continue
        known = differences(make, name, STEPS[name], which)
        assert abs(known) > 1e-8, f"nothing depends on {name}"
        assert along(gradient, controls[name][1]) == pytest.approx(
            known, rel=rtol
        ), name


def compare_motions(make, name, gradient, which, rtol):
    """Compare the gradient by a tool's place, or by its rotation."""
    dim = 2 if len(gradient) == 3 else 3
    if name == "place":
        parts = [(i, gradient[i]) for i in range(dim)]
    else:
        parts = [(2, gradient[2])] if dim == 2 else list(enumerate(gradient[3:]))
    for i, found in parts:
        known = differences(make, name, 1e-6 * np.eye(3)[i], which)
        assert found == pytest.approx(known, rel=rtol), (name, i)


FORMS = ["modulus", "load"]


@pytest.mark.parametrize("mu", [None, 0.2])
@pytest.mark.parametrize("which", ["form", "force"])
@pytest.mark.parametrize("method", ["points", "nodes", "dual", "penalty"])
def test_forms(method, which, mu):
    """The modulus and a load, that is, coefficients of the form."""
    compare(lambda **k: blocks(method=method, mu=mu, **k), FORMS, which)


@pytest.mark.parametrize("which", ["form", "force"])
@pytest.mark.parametrize("method", ["points", "nodes", "dual", "penalty"])
def test_two_bodies(method, which):
    """Without friction: the modulus, a load, the offset."""
    compare(lambda **k: blocks(method=method, **k), [*FORMS, "offset"], which)


@pytest.mark.parametrize("which", ["form", "force"])
@pytest.mark.parametrize("method", ["points", "nodes", "dual", "rate", "penalty"])
def test_two_bodies_with_friction(method, which):
    """In a step that slips: the coefficient too."""
    compare(
        lambda **k: blocks(method=method, mu=0.2, **k),
        [*FORMS, "offset", "friction"],
        which,
    )


@pytest.mark.parametrize("mu", [None, 0.2])
@pytest.mark.parametrize("method", ["points", "nodes", "dual", "penalty"])
def test_shape(method, mu):
    """Positions of the nodes of both bodies."""
    compare(lambda **k: blocks(method=method, mu=mu, **k), ["shape"])


@pytest.mark.parametrize("which", ["form", "force"])
@pytest.mark.parametrize("method, clearance", [("nodes", 0.005), ("dual", 0.02)])
def test_shape_below_a_tool(method, clearance, which):
    """The same of a block with laws at nodes, of which some are open."""
    compare(lambda **k: tool(method=method, mu=0.2, **k), ["shape"], which)
    compare(
        lambda **k: tool("tetrahedron", method, n=3, clearance=clearance, **k),
        ["shape"],
    )


@pytest.mark.parametrize("method", ["nodes", "dual"])
def test_shape_by_deformed_areas(method):
    """The same where areas are those of the deformed slave."""
    compare(
        lambda **k: blocks(method=method, mu=0.2, measure="current", **k), ["shape"]
    )


@pytest.mark.parametrize("mu", [None, 0.1])
@pytest.mark.parametrize("method", ["points", "rate", "dual"])
def test_tool(method, mu):
    """Radius and place of a rigid circle."""
    names = [*FORMS, "offset", "radius", "place", "turn"] + ["friction"] * bool(mu)
    compare(lambda **k: tool(method=method, mu=mu, **k), names)


@pytest.mark.parametrize("mu", [None, 0.2])
@pytest.mark.parametrize("method", ["penalty", "rate"])
def test_gamma(method, mu):
    """The coefficient of a penalty."""
    compare(lambda **k: blocks(method=method, mu=mu, **k), ["gamma"])


@pytest.mark.parametrize("mu", [None, 0.2])
@pytest.mark.parametrize("method", ["points", "nodes", "dual", "penalty"])
def test_blocks_in_space(method, mu):
    """Offset, friction, and the shape."""
    names = ["offset", "shape"] + ["friction"] * bool(mu)
    compare(lambda **k: blocks("tetrahedron", method, mu, n=(3, 2), **k), names)


@pytest.mark.parametrize("shape", ["sphere", "cylinder"])
@pytest.mark.parametrize("mu", [None, 0.1])
@pytest.mark.parametrize("method", ["points", "dual", "rate"])
def test_tool_in_space(method, mu, shape):
    """Radius, place and rotation of a sphere and a cylinder."""
    names = ["offset", "radius", "place", "turn"] + ["friction"] * bool(mu)
    cell = "tetrahedron"
    compare(lambda **k: tool(cell, method, mu, n=3, shape=shape, **k), names)

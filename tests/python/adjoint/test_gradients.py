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
    "radius": 1e-6, "shape": 1e-6,
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
        if name == "place":
            dim = scene.u.function_space.mesh.geometry.dim
            for i in range(dim):
                known = differences(make, name, 1e-6 * np.eye(3)[i], which)
                assert gradient[i] == pytest.approx(known, rel=rtol), (name, i)
            continue
        known = differences(make, name, STEPS[name], which)
        assert along(gradient, controls[name][1]) == pytest.approx(
            known, rel=rtol
        ), name


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
@pytest.mark.parametrize("method", ["points", "penalty"])
def test_shape(method, mu):
    """Positions of the nodes of both bodies."""
    compare(lambda **k: blocks(method=method, mu=mu, **k), ["shape"])


@pytest.mark.parametrize("mu", [None, 0.2])
@pytest.mark.parametrize("method", ["points", "rate", "dual"])
def test_tool(method, mu):
    """Radius and place of a rigid circle."""
    names = [*FORMS, "offset", "radius", "place"] + (["friction"] if mu else [])
    compare(lambda **k: tool(method=method, mu=mu, **k), names)

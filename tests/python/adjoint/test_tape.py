"""Gradients along paths with friction beside central differences."""

from __future__ import annotations

import numpy as np
import pytest
from adjoints import Parameters, along, blocks, tool
from test_gradients import STEPS

from raymortar import ContactError, LoadSteps, adjoint
from raymortar.core.errors import SetUpError

COUNT = 10


def motions(dim):
    """Motions that press in three steps and then slide, with a reversal."""
    found = []
    for n in range(1, COUNT + 1):
        slid = 0.01 * max(n - 3, 0) if n < 9 else 0.05 - 0.012 * (n - 8)
        found.append(
            (slid, -0.02 * min(n, 3)) if dim == 2 else (slid, 0.0, -0.02 * min(n, 3))
        )
    return found


def record(scene, count=COUNT):
    """Solve the first steps of a path and record them."""
    tape = adjoint.Tape(scene.problem)
    for motion in motions(scene.u.function_space.mesh.geometry.dim)[:count]:
        if scene.body is None:
            scene.motion.value[:] = motion
        else:
            scene.body.move(motion)
        scene.problem.solve()
        scene.contact.advance()
        tape.record()
    return tape


def work(scene, tape):
    """Forces by step, and the weights of a sum of them."""
    forces = [adjoint.force(scene.contact, axis) for axis in (0, 1)]
    weights = np.array([np.linspace(0.3, 1.0, COUNT), np.linspace(-0.5, 0.7, COUNT)])
    return forces, weights


SCENES = {
    "blocks, rate": lambda **k: blocks(method="rate", mu=0.25, **k),
    "blocks, nodes": lambda **k: blocks(method="nodes", mu=0.25, **k),
    "tool, rate": lambda **k: tool(method="rate", mu=0.25, **k),
    "tool, dual": lambda **k: tool(method="dual", mu=0.25, **k),
    "blocks in space": lambda **k: blocks("tetrahedron", "rate", 0.25, n=(3, 2), **k),
    "sphere": lambda **k: tool("tetrahedron", "dual", 0.25, n=3, **k),
}


def compare_path(make, names, count=COUNT):
    """Compare gradients of a path by some parameters with differences."""
    scene = make()
    tape = record(scene, count)
    J, weights = work(scene, tape)
    weights = weights[:, :count]
    controls = scene.directions()
    found = tape.gradient(J, [controls[one][0] for one in names], weights)
    for one, gradient in zip(names, found):
        by = 1e-6 * np.eye(3)[0] if one == "place" else STEPS[one]
        sums = []
        for sign in (1.0, -1.0):
            other = make(p=Parameters().changed(one, sign * by))
            values = record(other, count).values(work(other, None)[0])
            sums.append(float(np.sum(values * weights)))
        known = (sums[0] - sums[1]) / (2.0 * np.linalg.norm(by))
        got = gradient[0] if one == "place" else along(gradient, controls[one][1])
        assert abs(known) > 1e-8, f"nothing depends on {one}"
        assert got == pytest.approx(known, rel=1e-5), one


@pytest.mark.parametrize("name", SCENES)
def test_path_with_friction(name):
    """Modulus, load, offset, friction, and of a tool its radius and place."""
    names = ["modulus", "load", "offset", "friction"]
    of_tool = ["radius", "place"] if "tool" in name or name == "sphere" else []
    compare_path(SCENES[name], names + of_tool)


@pytest.mark.mpi
def test_path_on_ranks():
    """The same on any number of ranks, of four steps."""
    compare_path(SCENES["tool, rate"], ["friction"], 4)


def test_load_steps_are_recorded_and_state_comes_back():
    """A tape iterates load steps; gradients leave the last state as it was."""
    scene = tool(method="rate", mu=0.25)

    def apply(t):
        scene.body.move((0.05 * max(t - 0.5, 0.0), -0.06 * min(2.0 * t, 1.0)))

    tape = adjoint.Tape(LoadSteps(scene.problem.snes_solver, apply, 4))
    assert len(tape.run()) == len(tape) == 4
    before = scene.u.x.array.copy()
    values = tape.values(adjoint.force(scene.contact, 1))
    last = adjoint.force(scene.contact, 1)
    by_last = tape.gradient(last, scene.E)
    weighed = tape.gradient(last, scene.E, weights=[0.0, 0.0, 0.0, 1.0])
    assert np.array_equal(before, scene.u.x.array)
    assert np.all(np.diff(values[:2]) < 0.0)
    assert np.array_equal(by_last.x.array, weighed.x.array)


def test_springs_are_refused():
    """Tractions that a step hands on have no derivative."""
    scene = tool(method="penalty", mu=0.25)
    tape = adjoint.Tape(scene.problem)
    scene.solve((0.02, -0.05))
    scene.contact.advance()
    with pytest.raises(SetUpError, match="friction springs"):
        tape.record()


def test_weights_are_checked():
    """One for each step."""
    scene = tool(method="rate", mu=0.25)
    tape = adjoint.Tape(scene.problem)
    scene.solve((0.02, -0.05))
    scene.contact.advance()
    tape.record()
    with pytest.raises(ContactError, match="weights of shape"):
        tape.gradient(adjoint.force(scene.contact, 0), scene.load, [1.0, 2.0])

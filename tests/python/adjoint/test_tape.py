"""Gradients along paths with friction beside central differences."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np
import pytest
from adjoints import Parameters, along, blocks, tool
from problems import COMM
from test_gradients import STEPS

from raymortar import ContactError, Coulomb, Friction, LoadSteps, adjoint
from raymortar.core.errors import SetUpError
from raymortar.core.interface.point_results import Status

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
        scene.keep += [zone.points()["status"] for zone in scene.contact.zones]
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
# Springs hold tractions from step to step
SPRINGS = {
    "blocks": lambda **k: blocks(method="penalty", mu=0.25, **k),
    "quadratic blocks": lambda **k: blocks(method="penalty", mu=0.25, degree=2, **k),
    "deformed areas": lambda **k: blocks(
        "quadrilateral", "penalty", 0.25, measure="current", **k
    ),
    "tool": lambda **k: tool(method="penalty", mu=0.25, **k),
    "blocks in space": lambda **k: blocks(
        "tetrahedron", "penalty", 0.25, n=(3, 2), **k
    ),
    "hexahedra": lambda **k: blocks("hexahedron", "penalty", 0.25, n=(3, 2), **k),
    "sphere": lambda **k: tool("tetrahedron", "penalty", 0.25, n=3, **k),
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
    names += ["shape"] if name != "sphere" else []
    of_tool = ["radius", "place"] if "tool" in name or name == "sphere" else []
    compare_path(SCENES[name], names + of_tool)


@pytest.mark.parametrize("name", SPRINGS)
def test_path_with_springs(name):
    """The same with the elastic penalty, by its coefficient too, and by the shape."""
    names = ["modulus", "load", "offset", "friction", "gamma"]
    names += ["radius", "place"] if name in ("tool", "sphere") else []
    names += ["shape"] if name != "hexahedra" else []
    compare_path(SPRINGS[name], names)


SIZES = {
    "modulus": 0.1, "load": 0.01, "offset": 2e-5, "friction": 1e-4, "gamma": 0.5,
    "radius": 1e-4, "place": 1e-4, "shape": 1e-4,
}  # fmt: skip


@pytest.mark.parametrize("scene", [blocks, tool])
def test_remainder_of_path_with_springs(scene):
    """J(m + h d) - J(m) - h dJ falls by four where h halves, while points stick and
    slip."""
    count = 6

    def make(p=None):
        return scene(method="penalty", mu=0.25, p=p)

    start = make()
    tape = record(start, count)
    J, weights = work(start, tape)
    weights = weights[:, :count]
    assert {Status.STICK, Status.SLIP} <= set(np.concatenate(start.keep))
    controls = start.directions()
    names = [one for one in SIZES if one in controls]
    gradients = tape.gradient(J, [controls[one][0] for one in names], weights)
    value = float(np.sum(tape.values(J) * weights))
    for one, gradient in zip(names, gradients):
        is_place, size = one == "place", SIZES[one]
        slope = gradient[0] if is_place else along(gradient, controls[one][1])
        left = []
        for h in (size, size / 2.0):
            by = h * np.eye(3)[0] if is_place else h
            other = make(p=Parameters().changed(one, by))
            there = record(other, count).values(work(other, None)[0])
            left.append(float(np.sum(there * weights)) - value - h * slope)
        assert np.log2(left[0] / left[1]) == pytest.approx(2.0, abs=0.1), one


@pytest.mark.mpi
def test_path_on_ranks():
    """The same on any number of ranks, of four steps."""
    compare_path(SCENES["tool, rate"], ["friction"], 4)


@pytest.mark.mpi
@pytest.mark.parametrize("name", ["tool, dual", "tool", "blocks in space"])
def test_gradients_do_not_depend_on_ranks(name):
    """Gradients of a path are those of one rank."""
    found = []
    for comm in (COMM, MPI.COMM_SELF):
        scene = {**SCENES, **SPRINGS}[name](comm=comm)
        tape = record(scene, 5)
        J, weights = work(scene, tape)
        controls = scene.directions()
        gradients = tape.gradient(J, [c for c, _ in controls.values()], weights[:, :5])
        found.append(
            [
                gradient if direction is None else along(gradient, direction)
                for gradient, (_, direction) in zip(gradients, controls.values())
            ]
        )
    for several, one in zip(*found):
        assert several == pytest.approx(one, rel=1e-10, abs=1e-13)


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


def test_lags_are_refused():
    """Lengths that a multiplier's friction at points hands on have no derivative."""
    scene = tool(method="points", mu=0.25)
    tape = adjoint.Tape(scene.problem)
    scene.solve((0.02, -0.05))
    scene.contact.advance()
    with pytest.raises(SetUpError, match="hands on lengths"):
        tape.record()


@pytest.mark.parametrize(
    "friction, text",
    [
        (Coulomb(0.25, elastic_slip=1e-3), "elastic_slip of .* is kept"),
        (
            Friction(lambda p, v, slip: 0.25 * p / (1.0 + slip)),
            "depends on the slip of all steps",
        ),
    ],
    ids=["elastic", "softening"],
)
def test_lengths_that_a_law_keeps_are_refused(friction, text):
    """Elastic slip, and the slip of all steps that a user's bound depends on."""
    scene = tool(method="nodes", mu=friction)
    tape = adjoint.Tape(scene.problem)
    scene.solve((0.02, -0.05))
    scene.contact.advance()
    with pytest.raises(SetUpError, match=text):
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

"""Motion that stops and goes on from a file equals that which did not, in each column."""

from __future__ import annotations

from types import SimpleNamespace

import moving
import numpy as np
import pytest
import strips
import ufl
from dolfinx import fem

import raymortar
from raymortar import Checkpoint, Coulomb, Penalty, dynamics, rigid
from raymortar.dynamics import Adaptive, GeneralizedAlpha, Midpoint, Newmark

pytestmark = pytest.mark.mpi

SCHEMES = [Newmark(), Midpoint(), GeneralizedAlpha(0.8)]
DT, END = 0.02, 0.5


def bounced(master, held, speed, method=None, damping=0.0):
    """A soft strip that meets a tool with friction, and its energy. If it is held its
    head is met, else its foot."""
    scene = moving.bars(
        n=4, lower=False, width=3.0 if held else 0.4, heads=12 if held else 2
    )
    side = moving.HEAD if held else moving.SLAVE
    contact = raymortar.Contact(
        scene.u, scene.facets, [(side, master)], method, friction=Coulomb(0.3)
    )
    energy, linear = moving.elastic(scene, 400.0)
    residual = linear if held else strips.neo_hookean(scene.u, 20.0)
    bcs = [raymortar.tools.prescribe(scene.V, scene.facets.find(moving.SLAVE))]
    problem = raymortar.NonlinearProblem(residual, contact, bcs * held)
    mass = ufl.inner(scene.a, scene.v) * ufl.dx
    loss = ufl.inner(ufl.sym(ufl.grad(scene.a)), ufl.grad(scene.v)) * ufl.dx
    damped = damping * mass + 0.1 * damping * loss if damping else None
    inertia = dynamics.Inertia(mass, contact, damping=damped)
    velocity = fem.Function(scene.V)
    velocity.x.array.reshape(-1, 2)[:] = speed
    history = raymortar.History(problem, works={"foot": bcs} if held else None)
    return SimpleNamespace(
        problem=problem, inertia=inertia, velocity=velocity, history=history,
        energy=energy,
    )  # fmt: skip


def on_a_plane(**options):
    floor = rigid.Plane((0.0, -0.02), (0.0, 1.0))
    return bounced(floor, False, (0.3, -0.4), **options)


def under_a_ball():
    """A ball with mass and springs, under its weight."""
    circle = rigid.Circle((1.5, 1.53), 0.5)
    ball = rigid.Body(
        circle, name="ball", free=("x", "y", "r"), mass=0.4, inertia=0.05,
        stiffness={"x": 2.0}, damping={"y": 0.1}, force=(0.0, -0.5),
    )  # fmt: skip
    ball.velocity = {"x": 0.2, "y": -0.4, "r": 1.0}
    return bounced(ball, True, (0.0, 0.0))


def glued():
    """A bar that sticks to another one, on which it is pressed and from which shear and
    the waves tear it."""
    scene = moving.bars(n=6, width=0.4)
    energy, residual = moving.elastic(scene, 20.0)
    contact = raymortar.Contact(
        scene.u, scene.facets, [(moving.SLAVE, moving.MASTER)], Penalty(2000.0),
        adhesion=raymortar.Cohesive(0.2, 0.01),
    )  # fmt: skip
    problem = raymortar.NonlinearProblem(residual, contact)
    inertia = dynamics.Inertia(ufl.inner(scene.a, scene.v) * ufl.dx, contact)
    velocity = moving.by_bar(scene, 0.2)
    aside = velocity.x.array.reshape(-1, 2)
    aside[:, 0] = np.where(aside[:, 1] < 0.0, 0.4, 0.0)
    return SimpleNamespace(
        problem=problem, inertia=inertia, velocity=velocity, energy=energy,
        history=raymortar.History(problem),
    )  # fmt: skip


SCENES = {
    "damping": lambda: on_a_plane(damping=0.5),
    "adhesion": glued,
    "penalty": lambda: on_a_plane(method=Penalty(2000.0)),
    "multiplier": on_a_plane,
    "ball": under_a_ball,
}


def motion(scene, scheme, **options):
    return dynamics.TimeSteps(
        scene.problem.snes_solver, scene.inertia, end=END, dt=DT, scheme=scheme,
        energy=scene.energy, history=scene.history, **options,
    )  # fmt: skip


def compare(make, cut, folder, *args, **options):
    """Columns by how much they differ, over the largest energy, force or their own."""
    path, through, begun, rest = folder / "motion.chk", *(make() for _ in range(3))
    steps = motion(through, *args, velocity=through.velocity, **options)
    steps.run()
    steps = motion(begun, *args, velocity=begun.velocity, **options)
    checkpoint = Checkpoint(
        begun.problem, path, more=steps.fields, history=begun.history
    )
    for step in steps:
        if step.number == cut:
            assert begun.history["active"][-1] > 0.0
            checkpoint.write(step.time)
            break
    steps = motion(rest, *args, **options)
    checkpoint = Checkpoint(rest.problem, path, more=steps.fields, history=rest.history)
    steps.resume(checkpoint.read())
    steps.run()
    columns, found = through.history.columns, {}
    energies = [name for name in columns if name in ("kinetic", "elastic")]
    whole = max(through.history[name].max() for name in energies)
    for name in columns:
        a, b = through.history[name], rest.history[name]
        assert a.shape == b.shape
        size = np.nanmax(np.abs(a), initial=0.0)
        if "work" in name or name in energies:
            size = max(size, whole)
        elif name.startswith(("moment", "impulse", "force", "tangential", "normal")):
            size = max(size, 1e-2)  # of unit size, where a component is rounding error
        off = np.nanmax(np.abs(a - b), initial=0.0)
        if off > 1e-12 * size:
            found[name] = off / size
    return found


@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
@pytest.mark.parametrize("scene", SCENES)
def test_each_column_goes_on(scene, scheme, folder):
    assert compare(SCENES[scene], 8, folder, scheme) == {}


def test_sizes_of_adaptive_steps_go_on(folder):
    adapt = Adaptive(error=1e-3)
    assert compare(on_a_plane, 12, folder, Newmark(), adapt=adapt) == {}

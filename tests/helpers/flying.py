"""A soft strip above a plane that flies, bends or falls, and its time steps."""

from __future__ import annotations

from functools import cache

import moving
import numpy as np
import strips
import ufl
from dolfinx import fem

import raymortar
from raymortar import dynamics, rigid
from raymortar.dynamics import GeneralizedAlpha, Midpoint, Newmark

SCHEMES = [Newmark(), Midpoint(), GeneralizedAlpha(0.8)]


def beam(
    gap=5.0,
    n=6,
    held=True,
    speed=(0.3, -0.2),
    friction=None,
    E=20.0,
    weight=0.0,
    **options,
):
    """A soft strip above a plane, with a velocity that bends it if its head is held."""
    scene = moving.bars(n=n, lower=False, gap=gap, width=0.4)
    floor = rigid.Plane((0.0, 0.0), (0.0, 1.0))
    contact = raymortar.Contact(
        scene.u, scene.facets, [(moving.SLAVE, floor)], friction=friction, **options
    )
    residual = strips.neo_hookean(scene.u, E)
    residual += fem.Constant(scene.mesh, weight) * scene.v[1] * ufl.dx
    bcs = []
    if held:
        bcs.append(raymortar.tools.prescribe(scene.V, scene.facets.find(moving.HEAD)))
    scene.problem = raymortar.NonlinearProblem(residual, contact, bcs)
    scene.contact = contact
    form = ufl.inner(scene.a, scene.v) * ufl.dx
    scene.inertia = dynamics.Inertia(form, contact)
    scene.v0 = fem.Function(scene.V)
    top = gap + 1.0

    def bend(x):
        share = (top - x[1]) if held else 1.0 + 0.0 * x[1]
        return np.vstack([speed[0] * share, speed[1] * share])

    scene.v0.interpolate(bend)
    return scene


def steps_of(scene, scheme, dt, end, solver=None, **options):
    given = {"velocity": scene.v0} | options
    return dynamics.TimeSteps(
        solver or scene.problem.snes_solver, scene.inertia, end=end, dt=dt,
        scheme=scheme, **given,
    )  # fmt: skip


def after(scheme, dt, end=0.4, **options):
    """Displacement after some time in flight."""
    scene = beam(**options)
    steps_of(scene, scheme, dt, end).run()
    return scene.u.x.array.copy()


@cache
def in_fine_steps(scheme):
    return after(scheme, 0.4 / 256)

"""A tool without friction: what it does is stored in the block."""

import pytest
import ufl
from materials import lame, neo_hookean_energy
from rigid_scenes import NU, E, press, shapes

from raymortar import (
    AugmentedLagrangian,
    History,
    LoadSteps,
    Penalty,
    SNESSolver,
    rigid,
)

DEPTH, STEPS = 0.06, 12
METHODS = {
    "penalty": Penalty(),
    "points": AugmentedLagrangian(),
    "nodes": AugmentedLagrangian(condition="nodes"),
    "dual": AugmentedLagrangian(condition="nodes", multiplier="dual"),
}


def lacking(n, method):
    """Share of a circle's work that is not stored, with n facets."""
    body = rigid.Body(shapes(2, 0.0)["circle"], name="circle")
    scene = press("triangle", body, n=n, degree=1, method=method)
    mesh = scene.u.function_space.mesh
    F = ufl.Identity(2) + ufl.grad(scene.u)
    energy = neo_hookean_energy(F, *lame(E, NU)) * ufl.dx(mesh, degree=2)
    history = History(scene.problem, energy=energy)

    def lower(t):
        body.move((0.01 * t, -DEPTH * t))

    for step in LoadSteps(SNESSolver(scene.problem), lower, STEPS, progress=False):
        history.record(step.factor)
    stored = history["energy"][-1]
    if isinstance(method, Penalty):
        stored += history["stored_normal"][-1]
    return 1.0 - stored / history["work_circle"][-1]


@pytest.mark.parametrize("name", METHODS)
def test_work_of_a_tool_is_stored(name):
    """But for the rule of the work, of second order in the step."""
    assert abs(lacking(12, METHODS[name])) < 4e-3

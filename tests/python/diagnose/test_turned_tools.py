"""Free bodies that turn so far in one step that friction has no direction."""

import numpy as np
import pytest
from rigid_scenes import press

from raymortar import ConvergenceError, Coulomb, LoadSteps, SNESSolver, rigid

MU, WEIGHT, RADIUS, DAMPING = 0.3, 1.0, 0.5, 0.05
# Moment that friction carries at its limit
LIMIT = MU * WEIGHT * RADIUS


def pressed(friction=True):
    """A wheel on a block, turning on the spot against a damper, after its first solve."""
    wheel = rigid.Body(
        rigid.Circle((0.5, 1.0 + RADIUS), RADIUS),
        free=("x", "y", "r"),
        force=(0.0, -WEIGHT),
        stiffness={"x": 100.0},
        damping={"r": DAMPING},
    )
    law = Coulomb(MU) if friction else None
    scene = press("quadrilateral", wheel, n=8, friction=law, material="linear")
    solver = SNESSolver(scene.problem)
    solver.solve()
    scene.contact.advance()
    return scene, wheel, solver


@pytest.mark.mpi
def test_a_solve_that_turns_too_far_says_so():
    _, wheel, solver = pressed()
    wheel.moment = -LIMIT - 4.0 * DAMPING
    said = (
        "has turned by .* rad in this step: with friction it has to be less than 1.57"
    )
    with pytest.raises(ConvergenceError, match=said):
        solver.solve()


@pytest.mark.mpi
def test_load_steps_take_smaller_steps_and_friction_resists():
    scene, wheel, solver = pressed()

    def turn(t):
        wheel.moment = -LIMIT - 4.0 * DAMPING * t

    path = LoadSteps(solver, turn, 1).run()
    assert len(path) > 1
    # The wheel turns clockwise, and the block pushes it forward
    force = scene.contact.results.resultant_on(wheel).force
    assert wheel.rotation[2] < -0.5 * np.pi
    assert force[0] > 0.8 * MU * force[1] > 0.0


@pytest.mark.mpi
def test_without_friction_any_turn_is_fine():
    _, wheel, solver = pressed(friction=False)
    wheel.moment = -4.0 * DAMPING
    solver.solve()
    assert wheel.rotation[2] == pytest.approx(-4.0, rel=1e-6)

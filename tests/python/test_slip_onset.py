"""Much starts to slip at once: full steps of Newton's method against a line search."""

import numpy as np
import pytest
from sheared_blocks import SOFT, clamped

import raymortar
from problems import DIMENSION

# Automatic on quadrilaterals; on hexahedra even softer springs will do
CASES = {"quadrilateral": raymortar.Penalty, "hexahedron": SOFT["elastic"]}


def press_and_shear(cell, method, options=None):
    """Iterations of one step down and one along, from the untouched bodies."""
    problem, move = clamped(cell, method, raymortar.Coulomb(0.5))
    solver = raymortar.SNESSolver(problem.problem, options)
    push, iterations = np.zeros(DIMENSION[cell]), []
    for push[-1], push[0] in ((-0.06, 0.0), (-0.06, 0.03)):
        move(push)
        iterations.append(solver.solve()[0])
        problem.contact.advance()
    return iterations, problem.contact.resultant()


@pytest.mark.mpi
@pytest.mark.quick
@pytest.mark.parametrize("cell", CASES)
def test_springs_get_a_line_search(cell):
    iterations, force = press_and_shear(cell, CASES[cell]())
    assert max(iterations) <= 8
    # Part of the cone: the rest has not slipped
    ratio = np.linalg.norm(force.tangential) / np.linalg.norm(force.normal)
    assert 0.05 < ratio < 0.5


def test_full_steps_cycle_with_springs():
    """Why: the same in full steps, which the user may ask for.

    Not on hexahedra and not on several ranks, where rounding decides whether a cycle
    is left.
    """
    with pytest.raises(raymortar.ConvergenceError):
        press_and_shear(
            "quadrilateral", raymortar.Penalty(), {"snes_linesearch_type": "basic"}
        )


@pytest.mark.mpi
@pytest.mark.parametrize("cell", CASES)
def test_multipliers_need_no_line_search(cell):
    for options in (None, {"snes_linesearch_type": "bt"}):
        method = raymortar.AugmentedLagrangian()
        iterations, _ = press_and_shear(cell, method, options)
        assert sum(iterations) <= 10

"""Much starts to slip at once: full steps of Newton's method against a line search."""

import numpy as np
import pytest
from problems import DIMENSION
from sheared_blocks import SOFT, clamped

import raymortar

# Down, then along; the untouched bodies touch exactly
FROM_REST = ((0.0, -0.06), (0.03, -0.06))
# Lifted first, so that the first touch is with pressure and slip
OVER_A_GAP = ((0.0, 0.01), (0.02, -0.03))
# Automatic on quadrilaterals; on hexahedra softer springs too
METHODS = {
    "quadrilateral": raymortar.Penalty,
    "hexahedron": raymortar.Penalty,
    "hexahedron, soft": SOFT["elastic"],
}
FULL_STEPS = {"snes_linesearch_type": "basic"}


def press_and_shear(case, path, method=None, options=None):
    """Iterations of each step, and the contact force."""
    cell = case.split(",")[0]
    method = METHODS[case]() if method is None else method
    problem, move = clamped(cell, method, raymortar.Coulomb(0.5))
    solver = raymortar.SNESSolver(problem.problem, options)
    push, iterations = np.zeros(DIMENSION[cell]), []
    for push[0], push[-1] in path:
        move(push)
        iterations.append(solver.solve()[0])
        problem.contact.advance()
    return iterations, problem.contact.resultant()


@pytest.mark.mpi
@pytest.mark.quick
@pytest.mark.parametrize("options", [None, FULL_STEPS])
@pytest.mark.parametrize("case", METHODS)
def test_all_that_touches_at_rest_sticks_at_first(case, options):
    """Neither pressure nor traction: slip there would be in the direction of rounding,
    and full steps would cycle."""
    iterations, force = press_and_shear(case, FROM_REST, options=options)
    assert max(iterations) <= 4
    # Part of the cone: the rest has not slipped
    ratio = np.linalg.norm(force.tangential) / np.linalg.norm(force.normal)
    assert 0.05 < ratio < 0.5


@pytest.mark.mpi
@pytest.mark.parametrize("case", METHODS)
def test_springs_get_a_line_search(case):
    """Why: full steps, which the user may ask for, cycle at a first touch with slip."""
    press_and_shear(case, OVER_A_GAP)
    with pytest.raises(raymortar.ConvergenceError):
        press_and_shear(case, OVER_A_GAP, options=FULL_STEPS)


@pytest.mark.mpi
@pytest.mark.parametrize("case", list(METHODS)[:2])
def test_multipliers_need_no_line_search(case):
    for options in (None, {"snes_linesearch_type": "bt"}):
        method = raymortar.AugmentedLagrangian()
        iterations, _ = press_and_shear(case, FROM_REST, method, options)
        assert sum(iterations) <= 7

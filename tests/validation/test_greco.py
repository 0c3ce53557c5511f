"""GRECO's plate (Raous; code_aster SSNV128): opening, slip and stick on one edge.

Half of a plate rests on a rigid plane with friction, pressed from above and pushed
along from its free side. The reference displacements have a tolerance of 5 %.
"""

import gathered
import numpy as np
import pytest
from greco import FORCE, GAMMA, SIDE, STEPS, solve

# u_x in m on the contact edge, at x in m
PLACES = 1e-3 * np.array([0.0, 1.25, 5.0, 7.5, 11.25])
REFERENCE = np.array([2.86e-5, 2.72e-5, 2.28e-5, 1.98e-5, 1.5e-5])


def along_edge(function, nodes):
    """Places and values of a function at nodes of the contact edge, by x; of all ranks,
    on every one."""
    places = function.function_space.tabulate_dof_coordinates()
    x = gathered.concatenated(places[nodes, 0])
    values = gathered.concatenated(function.x.array.reshape(-1, 2)[nodes])
    # Nodes between two ranks are on both
    _, order = np.unique(np.round(x / SIDE, 9), return_index=True)
    return x[order], values[order]


@pytest.mark.mpi(where=lambda cell, degree: (cell, degree) == ("triangle", 1))
@pytest.mark.parametrize(
    "cell, degree", [("quadrilateral", 1), ("triangle", 1), ("quadrilateral", 2)]
)
def test_plate_agrees_with_the_references(cell, degree, record_property):
    problem, steps = solve(cell, degree)
    zone = problem.contact.zones[0]
    x, u = along_edge(problem.u, zone.facets.slave_surface.dofs)
    found = np.interp(PLACES, x, u[:, 0])
    record_property("deviations", (found / REFERENCE - 1.0).tolist())
    record_property("iterations", [step.iterations for step in steps])
    assert len(steps) <= 2 * STEPS
    np.testing.assert_allclose(found, REFERENCE, rtol=0.05)

    # Open from the pushed side, then slip, then stick, told from the traction
    x, traction = along_edge(problem.contact.multiplier, zone.multiplier_nodes)
    # Up to the held corner, which takes hardly any force
    assert abs(problem.contact.resultant(0).force[1] / FORCE - 1.0) < 5e-3
    normal, ratio = traction[:, 1], np.abs(traction[:, 0] / traction[:, 1])
    is_open = normal < 0.01 * normal.max()
    stick = ~is_open & (ratio < 0.9)
    slip = ~is_open & ~stick
    assert 0.0 < x[is_open].max() < x[slip].min()
    assert x[slip].max() < x[stick].min()
    # Linear multipliers overshoot next to the jump between slip and stick
    np.testing.assert_allclose(ratio[slip], 1.0, atol=0.05)


@pytest.mark.mpi
def test_plate_hardly_depends_on_gamma():
    ends = []
    for gamma in (0.1 * GAMMA, GAMMA, 10.0 * GAMMA):
        problem, _ = solve("quadrilateral", 1, gamma)
        nodes = problem.contact.zones[0].facets.slave_surface.dofs
        ends.append(along_edge(problem.u, nodes)[1][0, 0])
    np.testing.assert_allclose(ends, ends[1], rtol=5e-4)

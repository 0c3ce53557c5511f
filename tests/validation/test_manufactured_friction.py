"""Manufactured friction on a rigid curved master, exact for the slip of one step.

The gap is zero and the master rests, so the slip increment is the chord between two
states that are chosen in closed form, whatever the step. The traction on the slave
is chosen on the friction cone, and a dead load makes up for what the stress of the
exact field does not carry: lambda is exact for every augmentation coefficient.
"""

import gathered
import numpy as np
import pytest
import ufl
from manufactured import Manufactured, rates, value
from manufactured_fields import CUBE, MU, SQUARE, Motion
from manufactured_scenes import on_rigid

import raymortar

MOTIONS = {
    "slip": Motion((0.0, 0.0), (0.1, 0.05), 1.0, 1.0),
    "stick": Motion((0.1, 0.05), (0.1, 0.05), 1.5, 0.5),
}


def test_traction_is_that_of_the_table():
    X = ufl.SpatialCoordinate(on_rigid("triangle", 1).mesh)
    p, traction, n = SQUARE.contact(X, Motion((0.0,), (0.1,), 1.0, 1.0))
    close = {"atol": 1e-8, "rtol": 0.0}
    np.testing.assert_allclose(value(n, (0.0, 0.0)), [0.03996804, -0.99920096], **close)
    assert abs(value(p, (0.0, 0.0)) + 0.0231087535) < 1e-9
    np.testing.assert_allclose(
        value(traction, (0.0, 0.0)), [-0.0078507, 0.02281321], **close
    )
    np.testing.assert_allclose(
        value(traction, (1.0, 0.0)), [-0.00839728, 0.03561846], **close
    )


def solve(fields, cell, degree, n, motion, gamma=None):
    """Solved problem and its errors."""
    problem = Manufactured(
        fields,
        cell,
        n,
        degree,
        MOTIONS[motion],
        raymortar.AugmentedLagrangian(gamma, condition="points"),
        friction=raymortar.Coulomb(MU),
    )
    problem.solve()
    return problem, problem.errors()


# Least rates of displacement and multiplier in L2. The theory of the multiplier is
# 1.5; meshes of quadrilaterals do better with degree 2, as code_aster's do
PLANE = [
    ("triangle", 1, 1.9, 1.45),
    ("quadrilateral", 1, 1.9, 1.45),
    ("triangle", 2, 2.9, 1.5),
    ("quadrilateral", 2, 2.9, 2.4),
]
# The cube's field is one of hexahedra of degree 2, which would show no rate
SPACE = [
    ("hexahedron", 1, "slip", (2, 4, 8), 1.9, 1.5),
    ("tetrahedron", 1, "slip", (2, 4, 8), 1.9, 1.5),
    ("tetrahedron", 2, "slip", (2, 4), 2.5, 1.5),
    ("tetrahedron", 2, "stick", (2, 4), 2.5, 1.5),
]


def check_rates(fields, cell, degree, motion, levels, u_rate, lam_rate, record):
    expected = {"stick": 2, "slip": 3}[motion]
    errors = []
    for n in levels:
        problem, error = solve(fields, cell, degree, n, motion)
        errors.append(error)
    # Errors may let single points of coarse meshes slip, or open
    assert np.mean(gathered.points(problem.contact)["status"] == expected) > 0.9
    found = rates(errors)
    record("errors", errors)
    record("rates", found)
    assert found["u_upper"][-1] >= u_rate
    assert found["multiplier"][-1] >= lam_rate


@pytest.mark.mpi(where=lambda cell, degree, **_: (cell, degree) == ("quadrilateral", 1))
@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("cell, degree, u_rate, lam_rate", PLANE)
def test_rates_in_the_plane(cell, degree, u_rate, lam_rate, motion, record_property):
    check_rates(
        SQUARE, cell, degree, motion, (4, 8, 16), u_rate, lam_rate, record_property
    )


@pytest.mark.mpi(where=lambda degree, motion, **_: degree == 2 and motion == "slip")
@pytest.mark.parametrize("cell, degree, motion, levels, u_rate, lam_rate", SPACE)
def test_rates_in_space(
    cell, degree, motion, levels, u_rate, lam_rate, record_property
):
    check_rates(CUBE, cell, degree, motion, levels, u_rate, lam_rate, record_property)


@pytest.mark.mpi
def test_solution_hardly_depends_on_gamma():
    problem, reference = solve(SQUARE, "quadrilateral", 2, 8, "slip")
    for factor in (0.1, 10.0):
        gamma = factor * problem.contact.gamma
        _, error = solve(SQUARE, "quadrilateral", 2, 8, "slip", gamma)
        for name in ("u_upper", "multiplier"):
            assert error[name] == pytest.approx(reference[name], rel=0.05)


def test_degree_2_holds_the_cube():
    """Only the linear multiplier errs on hexahedra of degree 2."""
    _, error = solve(CUBE, "hexahedron", 2, 2, "slip")
    assert error["u_upper"] < 2e-6 and error["multiplier"] < 5e-3

"""Newton's method and the coefficient gamma: numbers and fields."""

import numpy as np
import pytest
from dolfinx import fem
from load_paths import blocks
from problems import CELLS_2D, DIMENSION, build, worst
from squeezing import homogeneous, squeeze, squeezed

import raymortar
from raymortar import AugmentedLagrangian, ContactError
from raymortar.core import compat

MAX_ITERATIONS = 8


# The coefficient


def changes(make, factors):
    """Relative changes of u and of the multiplier with the automatic coefficient."""
    first = make(AugmentedLagrangian())
    first.solve()
    for factor in factors:
        other = make(AugmentedLagrangian(factor * first.contact.gamma))
        iterations = other.solve()
        u = worst(other.u.x.array - first.u.x.array) / worst(first.u.x.array)
        lam = worst(other.slave_multiplier() - first.slave_multiplier())
        lam /= worst(first.slave_multiplier())
        print(f"gamma x {factor}: {iterations} iterations, u {u:.1e}, lambda {lam:.1e}")
        yield u, lam


def unequal(cell, degree, width):
    """Unequal bodies, compressed by 20 %: takes a method to the problem."""
    size = (width,) * (DIMENSION[cell] - 1) + (1.0,)
    return lambda method: build(
        blocks(cell, upper_size=size),
        degree,
        "neo-hookean",
        method,
        E={"lower": 2000.0, "upper": 3000.0},
        bcs=squeezed,
    )


@pytest.mark.mpi(where=lambda cell: cell == "triangle")
def test_closed_contact_does_not_depend_on_the_coefficient(cell):
    for change in changes(unequal(cell, 1, 0.95), (0.1, 10.0)):
        assert max(change) <= 1e-6


@pytest.mark.mpi(where=lambda cell, degree: (cell, degree) == ("quadrilateral", 2))
@pytest.mark.parametrize("degree", [1, 2])
def test_partly_open_contact_depends_little_on_the_coefficient(cell, degree):
    # min(0, lambda + gamma g) is taken point by point, and lambda and g vary within
    # a facet: a large gamma opens points by the slave's edges, where the coarse
    # master bends. The displacement may change by 1 % over two decades.
    for u, _ in changes(unequal(cell, degree, 0.8), (0.1, 10.0)):
        assert u <= 1e-2


def coefficient(scene, expression, family="Lagrange", degree=1):
    """Scalar function from points (n, d) to values (n,)."""
    gamma = fem.Function(compat.space(scene.mesh, family, degree))
    gamma.interpolate(lambda x: expression(x.T))
    return gamma


def of_function(cell, expression, family="Lagrange", degree=1, penalty=False):
    """A3 with a coefficient that is a function."""
    scene = blocks(cell)
    gamma = coefficient(scene, expression, family, degree)
    make = raymortar.Penalty if penalty else AugmentedLagrangian
    return squeeze(scene, method=make(gamma))[0]


@pytest.mark.mpi(
    where=lambda cell, family, **_: (cell, family) == ("quadrilateral", "DG")
)
@pytest.mark.parametrize("penalty", [False, True])
@pytest.mark.parametrize("family, degree", [("Lagrange", 1), ("DG", 0)])
def test_constant_function_is_its_number(cell, family, degree, penalty):
    value = 1e4
    function = of_function(cell, lambda x: 0 * x[:, 0] + value, family, degree, penalty)
    make = raymortar.Penalty if penalty else AugmentedLagrangian
    number = squeeze(blocks(cell), method=make(value))[0]
    counts = function.solve(), number.solve()
    assert counts[0] == counts[1]
    assert np.allclose(function.history[:-1], number.history[:-1], rtol=1e-6)
    assert worst(function.u.x.array - number.u.x.array) <= 1e-12


@pytest.mark.mpi(where=lambda cell: cell in CELLS_2D)
def test_varying_coefficient_leaves_the_patch_exact(cell):
    problem = of_function(cell, lambda x: 1e4 * (1 + 5 * x[:, 0]))
    assert problem.solve() <= MAX_ITERATIONS
    F = homogeneous(problem.dim)
    assert worst(problem.gradient() + np.eye(problem.dim) - F) <= 1e-8


@pytest.mark.mpi
def test_varying_penalty_is_taken_point_by_point(cell_2d):
    problem = of_function(cell_2d, lambda x: 1e4 * (1 + 5 * x[:, 0]), penalty=True)
    problem.solve()
    points = problem.contact.points()
    surface = problem.contact.zones[0].facets.slave_surface
    ends = surface.X[surface.facet_nodes[points["slave"]], 0]
    X = ends[:, 0] + points["xi"][:, 0] * (ends[:, 1] - ends[:, 0])
    gamma = 1e4 * (1 + 5 * X)
    assert np.allclose(points["pressure"], -gamma * points["gap"], rtol=1e-9)


@pytest.mark.mpi
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan])
def test_coefficient_must_be_positive_on_the_slave(cell_2d, value):
    with pytest.raises(ContactError, match=r"gamma is .* on slave tag 3.*positive"):
        of_function(cell_2d, lambda x: np.where(x[:, 0] > 0.5, value, 1.0))


@pytest.mark.mpi
def test_coefficient_may_be_anything_off_the_slave(cell_2d):
    of_function(cell_2d, lambda x: np.where(x[:, 1] < 0.9, -1.0, 1e4)).solve()

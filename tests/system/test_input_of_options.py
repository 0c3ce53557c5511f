"""Bad options and coefficients of `Contact` and of its method."""

import warnings

import numpy as np
import pytest
import ufl
from calls import PAIR, contact, refused, small_blocks
from dolfinx import fem
from problems import COMM, build, fix

import raymortar
from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, ContactWarning, Penalty, Search, SNESSolver
from raymortar.core import compat

pytestmark = [pytest.mark.quick, pytest.mark.mpi]


@pytest.fixture
def scene():
    return small_blocks()


@pytest.fixture
def scene_3d():
    return two_blocks(COMM, 3, "tetrahedron", 1, 1)


@pytest.mark.parametrize("method", [AugmentedLagrangian, Penalty])
@pytest.mark.parametrize(
    "gamma, pattern",
    [
        (0.0, "gamma = 0.0 must be positive"),
        (-1, "gamma = -1 must be positive"),
        (np.nan, "gamma = nan must be positive and finite"),
        (np.inf, "gamma = inf must be positive and finite"),
        ("stiff", "gamma must be a positive number, .* not 'stiff'"),
        ([1.0], r"gamma must be a positive number, .* not \[1.0\]"),
        (1 + 1j, "gamma must be a positive number"),
    ],
)
def test_bad_coefficients_are_refused(scene, method, gamma, pattern):
    with refused(pattern):
        contact(scene, method=method(gamma))


def test_vector_function_is_no_coefficient(scene):
    gamma = fem.Function(compat.vector_space(scene.mesh, 1))
    with refused("gamma must be a scalar Function"):
        contact(scene, method=Penalty(gamma))


@pytest.mark.parametrize(
    "options, pattern",
    [
        ({"method": "penalty"}, "method must be AugmentedLagrangian or Penalty"),
        ({"method": Penalty}, "method must be AugmentedLagrangian or Penalty"),
        ({"friction": 0.3}, "friction must be Coulomb.*0.3"),
        ({"measure": "deformed"}, "measure must be one of .* not 'deformed'"),
        ({"tangent": "exact"}, "tangent must be one of .* not 'exact'"),
        ({"search": "bvh"}, "search must be a Search, not 'bvh'"),
        ({"quadrature_degree": 0}, "quadrature_degree = 0"),
        ({"quadrature_degree": 99}, "quadrature_degree = 99"),
        ({"quadrature_degree": 2.5}, "quadrature_degree = 2.5"),
        ({"quadrature_degree": "high"}, "quadrature_degree = 'high'"),
    ],
)
def test_unknown_options_are_refused(scene, options, pattern):
    with refused(pattern):
        contact(scene, **options)


@pytest.mark.parametrize(
    "options, pattern",
    [
        ({"strategy": "octree"}, "search strategy 'octree' is not one of"),
        ({"reach": -1.0}, "reach = -1.0 must not be negative"),
        ({"depth": np.nan}, "depth = nan"),
        ({"skin": -0.1}, "skin = -0.1"),
        ({"reach": "far"}, "reach = 'far'"),
    ],
)
def test_bad_search_is_refused(scene, options, pattern):
    with refused(pattern):
        contact(scene, search=Search(**options))


def test_unknown_multipliers_are_refused(scene):
    with refused("multiplier must be 'normal' or 'vector', not 'tangential'"):
        contact(scene, method=AugmentedLagrangian(multiplier="tangential"))
    with refused("multiplier degree 3 is not 1 or 2"):
        contact(scene, method=AugmentedLagrangian(degree=3))


@pytest.mark.skipif(COMM.size > 1, reason="several ranks are told together, by Contact")
def test_one_rank_is_told_where_the_option_is_made():
    with refused("reach = -1"):
        Search(reach=-1)


def test_unstable_multiplier_degree_is_refused(scene, scene_3d):
    quadratic = AugmentedLagrangian(degree=2)
    V = compat.vector_space(scene_3d.mesh, 2)
    with refused("multiplier degree 2 is not stable: at most 1 .* degree 2 in 3D"):
        contact(scene_3d, V=V, method=quadratic)
    with refused("multiplier degree 2 is not stable: at most 1 .* degree 1 in 2D"):
        contact(scene, method=quadratic)
    contact(scene, V=compat.vector_space(scene.mesh, 2), method=quadratic)


# Coefficients beside the stiffness of the bodies


@pytest.mark.parametrize("E", [1.0, 2e11])
@pytest.mark.parametrize(
    "method, ratio",
    [(Penalty, ratio) for ratio in (1e-300, 1e-11, 1e11, 1e290)]
    + [(AugmentedLagrangian, ratio) for ratio in (1e-300, 1e-120, 1e11, 1e290)],
)
def test_coefficients_of_another_order_than_the_stiffness_are_refused(
    scene, ratio, method, E
):
    stiffness = build(scene, E=E, method=AugmentedLagrangian()).contact.gamma
    with refused(r"gamma = .* times the stiffness of the bodies .*: leave gamma out"):
        build(scene, E=E, method=method(ratio * stiffness))
    for allowed in (1e-9, 1e9):
        build(scene, E=E, method=method(allowed * stiffness))


@pytest.mark.parametrize("E", [1.0, 2e11])
@pytest.mark.parametrize(
    "ratio, doubtful", [(1e-14, True), (1e-80, True), (1e-3, False)]
)
def test_small_augmentations_solve_as_the_automatic_one_does(scene, ratio, doubtful, E):
    """And are told, as with friction Newton's method fails."""

    def pressed(gamma=None):
        case = build(
            scene,
            E=E,
            bcs=lambda V, s: [
                fix(V, s, "bottom"),
                fix(V, s, "top", value=lambda x: -0.05 * x),
            ],
            method=AugmentedLagrangian(gamma),
        )
        case.solve(SNESSolver)
        return case.contact

    automatic = pressed()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        found = pressed(ratio * automatic.gamma)
    told = [str(w.message) for w in caught if "leave gamma out" in str(w.message)]
    assert len(told) == doubtful
    assert all("as Newton's method may fail with it" in text for text in told)
    force = automatic.resultant().force
    assert np.linalg.norm(found.resultant().force - force) <= 1e-12 * np.linalg.norm(
        force
    )


def test_form_without_stiffness_gives_no_coefficient(scene):
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    c = raymortar.Contact(u, scene.facet_tags, PAIR)
    v = ufl.TestFunction(u.function_space)
    zero = fem.Constant(scene.mesh, 0.0)
    with refused("no automatic gamma: .* 0.0 on the slave, 0.0 on the master"):
        raymortar.NonlinearProblem(zero * ufl.inner(u, v) * ufl.dx, c)

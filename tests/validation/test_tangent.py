"""The tangent is the derivative of the residual at fixed integration points (T1)."""

import itertools

import gathered
import numpy as np
import pytest
import states
from dolfinx import fem
from problems import COMM, fix
from states import CLOSED, NONE, Case, is_quick, name_of
from tangents import COLUMN_TOLERANCE, DECADES, check_columns, slopes, taylor_remainders

from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, Contact, Penalty, Search
from raymortar.core import compat

# Largest steps to try; facets are 0.22 to 1 wide
FIRST_STEPS = 10.0 ** np.array([-2.5, -3.0, -3.5])
CASES = [
    Case(cell, *degrees, method, measure)
    for cell, degrees, method, measure in itertools.product(
        states.CELLS, states.DEGREES, states.METHODS, states.MEASURES
    )
]
SETTINGS = [
    ("single", "open"),
    ("single", "active"),
    ("single", "mixed"),
    ("many", "active"),
    ("many", "mixed"),
    ("overhang", "mixed"),
]


PARAMETERS = [
    pytest.param(c, id=name_of(c), marks=[pytest.mark.quick] if is_quick(c) else [])
    for c in CASES
]


def quiet_taylor(contact, scene, regime, form, seeds=range(40)):
    """Taylor test at the first random state where no point changes branch.

    Points that cross the edge of a master facet or open on the way make a kink, not
    an error of the tangent: the largest step is reduced until none does, and where
    one lies too close to a kink for four decades another state is taken.
    """
    for seed in seeds:
        states.set_state(contact, scene, regime, seed)
        if not states.in_regime(contact, regime):
            continue
        K = states.tangent(contact, form)
        U, R = states.unknowns(contact), states.assembled(contact)
        before = gathered.points(contact)
        direction = np.random.default_rng(seed + 1000).normal(size=U.size)
        for first in FIRST_STEPS:
            steps = first * 10.0 ** -np.arange(0.0, DECADES + 0.1, 0.5)
            contact.update(pair=False)
            remainders = taylor_remainders(contact, K, U, R, direction, steps)
            if remainders is not None:
                states.residual_at(contact, U + first * direction)
                moved = np.abs(gathered.points(contact)["eta"] - before["eta"])
                states.residual_at(contact, U)
                return steps, remainders, moved.max(), K
            states.residual_at(contact, U)
    raise AssertionError("no random state without a kink nearby")


def check_taylor(contact, scene, regime, form, record):
    steps, remainders, moved, K = quiet_taylor(contact, scene, regime, form)
    if not K.any():
        # Nothing touches, so there is no contact force: penalty
        assert regime == "open" and isinstance(contact.method, Penalty)
        assert not remainders.any()
        return
    found = slopes(steps, remainders)
    record("slope", found.tolist())
    record("first_step", steps[0])
    assert moved > 0.1 * steps[0]
    assert np.all(np.abs(found - 2.0) <= 0.05), (found, steps[0])


@pytest.mark.mpi(where=states.sampled)
@pytest.mark.parametrize("kind, regime", SETTINGS)
@pytest.mark.parametrize("case", PARAMETERS)
def test_taylor_remainder_is_quadratic(case, kind, regime, record_property):
    scene = case.scene(kind)
    # Few points where there are many edges to cross
    degree = 2 if kind == "many" and case.dim == 3 else None
    contact = states.make_contact(scene, case, quadrature_degree=degree)
    form = states.mass_form(contact.u.function_space)
    check_taylor(contact, scene, regime, form, record_property)


@pytest.mark.mpi(
    where=lambda cell, degree, method: (cell, degree, method)
    == ("quadrilateral", 1, "vector")
)
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("method", states.METHODS)
def test_residual_is_continuous_where_points_change_facets(cell, method, degree):
    """Kinks are all that the Taylor tests stay away from: no hit is lost at an edge
    of the master, and nothing jumps there."""
    case = Case(cell, degree, 1, method, "current")
    scene, count = case.scene("many"), 200
    contact = states.make_contact(scene, case)
    states.set_state(contact, scene, "active", 1)
    U, R = states.unknowns(contact), states.assembled(contact)
    upper = states.in_upper(scene, contact.u.function_space)
    aside = np.outer(upper, [0.2 / count] * (case.dim - 1) + [0.0]).ravel()
    slide = np.append(aside, np.zeros(U.size - aside.size))
    switches, lost, changes, master = 0, 0, [], gathered.points(contact)["master"]
    for i in range(1, count + 1):
        before, R = R, states.residual_at(contact, U + i * slide)
        changes.append(np.abs(R - before).max())
        points = gathered.points(contact)
        lost += np.count_nonzero(points["status"] == NONE)
        switches += np.count_nonzero(points["master"] != master)
        master = points["master"]
    assert lost == 0
    assert switches >= len(master) // 4
    # A jump would be of the size of R
    assert max(changes) <= 0.02 * np.abs(R).max()


@pytest.mark.mpi(where=states.sampled)
@pytest.mark.parametrize("kind, regime", [("single", "active"), ("overhang", "mixed")])
@pytest.mark.parametrize("case", PARAMETERS)
def test_columns_are_central_differences(case, kind, regime, record_property):
    scene = case.scene(kind)
    contact = states.make_contact(scene, case)
    form = states.mass_form(contact.u.function_space)
    # Leaves the contact at a state with no kink nearby
    quiet_taylor(contact, scene, regime, form)
    worst = check_columns(contact, form)
    record_property("column_error", worst)
    assert worst <= COLUMN_TOLERANCE


# Options that change the points or the law


def graded_gamma(scene):
    """Coefficient that doubles over the blocks."""
    gamma = fem.Function(compat.scalar_space(scene.mesh, 1))
    gamma.interpolate(lambda x: states.GAMMA * (1.0 + 0.5 * x[0]))
    return gamma


VARIANTS = {
    "graded gamma": lambda scene: {"method": AugmentedLagrangian(graded_gamma(scene))},
    "graded penalty": lambda scene: {"method": Penalty(graded_gamma(scene))},
    "linear multiplier": lambda scene: {
        "method": AugmentedLagrangian(states.GAMMA, multiplier="vector", degree=1)
    },
    "subdivided facets": lambda scene: {
        "method": AugmentedLagrangian(states.GAMMA),
        "search": Search(subdivide=True),
    },
}


@pytest.mark.mpi(where=lambda cell, **_: cell == "triangle")
@pytest.mark.parametrize("cell", ["triangle", "hexahedron"])
@pytest.mark.parametrize("variant", VARIANTS)
def test_columns_of_variants(variant, cell, record_property):
    scene = Case(cell, 2, 2).scene("overhang")
    contact = Contact(
        fem.Function(compat.vector_space(scene.mesh, 2)),
        scene.facet_tags,
        [(scene.tags["slave"], scene.tags["master"])],
        tangent="fixed",
        **VARIANTS[variant](scene),
    )
    form = states.mass_form(contact.u.function_space)
    check_taylor(contact, scene, "mixed", form, record_property)
    assert check_columns(contact, form) <= COLUMN_TOLERANCE


# Structure


def flat_touching(cell, degree, method, measure):
    """Blocks of equal facets that touch without gap, stretched, turned and sheared."""
    case = Case(cell, degree, 1, method, measure)
    scene = two_blocks(COMM, case.dim, cell, 2, 2, lower_size=1.0, upper_size=1.0)
    contact = states.make_contact(scene, case)
    rng = np.random.default_rng(5)
    X = states.dof_positions(contact.u.function_space)
    contact.u.x.array[:] = (X @ rng.normal(0.0, 0.2, (case.dim, case.dim))).ravel()
    return contact


@pytest.mark.mpi(
    where=lambda measure, degree, **_: measure == "current" and degree == 2
)
@pytest.mark.parametrize("measure", states.MEASURES)
@pytest.mark.parametrize("method", ["normal", "penalty"])
@pytest.mark.parametrize("degree", [1, 2])
def test_tangent_is_symmetric_where_flat_surfaces_touch(cell, degree, method, measure):
    contact = flat_touching(cell, degree, method, measure)
    K = states.tangent(contact, states.mass_form(contact.u.function_space))
    assert np.all(gathered.points(contact)["status"] == CLOSED)
    assert np.abs(K).max() > 0.0
    assert np.abs(K - K.T).max() <= 1e-13 * np.abs(K).max()


@pytest.mark.mpi(where=lambda measure, **_: measure == "current")
@pytest.mark.parametrize("measure", states.MEASURES)
@pytest.mark.parametrize("degree", [1, 2])
def test_coupling_is_symmetric_under_pressure(cell, degree, measure):
    """With traction the displacement block is not: lam n_s is no gradient of
    lam g unless n_s stays parallel to n_m (F3b). Its coupling to lam is."""
    contact = flat_touching(cell, degree, "normal", measure)
    U, n = states.unknowns(contact), gathered.size_u(contact)
    U[n:] = -np.random.default_rng(1).uniform(0.01, 0.02, U.size - n)
    states.set_unknowns(contact, U)
    K = states.tangent(contact, states.mass_form(contact.u.function_space))
    assert np.abs(K[:n, n:] - K[n:, :n].T).max() <= 1e-13 * np.abs(K[:n, n:]).max()
    assert np.abs(K[:n, :n] - K[:n, :n].T).max() > 1e-3 * np.abs(K[:n, :n]).max()


# Dirichlet conditions and accumulation


def loaded_state(cell, degree, method="normal"):
    """Overhanging blocks in contact, and conditions on both contact surfaces."""
    case = Case(cell, degree, 1, method, "current")
    scene = case.scene("overhang")
    contact = states.make_contact(scene, case)
    states.set_state(contact, scene, "mixed", 2)
    V = contact.u.function_space
    bcs = [
        fix(V, scene, "upper_right", value=lambda x: 0.1 + 0.05 * x),
        fix(V, scene, "lower_right", component=0, value=-0.07),
    ]
    return contact, bcs, states.mass_form(V)


@pytest.mark.mpi(where=lambda degree, **_: degree == 1)
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("method", states.METHODS)
@pytest.mark.parametrize("held", ["upper", "lower"])
def test_constrained_rows_and_columns_are_left_out(cell, degree, method, held):
    """One body held: where both are, multipliers are damped (test_held_nodes.py)."""
    contact, bcs, form = loaded_state(cell, degree, method)
    bcs = bcs[:1] if held == "upper" else bcs[1:]
    K, R = states.tangent(contact, form), states.assembled(contact)
    fixed, _ = states.constraints(contact, bcs)
    assert np.abs(K[fixed][:, ~fixed]).max() > 0.0  # or nothing is tested
    free = np.outer(~fixed, ~fixed)
    same = gathered.assert_same
    same(states.tangent(contact, form, bcs), np.where(free, K, 0.0))
    same(states.assembled(contact, bcs), np.where(fixed, 0.0, R))
    # Without conditions again all is there
    same(states.tangent(contact, form), K)
    same(states.assembled(contact), R)


@pytest.mark.mpi(where=lambda degree, alpha, **_: degree == 1 and alpha < 0.0)
@pytest.mark.parametrize("alpha", [-1.0, 0.5])
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("method", states.METHODS)
def test_lifting_is_the_constrained_columns(cell, degree, method, alpha):
    contact, bcs, form = loaded_state(cell, degree, method)
    K = states.tangent(contact, form)
    fixed, increment = states.constraints(contact, bcs)
    expected = np.where(fixed, 0.0, -alpha * K @ increment)
    b = contact.create_vector()
    b.set(3.0)
    contact.apply_lifting(b, bcs, contact.u.x.array, alpha)
    b.assemble()
    size = np.abs(expected).max()
    assert size > 0.0
    lifted = gathered.vector(contact, b) - 3.0
    np.testing.assert_allclose(lifted, expected, atol=1e-14 * (3.0 + size))


@pytest.mark.mpi
def test_assembly_adds_to_what_is_there(cell):
    contact, _, form = loaded_state(cell, 2)
    A, b = contact.create_matrix(form), contact.create_vector()
    once = []
    for _ in range(2):
        contact.assemble_matrix(A)
        contact.assemble_vector(b)
        A.assemble()
        b.assemble()
        once.append((states.dense(contact, A), gathered.vector(contact, b)))
    np.testing.assert_allclose(once[1][0], 2.0 * once[0][0], rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(once[1][1], 2.0 * once[0][1], rtol=1e-14, atol=1e-15)


@pytest.mark.mpi
def test_casting_again_at_the_same_state_changes_nothing(cell):
    contact, _, _ = loaded_state(cell, 2)
    R = states.assembled(contact)
    gathered.assert_same(states.residual_at(contact, states.unknowns(contact)), R)

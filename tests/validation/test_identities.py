"""Balances and invariances of the contact terms at random states (F1 to F5)."""

import itertools

import gathered
import numpy as np
import pytest
import states
from balances import moments, nodal_forces, nodal_positions
from rotations import rotation
from states import CLOSED, NONE, Case, by_place, is_quick, name_of

ALL = [
    Case(cell, *degrees, method, measure)
    for cell, degrees, method, measure in itertools.product(
        states.CELLS, states.DEGREES, states.METHODS, states.MEASURES
    )
]
KINDS = ("many", "overhang")


def cases(wanted=lambda case: True):
    """Cases as parameters."""
    return [
        pytest.param(c, id=name_of(c), marks=[pytest.mark.quick] if is_quick(c) else [])
        for c in ALL
        if wanted(c)
    ]


def rotates(case):
    """Whether positions are in the displacement's space, so that the body can turn.

    Virtual rotations are not where a linear displacement moves a quadratic geometry.
    """
    return case.degree >= case.geometry_degree


def regimes(case):
    """Regimes in which contact forces act."""
    return states.REGIMES[1 if case.method == "penalty" else 0 :]


def random_contact(case, kind, regime="mixed", seed=0):
    """Contact at a rough random state, neither smooth nor in balance."""
    scene = case.scene(kind)
    contact = states.make_contact(scene, case)
    states.set_state(contact, scene, regime, seed, noise=0.01)
    return contact


# Balances


@pytest.mark.mpi(where=states.sampled)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("case", cases())
def test_forces_are_in_balance(case, kind, record_property):
    for seed, regime in enumerate(regimes(case)):
        forces = nodal_forces(random_contact(case, kind, regime, seed))
        total = np.abs(forces).sum()
        assert total > 0.0
        error = np.abs(forces.sum(axis=0)).max() / total
        record_property("F2", error)
        assert error <= 1e-12


@pytest.mark.mpi(where=states.sampled)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("case", cases(rotates))
def test_moments_are_those_of_tractions_over_the_gap(case, kind, record_property):
    """F3. The residual is minus the force, so its moment is + g n x t."""
    defects = []
    for seed, regime in enumerate(regimes(case)):
        contact = random_contact(case, kind, regime, seed)
        x, r = nodal_positions(contact), nodal_forces(contact)
        p = gathered.points(contact)
        hit = p["status"] != NONE
        arm = p["gap"][:, None] * p["normal"]
        couple = p["weight"][:, None] * moments(arm, p["traction"])
        size = np.abs(moments(x, r)).sum()
        total = moments(x, r).sum(axis=0)
        error = np.abs(total - couple[hit].sum(axis=0)).max() / size
        record_property("F3", error)
        assert error <= 1e-12
        defects.append(np.abs(total).max() / size)
    if case.method == "vector":
        assert max(defects) > 1e-4  # or the identity is trivial
    else:
        assert max(defects) <= 1e-12  # the traction is along n


@pytest.mark.mpi(where=states.sampled)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("case", cases(rotates))
def test_resultant_is_the_sum_of_nodal_forces(case, kind, record_property):
    contact = random_contact(case, kind)
    scene = case.scene(kind)
    upper = states.in_upper(scene, contact.u.function_space)
    x, r = nodal_positions(contact)[upper], nodal_forces(contact)[upper]
    result = contact.resultant(0)
    force_error = np.abs(result.force + r.sum(axis=0)).max() / np.abs(r).sum()
    turn = moments(x, r)
    moment_error = np.abs(result.moment + turn.sum(axis=0)).max() / np.abs(turn).sum()
    record_property("resultant", max(force_error, moment_error))
    assert max(force_error, moment_error) <= 1e-12


# Invariance


def pairing(contact):
    """Pairs of facets, vertices of their segments and their polygons."""
    s = gathered.dictionary(contact.zones[0].cpp.segments())
    return s["slave"], s["master"], s["offsets"], s["xi"]


def polygon_error(before, after):
    """Largest difference of two pairings' polygons, in reference coordinates."""
    for a, b in zip(before[:3], after[:3]):
        np.testing.assert_array_equal(a, b)
    return np.abs(before[3] - after[3]).max()


def turned(contact, Q):
    """Residual blocks turned by Q: what that of the turned state must be."""
    R, n, dim = states.assembled(contact), gathered.size_u(contact), len(Q)
    R[:n] = (R[:n].reshape(-1, dim) @ Q.T).ravel()
    if contact.layout.components == dim:
        R[n:] = (R[n:].reshape(-1, dim) @ Q.T).ravel()
    return R


@pytest.mark.mpi(where=states.sampled)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("case", cases(rotates))
def test_residual_turns_with_the_bodies(case, kind, record_property):
    """R(QU) = Q R(U): no stage knows the axes."""
    contact = random_contact(case, kind)
    Q = rotation(case.dim)
    X = states.dof_positions(contact.u.function_space)
    x = X + contact.u.x.array.reshape(X.shape)
    before, gap = pairing(contact), gathered.points(contact)["gap"]
    expected = turned(contact, Q)
    contact.u.x.array[:] = (x @ Q.T - X).ravel()
    if case.method == "vector":
        lam = contact.multiplier.x.array.reshape(-1, case.dim)
        lam[:] = lam @ Q.T
    contact.update()
    error = np.abs(states.assembled(contact) - expected).max() / np.abs(expected).max()
    gap_error = np.abs(gathered.points(contact)["gap"] - gap).max()
    shape_error = polygon_error(before, pairing(contact))
    record_property("rotation", max(error, gap_error, shape_error))
    assert max(error, gap_error, shape_error) <= 1e-12


@pytest.mark.mpi(where=states.sampled)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("case", cases())
def test_residual_does_not_depend_on_the_place(case, kind, record_property):
    """Both bodies a thousand times their size away: digits are lost, no more."""
    contact = random_contact(case, kind)
    before, gap = pairing(contact), gathered.points(contact)["gap"]
    expected = states.assembled(contact)
    away = 2e3 * np.array([1.0, -0.8, 0.6])[: case.dim]
    u = contact.u.x.array.reshape(-1, case.dim)
    u += away
    contact.update()
    error = np.abs(states.assembled(contact) - expected).max() / np.abs(expected).max()
    gap_error = np.abs(gathered.points(contact)["gap"] - gap).max()
    shape_error = polygon_error(before, pairing(contact))
    record_property("translation", max(error, gap_error, shape_error))
    assert max(error, gap_error, shape_error) <= 1e-9


SCALES = (1e-9, 1e-6, 1e-3, 1e3, 1e6)


def in_moved_scene(contact, case, scene, Q, eta):
    """The state of a contact in a scene turned by Q and eta times as large."""
    moved = states.make_contact(scene, case, states.GAMMA / eta)
    u = contact.u.x.array.reshape(-1, case.dim)
    moved.u.x.array[:] = (eta * u @ Q.T).ravel()
    if case.method != "penalty":
        lam = contact.multiplier.x.array.reshape(-1, contact.layout.components)
        moved.multiplier.x.array[:] = (lam @ Q.T if lam.shape[1] > 1 else lam).ravel()
    moved.update()
    return moved


@pytest.mark.mpi(where=states.sampled)
@pytest.mark.parametrize("case", cases(lambda c: c.measure == "current"))
def test_residual_scales_with_the_unit_of_length(case, record_property):
    """F5: lengths times eta, gamma over eta, same tractions: forces times
    eta^(d - 1), and not one decision of the pairing changes."""
    contact = random_contact(case, "overhang")
    before, expected = pairing(contact), states.assembled(contact)
    statuses = gathered.points(contact)["status"]
    for eta in SCALES:
        scene = states.moved_scene("overhang", case, eta=eta)
        scaled = in_moved_scene(contact, case, scene, np.eye(case.dim), eta)
        np.testing.assert_array_equal(gathered.points(scaled)["status"], statuses)
        shape_error = polygon_error(before, pairing(scaled))
        R = states.assembled(scaled) / eta ** (case.dim - 1)
        error = np.abs(R - expected).max() / np.abs(expected).max()
        record_property("scale_polygons", shape_error)
        record_property("scale", error)
        assert shape_error <= 1e-12 and error <= 1e-10


@pytest.mark.mpi(where=states.sampled)
@pytest.mark.parametrize("case", cases(lambda c: c.geometry_degree == 2))
def test_residual_turns_with_the_reference(case, record_property):
    """F4: the whole model turned, mesh and displacement."""
    contact, Q = random_contact(case, "overhang"), rotation(case.dim)
    scene = states.moved_scene("overhang", case, Q)
    moved = in_moved_scene(contact, case, scene, Q, 1.0)
    expected = turned(contact, Q)
    error = np.abs(states.assembled(moved) - expected).max() / np.abs(expected).max()
    shape_error = polygon_error(pairing(contact), pairing(moved))
    record_property("frame", max(error, shape_error))
    assert max(error, shape_error) <= 1e-12


def copy_multiplier(contact, other):
    """Multiplier of one contact to another with the dofs elsewhere, by place.

    Nodes off the slave surface are of no account.
    """
    x, y = (states.dof_positions(c.multiplier.function_space) for c in (contact, other))
    n = contact.layout.components
    lam, new = (c.multiplier.x.array.reshape(-1, n) for c in (contact, other))
    for i in contact.zones[0].multiplier_nodes:
        new[np.linalg.norm(y - x[i], axis=1) < 1e-10] = lam[i]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("method", ["vector", "penalty"])
def test_residual_does_not_depend_on_numbering(
    cell, degree, method, seed, record_property
):
    """F6: cells, nodes and the order of vertices within cells shuffled."""
    case = Case(cell, degree, 1, method, "current")
    contact = random_contact(case, "overhang")
    scene = states.renumbered(case.scene("overhang"), seed)
    other = states.make_contact(scene, case)
    # Bodies touch in the reference, so that dofs are told apart by body first
    where = []
    for c, s in ((contact, case.scene("overhang")), (other, scene)):
        V = c.u.function_space
        x = 10.0 * np.ones((len(states.dof_positions(V)), case.dim + 1))
        x[:, 1:] = states.dof_positions(V)
        x[states.upper_dofs(s, V), 0] = 0.0
        where.append(x)
    dofs = by_place(*where)
    u = contact.u.x.array.reshape(-1, case.dim)
    other.u.x.array[:] = u[dofs].ravel()
    if method == "vector":
        copy_multiplier(contact, other)
    other.update()
    for key in ("pairs", "segments", "points", "hits"):
        assert getattr(contact.statistics, key) == getattr(other.statistics, key)
    forces = nodal_forces(contact)[dofs]
    errors = [np.abs(nodal_forces(other) - forces).max() / np.abs(forces).max()]
    # Points and multipliers are numbered differently: only as sets
    for values in (
        [gathered.points(c)["gap"] for c in (contact, other)],
        [states.assembled(c)[gathered.size_u(c) :] for c in (contact, other)],
    ):
        one, two = map(np.sort, values)
        size = np.abs(one).max(initial=np.finfo(float).tiny)
        errors.append(np.abs(one - two).max(initial=0.0) / size)
    record_property("numbering", max(errors))
    assert max(errors) <= 1e-10


# Energy


def parallel_surfaces(cell, degree):
    """Overlapping flat blocks, turned as one, in uniform penetration."""
    case = Case(cell, degree, 1, "penalty")
    scene = case.scene("overhang", flat=True)
    contact = states.make_contact(scene, case)
    V = contact.u.function_space
    X = states.dof_positions(V)
    x = X.copy()
    x[states.upper_dofs(scene, V), -1] -= 0.05
    contact.u.x.array[:] = (x @ rotation(case.dim).T - X).ravel()
    contact.update()
    return contact


def penalty_energy(contact):
    """1/2 gamma int min(0, g)^2 at the present points."""
    p = gathered.points(contact)
    hit = p["status"] != NONE
    g = np.minimum(0.0, p["gap"][hit])
    return 0.5 * states.GAMMA * float(p["weight"][hit] @ g**2)


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
def test_penalty_is_the_gradient_of_an_energy(cell, degree, record_property):
    """Where n_m = -n_s; elsewhere gamma g n_s is the gradient of nothing."""
    contact = parallel_surfaces(cell, degree)
    U, R = states.unknowns(contact), states.assembled(contact)
    assert np.all(np.isin(gathered.points(contact)["status"], [NONE, CLOSED]))
    rng, h = np.random.default_rng(4), 1e-6
    for _ in range(5):
        d = rng.normal(size=U.size)
        energies = []
        for step in (h, -h):
            states.residual_at(contact, U + step * d)
            energies.append(penalty_energy(contact))
        slope = (energies[0] - energies[1]) / (2.0 * h)
        size = np.abs(R) @ np.abs(d)
        record_property("energy", abs(slope - R @ d) / size)
        assert abs(slope - R @ d) <= 1e-9 * size

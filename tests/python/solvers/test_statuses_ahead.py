"""Iterations that end with the statuses of nodes where their linear step ends."""

from unittest import mock

import numpy as np
import pytest
import slender
from ahead import without
from pathing import take
from problems import COMM
from slender import bent, leaves
from touching import Touching, require_few_iterations_of_leaves

import raymortar
from raymortar.solvers import statuses_ahead as module
from raymortar.solvers.correcting import correcting
from raymortar.solvers.rows_of_nodes import RowsOfNodes
from raymortar.solvers.statuses_ahead import StatusesAhead

AT_NODES = raymortar.AugmentedLagrangian(condition="nodes")
NONE = np.empty(0)


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_rows_measure_gaps_and_slips(mu):
    """Each is an integral times gamma; with friction along n, less slips across it."""
    of = Touching(mu, AT_NODES)
    nodes = of.zone.cpp.nodes()
    areas, _ = of.problem.contact.system.cpp.node_weights(0)
    areas = np.asarray(areas)[of.zone.multiplier_nodes]
    set_changes(of, NONE, True)
    found = of.residual().reshape(-1, of.components) / of.part.gamma_scale
    exact = nodes["gap"][:, None] * nodes["normal"] - nodes["slip"]
    if of.components == 1:
        exact = nodes["gap"][:, None]
    assert worst_of(found - areas[:, None] * exact) <= 1e-13 * worst_of(areas * 5.0)
    # Their tangent is that of these integrals
    rng, size = np.random.default_rng(3), len(of.x.array)
    d = 1e-3 * rng.standard_normal(size)
    d[of.problem.contact.system.layout.n_u :] = 0.0
    fixed = of.problem.constrained
    d[: len(fixed)][fixed] = 0.0
    slope, x = of.matrix() @ of.rows.in_columns(d), of.x.array.copy()
    ends = []
    for sign in (1.0, -1.0):
        of.x.array[:] = x + sign * 1e-4 * d
        of.problem.form(of.x)
        ends.append(of.residual())
    difference = (ends[0] - ends[1]) / 2e-4
    assert worst_of(slope - difference) <= 1e-5 * worst_of(slope)


def set_changes(of, values, measures=False):
    of.zone.cpp.set_node_changes(np.ravel(values), measures)


def worst_of(values):
    return float(abs(values).max())


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_the_law_is_exact_where_it_is_linearised(mu):
    """It is linear between its kinks: rows linearised at other multipliers have, in
    that step, the residual that these multipliers have."""
    of = Touching(mu, AT_NODES)
    nodes, scalar = of.zone.cpp.nodes(), of.components == 1
    lam = of.part.surfaces.multiplier.x.array.reshape(-1, of.components)
    lam, n = lam[of.zone.multiplier_nodes], nodes["normal"]
    along = lam[:, 0] if scalar else (lam * n).sum(axis=1)
    # Every third node opens or closes; those that are closed slip to and fro
    change = -1.5 * (along + nodes["gamma"] * nodes["gap"])[:, None] * n
    change[np.arange(len(change)) % 3 > 0] = 0.0
    across = np.column_stack([-n[:, 1], n[:, 0]])
    change += np.linspace(-1.0, 1.0, len(change))[:, None] * worst_of(lam) * across
    if scalar:
        change = (change * n).sum(axis=1, keepdims=True)
    before = of.zone.cpp.nodes()["status"]
    set_changes(of, np.hstack([change, np.zeros((len(change), 2))]))
    assert (of.zone.cpp.nodes()["status"] != before).sum() > 5
    step = np.zeros(len(of.x.array))
    step[of.rows.local] = change.ravel() / of.part.gamma_scale
    linear = of.linear(step)
    set_changes(of, NONE)
    of.x.array[:] += step
    of.problem.form(of.x)
    assert worst_of(linear - of.residual()) <= 1e-10 * worst_of(linear)


def test_a_nearly_linear_step_takes_few_iterations():
    """Leaves open along nearly all of their length. In the linear step, which a small
    load makes of the whole, all of their nodes have their statuses at once."""
    make = {"share": 1e-3, "method": AT_NODES}
    with without():
        plain = take(leaves(3, **make))
    path = leaves(3, **make)
    found = take(path)
    assert found.arrived and plain.iterations >= 8
    assert found.iterations <= 3


@pytest.mark.mpi
@pytest.mark.quick
def test_leaves_take_few_iterations():
    require_few_iterations_of_leaves(AT_NODES, rel=1e-9)


@pytest.mark.mpi
def test_friction_takes_fewer_iterations_and_ends_the_same():
    with without():
        plain = take(one := bent(100, 0.3, method=AT_NODES))
    found = take(other := bent(100, 0.3, method=AT_NODES))
    assert found.arrived and found.iterations <= 20 < plain.iterations
    np.testing.assert_allclose(other.result(), one.result(), atol=1e-9)


def test_each_iterate_is_in_the_history_once():
    path = leaves(2, 1.0, 4, method=AT_NODES)
    solver = raymortar.SNESSolver(path.problem)
    path.apply(0.25)
    with correcting(solver):
        iterations, _ = solver.solve()
    assert len(path.problem.history) == iterations + 1
    assert solver.on_iterate is None


@pytest.mark.parametrize("most", [1, 40])
def test_too_many_columns_are_left_out(most, monkeypatch):
    monkeypatch.setattr(module, "MOST_COLUMNS", most)
    found = take(path := leaves(2, 1.0, 2, method=AT_NODES))
    assert found.arrived
    assert path.result() == pytest.approx(0.99497, rel=1e-3)


def iterations_of(**options):
    """Of a strip with friction, step by step."""
    found = take(bent(60, cells=(40, 2), **options))
    assert found.arrived
    return [step.iterations for step in found.steps]


@pytest.mark.parametrize("fault", ["singular", "worse"])
def test_steps_that_lead_nowhere_are_left_out(fault, monkeypatch):
    """Those with which nothing holds a body, and iterates further from balance."""
    law = {"mu": 0.3, "method": AT_NODES}
    with without():
        plain = iterations_of(**law)
    assert sum(iterations_of(**law)) < sum(plain)
    if fault == "worse":
        monkeypatch.setattr(module, "WORSE", 0.0)
    else:

        def singular(*_):
            raise np.linalg.LinAlgError("Singular matrix")

        monkeypatch.setattr(np.linalg, "solve", singular)
    assert iterations_of(**law) == plain


def test_a_law_of_the_users_takes_the_iterations_of_coulombs():
    """It is known at one pressure and slip, and linear around them."""

    def one(law):
        with mock.patch.object(slender, "coulomb", lambda mu: law):
            return iterations_of(mu=0.3, method=AT_NODES)

    coulomb = one(raymortar.Coulomb(0.3))
    assert one(raymortar.Friction(lambda p, rate: 0.3 * p)) == coulomb


@pytest.mark.parametrize("condition", ["points", "nodes", None])
def test_penalties_are_left_alone(condition):
    """Laws with a multiplier are not; None stands for a penalty."""
    method = raymortar.Penalty()
    if condition is not None:
        method = raymortar.AugmentedLagrangian(condition=condition)
    problem = bent(20, cells=(20, 2), method=method).problem
    ahead = StatusesAhead(raymortar.SNESSolver(problem))
    assert bool(ahead) == (condition is not None)


def test_an_error_gives_the_law_back(monkeypatch):
    """Laws are linearised at the present state whatever happens."""
    path = leaves(2, 1.0, 1, method=AT_NODES)
    solver = raymortar.SNESSolver(path.problem)
    path.apply(1.0)

    def fails(*_):
        raise ZeroDivisionError("of a column")

    monkeypatch.setattr(module._Step, "_add", fails)
    with correcting(solver), pytest.raises(ZeroDivisionError, match="of a column"):
        solver.solve()
    assert solver.on_iterate is None
    monkeypatch.undo()
    again = take(path)
    assert again.arrived
    other = leaves(2, 1.0, 1, method=AT_NODES)
    take(other)
    assert path.result() == pytest.approx(other.result(), rel=1e-9)


@pytest.mark.mpi
def test_rows_of_all_ranks_are_joined():
    path = bent(20, cells=(20, 2), method=AT_NODES)
    A = path.problem.create_matrix()
    A.shift(2.0)
    (part,) = path.problem.contact.parts
    known = [
        part.layout.multiplier_rows[zone.multiplier_nodes][:, None]
        for zone in part.zones
    ]
    rows = RowsOfNodes(known, A)
    assert len(rows.all) == COMM.allreduce(len(rows.local)) == 41
    first, _ = A.getOwnershipRange()
    own = rows.local + first
    np.testing.assert_array_equal(rows.joined(own), rows.all)
    np.testing.assert_array_equal(rows.own(rows.all), own)
    here = np.concatenate([one.ravel() for one in known])
    np.testing.assert_array_equal(rows.spread(here, here), rows.all)
    values = np.arange(*A.getOwnershipRange(), dtype=float)
    met = rows.in_columns(values)
    np.testing.assert_array_equal(rows.of_columns(met), rows.all)
    product = rows.matrix(rows.entries(A)) @ met
    np.testing.assert_array_equal(product, 2.0 * own)
    np.testing.assert_array_equal(rows.largest(rows.entries(A)), 2.0)

"""Iterations that end with the statuses of points where their linear step ends."""

from unittest import mock

import numpy as np
import pytest
import slender
from ahead import without
from pathing import take
from pressed_blocks import blocks
from problems import worst
from slender import bent
from touching import Touching, require_few_iterations_of_leaves

import raymortar
from raymortar.core.interface.point_results import CLOSED, OPEN
from raymortar.core.terms import Term
from raymortar.solvers import laws_ahead
from raymortar.solvers.correcting import correcting
from raymortar.solvers.statuses_ahead import StatusesAhead

AT_POINTS = raymortar.AugmentedLagrangian(condition="points")


def set_changes(of, values):
    of.zone.cpp.set_point_changes(np.ravel(values))


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_the_law_is_exact_where_it_is_linearised(mu):
    """It is linear between its kinks: rows linearised at other multipliers have, in
    that step, the residual that these multipliers have."""
    of = Touching(mu, AT_POINTS)
    before, x = of.zone.cpp.points(), of.x.array.copy()
    # Points open, close, stick and slip
    strength = worst(before["traction"]) + worst(before["gamma"] * before["gap"])
    step, rng = np.zeros(len(x)), np.random.default_rng(3)
    change = rng.uniform(-2.0, 2.0, len(of.rows.local)) * strength
    step[of.rows.local] = change / of.part.gamma_scale
    of.x.array[:] += step
    of.problem.form(of.x)
    there, exact = of.zone.cpp.points(), of.residual()
    assert (there["status"] != before["status"]).sum() > 5
    of.x.array[:] = x
    of.problem.form(of.x)
    traction = there["traction"] - before["traction"]
    set_changes(of, np.hstack([traction, np.zeros_like(traction)]))
    np.testing.assert_array_equal(of.zone.cpp.points()["status"], there["status"])
    assert worst(of.linear(step) - exact) <= 1e-10 * worst(exact)
    set_changes(of, np.empty(0))
    assert worst(of.linear(step) - exact) > 1e-3 * worst(exact)


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_no_change_is_the_present_state(mu):
    of = Touching(mu, AT_POINTS)
    plain, rows = of.residual(), of.matrix().toarray()
    set_changes(of, np.zeros((len(of.zone.cpp.points()["gap"]), 4)))
    assert worst(of.residual() - plain) <= 1e-14 * worst(plain)
    assert worst(of.matrix().toarray() - rows) <= 1e-14 * worst(rows)


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_rays_tell_the_change_of_gaps_and_slips(mu):
    """A body that goes up and sideways by a small amount: they change in proportion."""
    of = Touching(mu, AT_POINTS)
    here, x, way = of.zone.cpp.points(), of.x.array.copy(), np.array((1e-4, 2e-4))
    n_u, hit = of.problem.contact.system.layout.n_u, here["status"] >= CLOSED
    ends = []
    for share in (laws_ahead.SHARE, 1.0):
        of.x.array[:n_u] = x[:n_u] + share * np.tile(way, n_u // 2)
        of.problem.form(of.x)
        ends.append(of.zone.cpp.points())
    changes, n = laws_ahead._changes(here, ends[0]), here["contact_normal"]
    gap = ends[1]["gap"] - here["gap"]
    along = np.einsum("qi,qi->q", changes[:, 2:], n)
    np.testing.assert_allclose(along[hit], gap[hit], rtol=1e-2)
    slip = (along[:, None] * n - changes[:, 2:])[hit]
    if mu:
        exact = (ends[1]["slip"] - here["slip"])[hit]
        exact -= np.einsum("qi,qi->q", exact, n[hit])[:, None] * n[hit]
        np.testing.assert_allclose(slip, exact, atol=1e-2 * worst(exact))
        assert worst(exact) > 5e-5
    else:
        assert worst(slip) <= 1e-10 * worst(gap)
    assert not changes[here["status"] < OPEN].any()


@pytest.mark.mpi
@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_strips_take_few_iterations_and_end_the_same(mu):
    with without():
        plain = take(one := bent(100, mu, method=AT_POINTS))
    found = take(other := bent(100, mu, method=AT_POINTS))
    assert found.arrived and found.iterations <= 5 * 4 < plain.iterations
    np.testing.assert_allclose(other.result(), one.result(), atol=1e-7)


@pytest.mark.mpi
@pytest.mark.quick
def test_leaves_take_few_iterations():
    require_few_iterations_of_leaves(AT_POINTS, rel=1e-7)


def iterations_of(law):
    """Of a strip with friction, step by step."""
    with mock.patch.object(slender, "coulomb", lambda mu: law):
        found = take(bent(60, 0.3, cells=(40, 2), method=AT_POINTS))
    assert found.arrived
    return [step.iterations for step in found.steps]


def test_laws_of_the_users_are_left_alone():
    """They are known at points that are closed where a step begins."""
    own = raymortar.Friction(lambda p, rate: 0.3 * p)
    with without():
        plain = iterations_of(own)
    assert iterations_of(own) == plain
    assert sum(iterations_of(raymortar.Coulomb(0.3))) < sum(plain)


class Far(Term):
    leads_far = True


@pytest.mark.parametrize("term", [Term, Far])
def test_solves_that_lead_far_are_left_alone(term):
    def taken(*terms):
        path = bent(60, 0.3, cells=(40, 2), method=AT_POINTS)
        path.problem.terms.extend(terms)
        solver = raymortar.SNESSolver(path.problem)
        path.apply(0.25)
        with correcting(solver):
            return solver.solve()[0]

    with without():
        plain = taken()
    assert (taken(term()) == plain) == term.leads_far


@pytest.mark.parametrize("error", [None, raymortar.ContactError])
def test_rays_that_cannot_be_cast_leave_newtons_iterate(error, monkeypatch):
    path = bent(60, 0.3, cells=(40, 2), method=AT_POINTS)
    with without():
        plain = take(bent(60, 0.3, cells=(40, 2), method=AT_POINTS))
    if error is not None:

        def fails(*_):
            raise error("nothing is there")

        monkeypatch.setattr(laws_ahead.PointsAhead, "linearise", fails)
    found = take(path)
    assert found.arrived
    assert (found.iterations == plain.iterations) == (error is not None)


def test_nodes_and_points_in_one_problem_are_left_alone():
    """The rows of points change with rays, those of nodes with their integrals."""
    path = bent(20, cells=(20, 2), method=AT_POINTS)
    contacts = path.problem.contact.contacts
    assert StatusesAhead(raymortar.SNESSolver(path.problem))
    at_nodes = raymortar.AugmentedLagrangian(condition="nodes")
    other = bent(20, cells=(20, 2), method=at_nodes).problem.contact
    both = mock.Mock(constraints=None)
    both.contact.contacts = [*contacts, *other.contacts]
    both.contact.parts = [*path.problem.contact.parts, *other.parts]
    assert laws_ahead.laws_ahead(both) is None


@pytest.mark.parametrize(
    "cell, degree, solves", [("tetrahedron", 2, 0), ("hexahedron", 1, 1)]
)
def test_a_step_that_is_nearly_right_is_not_solved_again(cell, degree, solves):
    """Residuals fall by a factor above 100 in both, and one status changes, or twelve."""
    friction = raymortar.Coulomb(0.3)
    problem = blocks(cell, degree, friction=friction, method=AT_POINTS).problem
    solver = raymortar.NewtonSolver(problem)
    spy = mock.patch.object(
        StatusesAhead, "_step", autospec=True, side_effect=StatusesAhead._step
    )
    with correcting(solver), spy as step:
        iterations, _ = solver.solve()
    assert step.call_count == solves
    assert iterations == 1

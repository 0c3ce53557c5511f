"""Soft stick: fronts of slip that turns round, and when it acts."""

from mpi4py import MPI

import numpy as np
import pytest
from arriving import loose_stack, stacked
from pathing import take
from slender import belt, bent, leaves

import raymortar
from raymortar.paths.soft_start import SoftStart
from raymortar.paths.soft_stick import SoftStick
from raymortar.viscous import stabilization

LAW = {"method": raymortar.AugmentedLagrangian(condition="nodes")}


def soft_sticks(problem):
    """Number of terms that soften the tangents of a problem."""
    return sum(isinstance(term, SoftStick) for term in problem.terms)


def exact(monkeypatch):
    """No share of slip in the tangents of stick."""
    monkeypatch.setattr(SoftStick, "_softened", lambda self: [])


@pytest.mark.parametrize("cells", [134, 268])
def test_a_belt_whose_slip_turns_round_takes_few_iterations(cells):
    """29 and 31 iterations in the fifth step with exact stick."""
    path = belt(cells, **LAW)
    found = take(path)
    assert found.arrived and found.halvings == 0
    assert max(step.tangents for step in found.steps) <= 12
    assert found.ways == {"full": 28}
    # exp(mu pi) less what the thickness and bending take
    assert path.result()[0] == pytest.approx(np.exp(0.3 * np.pi), rel=0.006)


def test_a_belt_with_a_law_at_points_takes_few_iterations():
    """685 before: solves start from one with a soft coefficient and softened tangents."""
    path = belt(134)
    found = take(path)
    assert found.arrived and found.halvings == 0
    assert found.tangents <= 8 * 28
    assert path.result()[0] == pytest.approx(np.exp(0.3 * np.pi), rel=0.006)


@pytest.mark.quick
@pytest.mark.mpi
def test_it_changes_the_way_and_not_the_answer(monkeypatch):
    """A short coarse belt, tightened and pulled back a little."""
    found = []
    for prepare in (lambda _: None, exact):
        prepare(monkeypatch)
        path = belt(40, pull=1e-3, steps=(1, 2), **LAW)
        taken = take(path, extrapolate=False)
        assert taken.arrived and taken.halvings == 0
        found.append((path.result()[0], taken.tangents))
    (soft, fewer), (plain, more) = found
    assert soft == pytest.approx(plain, rel=1e-8)
    assert fewer < more


@pytest.mark.quick
def test_it_adds_a_spring_along_the_surface_at_nodes_that_stick():
    """Symmetric, negative, of the multiplier alone, halved each time."""
    path = belt(24, steps=(1, 1), **LAW)
    problem = path.problem
    assert take(path).arrived
    path.apply(1.0)
    x, A = problem.start(), problem.create_matrix()
    problem.J(x, A)
    plain = A.convert("dense").getDenseArray().copy()
    found = []
    soft = SoftStick(problem)
    with soft.acting():
        for _ in range(2):
            soft._last = soft._last * 0.0 - 1.0  # as if nodes had changed
            problem.J(x, A)
            found.append(A.convert("dense").getDenseArray() - plain)
    n, scale = problem.contact.layout.n, np.abs(plain).max()
    added = found[0][n:, n:]
    assert not found[0][:n].any() and not found[0][:, :n].any()
    assert np.abs(added - added.T).max() < 1e-12 * scale
    assert np.linalg.eigvalsh(added).max() < 1e-9 * np.abs(added).max()
    # One direction of two at each node that sticks
    status = problem.contact.zones[0].cpp.nodes()["status"]
    sticks = int((status == raymortar.results.Status.STICK).sum())
    assert sticks > 0
    assert np.linalg.matrix_rank(added, tol=1e-9 * np.abs(added).max()) == sticks
    assert np.abs(found[1] - 0.5 * found[0]).max() < 1e-9 * np.abs(added).max()
    problem.J(x, A)
    assert np.array_equal(A.convert("dense").getDenseArray(), plain)


@pytest.mark.parametrize("slenderness, most", [(20, 9), (60, 12)])
def test_a_strip_peels_off_the_tool_in_few_iterations(slenderness, most):
    """17 in the first step with exact tangents, one for each facet."""
    path = bent(slenderness, 0.3, **LAW)
    found = take(path)
    assert found.arrived and found.ways == {"full": 4}
    assert found.steps[0].tangents <= most
    assert found.tangents <= 4 * 5
    assert path.result()[1] == pytest.approx(
        {20: 1.44643677, 60: 0.345861087}[slenderness], rel=1e-7
    )


@pytest.mark.quick
@pytest.mark.parametrize(
    "make", [lambda **law: bent(20, **law), lambda **law: leaves(2, **law)]
)
def test_nodes_that_come_into_contact_are_soft_across_the_surface(make):
    """Symmetric, negative, of the multiplier alone, less each time, then none."""
    path = make(**LAW)
    problem = path.problem
    path.apply(0.2)
    x, A = problem.start(), problem.create_matrix()
    problem.J(x, A)
    plain = A.convert("dense").getDenseArray().copy()
    found, soft = [], SoftStick(problem)
    with soft.acting(opens=True):
        for _ in range(20):
            soft._last = soft._last * 0.0 - 1.0  # as if nodes had changed
            problem.J(x, A)
            found.append(A.convert("dense").getDenseArray() - plain)
    n = problem.contact.layout.n
    added = found[0][n:, n:]
    size = np.abs(added).max()
    assert not found[0][:n].any() and not found[0][:, :n].any()
    assert np.abs(added - added.T).max() < 1e-12 * size
    assert np.linalg.eigvalsh(added).max() < 1e-9 * size
    status = np.concatenate([z.cpp.nodes()["status"] for z in problem.contact.zones])
    closed = int((status >= raymortar.results.Status.STICK).sum())
    assert closed > 0 and np.linalg.matrix_rank(added, tol=1e-9 * size) == closed
    assert np.abs(found[1] - 0.3 * found[0]).max() < 1e-9 * size
    assert not found[-1].any()
    with soft.acting():  # without friction there is nothing else to soften
        assert soft_sticks(problem) == 0


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("opens", [False, True])
def test_points_with_a_soft_gamma_soften_their_nodes(opens):
    """Symmetric, negative, of the multiplier alone; none with a stiff gamma."""
    path = belt(24, steps=(1, 1))
    problem = path.problem
    start = SoftStart(problem)
    changed = start.stay()
    if not opens:
        assert take(path).arrived
    path.apply(0.5 if opens else 1.0)
    x, A = problem.start(), problem.create_matrix()
    problem.J(x, A)
    plain, added = A.copy(), []
    soft = SoftStick(problem)
    with soft.acting(opens):
        problem.J(x, A)
    plain.aypx(-1.0, A)  # what is added
    rows, columns = problem.contact.layout.n, plain.getOwnershipRange()
    begin = columns[0]
    for row in range(*columns):
        at, values = plain.getRow(row)
        if row - begin < rows:
            assert not values.any()
        added.append(values.sum() if len(values) else 0.0)
    size = problem.comm.allreduce(np.abs(plain.norm()), op=MPI.MAX)
    assert size > 0.0
    other = plain.copy()
    other.transpose()
    plain.axpy(-1.0, other)
    assert plain.norm() < 1e-12 * size
    assert problem.comm.allreduce(sum(added)) < 0.0
    start.undo(changed)
    with soft.acting(opens):
        assert soft_sticks(problem) == 0


@pytest.mark.quick
def test_residuals_that_come_again_shorten_the_step():
    """Three times in a solve, at points with a soft gamma."""
    problem = belt(24).problem
    start = SoftStart(problem)
    start.stay()
    x, A = problem.start(), problem.create_matrix()
    problem.J(x, A)
    plain, norms = A.norm(), problem.convergence.norms
    soft, cycle = SoftStick(problem), [3.0, 1.0, 2.0]
    monotone = [2.0**-k for k in range(8)]
    with soft.acting():
        soft._count = 20  # no share is left
        for before, factor in [
            (monotone, 1.0),
            (cycle + [3.1, 1.1, 2.1], 1.0),
            (cycle + cycle, 2.0),
            (2 * [5.0] + cycle + [3.01, 1.005, 2.005], 4.0),
            (cycle + cycle, 8.0),
            (cycle + cycle, 1.0),
        ]:
            norms[:] = before
            problem.J(x, A)
            assert A.norm() == pytest.approx(factor * plain, rel=1e-12)
            assert bool(norms) == (factor == 1.0)


@pytest.mark.quick
def test_it_leaves_compact_bodies_and_laws_at_points_alone():
    problem = stacked(3).problem
    with SoftStick(problem).acting():
        assert soft_sticks(problem) == 0
    for law in ({}, LAW):
        problem = belt(24, **law).problem
        with SoftStick(problem).acting():
            assert soft_sticks(problem) == bool(law)
        assert soft_sticks(problem) == 0


@pytest.mark.quick
def test_viscous_forces_give_up_where_they_cost_too_much(monkeypatch, unlanded):
    """The message of the failed step says so."""
    monkeypatch.setattr(stabilization, "MOST_TANGENTS", 1)
    path = loose_stack()
    with pytest.raises(raymortar.ConvergenceError, match="=True goes on for longer"):
        take(path, max_halvings=0)
    assert path.problem.tangents < 100
    assert take(loose_stack(), stabilize=True).arrived

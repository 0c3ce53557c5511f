"""Bodies that nothing touches land without a tangent."""

import numpy as np
import pytest
from arriving import loose_stack
from load_paths import body_above, nodal, resting
from pathing import take
from problems import worst

from raymortar import ConvergenceError, Coulomb
from raymortar.viscous.landing import Landing
from raymortar.viscous.stabilization import Stabilization

GAP, LIMIT, SHARE = 0.37, 0.1, 0.5


def falling(cell, gap=GAP, share=SHARE, **options):
    """Landing of a block under a share of its weight.

    Returns
    -------
    problem, Landing, whether a local node is of the block, load along its axis (force).
    """
    problem, steps, weight = resting(cell, gap, **options)
    steps.apply(share)
    of, block = problem.contact.system.bodies, body_above(problem.contact, 0)
    fall = Landing(problem, np.arange(of.count) == block, LIMIT)
    return problem, fall, of.dofs == block, share * weight


@pytest.mark.mpi
def test_a_body_moves_as_a_rigid_one_until_its_load_is_borne(cell):
    problem, fall, is_block, load = falling(cell)
    way = fall.land() / load
    u, points = nodal(problem), problem.contact.points()
    assert GAP < way < GAP + LIMIT and problem.tangents == 0
    assert worst(u[~is_block]) == 0.0 and worst(u[is_block, :-1]) <= 1e-12
    assert worst(u[is_block, -1] + way) <= 1e-12
    springs = points["weight"] * points["gamma"]
    deep = np.maximum(-points["gap"], 0.0)
    mine = np.array([springs @ deep, springs[deep > 0.0].sum()])
    borne, stiffness = problem.comm.allreduce(mine)
    # As near as the halves of the last move come
    assert load <= borne <= load + stiffness * LIMIT / 1000.0


@pytest.mark.mpi
def test_a_fall_is_no_slip():
    problem, fall, *_ = falling("quadrilateral", friction=Coulomb(0.5), aside=0.3)
    fall.land()
    problem.contact.update()
    points = problem.contact.points()
    assert points["gap"].min(initial=0.0) < 0.0 or not len(points["gap"])
    # Some partitions round the places of slave and master otherwise
    assert worst(points["slip"]) <= 1e-15
    assert np.array_equal(problem.contact.states.u_old, problem.contact.u.x.array)
    assert worst(nodal(problem)[:, 0]) > 0.2 * GAP


@pytest.mark.mpi
@pytest.mark.parametrize(
    "gap, share, sinks", [(GAP, 0.0, 0.0), (50.0, SHARE, 0.0), (GAP, SHARE, 0.1)]
)
def test_a_body_without_a_load_or_a_floor_at_rest_stays(gap, share, sinks):
    """Where 200 moves do not suffice, it is back where it was."""
    problem, fall, *_ = falling("triangle", gap, share, sinks=sinks)
    assert fall.land() is None
    assert worst(nodal(problem)) == 0.0


@pytest.mark.mpi
@pytest.mark.parametrize("gap", [0.1, 5.0])
def test_a_path_takes_no_more_tangents_from_high_above(gap):
    problem, steps, weight = resting("quadrilateral", gap, Coulomb(0.3), stabilize=True)
    steps.run()
    assert problem.tangents <= 6
    assert abs(problem.contact.resultant(0).force[-1] - weight) <= 1e-9 * weight


def mean_lifts(path):
    """Mean displacements along y of the bodies of a stack."""
    problem = path.problem
    of, u = problem.contact.system.bodies.dofs, nodal(problem)[:, 1]
    owned = problem.contact.u.function_space.dofmap.index_map.size_local
    sums = [np.bincount(of[:owned], one[:owned], 3) for one in (u, np.ones(len(u)))]
    total = problem.comm.allreduce(np.array(sums))
    return total[0] / total[1]


@pytest.mark.mpi
def test_bodies_that_bear_each_other_fall_as_one():
    """A weight on the upper one of two loose bodies: the lower one has none."""
    path = loose_stack(gap=0.1, steps=2, loaded="2")
    found = take(path)
    assert found.arrived and found.tangents <= 6
    forces = path.result()
    assert worst(forces[:, 1] - forces[0, 1]) <= 1e-9 * abs(forces[0, 1])


@pytest.mark.mpi
def test_a_fall_ends_at_a_thin_body():
    """Half of the gap to what it faces is the largest move: 30 times a sheet here."""
    path = loose_stack(
        gap=0.67, loaded="2", held=("bottom", "bottom_1"), heights=(1.0, 0.02, 1.0)
    )
    path.apply(1.0)
    loose = np.arange(3) == body_above(path.problem.contact, 1)
    assert Landing(path.problem, loose, 0.65).land() is not None
    assert mean_lifts(path) == pytest.approx(-0.67 * loose, abs=0.01)


@pytest.mark.mpi
def test_a_step_that_fails_has_no_work(monkeypatch):
    _, steps, _ = resting("triangle", GAP)
    steps.apply(SHARE)
    forces = Stabilization(steps.solver, 1.0)

    def fails(*_):
        raise ConvergenceError("as asked")

    monkeypatch.setattr(forces, "_landed", lambda: None)
    monkeypatch.setattr(forces, "_under", fails)
    with pytest.raises(ConvergenceError, match="as asked"):
        forces.solve()
    assert forces.work == 0.0

"""Bodies that nothing touches land without a tangent."""

import numpy as np
import pytest
import ufl
from arriving import loose_stack, on_tools
from first_tries import read
from load_paths import body_above, nodal, resting
from pathing import Path, take
from problems import worst

from raymortar import ConvergenceError, Coulomb
from raymortar.diagnose.holding import touching
from raymortar.viscous.bearing import bearing
from raymortar.viscous.landing import Landing
from raymortar.viscous.loads import depend_on_place
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


def landing(path, *loose):
    """Landing of bodies of a stack from whose facets the slaves of zones are."""
    path.apply(1.0)
    bodies = [body_above(path.problem.contact, i) for i in loose]
    return Landing(path.problem, np.isin(np.arange(3), bodies), LIMIT)


@pytest.mark.mpi
@pytest.mark.parametrize("gap", [0.1, 3.0])
def test_bodies_that_touch_fall_as_one(gap):
    """No load presses the upper one on the one that falls with it."""
    path = loose_stack(gap=gap, apart=0.0, steps=2)
    assert landing(path, 0, 1).land() is not None
    lifts = np.sort(mean_lifts(path))
    assert lifts == pytest.approx([-gap, -gap, 0.0], abs=0.02)
    assert lifts[0] == pytest.approx(lifts[1], abs=1e-12)


@pytest.mark.mpi
def test_a_body_on_springs_bears_what_falls():
    def springs(u, v, by_body):
        return by_body({"0": 1e3, "1": 0.0, "2": 0.0}) * ufl.inner(u, v)

    path = loose_stack(gap=0.1, steps=2, held=("top_2",), loaded="1", more=springs)
    found = take(path)
    assert found.arrived and found.tangents <= 6
    assert mean_lifts(path).min() < -0.1 and abs(path.result()[0, 1]) > 0.9


@pytest.mark.mpi
@pytest.mark.parametrize("guided", [(), ("left_1", "left_2")])
@pytest.mark.parametrize("stiffness", [1e-6, 1e-3])
def test_springs_that_a_load_stretches_far_hold_no_body(stiffness, guided):
    def springs(u, v, by_body):
        return by_body({"0": 0.0, "1": stiffness, "2": stiffness}) * ufl.inner(u, v)

    found = take(loose_stack(gap=0.1, steps=2, guided=guided, more=springs))
    assert found.arrived and found.tangents <= 6


def cable(y):
    """Taut before the floor."""
    return ufl.conditional(ufl.lt(y, -0.05), 1e3 * (y + 0.05), 0.0)


def detent(y):
    """Twice the weight, between 0.04 and 0.06 below the start alone."""
    return ufl.conditional(ufl.lt(abs(y + 0.05), 0.01), -2.0, 0.0)


@pytest.mark.mpi
@pytest.mark.parametrize("force", [cable, detent])
def test_a_body_that_a_force_may_hold_on_the_way_does_not_land(force):
    def more(u, v, by_body):
        return by_body({"0": 0.0, "1": 1.0, "2": 0.0}) * force(u[1]) * v[1]

    path = loose_stack(gap=0.1, loaded="1", more=more)
    fall = landing(path, 0, 1)
    assert fall.land() is None and fall.has_failed
    assert worst(nodal(path.problem)) == 0.0
    assert depend_on_place(path.problem)
    assert not depend_on_place(loose_stack().problem)


@pytest.mark.mpi
def test_a_fall_that_ends_nowhere_is_not_tried_in_halves_of_the_step(monkeypatch):
    falls = []
    land = Landing.land
    monkeypatch.setattr(Landing, "land", lambda fall: falls.append(fall) or land(fall))
    _, steps, _ = resting("triangle", 50.0, Coulomb(0.5), stabilize=True)
    steps.apply(SHARE)
    forces = Stabilization(steps.solver, 1.0)
    for again in (forces.land, forces.land, forces.accepted, forces.land):
        again()
    assert len(falls) == 2


@pytest.mark.mpi
@pytest.mark.parametrize("gap", [1e-6, 0.3])
def test_bodies_that_conditions_guide_land(gap):
    """Half of a stack, on its plane of symmetry."""
    found = take(loose_stack(gap=gap, steps=2, guided=("left_1", "left_2")))
    assert found.arrived and found.tangents <= 6


@pytest.mark.mpi
def test_bodies_that_constraints_link_stay(monkeypatch):
    problem, fall, *_ = falling("triangle")
    monkeypatch.setattr(problem, "constraints", object())
    assert fall.land() is None


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


def between_walls(gap, friction=None):
    """A block that touches two walls, a gap above a floor, under a weight. The result is
    the problem and its path."""

    def draw(occ):
        block = occ.addRectangle(0, gap, 0, 1.0, 1.0)
        return {"block": block}, {"skin": ("block", lambda x, y: True)}

    lines = [((0, 0), (0, 1)), ((0, 0), (1, 0)), ((1, 0), (-1, 0))]
    problem, _, weight = on_tools(
        read(draw, 0.2), "skin", lines, 1, 1e4, lambda weight: weight, friction
    )

    def load(t):
        weight.value = 10.0 * t

    return problem, Path(problem, load, 2)


@pytest.mark.mpi
@pytest.mark.parametrize("gap", [0.3, 2.0])
def test_a_body_falls_along_walls_that_it_touches(gap):
    """No load presses it on them: 6 tangents where they counted as what holds it."""
    problem, path = between_walls(gap)
    found = take(path)
    assert found.arrived and found.tangents <= 3
    assert problem.contact.resultant().force == pytest.approx([0.0, 10.0], abs=1e-8)


@pytest.mark.mpi
@pytest.mark.parametrize("friction, bears", [(None, False), (0.3, True)])
def test_walls_may_bear_by_friction_what_presses_on_none(friction, bears):
    """Pressure may come from elsewhere, as from what grips the body or from its heat."""
    problem, path = between_walls(0.3, friction)
    path.apply(1.0)
    problem.contact.update()
    pairs = bearing(problem, np.array([True]), 0.2)
    assert touching(problem.contact, 1)[0, 1] and pairs[0, 1] == bears

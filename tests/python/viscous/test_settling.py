"""Bodies that have landed turn and slide as rigid ones until they rest."""

from types import SimpleNamespace

from mpi4py import MPI

import numpy as np
import pytest
from arriving import FALL, RADIUS, free_disc, loose_stack
from load_paths import body_above, nodal, resting
from problems import worst

from raymortar import AugmentedLagrangian, Coulomb
from raymortar.core.discretization.ranks import ends_of
from raymortar.viscous.landing import Landing
from raymortar.viscous.loads import forces_on
from raymortar.viscous.placement import placement_of
from raymortar.viscous.settling import Settling

GAP, LIMIT, ANGLE, WIDTH = 0.2, 0.1, 0.3, 0.6


def turned(x, angle, middle):
    """Points turned about a middle in the plane of the first and last axis, (n, d)."""
    c, s = np.cos(angle), np.sin(angle)
    found, (a, b) = x.copy(), (x - middle)[:, [0, -1]].T
    found[:, 0], found[:, -1] = middle[0] + c * a - s * b, middle[-1] + s * a + c * b
    return found


def tilted(cell, friction=None, angle=ANGLE, **options):
    """A block under its weight that starts turned about its middle, above a wider one.
    Its sides face nothing.

    Returns
    -------
    namespace: problem, steps, weight as of `resting`, x, the undeformed places of this
    rank's nodes of the block (n, d), is_block, which of the nodes they are, middle (d,),
    fall, which lets it land and settle and returns the work of each, and settling, which
    makes a Settling.
    """
    problem, steps, weight = resting(cell, GAP, friction, **options)
    contact = problem.contact
    of, block = contact.system.bodies, body_above(contact, 0)
    is_block, V = of.dofs == block, contact.u.function_space
    x = V.tabulate_dof_coordinates()[is_block, : V.dofmap.index_map_bs]
    middle = ends_of(x, problem.comm).mean(axis=0)
    nodal(problem)[is_block] = turned(x, angle, middle) - x
    contact.advance()
    steps.apply(1.0)
    given = problem, np.arange(of.count) == block, LIMIT

    def fall():
        settling = Settling(*given)
        return Landing(*given).land(), settling.settle()

    def settling():
        return Settling(*given)

    return SimpleNamespace(
        problem=problem,
        steps=steps,
        weight=weight,
        x=x,
        is_block=is_block,
        middle=middle,
        fall=fall,
        settling=settling,
    )


def worst_of_block(block, aside):
    """Largest distance of a node of the block from where it lies: moved aside and down,
    by as much as bears the weight."""
    contact, u = block.problem.contact, nodal(block.problem)
    points = contact.points()
    stiffness = (points["weight"] * points["gamma"])[points["gap"] < 0.0].sum()
    depth = block.weight / block.problem.comm.allreduce(stiffness)
    at_rest = np.zeros(u.shape[1])
    at_rest[0], at_rest[-1] = aside, -GAP - depth
    return worst(u[block.is_block] - at_rest)


@pytest.mark.mpi
@pytest.mark.parametrize("friction", [None, Coulomb(0.0)])
def test_a_block_lies_down(cell, friction):
    """Without friction its middle stays above the same point."""
    block = tilted(cell, friction)
    works = block.fall()
    assert block.problem.tangents == 0
    assert worst(nodal(block.problem)[~block.is_block]) == 0.0
    assert worst_of_block(block, 0.0) <= 0.01 * LIMIT
    assert sum(works) == pytest.approx(GAP * block.weight, rel=0.02)


@pytest.mark.mpi
def test_a_block_turns_about_its_edge(cell):
    """Friction keeps the edge where it has landed, up to the springs that hold it."""
    block = tilted(cell, Coulomb(0.5))
    block.fall()
    corner = block.middle.copy()
    corner[[0, -1]] -= 0.5 * np.array([WIDTH, 1.0])
    aside = (turned(corner[None], ANGLE, block.middle)[0] - corner)[0]
    assert aside > LIMIT and worst_of_block(block, aside) <= 0.1 * LIMIT


@pytest.mark.mpi
@pytest.mark.parametrize("friction", [None, Coulomb(0.1), Coulomb(0.5)])
@pytest.mark.parametrize("angle", [-0.02, ANGLE])
def test_a_block_that_lands_on_an_edge_takes_the_tangents_of_one_that_lies(
    friction, angle
):
    block = tilted("triangle", friction, angle)
    block.steps.run()
    problem = block.problem
    assert problem.tangents <= 8 and not block.steps.halvings
    force = problem.contact.resultant(0).force[-1]
    assert abs(force - block.weight) <= 1e-9 * block.weight


@pytest.mark.mpi
@pytest.mark.parametrize("load", [0.02, 20.0])
def test_a_corner_inside_settles_where_a_law_at_nodes_has_not_closed(load):
    law = AugmentedLagrangian(condition="nodes")
    block = tilted("triangle", Coulomb(0.5), force=0.05 * load, method=law)
    block.steps.run()
    assert block.problem.tangents <= 8 and not block.steps.halvings
    assert worst_of_block(block, 0.0) <= 0.3 * WIDTH


@pytest.mark.mpi
def test_a_weight_has_no_moment_about_the_centre():
    """Nodes of the disc weigh alike, and do not show where its mass is."""
    aside = 0.1
    path = free_disc(aside=aside * RADIUS)
    path.apply(1.0)
    problem = path.problem
    centre = placement_of(problem, forces_on(problem)).centre
    assert worst(centre - (aside * RADIUS, RADIUS + FALL)) <= 0.01 * RADIUS
    assert worst(placement_of(problem).centre[:, 0]) <= 0.5 * aside * RADIUS


@pytest.mark.mpi
def test_a_body_that_slides_on_is_back_where_it_was():
    """It lands first: there is nothing to slide on above."""
    block = tilted("quadrilateral", aside=0.3)
    landed, settled = block.fall()
    assert landed > 0.0 and settled is None
    assert np.array_equal(
        block.problem.contact.states.u_old, block.problem.contact.u.x.array
    )
    assert nodal(block.problem)[block.is_block][:, 1].min(initial=0.0) > -1.0


@pytest.mark.mpi
def test_a_body_on_which_contact_carries_something_stays():
    problem, steps, _ = resting("triangle", GAP, Coulomb(0.5), stabilize=True)
    steps.run()
    before, loose = problem.contact.u.x.array.copy(), np.ones(2, dtype=bool)
    loose[1 - body_above(problem.contact, 0)] = False
    assert Settling(problem, loose, LIMIT).settle() is None
    assert np.array_equal(problem.contact.u.x.array, before)


@pytest.mark.mpi
@pytest.mark.parametrize("aside, rests", [(0.25, True), (0.35, False)])
def test_a_body_that_its_load_pulls_beyond_friction_stays(cell, aside, rests):
    """Settling would let it stick to its edge and turn over it, where it slides."""
    block = tilted(cell, Coulomb(0.3), aside=aside)
    settled = block.fall()[1]
    assert (settled is not None) == rests
    if not rests:
        u = nodal(block.problem)[block.is_block]
        turn = turned(block.x, ANGLE, block.middle) - block.x
        ends = ends_of(u - turn, block.problem.comm)
        assert worst(np.ptp(ends, axis=0)) <= 1e-12


@pytest.mark.mpi
def test_a_body_in_flight_stays_and_others_settle():
    """The block in the middle of a stack has a weight, the one above it has none."""
    path = loose_stack(gap=GAP, loaded="1")
    path.apply(1.0)
    problem = path.problem
    middle, above = (body_above(problem.contact, i) for i in (0, 1))
    loose = np.isin(np.arange(3), (middle, above))
    settling = Settling(problem, loose, LIMIT)
    assert Landing(problem, loose, LIMIT).land() is not None
    assert settling.settle() is not None
    u, of = nodal(problem)[:, 1], problem.contact.system.bodies.dofs
    assert worst(u[of == middle] + GAP) <= 0.1 * LIMIT
    assert worst(u[of == above]) == 0.0


@pytest.mark.mpi
def test_a_block_beyond_its_edge_does_not_climb_over_it():
    """Upright it would have less energy, but the way there leads uphill."""
    block = tilted("quadrilateral", Coulomb(0.5), 0.62)  # the edge bears up to 0.54
    block.fall()
    ends = ends_of(nodal(block.problem)[block.is_block], block.problem.comm)
    assert np.ptp(ends[:, 0]) > 0.3  # upright, all nodes have moved alike


@pytest.mark.mpi
@pytest.mark.parametrize("load, rests", [(0.2, True), (60.0, False)])
def test_a_body_that_would_sink_into_what_bears_it_stays(load, rests):
    """A fifth of a facet is the largest depth of a body at rest."""
    block = tilted("triangle", Coulomb(0.5))
    block.steps.apply(load)
    settled = block.fall()[1]
    assert (settled is not None) == rests
    deep = -block.problem.contact.points()["gap"].min(initial=0.0)
    assert block.problem.comm.allreduce(deep, op=MPI.MAX) <= 0.3 * LIMIT


@pytest.mark.mpi
@pytest.mark.parametrize("friction", [None, Coulomb(0.5)])
def test_stiffness_is_that_of_the_forces(cell, friction):
    """Central differences on a block that lies, whose points all stay closed. Their
    pressure turns with it, which is left out: the weight over its size."""
    block = tilted(cell, friction)
    block.fall()
    settling, begin = block.settling(), block.problem.contact.state()
    placement = placement_of(block.problem)
    stiffness = settling._springs(placement)[1]
    found = np.zeros_like(stiffness)
    for motion in range(stiffness.shape[1]):
        for way in (-1e-5, 1e-5):
            step = np.zeros((1, stiffness.shape[1]))
            step[0, motion] = way * LIMIT
            settling._move(placement, step)
            force = settling._springs(placement)[0]
            found[:, :, 0, motion] -= 0.5 * force / (way * LIMIT)
            block.problem.contact.restore(begin)
    assert worst(found - stiffness) <= 0.02 * worst(stiffness)

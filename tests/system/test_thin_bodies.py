"""Layers of thin masters: which of them a point of the slave is paired with.

A slave that has sunk into a plate sees the plate behind it at a small gap. Paired with
that it would be open, and converge without a force.
"""

from mpi4py import MPI

import numpy as np
import pytest
from dolfinx import fem
from pairing import HIT, lift, measures, total, touch
from problems import COMM, DIMENSION, build, fix, stack, worst
from rotations import ROTATION

import raymortar
from meshes.blocks import Block, rotated
from meshes.meshing import assemble_blocks
from meshes.scenes import two_blocks
from raymortar import ContactWarning, Penalty, Search
from raymortar.core import compat

ROUNDING = 1e-12
THICK, APART = 0.1, 0.02  # of plates


def plates(cell, sunk, count=2, layers=1, size=1.0, turned=False, n=3):
    """A block on plates, lowest first, its bottom sunk into the top one of them."""
    heights = [*[THICK * size] * count, 0.5 * size]
    gaps = [0.0, *[APART * size] * (count - 1), -sunk * size]
    divisions = (*[layers] * count, n)
    R = ROTATION[DIMENSION[cell]] if turned else None
    widths = [size] * (count + 1)
    return stack(cell, divisions, heights, gaps, widths, R)


def all_plates(count=2):
    """Pairs of the block with the upper side of every plate."""
    return [(f"bottom_{count}", f"top_{k}") for k in range(count)]


def gap_of_all(contact):
    """The gap, which is the same everywhere; every point has a master."""
    points = contact.points()
    assert np.all(points["status"] >= HIT)
    low = COMM.allreduce(points["gap"].min(initial=np.inf), op=MPI.MIN)
    high = COMM.allreduce(points["gap"].max(initial=-np.inf), op=MPI.MAX)
    assert high - low <= ROUNDING * max(1.0, abs(low))
    return high


# Where the slave starts within a plate


@pytest.mark.quick
@pytest.mark.mpi(where=lambda share, layers, **_: share == 0.7 and layers == 1)
@pytest.mark.parametrize("layers", [1, 2])
@pytest.mark.parametrize("share", [0.1, 0.4, 0.55, 0.7, 0.95])
@pytest.mark.parametrize("search", [Search(), Search(depth=0.99 * THICK)])
def test_a_slave_within_a_plate_meets_its_surface(cell, layers, share, search):
    """Not the plate behind, though that is nearer from 0.6 of the thickness on."""
    dim, sunk, gamma = DIMENSION[cell], share * THICK, 1e3
    scene = plates(cell, sunk, layers=layers, turned=True)
    contact = touch(scene, all_plates(), method=Penalty(gamma), search=search)
    assert abs(gap_of_all(contact) + sunk) <= ROUNDING
    force = contact.resultant().force @ ROTATION[dim][:, -1]
    assert abs(force - gamma * sunk) <= 1e-9 * gamma * sunk
    assert abs(measures(contact)[1] - 1.0) <= ROUNDING


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize("strategy", ["bvh", "advancing-front", "brute-force"])
def test_the_order_of_pairs_and_the_strategy_say_nothing(cell, order, strategy):
    pairs = all_plates()[::order]
    contact = touch(plates(cell, 0.8 * THICK), pairs, search=Search(strategy))
    assert abs(gap_of_all(contact) + 0.8 * THICK) <= ROUNDING


@pytest.mark.parametrize("size", [1e-9, 1e-3, 1e6])
def test_the_unit_of_length_says_nothing(cell, size):
    contact = touch(plates(cell, 0.8 * THICK, size=size), all_plates())
    gap = contact.points()["gap"] / size
    assert np.all(contact.points()["status"] >= HIT)
    assert worst(gap + 0.8 * THICK) <= ROUNDING


def test_a_plate_that_has_been_passed_gives_way(cell):
    """Without a history the slave is where it is: between the plates."""
    sunk = THICK + 0.4 * APART
    contact = touch(plates(cell, sunk), all_plates())
    assert abs(gap_of_all(contact) - 0.6 * APART) <= ROUNDING


def test_a_slave_in_the_second_plate_meets_the_second(cell):
    sunk = THICK + APART + 0.3 * THICK
    contact = touch(plates(cell, sunk, count=4), all_plates(4))
    assert abs(gap_of_all(contact) + 0.3 * THICK) <= ROUNDING


# Where it comes from


@pytest.mark.mpi(where=lambda sunk, **_: sunk > THICK)
@pytest.mark.parametrize("sunk", [0.6 * THICK, THICK + 0.5 * APART, 2.5 * THICK])
@pytest.mark.parametrize("count", [1, 2, 4])
def test_a_step_through_plates_stays_with_the_first(cell, sunk, count):
    """The last accepted step knows which plate the slave was in front of."""
    above = 0.3 * THICK
    contact = touch(plates(cell, -above, count), all_plates(count))
    assert abs(gap_of_all(contact) - above) <= ROUNDING
    lift(contact, -(above + sunk))
    assert abs(gap_of_all(contact) + sunk) <= ROUNDING
    lift(contact, -above)  # an iterate is no history
    assert abs(gap_of_all(contact)) <= ROUNDING
    lift(contact, -(above + sunk))
    assert abs(gap_of_all(contact) + sunk) <= ROUNDING


@pytest.mark.mpi
def test_a_state_restores_the_layer(cell):
    """Within a plate by one history, between the plates by another."""
    above, sunk = 0.3 * THICK, THICK + 0.5 * APART
    contact = touch(plates(cell, -above), all_plates())
    lift(contact, -(above + sunk))
    before = contact.state()
    assert abs(gap_of_all(contact) + sunk) <= ROUNDING
    contact.advance()
    contact.update()  # accepted there, it has passed the plate
    assert abs(gap_of_all(contact) - 0.5 * APART) <= ROUNDING
    contact.restore(before)
    contact.update()
    assert abs(gap_of_all(contact) + sunk) <= ROUNDING


@pytest.mark.mpi
def test_a_plate_that_comes_from_the_side_counts(cell):
    """The slave was in front of the lower plate only, and meets the edge of another."""
    dim = DIMENSION[cell]
    scene = stack(cell, (1, 1, 3), (0.1, 0.1, 0.5), (0.0, 0.02, -0.06), (3.0, 1.0, 1.0))
    contact = touch(scene, all_plates())
    move = np.zeros(dim)
    surface = contact.zones[0].facets.slave_surface
    u = contact.u.x.array.reshape(-1, dim)
    for share in (1.5, 0.75):  # beside the upper plate, then a quarter on it
        move[0] = share
        u[surface.dofs] = move
        contact.update()
        if share > 1.0:
            assert abs(gap_of_all(contact) - 0.06) <= ROUNDING
            contact.advance()
    points = contact.points()
    assert np.all(points["status"] >= HIT)
    on_upper = points["x"][:, 0] < 1.0
    assert worst(points["gap"] - np.where(on_upper, -0.06, 0.06)) <= ROUNDING
    assert abs(total(points["weight"][on_upper]) - 0.25) <= ROUNDING


# Other layers


def folded_sheet(cell, sunk, n=24):
    """A sheet bent into a U that lies on its side, and a block sunk into its upper arm.

    The outer side of the upper arm faces the block, and so does the inner side of the
    lower arm, 2 R - t below.
    """
    R, t, dim = 0.11, THICK, DIMENSION[cell]
    bend = np.pi * R

    def fold(x):
        s, z = x[:, 0], x[:, -1]
        angle = np.clip((s - 1.0) / R, 0.0, np.pi)
        past = np.clip(s - 1.0 - bend, 0.0, None)
        y = x.copy()
        y[:, 0] = np.minimum(s, 1.0) + (R - z) * np.sin(angle) - past
        y[:, -1] = R - (R - z) * np.cos(angle)
        return y

    depth = [(1,), (0.0,), (1.0,)] if dim == 3 else [(), (), ()]
    sheet = Block(
        (n, *depth[0], 1),
        (0.0, *depth[1], 0.0),
        (2.0 + bend, *depth[2], t),
        mapping=fold,
        tags={"bottom": 1, "top": 2},
    )
    low = 2 * R - sunk
    inner = [(2,), (0.1,), (0.9,)] if dim == 3 else [(), (), ()]
    block = Block(
        (4, *inner[0], 2),
        (0.2, *inner[1], low),
        (0.7, *inner[2], low + 0.4),
        tags={"bottom": 3},
    )
    blocks = rotated([sheet, block], ROTATION[dim])
    return assemble_blocks(COMM, blocks, cell, 1)


@pytest.mark.mpi(where=lambda share, **_: share == 0.8)
@pytest.mark.parametrize("share", [0.3, 0.8])
def test_a_fold_is_met_on_its_outside(cell, share):
    mesh, _, facet_tags = folded_sheet(cell, share * THICK)
    u = fem.Function(compat.vector_space(mesh, 1))
    contact = raymortar.Contact(u, facet_tags, [(3, 1), (3, 2)], Penalty(1.0))
    contact.update()
    assert abs(gap_of_all(contact) + share * THICK) <= 1e-10


@pytest.mark.mpi
def test_thin_bodies_do_not_meet_back_to_back(cell):
    """The back of a thin plate is not "deep inside" the one that its front lies on."""
    scene = stack(cell, (1, 2), (THICK, THICK), (0.0, 0.1 * THICK))
    contact = touch(scene, [("bottom_1", "top_0"), ("top_1", "bottom_0")])
    front, back = contact.points(0), contact.points(1)
    assert np.all(front["status"] >= HIT) and np.all(back["status"] < HIT)
    assert all(len(zone.cpp.penetrating_points()) == 0 for zone in contact.zones)


@pytest.mark.mpi
def test_inclined_layers_are_told_apart_point_by_point(cell):
    """Two plates that cross: of each point the nearest, though one facet has both."""
    if DIMENSION[cell] == 3:
        pytest.skip("the same code; one dimension shows it")
    slopes = (0.4, -0.4)
    blocks = [
        Block(
            (1, 1),
            (0.0, -2.0),
            (1.0, -1.0),
            mapping=lambda x, k=k: np.column_stack(
                [x[:, 0], x[:, 1] + 1.0 + k * (x[:, 0] - 0.5)]
            ),
            tags={"top": i},
        )
        for i, k in enumerate(slopes, 1)
    ]
    blocks.append(Block((1, 1), (0.0, 0.3), (1.0, 1.0), tags={"bottom": 3}))
    mesh, _, facet_tags = assemble_blocks(COMM, blocks, cell, 1)
    u = fem.Function(compat.vector_space(mesh, 1))
    contact = raymortar.Contact(u, facet_tags, [(3, 1), (3, 2)], Penalty(1.0))
    contact.update()
    points = contact.points()
    assert np.all(points["status"] >= HIT)
    expected = 0.3 - 0.4 * np.abs(points["x"][:, 0] - 0.5)
    assert worst(points["gap"] - expected) <= ROUNDING


# Local distances


@pytest.mark.mpi
@pytest.mark.parametrize("gap, seen", [(1.9, True), (2.1, False)])
@pytest.mark.parametrize("sign", [1, -1])
def test_distances_are_of_the_slave_and_not_of_a_coarse_partner(cell, gap, seen, sign):
    """One master facet beside 100 or 8 x 8 slave facets."""
    n = 100 if DIMENSION[cell] == 2 else 8
    diameter = (2.0**0.5 if cell in ("tetrahedron", "hexahedron") else 1.0) / n
    scene = stack(cell, (1, n), (1.0, 1.0), (0.0, sign * gap * diameter))
    statistics = touch(scene).statistics
    assert statistics.hits == (statistics.points if seen else 0)
    assert statistics.candidates <= 2 * statistics.slave_facets


@pytest.mark.mpi
def test_small_facets_see_as_far_as_their_surface_does_in_the_mean(cell):
    """Graded by 1:1000: the smallest facets do not lose what others find."""
    dim = DIMENSION[cell]
    grading = [lambda t: np.geomspace(1e-3, 1.0 + 1e-3, len(t)) - 1e-3] * (dim - 1)
    n = 12 if dim == 2 else 6
    low, high = (0.0,) * (dim - 1), (1.0,) * (dim - 1)
    blocks = [
        Block((4,) * dim, (*low, 0.0), (*high, 1.0), tags={"top": 1}),
        Block(
            (*(n,) * (dim - 1), 2),
            (*low, 1.0 - 1.0 / n),
            (*high, 2.0),
            grading=[*grading, None],
            tags={"bottom": 2},
        ),
    ]
    mesh, _, facet_tags = assemble_blocks(COMM, blocks, cell, 1)
    u = fem.Function(compat.vector_space(mesh, 1))
    contact = raymortar.Contact(u, facet_tags, [(2, 1)], Penalty(1.0))
    contact.update()
    assert abs(gap_of_all(contact) + 1.0 / n) <= ROUNDING


# Solutions


@pytest.mark.mpi(where=lambda method, **_: method == "multiplier")
@pytest.mark.parametrize("method", ["multiplier", "penalty"])
def test_a_block_pushed_into_a_plate_in_one_step_is_carried_by_it(cell_2d, method):
    """The first iterate is within the plate, nearer to the one behind."""
    above, push = 0.2 * THICK, 0.95 * THICK
    scene = plates(cell_2d, -above, layers=2, n=2)
    penalty = Penalty() if method == "penalty" else None

    def held(V, scene):
        return [
            fix(V, scene, "bottom_0"),
            fix(V, scene, "left_1"),
            fix(V, scene, "right_1"),
            fix(V, scene, "top_2", value=-push, component=1),
            fix(V, scene, "top_2", value=0.0, component=0),
        ]

    problem = build(scene, method=penalty, bcs=held, pairs=all_plates())
    problem.solve()
    contact = problem.contact
    assert contact.statistics.active_points > 0
    assert contact.resultant().force[1] > 0.0
    deepest = COMM.allreduce(contact.points()["gap"].min(initial=0.0), op=MPI.MIN)
    assert deepest > -0.1 * THICK


@pytest.mark.mpi(where=lambda method, **_: method is None)
@pytest.mark.parametrize("method", [None, Penalty()])
def test_contact_that_is_lost_for_its_depth_is_said(cell_2d, method):
    """Within the master, deeper than what counts: converged, and without a force."""

    def held(V, scene):
        return [fix(V, scene, "bottom"), fix(V, scene, "top")]

    scene, search = two_blocks(COMM, 2, cell_2d, gap=-0.12), Search(depth=0.1)
    problem = build(scene, method=method, bcs=held, search=search)
    with pytest.warns(
        ContactWarning, match="1.200e-01 deep .* where contact is not seen"
    ):
        problem.solve()
    assert problem.contact.statistics.hits == 0

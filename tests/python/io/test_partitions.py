"""Partitions by the place of the cells."""

import numpy as np
import pytest
from dolfinx import fem
from gathered import concatenated
from problems import COMM, DIMENSION

from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, Contact, ContactError
from raymortar.core import compat
from raymortar.io.partitions import columns, patches, sectors, strips

RANKS = pytest.mark.parametrize("ranks", [1, 2, 3, 4, 7, 8])


def assert_balanced(found, ranks):
    counts = np.bincount(found, minlength=ranks)
    assert len(counts) == ranks and counts.max() - counts.min() <= 1


@pytest.mark.quick
@pytest.mark.parametrize("ranks", [1, 2, 3, 7])
def test_strips_follow_each_other_with_as_many_cells(ranks):
    x = np.random.default_rng(1).uniform(-3.0, 5.0, (200, 3))
    found = strips(x, ranks)
    assert_balanced(found, ranks)
    for r in range(1, ranks):
        assert x[found == r - 1, 0].max() < x[found == r, 0].min()
    # Neither unit nor place matters
    np.testing.assert_array_equal(strips(1e-9 * x, ranks), found)
    np.testing.assert_array_equal(strips(x + 1e3, ranks), found)


def test_cells_above_each_other_are_told_apart_by_their_order():
    x = np.column_stack([0.1 * np.ones(6) + 1e-17 * np.arange(6), np.arange(6.0)])
    assert strips(x, 3).tolist() == [0, 0, 1, 1, 2, 2]
    assert strips(x[:2], 3).tolist() == [0, 1]


@pytest.mark.mpi
def test_the_same_mesh_is_cut_in_the_same_way(cell_3d):
    def cells():
        scene = two_blocks(COMM, DIMENSION[cell_3d], cell_3d, 4, 3)
        return np.asarray(scene.mesh.topology.original_cell_index)

    first = cells()
    assert len(np.unique(np.concatenate(COMM.allgather(first)))) == COMM.allreduce(
        len(first)
    )
    for _ in range(5):
        np.testing.assert_array_equal(cells(), first)


def grid(*shape):
    """Midpoints of the cells of a box, the last axis first in the order, (n, d)."""
    axes = [np.arange(n) + 0.5 for n in shape]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(shape))


def rotation(dim):
    """A turn about no axis of the coordinates."""
    return np.linalg.qr(np.random.default_rng(3).normal(size=(dim, dim)))[0]


def piles_of_several_ranks(found, piles):
    """How many sets of cells above each other are not on one rank."""
    ranks = [
        set(found[np.all(piles == pile, axis=1)]) for pile in np.unique(piles, axis=0)
    ]
    return sum(len(some) > 1 for some in ranks)


@pytest.mark.quick
@RANKS
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("dim", [2, 3])
def test_columns_have_cells_above_each_other_on_one_rank(dim, turned, ranks):
    x = grid(*(17, 13, 6)[3 - dim :])
    turn = rotation(dim) if turned else np.eye(dim)
    found = columns(5.0 * turn[:, -1])(x @ turn.T, ranks)
    assert_balanced(found, ranks)
    # Each cut may go through one
    assert piles_of_several_ranks(found, x[:, :-1]) <= ranks - 1


@pytest.mark.quick
def test_columns_do_not_depend_on_rounding_unit_and_place():
    x, rng = grid(9, 8, 4), np.random.default_rng(5)
    cut = columns((0.0, 0.0, 1.0))
    found = cut(x, 6)
    for _ in range(10):
        noise = 1.0 + 1e-15 * rng.normal(size=x.shape)
        np.testing.assert_array_equal(cut(noise * x, 6), found)
    np.testing.assert_array_equal(cut(1e-9 * x, 6), found)
    np.testing.assert_array_equal(cut(x + 1e3, 6), found)


@pytest.mark.quick
def test_columns_are_cut_across_their_width():
    """Four ranks on a square have a quarter each, on a strip a length each."""
    square, strip = grid(8, 8, 2), grid(32, 2, 2)
    for x, size in ((square, (4, 4)), (strip, (8, 2))):
        found = columns((0.0, 0.0, 1.0))(x, 4)
        for rank in range(4):
            extent = np.ptp(x[found == rank, :2], axis=0) + 1.0
            np.testing.assert_allclose(extent, size)


def ring(rings, around, along=1):
    """Midpoints of the cells of a tube, and the (angle, height) they share."""
    r, i, z = np.indices((rings, around, along)).reshape(3, -1)
    angle = 2.0 * np.pi * (i + 0.5) / around
    x = np.column_stack([(1 + r) * np.cos(angle), (1 + r) * np.sin(angle), z])
    return x, np.column_stack([i, z])


@pytest.mark.quick
@RANKS
def test_sectors_of_a_ring_are_one_piece_with_the_shaft(ranks):
    x, piles = ring(5, 60)
    found = sectors((4.0, -1.0))(x[:, :2] + (4.0, -1.0), ranks)
    assert_balanced(found, ranks)
    assert piles_of_several_ranks(found, piles) <= 2 * ranks
    of_inner = found[:60]
    borders = np.count_nonzero(of_inner != np.roll(of_inner, 1))
    assert borders == (ranks if ranks > 1 else 0)


@pytest.mark.quick
def test_sectors_of_a_long_shaft_are_cut_along_it():
    x, piles = ring(3, 12, 400)
    turn = rotation(3)
    found = sectors(turn @ (1.0, 2.0, 3.0), turn[:, 2])(
        (x + (1.0, 2.0, 3.0)) @ turn.T, 4
    )
    assert_balanced(found, 4)
    assert piles_of_several_ranks(found, piles) == 0
    heights = [np.ptp(x[found == rank, 2]) + 1.0 for rank in range(4)]
    np.testing.assert_allclose(heights, 100.0)


def test_a_cell_on_the_axis_of_sectors_is_somewhere():
    x = np.vstack([np.zeros((1, 3)), ring(2, 8)[0]])
    assert_balanced(sectors((0.0, 0.0, 0.0))(x, 3), 3)


@pytest.mark.quick
@RANKS
def test_patches_follow_coordinates_of_ones_own(ranks):
    """A ball in a socket: shells of cells in the same directions."""
    rays = np.random.default_rng(2).normal(size=(150, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    x = np.concatenate([radius * rays for radius in (0.5, 1.0, 1.3)])
    cut = patches(lambda x: x / np.linalg.norm(x, axis=1, keepdims=True))
    found = cut(x, ranks)
    assert_balanced(found, ranks)
    assert piles_of_several_ranks(found, np.tile(rays, (3, 1))) <= ranks - 1


@pytest.mark.parametrize(
    "wrong, message",
    [
        (lambda: columns((0.0, 0.0)), "direction is zero"),
        (
            lambda: columns((1.0, 0.0))(grid(2, 2, 2), 2),
            "direction .* must be 3 finite",
        ),
        (lambda: sectors((1.0, np.nan)), "centre = .* must be 2 or 3 finite"),
        (lambda: sectors((0.0, 0.0, 0.0))(grid(2, 2), 2), "centre .* must be 2 finite"),
        (lambda: patches((1.0, 0.0)), "place must be a function"),
        (
            lambda: patches(lambda x: x[:, 0])(grid(2, 2), 2),
            r"shape \(4, k\), not \(4,\)",
        ),
        (lambda: patches(lambda x: x / 0.0)(grid(2, 2), 2), "not finite"),
        (lambda: strips(np.full((3, 2), np.nan), 2), "not finite"),
        (lambda: strips(grid(2, 2), -1), "ranks = -1 must be a positive whole"),
        (lambda: columns((0.0, 1.0))(grid(2, 2), 2.5), "ranks = 2.5 must be"),
    ],
)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_wrong_arguments_are_refused(wrong, message):
    with pytest.raises(ContactError, match=message):
        wrong()


@pytest.mark.mpi
@pytest.mark.parametrize(
    "partition, message",
    [
        (lambda x, ranks: np.zeros(3, dtype=np.int32), r"not int32 of shape \(3,\)"),
        (lambda x, ranks: np.zeros(len(x)), "whole numbers of shape .* not float64"),
        (lambda x, ranks: np.full(len(x), ranks), "gives cell 0 to rank"),
        (lambda x, ranks: np.full(len(x), -1), "gives cell 0 to rank -1"),
    ],
)
@pytest.mark.skipif(COMM.size == 1, reason="one rank has all cells")
def test_blocks_refuse_what_is_no_rank_of_each_cell(partition, message):
    with pytest.raises(ContactError, match=message):
        two_blocks(COMM, 2, "triangle", 2, 2, partition=partition)


def bodies_apart(x, ranks):
    """The upper body on the last rank, the lower one in strips on the others."""
    below = np.minimum(x[:, 0] * max(ranks - 1, 1), max(ranks - 2, 0)).astype(int)
    return np.where(x[:, -1] > 0.1, ranks - 1, below)


def sent_entries(partition):
    """Entries of the tangent and of the residual that the rank inserts which inserts
    most in rows of others, for two slabs in contact."""
    sizes = {"lower_size": (1.0, 1.0, 0.1), "upper_size": (0.8, 0.8, 0.1)}
    scene = two_blocks(
        COMM, 3, "hexahedron", (16, 16, 1), (14, 14, 1), **sizes, partition=partition
    )
    contact = Contact(
        fem.Function(compat.vector_space(scene.mesh, 1)),
        scene.facet_tags,
        [(scene.tags["slave"], scene.tags["master"])],
        AugmentedLagrangian(1.0),
    )
    contact.update()
    largest = contact.statistics.communication.largest
    return np.array([largest.matrix_entries, largest.vector_entries])


@pytest.mark.mpi
@pytest.mark.many_ranks
@pytest.mark.skipif(COMM.size == 1, reason="one rank sends nothing")
def test_columns_insert_a_fraction_on_other_ranks():
    apart, together = map(sent_entries, (bodies_apart, columns((0.0, 0.0, 1.0))))
    assert np.all(5 * together < apart) and np.all(apart > 0)


@pytest.mark.mpi
def test_blocks_have_cells_above_each_other_on_one_rank():
    scene = two_blocks(
        COMM, 3, "hexahedron", (6, 6, 2), (6, 6, 2), partition=columns((0, 0, 1))
    )
    mesh = scene.mesh
    cells = compat.geometry_dofmap(mesh)[: mesh.topology.index_map(3).size_local]
    places = np.round(mesh.geometry.x[cells].mean(axis=1)[:, :2], 6)
    ranks = concatenated(np.full(len(cells), COMM.rank))
    assert_balanced(ranks, COMM.size)
    assert piles_of_several_ranks(ranks, concatenated(places)) <= COMM.size - 1

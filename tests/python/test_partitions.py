"""Partitions by the place of the cells."""

import numpy as np
import pytest
from problems import COMM, DIMENSION

from meshes.scenes import two_blocks
from raymortar.partitions import strips


@pytest.mark.quick
@pytest.mark.parametrize("ranks", [1, 2, 3, 7])
def test_strips_follow_each_other_with_as_many_cells(ranks):
    x = np.random.default_rng(1).uniform(-3.0, 5.0, (200, 3))
    found = strips(x, ranks)
    counts = np.bincount(found, minlength=ranks)
    assert counts.max() - counts.min() <= 1
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

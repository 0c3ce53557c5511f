"""Bodies: parts of the mesh that hang together, whatever rank has which cell."""

import gathered
import numpy as np
import pytest
from dolfinx import fem
from partitions import scattered
from problems import COMM, DIMENSION, stack

from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from meshes.scenes import two_blocks
from raymortar.core import compat
from raymortar.core.discretization.surfaces import connected, find_bodies
from raymortar.self_contact.all_facets import _by_place, in_order


def bodies_of_cells(V, bodies):
    """Body of each local cell, and whether all its dofs agree."""
    table = bodies.dofs[compat.dofmap_array(V)]
    assert gathered.everywhere((table == table[:, :1]).all())
    return table[:, 0]


@pytest.mark.quick
@pytest.mark.mpi(where=lambda degree, **_: degree == 1)
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("partition", [None, scattered])
def test_each_block_of_a_stack_is_a_body(cell, degree, partition):
    scene = stack(cell, (3, 4, 2), partition=partition)
    V = compat.vector_space(scene.mesh, degree)
    bodies = find_bodies(V)
    assert bodies.count == 3
    body = bodies_of_cells(V, bodies)
    tags = scene.cell_tags
    pairs = {(t, b) for t, b in zip(tags.values, body[tags.indices])}
    pairs = set().union(*COMM.allgather(pairs))
    assert len(pairs) == 3
    assert len({b for _, b in pairs}) == 3


@pytest.mark.mpi
def test_glued_blocks_are_one_body(cell):
    dim = DIMENSION[cell]
    ends = [((0.0,) * dim, (1.0,) * dim)]
    ends.append(((1.0,) + (0.0,) * (dim - 1), (2.0,) + (1.0,) * (dim - 1)))
    ends.append(((0.0,) * (dim - 1) + (5.0,), (1.0,) * (dim - 1) + (6.0,)))
    divisions = (2,) * dim
    blocks = [Block(divisions, *end, body=b) for end, b in zip(ends, "aab")]
    mesh, _, _ = assemble_blocks(COMM, blocks, cell)
    assert find_bodies(compat.vector_space(mesh, 1)).count == 2


@pytest.mark.mpi
def test_labels_are_the_same_on_all_ranks():
    """Of a dof, by its global number."""
    scene = two_blocks(COMM, 3, "tetrahedron", 4, 3, partition=scattered)
    V = compat.vector_space(scene.mesh, 2)
    bodies = find_bodies(V)
    numbers = compat.local_to_global(V.dofmap.index_map)
    assert bodies.count == 2
    both = set(zip(numbers.tolist(), bodies.dofs.tolist()))
    both = set().union(*COMM.allgather(both))
    assert len(both) == len({number for number, _ in both})


def test_chains_in_any_order_are_found():
    """Rows that tie neighbours of a chain, numbered at random, in two chains."""
    rng = np.random.default_rng(0)
    for n in (2, 3, 10, 1000):
        number = rng.permutation(2 * n).astype(np.int32)
        links = [[i, i + 1] for i in range(2 * n - 1) if i != n - 1]
        rows = number[rng.permutation(links)]
        lowest = connected(rows, 2 * n)
        for chain in (number[:n], number[n:]):
            assert (lowest[chain] == chain.min()).all()


def test_no_rows_tie_nothing():
    assert (connected(np.empty((0, 3), dtype=np.int32), 4) == np.arange(4)).all()


@pytest.mark.mpi
@pytest.mark.parametrize("unit", [1.0, 1e-3, 25.4, 1.0 / 3.0, 0.7])
def test_numbers_of_bodies_do_not_depend_on_the_unit_of_length(unit):
    """The middles of a stack have one x, whatever the nodes within are.

    Nodes of each unit's mesh are at places of their own, as those of a generator are.
    """
    scene = stack("triangle", (3, 4, 7))
    x = scene.mesh.geometry.x
    bump = x[:, 0] * (1.0 - x[:, 0]) * np.sin(7.0 * x[:, 1] / unit)
    x[:, 0] += 0.1 * bump
    x[:] *= unit
    V = compat.vector_space(scene.mesh, 1)
    bodies = find_bodies(V)
    number = _by_place(fem.Function(V), bodies)[bodies.dofs]
    heights = V.tabulate_dof_coordinates()[:, 1] / unit
    # Blocks of height 1 on each other, which may touch
    inner = np.abs(heights - np.round(heights)) > 1e-6
    assert gathered.everywhere((number == np.floor(heights))[inner].all())


def test_places_that_differ_by_rounding_are_the_same():
    noise = 1e-12 * np.random.default_rng(3).standard_normal((6, 3))
    places = np.array([[0.5, 0.1 * (5 - k), 0.2 * (k % 2)] for k in range(6)])
    assert in_order(places + noise, 1e-9).tolist() == [5, 4, 3, 2, 1, 0]
    places[:, 1] = 0.3
    assert in_order(places + noise, 1e-9).tolist() == [0, 2, 4, 1, 3, 5]
    assert in_order(places[:1], 0.0).tolist() == [0]

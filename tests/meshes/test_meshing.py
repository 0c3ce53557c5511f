"""Meshes of several bodies: measures, tags, glue, orientation, distribution."""

import itertools

from mpi4py import MPI

import mesh_measures as measure
import numpy as np
import pytest

from meshes.meshing import Block, assemble_blocks, mirrored
from raymortar.core import compat

COMM = MPI.COMM_WORLD
DIMENSION = {"triangle": 2, "quadrilateral": 2, "tetrahedron": 3, "hexahedron": 3}
CELLS = pytest.mark.parametrize("cell", DIMENSION)
DEGREES = pytest.mark.parametrize("degree", [1, 2])
PATTERNS = ["right", "left", "alternate", "random"]
SIDES = {
    2: ["left", "right", "bottom", "top"],
    3: ["left", "right", "front", "back", "bottom", "top"],
}


def unit(d, n=3, start=0.0, axis=0, **options):
    """Unit box, moved along an axis."""
    lower = np.zeros(d)
    lower[axis] = start
    return Block((n,) * d, tuple(lower), tuple(lower + 1.0), **options)


def brick(d):
    """Box of sides 1, 2 (, 3) with a tag on every side, and their measures."""
    size = (1.0, 2.0, 3.0)[:d]
    tags = {side: 11 + i for i, side in enumerate(SIDES[d])}
    areas = np.repeat(np.prod(size) / np.array(size), 2)
    block = Block((2, 3, 4)[:d], (0.0,) * d, size, tags=tags)
    return block, dict(zip(tags.values(), areas))


def turned(x):
    """Rotation by a right angle about the last axis (3D) or the origin (2D)."""
    y = x.copy()
    y[:, 0], y[:, 1] = -x[:, 1], x[:, 0]
    return y


@pytest.mark.mpi
@CELLS
@DEGREES
@pytest.mark.parametrize("perturb", [0.0, 0.25])
def test_box_has_its_volume_and_sides(cell, degree, perturb):
    block, areas = brick(DIMENSION[cell])
    mesh, cell_tags, facet_tags = assemble_blocks(
        COMM, [block], cell, degree, perturb, perturb
    )
    assert np.isclose(measure.volume(mesh, cell_tags, 1), np.prod(block.upper))
    for tag, expected in areas.items():
        assert np.isclose(measure.area(mesh, facet_tags, tag), expected)
    assert measure.smallest_jacobian(mesh) > 0.02
    assert compat.geometry_degree(mesh) == degree


@pytest.mark.mpi
@CELLS
def test_tags_follow_the_logical_side_not_the_place(cell):
    block, _ = brick(DIMENSION[cell])
    block = Block(
        block.divisions, block.lower, block.upper, mapping=turned, tags=block.tags
    )
    mesh, _, facet_tags = assemble_blocks(COMM, [block], cell)
    # The logical left side, x = 0, has become the bottom, y = 0
    facets = measure.owned_facets(mesh, facet_tags, block.tags["left"])
    assert np.allclose(measure.facet_nodes(mesh, facets)[:, :, 1], 0.0)
    facets = measure.owned_facets(mesh, facet_tags, block.tags["right"])
    assert np.allclose(measure.facet_nodes(mesh, facets)[:, :, 1], 1.0)


@pytest.mark.mpi
@CELLS
@DEGREES
def test_bodies_share_no_node_even_where_they_coincide(cell, degree):
    d = DIMENSION[cell]
    blocks = [unit(d, tags={"top": 4}), unit(d, start=1.0, axis=d - 1)]
    mesh, cell_tags, _ = assemble_blocks(COMM, blocks, cell, degree)
    dofmap = compat.geometry_dofmap(mesh)
    nodes = compat.geometry_nodes_global(mesh)[dofmap]
    parts = [np.unique(nodes[cell_tags.indices[cell_tags.values == b]]) for b in (1, 2)]
    every = [np.unique(np.concatenate(COMM.allgather(part))) for part in parts]
    assert len(every[0]) == len(every[1]) == (3 * degree + 1) ** d
    assert len(np.intersect1d(*every)) == 0
    assert np.isclose(measure.exterior_area(mesh), 2 * 2 * d)


@pytest.mark.mpi
@CELLS
@DEGREES
@pytest.mark.parametrize("pattern", PATTERNS)
def test_glued_blocks_conform_even_if_turned(cell, degree, pattern):
    d = DIMENSION[cell]
    # Turning takes the second block beside the first one: to 1 <= x <= 2
    blocks = [
        unit(d, pattern=pattern, body="one", tags={"left": 1}),
        Block(
            (3,) * d,
            (0.0, -2.0, 0.0)[:d],
            (1.0, -1.0, 1.0)[:d],
            mapping=turned,
            pattern="random",
            body="one",
            tags={"bottom" if d == 2 else "front": 2},
        ),
    ]
    mesh, cell_tags, facet_tags = assemble_blocks(COMM, blocks, cell, degree)
    assert np.isclose(measure.volume(mesh, cell_tags, 1), 2.0)
    # Facets that do not match at the common side would count as boundary
    assert np.isclose(measure.exterior_area(mesh), {2: 6.0, 3: 10.0}[d])
    assert np.isclose(measure.area(mesh, facet_tags, 2), 1.0)
    nodes = mesh.geometry.index_map().size_global
    assert nodes == (6 * degree + 1) * (3 * degree + 1) ** (d - 1)


@CELLS
@DEGREES
def test_perturbation_keeps_faces_and_edges(cell, degree):
    d = DIMENSION[cell]
    block = unit(d, n=4, tags={"top": 1})
    meshes = [
        assemble_blocks(MPI.COMM_SELF, [block], cell, degree, *perturb)[0]
        for perturb in [(0.0, 0.0), (0.3, 0.0), (0.3, 0.3)]
    ]
    # The same cells, so the same distribution: the nodes correspond
    order = [np.argsort(m.geometry.input_global_indices) for m in meshes]
    x = [m.geometry.x[o][:, :d] for m, o in zip(meshes, order)]
    bounds = [np.sum((p == 0.0) | (p == 1.0), axis=1) for p in x]
    inside, face = bounds[0] == 0, (bounds[0] == 1) & (x[0][:, -1] == 1.0)
    assert np.array_equal(x[1][~inside], x[0][~inside])
    # Mid nodes go with their edge, which may lead from side to side
    vertex = np.all(np.isclose(4.0 * x[0], np.rint(4.0 * x[0])), axis=1)
    assert np.all(np.any(x[1][inside & vertex] != x[0][inside & vertex], axis=1))
    moved = np.any(x[2] != x[0], axis=1)
    assert np.array_equal(moved[vertex], (inside | face)[vertex])
    assert not np.any(moved & ~(inside | face))
    assert np.all(x[2][face][:, -1] == 1.0)
    assert np.abs(x[2] - x[0]).max() < 0.3 / 4


@CELLS
@pytest.mark.parametrize("pattern", ["right", "random"])
def test_shaken_cells_are_straight(cell, pattern):
    """Bent edges of diagonals would cost all orders of convergence."""
    block = unit(DIMENSION[cell], n=4, tags={"top": 1}, pattern=pattern)
    mesh, _, _ = assemble_blocks(MPI.COMM_SELF, [block], cell, 2, 0.3, 0.3)
    points = compat.basix_element(cell, 2).points
    nodes, shape = measure.cell_nodes(mesh), measure.lagrange(cell, 1, points)[0]
    straight = np.einsum("qn,cni->cqi", shape, nodes[:, : shape.shape[1]])
    np.testing.assert_allclose(nodes, straight, atol=1e-13)


def annulus(d, n, grading=None):
    """Quarter of a ring between the radii 1 and 2, of height 1 in 3D."""

    def mapping(x):
        r, angle = 1.0 + x[:, -1], 0.5 * np.pi * (1.0 - x[:, 0])
        y = np.column_stack([r * np.cos(angle), r * np.sin(angle)])
        # x, radius and height are right-handed with the height reversed
        return y if d == 2 else np.column_stack([y, 1.0 - x[:, 1]])

    tags = {"bottom": 1, "top": 2, "left": 3, "right": 4}
    return unit(d, n=n, mapping=mapping, tags=tags, grading=grading)


@CELLS
@DEGREES
def test_curved_measures_converge(cell, degree):
    d, errors = DIMENSION[cell], []
    for n in (3, 6):
        mesh, cell_tags, facet_tags = assemble_blocks(
            MPI.COMM_SELF, [annulus(d, n)], cell, degree
        )
        assert measure.smallest_jacobian(mesh) > 0.4
        exact = [0.75 * np.pi, 0.5 * np.pi, np.pi, 1.0, 1.0]
        measures = [measure.volume(mesh, cell_tags, 1)]
        measures += [measure.area(mesh, facet_tags, tag) for tag in (1, 2, 3, 4)]
        errors.append(np.abs(np.array(measures) - exact))
    assert np.allclose(errors[1][3:], 0.0, atol=1e-13)
    rates = np.log2(errors[0][:3] / errors[1][:3])
    assert np.all(rates > {1: 1.9, 2: 3.8}[degree])
    assert errors[1].max() < {1: 0.03, 2: 1e-4}[degree]


@pytest.mark.parametrize("cell", ["triangle", "quadrilateral"])
def test_mid_nodes_lie_at_mean_parameters(cell):
    def parabola(x):
        return np.column_stack([x[:, 0], x[:, 1] * (1.0 + x[:, 0] ** 2)])

    block = unit(2, n=4, mapping=parabola, tags={"top": 1}, grading=(np.square, None))
    mesh, _, tags = assemble_blocks(MPI.COMM_SELF, [block], cell, 2, perturb_sides=0.2)
    nodes = measure.facet_nodes(mesh, tags.indices)
    assert np.allclose(nodes[:, 2, 0], nodes[:, :2, 0].mean(axis=1))
    assert np.allclose(nodes[:, :, 1], 1.0 + nodes[:, :, 0] ** 2)


@CELLS
@pytest.mark.parametrize("mapped", [False, True])
def test_mirror_image_keeps_orientation_and_swaps_sides(cell, mapped):
    d = DIMENSION[cell]
    block = annulus(d, 3, [np.square, *[None] * (d - 1)]) if mapped else brick(d)[0]
    for axis in range(d):
        image = mirrored(block, axis)
        mesh, cell_tags, facet_tags = assemble_blocks(MPI.COMM_SELF, [image], cell)
        first, first_cells, first_tags = assemble_blocks(MPI.COMM_SELF, [block], cell)
        assert measure.smallest_jacobian(mesh) > 0.0
        volumes = [measure.volume(mesh, cell_tags, 1)]
        volumes += [measure.volume(first, first_cells, 1)]
        # The cut of simplices' sides need not be mirrored: equal to second order
        assert np.isclose(*volumes, rtol=0.01 if mapped else 1e-12)
        for tag in block.tags.values():
            a = measure.facet_nodes(mesh, facet_tags.indices[facet_tags.values == tag])
            b = measure.facet_nodes(first, first_tags.indices[first_tags.values == tag])
            a[:, :, axis] *= -1.0
            assert np.allclose(*[np.sort(p.reshape(-1, d), axis=0) for p in (a, b)])


@pytest.mark.mpi
@CELLS
def test_same_arguments_same_mesh(cell):
    d = DIMENSION[cell]

    def nodes(seed):
        block = unit(d, pattern="random", tags={"top": 1})
        mesh, _, _ = assemble_blocks(COMM, [block], cell, 1, 0.2, 0.2, seed)
        owned = measure.cell_nodes(mesh)
        number = mesh.topology.original_cell_index[: len(owned)]
        # On several ranks DOLFINx itself need not repeat its own order of the cells
        parts = [np.concatenate(part) for part in zip(*COMM.allgather((number, owned)))]
        return parts[1][np.argsort(parts[0])]

    first, again, other = nodes(1), nodes(1), nodes(2)
    assert np.array_equal(first, again)
    assert not np.allclose(first, other)


@pytest.mark.mpi
@CELLS
def test_tags_are_those_of_a_single_rank(cell):
    block, areas = brick(DIMENSION[cell])
    meshes = [assemble_blocks(c, [block], cell, 2) for c in (COMM, MPI.COMM_SELF)]
    counts = [measure.facet_counts(m, tags, 16) for m, _, tags in meshes]
    assert np.array_equal(*counts)
    # A tag on each local facet of the boundary, owned or not, and on no other
    mesh, _, tags = meshes[0]
    owned = tags.indices < mesh.topology.index_map(mesh.topology.dim - 1).size_local
    assert np.array_equal(tags.indices[owned], compat.exterior_facets(mesh))


@pytest.mark.mpi
def test_a_rank_without_cells_is_fine():
    mesh, cell_tags, facet_tags = assemble_blocks(COMM, [unit(2, 1, tags={"top": 1})])
    assert np.isclose(measure.volume(mesh, cell_tags, 1), 1.0)
    assert np.isclose(measure.area(mesh, facet_tags, 1), 1.0)


def test_bodies_are_numbered_in_order():
    labels = ["b", None, "a", "b"]
    blocks = [unit(2, 1, start, body=b) for start, b in zip((0, 5, 9, 1), labels)]
    mesh, cell_tags, _ = assemble_blocks(MPI.COMM_SELF, blocks, "quadrilateral")
    areas = [measure.volume(mesh, cell_tags, b) for b in (1, 2, 3)]
    assert np.allclose(areas, [2.0, 1.0, 1.0])


@pytest.mark.parametrize(
    "change, message",
    [
        ({"divisions": (2,)}, "not 2 or 3"),
        ({"divisions": (2, 0)}, "integers >= 1"),
        ({"divisions": (2, 1.5)}, "integers >= 1"),
        ({"lower": (0.0,)}, "must have 2 numbers"),
        ({"upper": (1.0, 0.0)}, "not below"),
        ({"upper": (1.0, np.nan)}, "not below"),
        ({"grading": (None,)}, "2 entries"),
        ({"tags": {"front": 1}}, "no side 'front'"),
        ({"tags": {"top": 0}}, "positive int32"),
        ({"pattern": "up"}, "pattern 'up'"),
    ],
)
def test_bad_blocks_are_refused(change, message):
    arguments = {"divisions": (2, 2), "lower": (0.0, 0.0), "upper": (1.0, 1.0)}
    with pytest.raises(ValueError, match=message):
        Block(**{**arguments, **change})


@pytest.mark.parametrize(
    "blocks, options, message",
    [
        ([], {}, "no blocks"),
        ([unit(2)], {"cell": "prism"}, "'prism' is not one of"),
        ([unit(2)], {"cell": "hexahedron"}, "dimension 3"),
        ([unit(2)], {"geometry_degree": 3}, "neither 1 nor 2"),
        ([unit(2)], {"perturb": 0.5}, "perturb = 0.5"),
        ([unit(2)], {"perturb_sides": -0.1}, "perturb_sides = -0.1"),
        ([unit(2, grading=(np.zeros(4), None))], {}, "does not increase"),
        ([unit(2, grading=(np.linspace(0, 2, 4), None))], {}, "does not increase"),
        ([unit(2, grading=(np.zeros(3), None))], {}, "has shape"),
        ([unit(2, mapping=lambda x: x[:, :1])], {}, "finite points"),
        ([unit(2, mapping=lambda x: x * np.nan)], {}, "finite points"),
        ([unit(2, mapping=lambda x: -x[:, ::-1])], {}, "inverted or flat"),
        ([unit(2, mapping=lambda x: x * [1.0, 0.0])], {}, "inverted or flat"),
        ([unit(2, body=1), unit(2, start=2.0, body=1)], {}, "do not hang together"),
        (
            [unit(2, body=1, tags={"right": 7}), unit(2, start=1.0, body=1)],
            {},
            r"tags \[7\] are on sides glued",
        ),
    ],
)
def test_bad_input_is_refused(blocks, options, message):
    with pytest.raises(ValueError, match=message):
        assemble_blocks(MPI.COMM_SELF, blocks, **options)


@pytest.mark.parametrize("keys", list(itertools.permutations(range(4))))
def test_quadrilaterals_are_cut_through_their_lowest_vertex(keys):
    from meshes.cells import split_quadrilaterals

    triangles = split_quadrilaterals(np.array([keys]))[0]
    first = int(np.argmin(keys))
    assert {first, 3 - first} == set(triangles[0]) & set(triangles[1])


def test_hexahedra_are_filled_and_cut_through_lowest_vertices():
    from meshes.cells import split_hexahedra

    rng = np.random.default_rng(3)
    keys = np.array([rng.permutation(8) for _ in range(400)])
    corners = (np.arange(8)[:, None] >> np.arange(3)) & 1
    for key, tetrahedra in zip(keys, split_hexahedra(keys)):
        x = corners[tetrahedra]
        assert np.allclose(np.linalg.det(x[:, 1:] - x[:, :1]), 1.0)
        edges = {frozenset(e) for t in tetrahedra for e in itertools.combinations(t, 2)}
        for axis, end in itertools.product(range(3), range(2)):
            face = np.flatnonzero(corners[:, axis] == end)
            lowest = face[np.argmin(key[face])]
            opposite = face.sum() // 2 - lowest
            assert frozenset((lowest, opposite)) in edges

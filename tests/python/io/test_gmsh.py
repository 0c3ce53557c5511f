"""Meshes from Gmsh."""

from pathlib import Path

import mesh_measures as measure
import numpy as np
import pytest
from gathered import concatenated
from problems import COMM

from raymortar.core import compat, errors
from raymortar.io import read_gmsh
from raymortar.io.partitions import columns

pytestmark = pytest.mark.mpi


def gmsh_square(gmsh):
    """Model of the unit square, with named groups."""
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add("square")
    surface = gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(2, [surface], 5)
    gmsh.model.setPhysicalName(2, 5, "body")
    sides = gmsh.model.getBoundary([(2, surface)], oriented=False)
    gmsh.model.addPhysicalGroup(1, [tag for _, tag in sides], 8)
    gmsh.model.setPhysicalName(1, 8, "skin")
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.setOrder(2)


@pytest.mark.parametrize("from_file", [False, True])
def test_read_gmsh(from_file, tmp_path):
    gmsh = pytest.importorskip("gmsh")
    source = None
    if COMM.rank == 0:
        gmsh.initialize(["", "-v", "1"])
        gmsh_square(gmsh)
        source = gmsh.model
        if from_file:
            source = tmp_path / "square.msh"
            gmsh.write(str(source))
            gmsh.finalize()
    read = read_gmsh(source, COMM, gdim=2)
    if COMM.rank == 0 and not from_file:
        gmsh.finalize()
    assert read.names == {"body": (2, 5), "skin": (1, 8)}
    assert read.mesh.geometry.dim == 2 and compat.geometry_degree(read.mesh) == 2
    assert np.all(read.cell_tags.values == 5)
    exterior = compat.exterior_facets(read.mesh)
    assert set(exterior) <= set(read.facet_tags.indices[read.facet_tags.values == 8])


def gmsh_crack(gmsh):
    """Square with a cut in the middle, whose two faces Gmsh's plugin makes: it numbers
    the nodes with a hole."""
    gmsh.model.add("crack")
    occ = gmsh.model.occ
    square = occ.addRectangle(-1, -1, 0, 2, 2)
    cut = occ.addLine(*(occ.addPoint(x, 0, 0) for x in (-0.5, 0.5)))
    occ.fragment([(2, square)], [(1, cut)])
    occ.synchronize()
    lines = [line for line in gmsh.model.getEntities(1) if is_inside(gmsh, line)]
    gmsh.model.addPhysicalGroup(2, [square], 5)
    gmsh.model.addPhysicalGroup(1, [tag for _, tag in lines], 8)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.25)
    gmsh.model.mesh.generate(2)
    for name, value in (("Dimension", 1), ("PhysicalGroup", 8)):
        gmsh.plugin.setNumber("Crack", name, value)
    gmsh.plugin.run("Crack")


def is_inside(gmsh, line):
    """Whether a line of the square is no side of it."""
    return np.abs(gmsh.model.getBoundingBox(*line)).max() < 0.6


@pytest.mark.quick
@pytest.mark.parametrize("from_file", [False, True])
@pytest.mark.parametrize("partition", [None, columns((0.0, 1.0))])
def test_nodes_may_be_numbered_with_holes(partition, from_file, tmp_path):
    gmsh = pytest.importorskip("gmsh")
    source, before = None, []
    if COMM.rank == 0:
        gmsh.initialize(["", "-v", "1"])
        gmsh_crack(gmsh)
        before = gmsh.model.mesh.getNodes()[0]
        assert max(before) > len(before)
        source = gmsh.model
        if from_file:
            source = tmp_path / "crack.msh"
            gmsh.write(str(source))
            gmsh.finalize()
    read = read_gmsh(source, COMM, gdim=2, partition=partition)
    if COMM.rank == 0 and not from_file:
        # The caller knows nodes by these numbers
        assert np.array_equal(np.sort(gmsh.model.mesh.getNodes()[0]), np.sort(before))
        gmsh.finalize()
    nodes = read.mesh.geometry.index_map()
    assert nodes.size_global == COMM.bcast(len(before), root=0)
    assert measure.volume(read.mesh, read.cell_tags, 5) == pytest.approx(4.0, rel=1e-12)
    # Both faces of the cut
    assert measure.area(read.mesh, read.facet_tags, 8) == pytest.approx(2.0)


def gmsh_pair(gmsh, order, recombined):
    """Model of two squares above each other that share no node, with named groups."""
    gmsh.model.add("pair")
    bodies = [gmsh.model.occ.addRectangle(0, k, 0, 1, 1) for k in range(2)]
    gmsh.model.occ.synchronize()
    for tag, body in zip((4, 9), bodies):
        gmsh.model.addPhysicalGroup(2, [body], tag)
        sides = gmsh.model.getBoundary([(2, body)], oriented=False)
        gmsh.model.addPhysicalGroup(1, [side for _, side in sides], tag)
        if recombined:
            gmsh.model.mesh.setTransfiniteSurface(body)
            gmsh.model.mesh.setRecombine(2, body)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.2)
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.setOrder(order)


def midpoints(mesh):
    """Means of the nodes of this rank's own cells, shape (n, 3)."""
    cells = compat.geometry_dofmap(mesh)[: mesh.topology.index_map(2).size_local]
    return mesh.geometry.x[cells].mean(axis=1)


@pytest.mark.parametrize("order, recombined", [(1, False), (1, True), (2, True)])
def test_a_partition_says_where_cells_of_a_gmsh_model_go(order, recombined):
    """Each body from its own side, so that cells in another order would be elsewhere."""
    gmsh = pytest.importorskip("gmsh")

    def partition(x, ranks):
        assert x.shape[1] == 2
        along = np.where(x[:, 1] < 1.0, x[:, 0], 1.0 - x[:, 0])
        return (0.99 * along * ranks).astype(int)  # no midpoint is on a border

    if COMM.rank == 0:
        gmsh.initialize(["", "-v", "1"])
        gmsh_pair(gmsh, order, recombined)
    source = gmsh.model if COMM.rank == 0 else None
    # Looked at where the model is
    given = partition if COMM.rank == 0 else None
    read = read_gmsh(source, COMM, gdim=2, partition=given)
    whole = read_gmsh(source, COMM, gdim=2)
    if COMM.rank == 0:
        gmsh.finalize()
    x = midpoints(read.mesh)
    assert COMM.size == 1 or read.mesh.topology.index_map(2).num_ghosts == 0
    np.testing.assert_array_equal(partition(x[:, :2], COMM.size), COMM.rank)
    tags = np.zeros(len(x), dtype=int)
    tags[read.cell_tags.indices] = read.cell_tags.values
    np.testing.assert_array_equal(tags, np.where(x[:, 1] < 1.0, 4, 9))
    assert compat.geometry_degree(read.mesh) == order
    same = [
        sorted(np.round(concatenated(midpoints(m.mesh)), 9).tolist())
        for m in (read, whole)
    ]
    assert same[0] == same[1]
    for tag in (4, 9):
        lengths = [measure.area(m.mesh, m.facet_tags, tag) for m in (read, whole)]
        np.testing.assert_allclose(lengths, 4.0)


def test_a_flat_mesh_in_space_takes_a_partition():
    path = Path(__file__).parents[3] / "meshes" / "two_blocks_2d.msh"
    read = read_gmsh(path, COMM, partition=columns((0.0, 1.0, 0.0)))
    assert read.mesh.geometry.dim == 3
    counts = COMM.allgather(read.mesh.topology.index_map(2).size_local)
    assert max(counts) - min(counts) <= 1


@pytest.mark.parametrize(
    "partition, error, message",
    [
        ("graph", errors.ContactError, "must be a function .*, not 'graph'"),
        (lambda x, ranks: [0, 0], errors.ContactError, r"not int64 of shape \(2,\)"),
        (lambda x, ranks: np.zeros(len(x)), errors.ContactError, "not float64 of"),
        (lambda x, ranks: np.full(len(x), ranks), errors.ContactError, "to rank"),
        (columns((0.0, 0.0, 1.0)), errors.ContactError, "must be 2 finite numbers"),
        (lambda x, ranks: x[:, 5], IndexError, "out of bounds"),
    ],
)
def test_wrong_partitions_are_refused_everywhere(partition, error, message, tmp_path):
    gmsh = pytest.importorskip("gmsh")
    path = tmp_path / "square.msh"
    if COMM.rank == 0:
        gmsh.initialize(["", "-v", "1"])
        gmsh_square(gmsh)
        gmsh.write(str(path))
        gmsh.finalize()
    with pytest.raises(error, match=message):
        read_gmsh(path, COMM, gdim=2, partition=partition)


def test_missing_gmsh_file_is_refused_everywhere(tmp_path):
    pytest.importorskip("gmsh")
    with pytest.raises(errors.ContactError, match="no Gmsh file .*none.msh"):
        read_gmsh(tmp_path / "none.msh", COMM, gdim=2)


def gmsh_halves(gmsh):
    """Two squares, one of quadrilaterals and one of triangles."""
    halves = [(2, gmsh.model.occ.addRectangle(x, 0, 0, 1, 1)) for x in (0, 1)]
    gmsh.model.occ.fragment(halves[:1], halves[1:])
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(2, [tag for _, tag in halves], 1)
    gmsh.model.mesh.setRecombine(*halves[0])
    gmsh.model.mesh.generate(2)


@pytest.mark.parametrize(
    "fill_model, pattern",
    [
        (lambda gmsh: None, "no physical groups"),
        (gmsh_halves, r"one type, not of \['Quadr.*', 'Triangle 3'\]"),
    ],
)
def test_unreadable_gmsh_models_are_refused_everywhere(fill_model, pattern):
    gmsh = pytest.importorskip("gmsh")
    if COMM.rank == 0:
        gmsh.initialize(["", "-v", "1"])
        gmsh.model.add("bad")
        fill_model(gmsh)
    with pytest.raises(errors.ContactError, match=pattern):
        read_gmsh(gmsh.model, COMM, gdim=2)
    if COMM.rank == 0:
        gmsh.finalize()


def gmsh_lone(gmsh):
    """A square, and a line apart from it in a group of its own."""
    gmsh_square(gmsh)
    ends = [gmsh.model.occ.addPoint(x, 0, 0) for x in (2, 3)]
    lone = gmsh.model.occ.addLine(*ends)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(1, [lone], 9)
    gmsh.model.setPhysicalName(1, 9, "lone")
    gmsh.model.mesh.clear()
    gmsh.model.mesh.generate(2)


def gmsh_diagonal(gmsh):
    """A square, and a line between two of its corners that is no edge of a cell."""
    gmsh_square(gmsh)
    line = gmsh.model.addDiscreteEntity(1)
    gmsh.model.mesh.addElementsByType(line, 1, [], [1, 3])
    gmsh.model.addPhysicalGroup(1, [line], 9)


def gmsh_sheet(gmsh):
    """A cube of tetrahedra, and a face above it."""
    gmsh.model.add("sheet")
    body = gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
    sheet = gmsh.model.occ.addRectangle(0, 0, 2, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(3, [body], 1)
    skin = gmsh.model.getBoundary([(3, body)], oriented=False)
    gmsh.model.addPhysicalGroup(2, [tag for _, tag in skin], 2)
    gmsh.model.addPhysicalGroup(2, [sheet], 3)
    gmsh.model.setPhysicalName(2, 3, "sheet")
    gmsh.option.setNumber("Mesh.MeshSizeMax", 1.0)
    gmsh.model.mesh.generate(3)


@pytest.mark.parametrize(
    "fill_model, dim, said",
    [
        (
            gmsh_lone,
            2,
            r"group 'lone' \(tag 9\) has 4 facet.* of no cell .* at \(2\.\d*, 0,",
        ),
        (
            gmsh_diagonal,
            2,
            r"group tag 9 has 1 facet.* the first at \(0.5, 0.5, 0\): take",
        ),
        (gmsh_sheet, 3, r"group 'sheet' \(tag 3\) has \d+ facet.*, 2\): take them out"),
    ],
)
def test_facets_of_no_cell_are_refused_everywhere(fill_model, dim, said):
    gmsh = pytest.importorskip("gmsh")
    if COMM.rank == 0:
        gmsh.initialize(["", "-v", "1"])
        fill_model(gmsh)
    with pytest.raises(errors.ContactError, match=said):
        read_gmsh(gmsh.model, COMM, gdim=dim)
    if COMM.rank == 0:
        gmsh.finalize()

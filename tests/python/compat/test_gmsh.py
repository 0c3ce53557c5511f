"""Meshes from Gmsh."""

import numpy as np
import pytest
from problems import COMM

from raymortar import compat, errors

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
    read = compat.read_gmsh(source, COMM, gdim=2)
    if COMM.rank == 0 and not from_file:
        gmsh.finalize()
    assert read.names == {"body": (2, 5), "skin": (1, 8)}
    assert read.mesh.geometry.dim == 2 and compat.geometry_degree(read.mesh) == 2
    assert np.all(read.cell_tags.values == 5)
    exterior = compat.exterior_facets(read.mesh)
    assert set(exterior) <= set(read.facet_tags.indices[read.facet_tags.values == 8])


def test_missing_gmsh_file_is_refused_everywhere(tmp_path):
    pytest.importorskip("gmsh")
    with pytest.raises(errors.ContactError, match="no Gmsh file .*none.msh"):
        compat.read_gmsh(tmp_path / "none.msh", COMM, gdim=2)


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
        compat.read_gmsh(gmsh.model, COMM, gdim=2)
    if COMM.rank == 0:
        gmsh.finalize()

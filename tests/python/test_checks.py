"""Every refusal of spaces, tags and facets."""

import numpy as np
import pytest
from dolfinx import fem, mesh as dmesh

from boxes import (
    COMM,
    CELLS,
    DEGREES,
    box_arrays,
    build,
    box,
    curve,
    displacement,
    tag_sides,
    whole_boundary,
)
from raymortar import compat, errors
from raymortar.checks import check_areas, check_pair, check_space
from raymortar.facets import tagged_facets

pytestmark = pytest.mark.mpi


# Refusals of the displacement


def refused(u, pattern):
    with pytest.raises(errors.ContactError, match=pattern):
        check_space(u)


@pytest.mark.parametrize("p, g", DEGREES)
@pytest.mark.parametrize("cell", CELLS)
def test_good_spaces_pass(cell, p, g):
    check_space(displacement(box(cell, degree=g), p))


@pytest.mark.parametrize(
    "family, degree, shape, pattern",
    [
        ("Lagrange", 3, (2,), "has degree 3"),
        ("Lagrange", 1, (), r"shape \(\); contact needs vectors"),
        ("Lagrange", 1, (3,), r"shape \(3,\)"),
        ("Lagrange", 1, (2, 2), r"shape \(2, 2\)"),
        ("DG", 1, (2,), "discontinuous"),
        ("RT", 1, (), "not a Lagrange element"),
    ],
)
def test_other_elements_are_refused(family, degree, shape, pattern):
    V = compat.space(box("triangle"), family, degree, shape)
    refused(fem.Function(V), pattern)


def test_sub_space_is_refused():
    u = displacement(box("triangle"))
    refused(u.sub(0), "view into a larger space")


def test_mixed_element_is_refused(monkeypatch):
    u = displacement(box("triangle"))
    mixed = compat.ElementInfo(False, -1, 1, (3,), True, False, False)
    monkeypatch.setattr(compat, "element_info", lambda V: mixed)
    refused(u, "is mixed")


def test_mixed_cells_are_refused(monkeypatch):
    u = displacement(box("triangle"))
    monkeypatch.setattr(compat, "cell_name", lambda mesh: "mixed")
    refused(u, "has mixed cells")


def test_prisms_are_refused():
    u = displacement(dmesh.create_unit_cube(COMM, 2, 2, 2, dmesh.CellType.prism))
    refused(u, "has prism cells; supported")


def test_membrane_is_refused():
    cells, x = box_arrays("triangle", 2, 1)
    u = displacement(build("triangle", (cells, np.column_stack([x, 0 * x[:, 0]]))))
    refused(u, "cells of dimension 2 in a space of dimension 3")


def test_line_is_refused():
    cells = np.arange(4)[:, None] + [0, 1]
    u = displacement(build("interval", (cells, np.arange(5.0)[:, None])))
    refused(u, "space of dimension 1")


def test_cubic_geometry_is_refused():
    refused(
        displacement(box("triangle", degree=3)), "geometry of the mesh has degree 3"
    )


def test_complex_numbers_are_refused(monkeypatch):
    u = displacement(box("triangle"))
    monkeypatch.setattr(compat, "scalar_type_is_real", lambda: False)
    refused(u, "not complex PETSc")


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_values_that_are_not_finite_are_refused_with_rank_and_count(value):
    u = displacement(box("triangle"))
    last = COMM.size - 1
    if COMM.rank == last:
        u.x.array[:2] = value
    where = rf".*\(rank {last}\)" if COMM.size > 1 else "$"
    refused(u, r"2 value\(s\) not finite" + where)


# Refusals of tags


def test_tags_of_cells_are_refused():
    mesh = box("triangle")
    tags = compat.meshtags(mesh, 2, [0], 1)
    with pytest.raises(errors.ContactError, match="entities of dimension 2; facets"):
        tagged_facets(mesh, tags, 1, "slave")


def test_unknown_tag_is_refused_with_the_tags_that_exist():
    mesh = box("triangle")
    tags = tag_sides(mesh, (0, 0.0), (0, 1.0))
    with pytest.raises(errors.ContactError, match=r"master tag 5; .*are \[1, 2\]"):
        tagged_facets(mesh, tags, 5, "master")


@pytest.mark.parametrize("ghosts", [False, True])
@pytest.mark.parametrize("cell, inside", [("quadrilateral", 8), ("hexahedron", 32)])
def test_interior_facets_are_refused_and_counted(cell, inside, ghosts):
    """Two planes inside and one on the boundary carry the tag."""
    mesh = box(cell, n=4, ghosts=ghosts)
    dim = mesh.topology.dim - 1
    planes = [
        dmesh.locate_entities(mesh, dim, lambda x: np.isclose(x[0], value))
        for value in (0.0, 0.25, 0.5)
    ]
    found = np.concatenate(planes)
    tags = compat.meshtags(mesh, dim, found, 1)
    pattern = rf"{inside} facet\(s\) with the slave tag 1 lie inside .*at \(0\.(25|5), "
    with pytest.raises(errors.ContactError, match=pattern):
        tagged_facets(mesh, tags, 1, "slave")


@pytest.mark.parametrize("cell", CELLS)
def test_surfaces_that_share_vertices_are_refused(cell):
    mesh = box(cell)
    tags = tag_sides(mesh, (0, 0.0), (1, 0.0))
    slave, master = (tagged_facets(mesh, tags, t, "") for t in (1, 2))
    count = 1 if mesh.geometry.dim == 2 else 3
    pattern = rf"tag 1\).*tag 2\) share {count} vertex\(es\), for example at \(0, 0"
    with pytest.raises(errors.ContactError, match=pattern):
        check_pair(mesh, slave, master)
    with pytest.raises(errors.ContactError, match=r"tag 1\).*tag 1\) share"):
        check_pair(mesh, slave, slave)


def test_surfaces_that_meet_at_a_rank_boundary_are_refused():
    """Wherever the mesh is cut, the two halves of the bottom meet in one vertex."""
    cells, x = box_arrays("quadrilateral", 8, 1)
    mesh = build("quadrilateral", (cells, x * [4, 1]))
    bottom = dmesh.locate_entities_boundary(mesh, 1, lambda x: np.isclose(x[1], 0))
    for cut in np.arange(0.5, 4, 0.5):
        left = dmesh.locate_entities_boundary(
            mesh, 1, lambda x: np.isclose(x[1], 0) & (x[0] < cut + 1e-9)
        )
        values = np.where(np.isin(bottom, left), 1, 2)
        tags = compat.meshtags(mesh, 1, bottom, values)
        slave, master = (tagged_facets(mesh, tags, t, "") for t in (1, 2))
        with pytest.raises(errors.ContactError, match=rf"share 1 .* at \({cut:g}, 0\)"):
            check_pair(mesh, slave, master)


@pytest.mark.parametrize("cell", CELLS)
def test_surfaces_apart_pass(cell):
    mesh = box(cell)
    tags = tag_sides(mesh, (0, 0.0), (0, 1.0))
    slave, master = (tagged_facets(mesh, tags, t, "") for t in (1, 2))
    check_pair(mesh, slave, master)


# Refusals of facets


@pytest.mark.parametrize("g", [1, 2])
@pytest.mark.parametrize("cell", CELLS)
def test_good_facets_pass_at_any_scale(cell, g):
    for scale in (1e-9, 1e9):
        mesh = box(cell, degree=g, move=lambda x: scale * curve(x))
        check_areas(mesh, whole_boundary(mesh))


@pytest.mark.parametrize("cell", ["quadrilateral", "hexahedron"])
def test_facets_without_area_are_refused(cell):
    def collapse(x):
        x[:, 0] *= np.where(np.isclose(x[:, 1], 0), 0, 1)
        return x

    mesh = box(cell, n=1, move=collapse)
    pattern = r"1 facet\(s\) with tag 7 have no area, the first on cell 0 at \(0, 0"
    with pytest.raises(errors.ContactError, match=pattern):
        check_areas(mesh, whole_boundary(mesh))


def test_thin_facets_pass():
    """A stack of sheets, a million times longer than thick, is still a body."""
    mesh = box("hexahedron", move=lambda x: x * [1, 1, 1e-6])
    check_areas(mesh, whole_boundary(mesh))


def test_coordinates_that_are_not_finite_are_refused():
    mesh = box("triangle")
    facets = whole_boundary(mesh)
    mesh.geometry.x[:] = np.nan
    with pytest.raises(errors.ContactError, match="tag 7 have coordinates not finite"):
        check_areas(mesh, facets)

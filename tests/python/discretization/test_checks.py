"""Every refusal of spaces, tags and facets."""

import numpy as np
import pytest
from boxes import (
    CELLS,
    COMM,
    DEGREES,
    box,
    box_arrays,
    build,
    curve,
    displacement,
    tag_sides,
    whole_boundary,
)
from dolfinx import fem
from dolfinx import mesh as dmesh

from raymortar.core import compat, errors
from raymortar.core.discretization.facets import tagged_facets
from raymortar.setup.arguments import check_space
from raymortar.setup.facets import check_areas, check_cells
from raymortar.setup.shared_vertices import check_pair

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


# Refusals of cells


def moved_node(cell, g, place, to):
    """A box of two cells each way; its geometry's node at one place goes elsewhere."""

    def move(x):
        x[np.all(np.isclose(x, place), axis=1)] = to
        return x

    return box(cell, degree=g, move=move)


def single(cell, corners, degree=1):
    """Mesh of one cell."""
    return build(cell, (np.arange(len(corners))[None], np.array(corners)), degree)


# Cell, degree of the geometry, a node's place and where it goes, tagged facets that
# are on cells which this folds. Outlines tell nothing of most of them
FOLDED = {
    "re-entrant corner": ("quadrilateral", 1, (0.5, 0.5), (0.2, 0.2), 2),
    "crossed sides": ("quadrilateral", 1, (0.5, 0.5), (-0.3, 0.25), 4),
    "re-entrant corner in 3D": ("hexahedron", 1, (0.5,) * 3, (0.1,) * 3, 3),
    "edge over a vertex": ("triangle", 2, (0.25, 0.25), (0.45, 0.0), 1),
    "node near the end of its edge": ("triangle", 2, (0.25, 0.0), (0.4, 0.0), 1),
    "edge of tetrahedra": ("tetrahedron", 2, (0.25, 0.0, 0.0), (0.4, 0.0, 0.0), 2),
    "edge across its cell": ("quadrilateral", 2, (0.25, 0.5), (0.25, 0.05), 2),
    "middle": ("hexahedron", 2, (0.25,) * 3, (0.45, 0.25, 0.25), 3),
}


@pytest.mark.parametrize("case", FOLDED)
def test_facets_on_folded_cells_are_refused(case):
    *moved, count = FOLDED[case]
    mesh = moved_node(*moved)
    facets = whole_boundary(mesh)
    check_areas(mesh, facets)
    with pytest.raises(errors.ContactError, match="tag 7 .* a fold") as caught:
        check_cells(mesh, facets)
    # Facets of the rank that is named; the cells may be on several
    number = int(str(caught.value).split()[0])
    assert number == count if COMM.size == 1 else 1 <= number <= count


@pytest.mark.parametrize("corner", [0, 1, 2, 3])
def test_the_fold_is_found_from_any_corner_and_named(corner):
    corners = np.roll([[0.0, 0], [1, 0], [0.2, 0.2], [0, 1]], corner, axis=0)
    mesh = single("quadrilateral", corners[[0, 1, 3, 2]])
    x = np.stack([corners, np.roll(corners, -1, axis=0)]).mean(axis=0)
    with pytest.raises(errors.ContactError) as caught:
        check_cells(mesh, whole_boundary(mesh))
    text = str(caught.value)
    assert text.startswith("4 facet(s) with tag 7 are on cells with a fold")
    assert "the first on cell 0 at" in text
    assert any(f"({a:.6g}, {b:.6g})" in text for a, b in x)
    assert ("(rank " in text) == (COMM.size > 1)


FLAT = {
    "triangle": [[0.0, 0], [1, 0], [0.4, 0]],
    "quadrilateral": [[0.0, 0], [1, 0], [0.2, 0], [0.6, 0]],
    "tetrahedron": [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.4, 0]],
}


@pytest.mark.parametrize("cell", FLAT)
def test_cells_without_volume_are_refused(cell):
    """All of their facets have area."""
    for height, bad in ((0.0, True), (1e-14, True), (1e-9, False)):
        corners = np.array(FLAT[cell])
        corners[2:, -1] += height
        mesh = single(cell, corners)
        facets = whole_boundary(mesh)
        check_areas(mesh, facets)
        if bad:
            with pytest.raises(errors.ContactError, match="tag 7 .* no volume"):
                check_cells(mesh, facets)
        else:
            check_cells(mesh, facets)


@pytest.mark.parametrize(
    "check, g", [(check_areas, 1), (check_cells, 1), (check_cells, 2)]
)
def test_nodes_off_the_facets_must_be_finite_too(check, g):
    """A vertex inside, or the middle of a cell."""
    mesh = moved_node("quadrilateral", g, (0.5 / g,) * 2, (np.nan, 0.5))
    with pytest.raises(errors.ContactError, match="tag 7 .* coordinates not finite"):
        check(mesh, whole_boundary(mesh))


def sheared(x):
    """By 87 degrees."""
    return x + 20.0 * x[:, ::-1] * (np.arange(x.shape[1]) == 0)


def mirrored(x):
    return x * np.where(np.arange(x.shape[1]) == 0, -1.0, 1.0)


def shaken(x):
    """Nodes of two cells each way, vertices or not, by up to a fifteenth of a cell."""
    return x + 0.03 * np.sin(40.0 * x @ (1.3 + np.eye(x.shape[1])))


SANE = {
    "curved": curve,
    "shaken": shaken,
    "sheared": sheared,
    "mirrored": mirrored,
    "thin": lambda x: x * np.where(np.arange(x.shape[1]) == 0, 1e-6, 1.0),
    "small": lambda x: 1e-9 * curve(x),
    "large": lambda x: 1e9 * curve(x),
    "far": lambda x: 1e5 + shaken(x),
}


@pytest.mark.parametrize("g", [1, 2])
@pytest.mark.parametrize("cell", CELLS)
def test_sane_cells_pass(cell, g):
    for move in SANE.values():
        mesh = box(cell, degree=g, move=move)
        check_cells(mesh, whole_boundary(mesh))


def test_vertices_of_180_degrees_and_quarter_nodes_pass():
    """Where the volume element vanishes in a node: far from the origin it is rounded
    to either sign."""
    straight = [[0.0, 0], [1, 0], [0, 1], [0.5, 0.5]]
    collapsed = [[0.0, 0], [1, 0], [0, 1], [0, 1]]
    for corners in (straight, collapsed):
        for shift in (0.0, 1e4):
            mesh = single("quadrilateral", np.array(corners) + shift / 3.0)
            check_cells(mesh, whole_boundary(mesh))
    # Nodes of a triangle of degree 2, as at the tip of a crack in its first vertex
    nodes = [[0.0, 0], [1, 0], [0, 1], [0.5, 0.5], [0, 0.25], [0.25, 0]]
    mesh = single("triangle", nodes, degree=2)
    check_cells(mesh, whole_boundary(mesh))

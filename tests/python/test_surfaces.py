"""Facets as arrays: node order, normals, identification, and every refusal."""

from itertools import permutations

import numpy as np
import pytest
from dolfinx import fem, mesh as dmesh
from mpi4py import MPI

from raymortar import compat, errors, surfaces

COMM = MPI.COMM_WORLD
CELLS = ["triangle", "quadrilateral", "tetrahedron", "hexahedron"]
DEGREES = [(1, 1), (1, 2), (2, 1), (2, 2)]  # of displacement, of geometry


def unit_cells(cell):
    """Corners of the cells that fill the unit square or cube."""
    square = np.array([[0.0, 0], [1, 0], [0, 1], [1, 1]])
    if cell == "triangle":
        return square[[[0, 1, 3], [0, 2, 3]]]
    if cell == "quadrilateral":
        return square[None]
    if cell == "hexahedron":
        bottom = np.column_stack([square, np.zeros(4)])
        return np.vstack([bottom, bottom + [0, 0, 1]])[None]
    # Kuhn's six tetrahedra: walk from 0 to (1, 1, 1) along the axes in any order.
    steps = [np.eye(3)[list(order)] for order in permutations(range(3))]
    return np.array([np.vstack([np.zeros(3), s.cumsum(axis=0)]) for s in steps])


def corner_functions(cell, points):
    """(Bi, tri)linear functions of the corners at reference points."""
    if cell in ("triangle", "tetrahedron"):
        return np.column_stack([1 - points.sum(axis=1), points])
    columns = []
    for a in range(2 ** points.shape[1]):
        bits = np.array([a >> i & 1 for i in range(points.shape[1])])
        columns.append(np.prod(np.where(bits, points, 1 - points), axis=1))
    return np.column_stack(columns)


def box_arrays(cell, n, degree, offset=0.0, move=lambda x: x):
    """Cells and points of n^d boxes in the unit square or cube."""
    corners = unit_cells(cell)
    gdim = corners.shape[2]
    grid = np.stack(np.meshgrid(*[np.arange(n)] * gdim, indexing="ij"), axis=-1)
    corners = (grid.reshape(-1, 1, 1, gdim) + corners).reshape(-1, *corners.shape[1:])
    values = corner_functions(cell, compat.basix_element(cell, degree).points)
    points = np.einsum("ab,cbd->cad", values, corners / n)
    keys = np.round(points * 60).astype(int).reshape(-1, gdim)
    _, first, cells = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    x = move(points.reshape(-1, gdim)[first])
    x[:, -1] += offset
    return cells.reshape(points.shape[:2]), x


def build(cell, arrays, degree=1, ghosts=False):
    """Distribute arrays that live on the first rank."""
    cells, x = arrays
    if COMM.rank > 0:
        cells, x = cells[:0], x[:0]
    return compat.create_mesh(COMM, cells, x, cell, degree, ghosts)


def box(cell, n=2, degree=1, ghosts=False, **options):
    return build(cell, box_arrays(cell, n, degree, **options), degree, ghosts)


def curve(x):
    """Smooth bend that keeps the shape of the cells."""
    return x + 0.08 * np.sin(2 * x[:, ::-1] + np.arange(x.shape[1]))


def displacement(mesh, degree=1):
    return fem.Function(compat.vector_space(mesh, degree))


def tag_sides(mesh, *sides):
    """Tags 1, 2, ... on the boundary facets at coordinate ``axis`` = ``value``."""
    tdim = mesh.topology.dim
    entities, values = [], []
    for tag, (axis, value) in enumerate(sides, 1):
        found = dmesh.locate_entities_boundary(
            mesh, tdim - 1, lambda x: np.isclose(x[axis], value)
        )
        entities.append(found)
        values.append(np.full(len(found), tag))
    return compat.meshtags(
        mesh, tdim - 1, np.concatenate(entities), np.concatenate(values)
    )


def whole_boundary(mesh):
    facets = compat.exterior_facets(mesh)
    tags = compat.meshtags(mesh, mesh.topology.dim - 1, facets, 7)
    return surfaces.tagged_facets(mesh, tags, 7, "slave")


def integrate(surface, integrand):
    """Integral over all ranks' facets of a function of (x, m)."""
    points, weights = compat.quadrature(surface.shape, 8)
    values, gradients = surfaces.shape_functions(
        surface.shape, surface.node_degree, points
    )
    nodes = surface.X[surface.facet_nodes]
    x = np.einsum("qa,fad->fqd", values, nodes)
    m = surfaces.normals(np.einsum("iqa,fad->ifqd", gradients, nodes))
    return COMM.allreduce(np.einsum("q,fq...->...", weights, integrand(x, m)))


# Reference facets


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("shape", ["interval", "triangle", "quadrilateral"])
def test_facet_nodes_are_in_basix_order(shape, degree):
    basix_points = compat.basix_element(shape, degree).points
    assert np.allclose(surfaces.facet_nodes(shape, degree), basix_points)


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("shape", ["interval", "triangle", "quadrilateral"])
def test_shape_functions_are_nodal_and_sum_to_one(shape, degree):
    nodes = surfaces.facet_nodes(shape, degree)
    values, gradients = surfaces.shape_functions(shape, degree, nodes)
    assert np.allclose(values, np.eye(len(nodes)))
    assert np.allclose(gradients.sum(axis=2), 0)
    slopes = np.einsum("iqa,ad->qdi", gradients, nodes)
    assert np.allclose(slopes, np.eye(nodes.shape[1]))


def test_reflections_are_those_of_the_contract():
    assert surfaces.reflection("interval", 2).tolist() == [1, 0, 2]
    assert surfaces.reflection("triangle", 2).tolist() == [0, 2, 1, 3, 5, 4]
    quad = surfaces.reflection("quadrilateral", 2)
    assert quad.tolist() == [0, 2, 1, 3, 5, 4, 7, 6, 8]


# Surfaces


@pytest.mark.parametrize("p, g", DEGREES)
@pytest.mark.parametrize("cell", CELLS)
def test_tables_agree_with_the_geometry_of_the_facets(cell, p, g):
    mesh = box(cell, degree=g, move=curve)
    u, facets = displacement(mesh, p), whole_boundary(mesh)
    surface = surfaces.build_surface(u, [facets])
    geometry = mesh.geometry.x[surfaces.facet_node_table(mesh, facets), : surface.gdim]
    nodes = surfaces.facet_nodes(surface.shape, surface.node_degree)
    values, _ = surfaces.shape_functions(surface.shape, g, nodes)
    on_facet = np.einsum("qa,fad->fqd", values, geometry)
    assert np.allclose(surface.X[surface.facet_nodes], on_facet, atol=1e-13)

    u.interpolate(lambda x: x[: surface.gdim])
    at_dofs = u.x.array.reshape(-1, surface.gdim)[surface.dofs][surface.facet_dofs]
    nodes = surfaces.facet_nodes(surface.shape, p)
    values, _ = surfaces.shape_functions(surface.shape, g, nodes)
    on_facet = np.einsum("qa,fad->fqd", values, geometry)
    assert np.allclose(at_dofs, on_facet, atol=1e-13)


@pytest.mark.parametrize("ghosts", [False, True])
@pytest.mark.parametrize("p, g", DEGREES)
@pytest.mark.parametrize("cell", CELLS)
def test_closed_surface_has_outward_normals(cell, p, g, ghosts):
    mesh = box(cell, degree=g, ghosts=ghosts)
    gdim = mesh.geometry.dim
    surface = surfaces.build_surface(displacement(mesh, p), [whole_boundary(mesh)])
    area = integrate(surface, lambda x, m: np.linalg.norm(m, axis=-1))
    volume = integrate(surface, lambda x, m: np.sum(x * m, axis=-1)) / gdim
    assert np.isclose(area, 2 * gdim, rtol=1e-12)
    assert np.isclose(volume, 1, rtol=1e-12)
    _, gradients = surfaces.shape_functions(
        surface.shape, surface.node_degree, np.full((1, gdim - 1), 1 / 3)
    )
    nodes = surface.X[surface.facet_nodes]
    m = surfaces.normals(np.einsum("iqa,fad->ifqd", gradients, nodes))[:, 0]
    assert np.all(np.sum(m * (nodes.mean(axis=1) - 0.5), axis=1) > 0)


@pytest.mark.parametrize("p, g", DEGREES)
@pytest.mark.parametrize("cell", CELLS)
def test_normals_of_a_closed_curved_surface_cancel(cell, p, g):
    mesh = box(cell, degree=g, move=curve)
    surface = surfaces.build_surface(displacement(mesh, p), [whole_boundary(mesh)])
    assert np.allclose(integrate(surface, lambda x, m: m), 0, atol=1e-13)


@pytest.mark.parametrize("cell", CELLS)
def test_one_side_of_the_box(cell):
    mesh = box(cell, n=3)
    axis = mesh.geometry.dim - 1
    tags = tag_sides(mesh, (axis, 1.0), (axis, 0.0))
    top = surfaces.tagged_facets(mesh, tags, 1, "slave")
    surface = surfaces.build_surface(displacement(mesh), [top])
    assert np.allclose(integrate(surface, lambda x, m: m), np.eye(axis + 1)[axis])
    assert np.allclose(surface.X[:, axis], 1)


@pytest.mark.parametrize("p, g", DEGREES)
def test_ids_are_unique_over_ranks(p, g):
    mesh = box("tetrahedron", degree=g)
    surface = surfaces.build_surface(displacement(mesh, p), [whole_boundary(mesh)])
    facets = np.concatenate(COMM.allgather(surface.facet_ids))
    assert len(facets) == len(set(facets)) == 6 * 2 * 2**2
    # A node has one position and a position one node, whichever rank looks.
    positions = np.vstack(COMM.allgather(surface.X)).round(9)
    node_ids = np.concatenate(COMM.allgather(surface.node_ids))
    pairs = {(i, *x) for i, x in zip(node_ids.tolist(), positions.tolist())}
    n_nodes = 26 if max(p, g) == 1 else 98
    assert len(pairs) == len(set(node_ids)) == n_nodes
    dof_ids = np.concatenate(COMM.allgather(surface.dof_ids))
    assert len(set(dof_ids)) == (26 if p == 1 else 98)


def test_zones_and_types():
    mesh = box("quadrilateral", n=3)
    tags = tag_sides(mesh, (1, 1.0), (1, 0.0))
    sets = [surfaces.tagged_facets(mesh, tags, t, "master") for t in (2, 1)]
    surface = surfaces.build_surface(displacement(mesh), sets)
    heights = surface.X[surface.facet_nodes, 1].mean(axis=1)
    assert np.allclose(heights, surface.zone)
    assert COMM.allreduce(len(surface.zone)) == 6
    for name in ("dofs", "facet_dofs", "facet_nodes", "zone"):
        assert getattr(surface, name).dtype == np.int32, name
    for name in ("dof_ids", "node_ids", "facet_ids"):
        assert getattr(surface, name).dtype == np.int64, name
    assert np.all(np.diff(surface.dofs) > 0)
    assert surface.facet_nodes is surface.facet_dofs


def test_rank_without_facets():
    mesh = box("hexahedron", n=1)
    facets = whole_boundary(mesh)
    none = surfaces.Facets(3, *[facets.facets[:0]] * 3)
    surface = surfaces.build_surface(displacement(mesh, 2), [none])
    assert surface.facet_dofs.shape == surface.facet_nodes.shape == (0, 9)
    assert surface.X.shape == (0, 3)
    assert len(surface.zone) == len(surface.facet_ids) == 0


def test_tables_are_quick_to_make():
    """No Python loop over facets: 1e5 of them in a fraction of a second."""
    mesh = box("hexahedron", n=3)
    u, facets = displacement(mesh, 2), whole_boundary(mesh)
    repeats = 100_000 // max(len(facets.facets), 1) + 1
    names = ("facets", "cells", "local_facets")
    many = surfaces.Facets(7, *[np.tile(getattr(facets, n), repeats) for n in names])
    start = MPI.Wtime()
    surfaces.build_surface(u, [many])
    surfaces.check_areas(mesh, many)
    assert MPI.Wtime() - start < 3


# Refusals of the displacement


def refused(u, pattern):
    with pytest.raises(errors.ContactError, match=pattern):
        surfaces.check_space(u)


@pytest.mark.parametrize("p, g", DEGREES)
@pytest.mark.parametrize("cell", CELLS)
def test_good_spaces_pass(cell, p, g):
    surfaces.check_space(displacement(box(cell, degree=g), p))


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
        surfaces.tagged_facets(mesh, tags, 1, "slave")


def test_unknown_tag_is_refused_with_the_tags_that_exist():
    mesh = box("triangle")
    tags = tag_sides(mesh, (0, 0.0), (0, 1.0))
    with pytest.raises(errors.ContactError, match=r"master tag 5; .*are \[1, 2\]"):
        surfaces.tagged_facets(mesh, tags, 5, "master")


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
        surfaces.tagged_facets(mesh, tags, 1, "slave")


@pytest.mark.parametrize("cell", CELLS)
def test_surfaces_that_share_vertices_are_refused(cell):
    mesh = box(cell)
    tags = tag_sides(mesh, (0, 0.0), (1, 0.0))
    slave, master = (surfaces.tagged_facets(mesh, tags, t, "") for t in (1, 2))
    count = 1 if mesh.geometry.dim == 2 else 3
    pattern = rf"tag 1\).*tag 2\) share {count} vertex\(es\), for example at \(0, 0"
    with pytest.raises(errors.ContactError, match=pattern):
        surfaces.check_pair(mesh, slave, master)
    with pytest.raises(errors.ContactError, match=r"tag 1\).*tag 1\) share"):
        surfaces.check_pair(mesh, slave, slave)


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
        slave, master = (surfaces.tagged_facets(mesh, tags, t, "") for t in (1, 2))
        with pytest.raises(errors.ContactError, match=rf"share 1 .* at \({cut:g}, 0\)"):
            surfaces.check_pair(mesh, slave, master)


@pytest.mark.parametrize("cell", CELLS)
def test_surfaces_apart_pass(cell):
    mesh = box(cell)
    tags = tag_sides(mesh, (0, 0.0), (0, 1.0))
    slave, master = (surfaces.tagged_facets(mesh, tags, t, "") for t in (1, 2))
    surfaces.check_pair(mesh, slave, master)


# Refusals of facets


@pytest.mark.parametrize("g", [1, 2])
@pytest.mark.parametrize("cell", CELLS)
def test_good_facets_pass_at_any_scale(cell, g):
    for scale in (1e-9, 1e9):
        mesh = box(cell, degree=g, move=lambda x: scale * curve(x))
        surfaces.check_areas(mesh, whole_boundary(mesh))


@pytest.mark.parametrize("cell", ["quadrilateral", "hexahedron"])
def test_facets_without_area_are_refused(cell):
    def collapse(x):
        x[:, 0] *= np.where(np.isclose(x[:, 1], 0), 0, 1)
        return x

    mesh = box(cell, n=1, move=collapse)
    pattern = r"1 facet\(s\) with tag 7 have no area, the first on cell 0 at \(0, 0"
    with pytest.raises(errors.ContactError, match=pattern):
        surfaces.check_areas(mesh, whole_boundary(mesh))


def test_thin_facets_pass():
    """A stack of sheets, a million times longer than thick, is still a body."""
    mesh = box("hexahedron", move=lambda x: x * [1, 1, 1e-6])
    surfaces.check_areas(mesh, whole_boundary(mesh))


def test_coordinates_that_are_not_finite_are_refused():
    mesh = box("triangle")
    facets = whole_boundary(mesh)
    mesh.geometry.x[:] = np.nan
    with pytest.raises(errors.ContactError, match="tag 7 have coordinates not finite"):
        surfaces.check_areas(mesh, facets)

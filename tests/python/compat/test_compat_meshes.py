"""The same cells, meshes, spaces and files from every DOLFINx."""

import re

from mpi4py import MPI

import numpy as np
import pytest
import ufl
from dolfinx import fem
from few_cells import square
from problems import COMM

from raymortar.core import compat
from raymortar.io import write_xdmf

pytestmark = pytest.mark.mpi

# Cells and rules


@pytest.mark.parametrize("degree", [1, 2, 5])
@pytest.mark.parametrize(
    "shape, volume", [("interval", 1.0), ("triangle", 0.5), ("quadrilateral", 1.0)]
)
def test_quadrature_is_exact(shape, volume, degree):
    points, weights = compat.quadrature(shape, degree)
    assert points.shape == (len(weights), 1 if shape == "interval" else 2)
    assert np.isclose(weights.sum(), volume)
    moment = weights @ points[:, 0] ** degree
    exact = 1 / (degree + 1)
    if shape == "triangle":
        exact -= 1 / (degree + 2)
    assert np.isclose(moment, exact)


@pytest.mark.parametrize("cell", ["triangle", "quadrilateral", "tetrahedron"])
def test_element_on_a_reference_cell(cell):
    element = compat.basix_element(cell, 2)
    for dofs, vertices in zip(element.facet_dofs, element.facet_vertices):
        corners = element.vertices[list(vertices)]
        on_facet = element.points[list(dofs)]
        assert np.allclose(on_facet.mean(axis=0), corners.mean(axis=0))
    # Of a polynomial of degree 2
    x = element.points
    values = x[:, 0] ** 2 - 3.0 * x[:, 0] * x[:, 1]
    exact = np.zeros_like(x)
    exact[:, 0] = 2.0 * x[:, 0] - 3.0 * x[:, 1]
    exact[:, 1] = -3.0 * x[:, 0]
    assert np.allclose(element.gradients @ values, exact.T)


# Meshes


@pytest.mark.parametrize("degree", [1, 2])
def test_mesh_from_arrays(degree):
    mesh = square(degree)
    assert compat.cell_name(mesh) == "quadrilateral"
    assert compat.geometry_degree(mesh) == degree
    table = compat.geometry_dofmap(mesh)
    assert table.shape[1] == (degree + 1) ** 2 and table.dtype == np.int32
    ids = compat.geometry_nodes_global(mesh)
    assert len(ids) == len(mesh.geometry.x) and ids.dtype == np.int64
    assert COMM.allreduce(set(ids.tolist()), op=MPI.BOR) == set(range(9))
    center = mesh.geometry.x[table].mean(axis=1)
    assert np.all((center > [0.5, 0, -1]) & (center < [1.5, 1, 1]))


@pytest.mark.parametrize("ghosts", [False, True])
def test_exterior_facets_are_owned_by_one_rank(ghosts):
    mesh = square(ghosts=ghosts)
    facets = compat.exterior_facets(mesh)
    assert COMM.allreduce(len(facets)) == 8
    links = compat.connectivity(mesh, 1, 2)
    cells = links.array[links.offsets[facets]]
    assert np.all(cells < mesh.topology.index_map(2).size_local)


def test_points_are_in_the_boxes_of_their_cells():
    """Of the cells that are asked about, on the rank that has them."""
    mesh = square()
    cells = np.arange(mesh.topology.index_map(2).size_local, dtype=np.int32)[1:]
    x = mesh.geometry.x[compat.geometry_dofmap(mesh)].mean(axis=1)[:, :2]
    outside = np.array([[9.0, 9.0]])
    at, found = compat.points_in_boxes(mesh, cells, np.concatenate([x, outside]))
    pairs = set(zip(at.tolist(), found.tolist()))
    own = set(zip(cells.tolist(), cells.tolist()))
    assert pairs == own if len(cells) > 1 else pairs >= own


def test_a_cell_alone_is_a_candidate_for_each_point():
    """DOLFINx 0.9's tree of one box reads memory of others for a point outside it."""
    mesh = square()
    cells = np.arange(mesh.topology.index_map(2).size_local, dtype=np.int32)[-1:]
    x = np.linspace(-9.0, 9.0, 200).reshape(100, 2)
    at, found = compat.points_in_boxes(mesh, cells, x)
    assert at.tolist() == list(range(100))
    assert found.tolist() == cells.tolist() * 100


def test_meshtags_take_any_order():
    mesh = square()
    facets = compat.exterior_facets(mesh)
    tags = compat.meshtags(mesh, 1, facets[::-1], np.arange(len(facets)))
    assert np.array_equal(tags.indices, facets)
    assert np.array_equal(tags.values, np.arange(len(facets))[::-1])
    assert np.all(compat.meshtags(mesh, 1, facets, 4).values == 4)


# Spaces


@pytest.mark.parametrize(
    "family, degree, shape, lagrange, discontinuous",
    [
        ("Lagrange", 1, (), True, False),
        ("Lagrange", 2, (2,), True, False),
        ("Lagrange", 1, (2, 2), True, False),
        ("DG", 0, (2,), True, True),
        ("RTCF", 1, (), False, False),
    ],
)
def test_element_info(family, degree, shape, lagrange, discontinuous):
    info = compat.element_info(compat.space(square(), family, degree, shape))
    assert info.is_lagrange == lagrange and info.is_discontinuous == discontinuous
    assert not info.is_mixed and not info.is_sub_space
    assert info.degree == degree
    assert info.block_size == np.prod(shape, dtype=int)
    assert info.value_shape == (shape or ((2,) if family == "RTCF" else ()))


def mixed_space(mesh):
    """Taylor-Hood pair, which compat has no need to make."""
    if hasattr(ufl, "MixedElement"):
        cell = mesh.ufl_cell()
        vector = ufl.VectorElement("Lagrange", cell, 2)
        element = ufl.MixedElement(vector, ufl.FiniteElement("Lagrange", cell, 1))
        return fem.FunctionSpace(mesh, element)
    import basix.ufl

    vector = basix.ufl.element("Lagrange", "quadrilateral", 2, shape=(2,))
    scalar = basix.ufl.element("Lagrange", "quadrilateral", 1)
    return fem.functionspace(mesh, basix.ufl.mixed_element([vector, scalar]))


def test_mixed_spaces_and_sub_spaces_are_told_apart():
    V = mixed_space(square())
    whole, part = compat.element_info(V), compat.element_info(V.sub(0))
    assert whole.is_mixed and not whole.is_sub_space and not whole.is_lagrange
    assert part.is_sub_space and not part.is_mixed
    assert compat.element_info(compat.vector_space(V.mesh, 1).sub(0)).is_sub_space


def test_dofmap_array():
    V = compat.vector_space(square(), 2)
    table = compat.dofmap_array(V)
    assert table.shape[1] == 9 and table.dtype == np.int32
    for cell, row in enumerate(table):
        assert np.array_equal(row, V.dofmap.cell_dofs(cell))


def test_scatter_sums_at_the_owner():
    V = compat.scalar_space(square(), 1)
    vector = compat.create_la_vector(V.dofmap.index_map)
    vector.array[:] = 1
    compat.scatter_reverse_add(vector)
    compat.scatter_forward(vector)
    ids = compat.local_to_global(V.dofmap.index_map)
    holders = COMM.allreduce(np.bincount(ids, minlength=9))
    assert np.array_equal(vector.array, holders[ids])


# Scalars and files


def test_real_petsc():
    assert compat.scalar_type_is_real()


@pytest.mark.parametrize("degree, g", [(1, 1), (2, 1), (1, 2), (2, 2)])
def test_write_xdmf(degree, g, folder):
    path = folder / "out.xdmf"
    mesh = square(g)
    u = fem.Function(compat.vector_space(mesh, degree))
    u.name = "displacement"
    cellwise = fem.Function(compat.space(mesh, "DG", 0))
    cellwise.name = "zone"
    write_xdmf(path, mesh, [u, cellwise], t=0.0)
    write_xdmf(path, mesh, [u, cellwise], t=0.5, append=True)
    text = path.read_text()
    assert set(re.findall(r'Attribute Name="(\w+)"', text)) == {"displacement", "zone"}
    assert len(set(re.findall(r'Time Value="([^"]+)"', text))) == 2

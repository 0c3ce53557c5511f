"""The same answers from every DOLFINx, and equal to DOLFINx's own."""

import re

from mpi4py import MPI
from petsc4py import PETSc

import dolfinx.fem.petsc
import numpy as np
import pytest
import ufl
from conditions import dirichlet_dofs
from dolfinx import fem
from dolfinx import mesh as dmesh

from meshes.from_arrays import create_mesh
from raymortar.core import compat
from raymortar.io import write_xdmf

pytestmark = pytest.mark.mpi

COMM = MPI.COMM_WORLD
N_MULTIPLIERS = 3  # rows per rank after the displacement's


def square(degree=1, ghosts=False):
    """Four quadrilaterals or, of degree 2, one of nine nodes, moved to the right."""
    n = 3
    x, y = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    points = np.column_stack([x.ravel() + 1.0, y.ravel()]) * 0.5
    if degree == 1:
        cells = np.array([[0, 3, 1, 4]]) + np.array([[0], [1], [3], [4]])
    else:
        cells = np.array([[0, 6, 2, 8, 3, 1, 7, 5, 4]])
    if COMM.rank > 0:
        cells, points = cells[:0], points[:0]
    return create_mesh(COMM, cells, points, "quadrilateral", degree, ghosts)


def ghosted(V):
    """Ghosted array of zeros."""
    index_map = V.dofmap.index_map
    return np.zeros((index_map.size_local + index_map.num_ghosts) * V.dofmap.bs)


def fill(V, seed):
    """Ghosted array of numbers that depend on the global dof alone."""
    bs = V.dofmap.index_map_bs
    ids = compat.local_to_global(V.dofmap.index_map)
    return np.sin(seed + 3.7 * (ids[:, None] * bs + np.arange(bs))).ravel()


def sum_ghosts(V, b):
    """Owned part of a ghosted array after sending ghosts home."""
    vector = compat.create_la_vector(V.dofmap.index_map, V.dofmap.index_map_bs)
    vector.array[:] = b
    compat.scatter_reverse_add(vector)
    return vector.array[: n_owned(V)].copy()


def n_owned(V):
    return V.dofmap.index_map.size_local * V.dofmap.index_map_bs


def coupled_matrix(V):
    """Empty matrix with rows [displacement, multiplier] on each rank."""
    n = n_owned(V) + N_MULTIPLIERS
    first = COMM.exscan(n) or 0
    rows = compat.create_la_vector(V.dofmap.index_map, V.dofmap.index_map_bs)
    rows.array[: n_owned(V)] = first + np.arange(n_owned(V))
    compat.scatter_forward(rows)
    multipliers = first + n_owned(V) + np.arange(N_MULTIPLIERS)
    rows = np.concatenate([rows.array, multipliers]).astype(PETSc.IntType)
    A = PETSc.Mat().createAIJ(((n, None), (n, None)), nnz=40, comm=COMM)
    A.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
    A.setLGMap(PETSc.LGMap().create(rows, comm=COMM))
    return A


def elasticity(V):
    """A bilinear form without symmetry, so that rows and columns cannot swap."""
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    x = ufl.SpatialCoordinate(V.mesh)
    a = ufl.inner(ufl.grad(u), ufl.grad(v)) + x[0] * ufl.inner(u.dx(0), v)
    return compat.form(a * ufl.dx)


def clamp(V, value=(0.25, -0.5)):
    """Prescribed vector on the left side, and one component on the right one."""
    mesh = V.mesh
    left = dmesh.locate_entities_boundary(mesh, 1, lambda x: np.isclose(x[0], 0.5))
    right = dmesh.locate_entities_boundary(mesh, 1, lambda x: np.isclose(x[0], 1.5))
    on_left = fem.locate_dofs_topological(V, 1, left)
    on_right = fem.locate_dofs_topological(V.sub(1), 1, right)
    return [
        fem.dirichletbc(np.array(value), on_left, V),
        fem.dirichletbc(0.75, on_right, V.sub(1)),
    ]


def expected_conditions(V):
    """Marker and values of :func:`clamp`, from the positions of the dofs."""
    x = V.tabulate_dof_coordinates()
    marker = np.zeros((len(x), 2), dtype=np.int8)
    values = np.zeros((len(x), 2))
    marker[np.isclose(x[:, 0], 0.5)] = 1
    values[np.isclose(x[:, 0], 0.5)] = 0.25, -0.5
    marker[np.isclose(x[:, 0], 1.5), 1] = 1
    values[np.isclose(x[:, 0], 1.5), 1] = 0.75
    return marker.ravel(), values.ravel()


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


# Assembly


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("constrained", [False, True])
def test_displacement_block_is_the_matrix_of_dolfinx(degree, constrained):
    V = compat.vector_space(square(), degree)
    a, bcs = elasticity(V), clamp(V) if constrained else []
    reference = dolfinx.fem.petsc.assemble_matrix(a, bcs)
    reference.assemble()
    A = coupled_matrix(V)
    compat.assemble_jacobian(A, a, bcs)
    # Whatever follows may add or insert.
    A.setValueLocal(len(ghosted(V)), 0, 2.5, addv=PETSc.InsertMode.ADD)
    A.assemble()

    x, y = A.createVecs()
    x0, y0 = reference.createVecs()
    owned = n_owned(V)
    x.array[:owned] = x0.array[:] = fill(V, 0.3)[:owned]
    A.mult(x, y)
    reference.mult(x0, y0)
    assert np.allclose(y.array[:owned], y0.array, rtol=1e-13, atol=1e-13)
    if owned > 0:
        assert np.allclose(y.array[owned:], [2.5 * x.array[0], 0, 0])


def test_assembling_twice_adds_but_keeps_the_identity():
    V = compat.vector_space(square(), 1)
    a, bcs = elasticity(V), clamp(V)
    A = coupled_matrix(V)
    for _ in range(2):
        compat.assemble_jacobian(A, a, bcs)
    A.assemble()
    diagonal = A.getDiagonal().array[: n_owned(V)]
    marker, _ = dirichlet_dofs(bcs, V)
    constrained = marker[: n_owned(V)] == 1
    assert np.all(diagonal[constrained] == 1)


def test_residual_is_added():
    V = compat.vector_space(square(), 1)
    v = ufl.TestFunction(V)
    L = compat.form(ufl.inner(ufl.as_vector([2.0, -1.0]), v) * ufl.dx)
    b = ghosted(V)
    compat.assemble_residual(b, L)
    once = b.copy()
    compat.assemble_residual(b, L)
    assert np.allclose(b, 2 * once)
    total = COMM.allreduce(sum_ghosts(V, once).reshape(-1, 2).sum(axis=0))
    assert np.allclose(total, [2, -1])


@pytest.mark.parametrize("scale", [-1.0, 0.5])
def test_lifting_is_the_matrix_times_the_jump(scale):
    V = compat.vector_space(square(), 1)
    a, bcs, x0 = elasticity(V), clamp(V), fill(V, 1.1)
    marker, values = dirichlet_dofs(bcs, V)
    b = ghosted(V)
    compat.apply_lifting(b, a, bcs, x0, scale)

    full = dolfinx.fem.petsc.assemble_matrix(a)
    full.assemble()
    jump, product = full.createVecs()
    owned = n_owned(V)
    jump.array[:] = (marker * (values - x0))[:owned]
    full.mult(jump, product)
    free = marker[:owned] == 0
    assert np.allclose(sum_ghosts(V, b)[free], -scale * product.array[free])


def test_conditions_of_a_space_and_its_components():
    V = compat.vector_space(square(), 2)
    marker, values = dirichlet_dofs(clamp(V), V)
    expected_marker, expected_values = expected_conditions(V)
    assert np.array_equal(marker, expected_marker) and marker.dtype == np.int8
    assert np.allclose(values, expected_values)


def test_set_bc_sets_the_scaled_jump():
    V = compat.vector_space(square(), 1)
    bcs, x0 = clamp(V), fill(V, 2.0)
    marker, values = dirichlet_dofs(bcs, V)
    b = np.full_like(x0, 9.0)
    compat.set_bc(b, bcs, x0, -1.0)
    assert np.allclose(b, np.where(marker == 1, x0 - values, 9.0))


# Solver and output


def test_newton_solver_finds_square_roots():
    x, b = PETSc.Vec().createMPI((2, None), comm=COMM), None
    b = x.duplicate()
    A = PETSc.Mat().createAIJ(((2, None), (2, None)), nnz=1, comm=COMM)
    seen = []

    def residual(x, b):
        b.array[:] = x.array_r**2 - [4.0, 9.0]

    def jacobian(x, A):
        A.setDiagonal(2 * x)
        A.assemble()

    solver = compat.make_newton_solver(COMM)
    solver.setF(residual, b)
    solver.setJ(jacobian, A)
    solver.set_form(lambda x: seen.append(1))
    solver.rtol = solver.atol = 1e-12
    solver.max_it = 20
    solver.convergence_criterion = "residual"
    solver.relaxation_parameter = 1.0
    solver.report = False
    solver.error_on_nonconvergence = False
    solver.krylov_solver.setType("gmres")
    solver.krylov_solver.getPC().setType("jacobi")
    solver.krylov_solver.setTolerances(rtol=1e-12)
    x.set(1.0)
    iterations, converged = solver.solve(x)
    assert converged and 3 < iterations < 12 and len(seen) >= iterations
    assert np.allclose(x.array, [2, 3], rtol=1e-12)


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

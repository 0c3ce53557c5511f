"""The same matrices, vectors and solutions from every DOLFINx, and equal to its own."""

from petsc4py import PETSc

import dolfinx.fem.petsc
import numpy as np
import pytest
import ufl
from conditions import dirichlet_dofs
from dolfinx import fem
from dolfinx import mesh as dmesh
from few_cells import square
from problems import COMM

from raymortar.core import compat

pytestmark = pytest.mark.mpi

N_MULTIPLIERS = 3  # rows per rank after the displacement's


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


# Solver


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

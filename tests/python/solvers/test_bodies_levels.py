"""Levels of the bodies: interpolation, products, and the tangent without contact."""

from petsc4py import PETSc

import dolfinx.fem.petsc
import numpy as np
import pytest
from dolfinx import fem
from pressed_blocks import METHODS, blocks, solved
from problems import CELLS, COMM, DIMENSION, build, fix, stack, worst

from raymortar import Coulomb, solvers
from raymortar.core import compat
from raymortar.core.solvers.petsc_objects import PetscOptions
from raymortar.solvers import levels as levels_of
from raymortar.solvers.levels import BodiesLevels, LinearInterpolation


@pytest.mark.mpi
@pytest.mark.parametrize("cell", CELLS)
def test_interpolation_takes_linear_fields_to_linear_fields(cell):
    dim = DIMENSION[cell]
    V = compat.vector_space(stack(cell, (2, 3)).mesh, 2)
    n = V.dofmap.index_map.size_local * dim
    step = LinearInterpolation(V, np.zeros(n, dtype=bool))
    A = np.arange(dim * dim).reshape(dim, dim) - 2.0
    values = [(W.tabulate_dof_coordinates()[:, :dim] @ A + 1.0) for W in (V, step.W)]
    x, y = step.matrix.createVecs()
    x.array[:] = values[1].ravel()[: x.local_size]
    step.matrix.mult(x, y)
    assert y.array == pytest.approx(values[0].ravel()[:n], abs=1e-13)
    assert not step.fixed.any()


@pytest.mark.mpi
@pytest.mark.parametrize("cell", CELLS)
def test_product_is_the_tangent_of_degree_1_with_the_conditions(cell):
    """Of a linear material on straight cells: spaces of degree 1 are in those of 2."""
    scene = stack(cell, (2, 3))
    one, two = (
        build(scene, p, bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", 0)])
        for p in (1, 2)
    )
    K, coarse = (
        fem.petsc.assemble_matrix(p.problem.a, bcs=p.problem.bcs) for p in (two, one)
    )
    K.assemble()
    coarse.assemble()
    step = LinearInterpolation(two.u.function_space, two.problem.constrained)
    assert np.array_equal(step.fixed, one.problem.constrained)
    product = step.product(K)
    x, y = coarse.createVecs()
    rng = np.random.default_rng(COMM.rank)
    x.array[:] = np.where(step.fixed, 0.0, rng.random(x.local_size))
    coarse.mult(x, y)
    size = worst(y.array)
    z = y.duplicate()
    product.mult(x, z)
    assert worst(z.array - y.array) <= 1e-12 * size
    assert (product.getDiagonal().array > 0.0).all()


@pytest.mark.mpi
@pytest.mark.parametrize("cell, degree", [("tetrahedron", 2), ("hexahedron", 1)])
def test_products_of_the_volume_serve_once_and_only_for_the_same_bodies(
    cell, degree, monkeypatch
):
    """Beside what contact adds: those of GAMG are P^T S P to rounding."""
    coupled = blocks(cell, degree, 3 - degree, friction=Coulomb(0.3)).problem
    found, judge = [], levels_of._is_product
    monkeypatch.setattr(
        levels_of, "_is_product", lambda *of: found.append(judge(*of)) or found[-1]
    )
    rng = np.random.default_rng(COMM.rank)
    # The bodies' tangent with springs at the surfaces, and that of stiffer bodies
    for factor, springs in ((1.0, 3.0), (2.0, 0.0)):
        del found[:]
        S = fem.petsc.assemble_matrix(coupled.a, bcs=coupled.bcs)
        S.assemble()
        S.scale(factor)
        diagonal = S.getDiagonal()
        with PetscOptions("once_", solvers.iterative("bodies")):
            levels = BodiesLevels(coupled, "once_displacement_levels_")
        diagonal.array[levels._rows] *= 1.0 + springs
        S.setDiagonal(diagonal)
        operators = levels.operators(S)
        assert len(operators) > degree
        assert found == ([True] * (len(operators) - 1) if factor == 1.0 else [False])
        for one, again in zip(operators, levels.operators(S), strict=True):
            x, y = one.createVecs()
            z = y.duplicate()
            x.array[:] = rng.random(x.local_size)
            # Rows that the products lack have any diagonal
            of = one.getDiagonal().array_r == again.getDiagonal().array_r
            x.array[~of] = 0.0
            one.mult(x, y)
            again.mult(x, z)
            assert worst(y.array - z.array) <= 1e-12 * worst(y.array)
        assert len(found) == len(operators) - 1 or factor != 1.0


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("method", METHODS)
def test_levels_take_the_bodies_part_of_the_tangent(method, degree):
    """The tangent less contact's own, without the room that contact has in it."""
    friction = Coulomb(0.3)
    problem = blocks(degree=degree, method=METHODS[method](), friction=friction)
    solved(problem, solvers.direct())
    coupled = problem.problem
    A, x = coupled.create_matrix(), coupled.start()
    coupled.J(x, A)
    K = fem.petsc.assemble_matrix(coupled.a, bcs=coupled.bcs)
    K.assemble()
    own = levels_of.without_contact(coupled, A, None)
    given, image = K.createVecs()
    given.array[:] = np.random.default_rng(COMM.rank).random(given.local_size)
    K.mult(given, image)
    found = image.duplicate()
    own.mult(given, found)
    assert worst(found.array - image.array) <= 1e-12 * worst(image.array)
    assert entries(own) > entries(K) and own.getBlockSizes() == K.getBlockSizes()
    with_room, bare = own, K
    if degree == 2:
        step = LinearInterpolation(problem.u.function_space, coupled.constrained)
        with_room, bare = (step.product(one) for one in (own, K))
    assert entries(with_room) > entries(bare)
    fewer = levels_of._without_room(with_room)
    assert entries(fewer) <= entries(bare)
    assert fewer.getBlockSizes() == K.getBlockSizes()
    x, product = bare.createVecs()
    x.array[:] = np.random.default_rng(COMM.rank).random(x.local_size)
    bare.mult(x, product)
    image = product.duplicate()
    fewer.mult(x, image)
    assert worst(image.array - product.array) <= 1e-12 * worst(product.array)


@pytest.mark.parametrize("degree", [1, 2])
def test_levels_with_a_tangent_at_hand_assemble_no_other(degree, monkeypatch):
    coupled = blocks(degree=degree).problem
    A, x = coupled.create_matrix(), coupled.start()
    coupled.J(x, A)
    monkeypatch.delattr(levels_of, "assemble_matrix")
    with PetscOptions("given_", solvers.iterative("bodies")):
        levels = BodiesLevels(coupled, "given_displacement_levels_", A)
    assert levels.interpolations


def entries(A):
    """How many entries a matrix has room for."""
    return A.getInfo(PETSc.Mat.InfoType.GLOBAL_SUM)["nz_used"]

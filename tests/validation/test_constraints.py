"""Linear constraints between unknowns: periodic cells under contact."""

from __future__ import annotations

from petsc4py import PETSc

import numpy as np
import periodic
import pytest
from periodic import Cell
from scipy.sparse import identity
from tangents import remainders_in_petsc

from raymortar import AugmentedLagrangian, ContactError, Penalty
from raymortar.core.errors import SetUpError

POINTS = AugmentedLagrangian(condition="points")


@pytest.mark.mpi
@pytest.mark.parametrize(
    "cell, degree, method, mu",
    [
        ("quadrilateral", 1, Penalty(), 0.3),
        ("quadrilateral", 2, POINTS, 0.0),
    ],
)
def test_a_periodic_cell_with_a_mirror_is_a_symmetric_one(cell, degree, method, mu):
    cells = [Cell(cell, degree, method, mu, held) for held in ("symmetric", "periodic")]
    iterations = [one.press() for one in cells]
    assert iterations[0] == iterations[1]
    forces = [one.contact.resultant().force for one in cells]
    norms = [one.norm() for one in cells]
    assert abs(norms[1] - norms[0]) <= 1e-9 * norms[0]
    assert np.abs(forces[1] - forces[0]).max() <= 1e-9 * np.abs(forces[0]).max()


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
def test_where_a_cell_is_cut_changes_nothing(degree):
    """Pressed at its middle or across its sides, where two nodes have one multiplier,
    with friction and sheared."""
    cells = [Cell("quadrilateral", degree, POINTS, 0.3, shift=s) for s in (0.0, 0.5)]
    iterations = [one.press(0.02) for one in cells]
    assert iterations[0] == iterations[1]
    forces = [one.contact.resultant().force for one in cells]
    assert abs(forces[0][0]) > 0.05 * forces[0][1]
    assert np.abs(forces[1] - forces[0]).max() <= 1e-9 * np.abs(forces[0]).max()


def test_a_chosen_law_goes_to_points():
    one = Cell("quadrilateral", 1, None, 0.3)
    assert one.contact.method.condition == "points"
    assert one.press(steps=2)


@pytest.mark.parametrize("cell, degree", [("triangle", 2), ("tetrahedron", 1)])
def test_the_tangent_is_that_of_the_reduced_residual(cell, degree):
    """At a state that does not meet the constraints."""
    one = Cell(cell, degree, POINTS, 0.3, n=3)
    problem, rng = one.problem, np.random.default_rng(3)
    x, way = problem.start(), problem.create_vector()
    held = np.flatnonzero(problem.prescribed)
    n, dim = len(problem.prescribed), one.V.mesh.geometry.dim
    for vector, size in ((x, 5e-3), (way, 1.0)):
        vector.array[:] = size * rng.normal(size=len(x.array))
        vector.array[dim - 1 : n : dim] -= 0.03
        vector.array[held] = 0.0
    problem.F(x, problem.create_vector())
    assert one.contact.points()["pressure"].max() > 0.0
    first, last = remainders_in_petsc(problem, x, way, 10.0 ** -np.array([4.0, 5.0]))
    assert last <= 2e-2 * first


def test_dolfinx_mpc_gives_the_same_as_a_matrix():
    mpc = pytest.importorskip("dolfinx_mpc")
    one = Cell("quadrilateral", 1, POINTS, 0.3)
    other = Cell("quadrilateral", 1, POINTS, 0.3, held=None)
    found = mpc.MultiPointConstraint(other.V)

    def partner(x):
        return x - np.array([[1.0], [0.0], [0.0]])

    found.create_periodic_constraint_geometrical(
        other.V, lambda x: np.isclose(x[0], 1.0), partner, other.bcs
    )
    with pytest.raises(ContactError, match="not finalized"):
        other.remake(found)
    found.finalize()
    other.remake(found)
    assert one.press() == other.press()
    assert abs(one.norm() - other.norm()) <= 1e-12 * one.norm()


def faulty(change):
    """A cell whose T is changed."""
    one = Cell("quadrilateral", 1, POINTS, 0.3, held=None, n=4)
    T = one.matrix().tolil()
    change(T, one)
    return one, T.tocsr()


def _slave(T):
    """The first dof that is a slave."""
    return int(np.flatnonzero(T.diagonal() == 0.0)[0])


@pytest.mark.mpi
def test_complex_and_broken_entries_are_refused_on_all_ranks():
    """Also where one rank alone has the row."""
    one = Cell("quadrilateral", 1, POINTS, 0.3, held=None, n=4)
    index_map = one.V.dofmap.index_map
    size, (begin, end) = 2 * index_map.size_global, 2 * np.array(index_map.local_range)
    T = identity(size, format="lil")
    with pytest.raises(ContactError, match="constraints has complex entries"):
        one.remake(T.tocsr().astype(complex))
    if begin == 0 < end:
        T[0, size - 1] = np.inf
    with pytest.raises(ContactError, match="constraints has the entry inf in row 0"):
        one.remake(T.tocsr())


def test_constraints_that_cannot_hold_are_refused():
    def empty(T, one):
        T[0] = 0.0

    def chained(T, one):
        rows = np.flatnonzero(T.diagonal() == 0.0)
        x = one.V.tabulate_dof_coordinates()[:, 1]
        row = 2 * int(np.flatnonzero(np.isclose(x, 0.25))[0])
        T[row, row], T[row, rows[0]] = 0.0, 1.0

    def prescribed(T, one):
        row = int(one.bcs[0].dof_indices()[0][0])
        T[row, row], T[row, (row + 2) % T.shape[0]] = 0.0, 1.0

    def alone(T, one):
        """Feet at the right follow the nodes above the left ones."""
        x = one.V.tabulate_dof_coordinates()
        right = np.flatnonzero(np.isclose(x[:, 0], 1.0) & np.isclose(x[:, 1], 0.0))[0]
        above = np.flatnonzero(np.isclose(x[:, 0], 0.0) & np.isclose(x[:, 1], 0.25))[0]
        for k in range(2):
            T[2 * right + k] = 0.0
            T[2 * right + k, 2 * above + k] = 1.0

    def broken(T, one):
        T[_slave(T), 0] = np.nan

    def own(T, one):
        T[_slave(T), _slave(T)] = 0.5

    for change, kind, text in (
        (broken, ContactError, "constraints has the entry nan in row"),
        (own, ContactError, "row .* of constraints has 0.5 on the diagonal, .* 1 and"),
        (empty, ContactError, "row 0 of constraints is empty"),
        (chained, SetUpError, "masters that are slaves"),
        (prescribed, SetUpError, "slaves that bcs prescribe"),
        (alone, SetUpError, "no single slave node of the same contact"),
    ):
        one, T = faulty(change)
        with pytest.raises(kind, match=text):
            one.remake(T)
    one, T = faulty(lambda T, one: None)
    with pytest.raises(ContactError, match="must be square"):
        one.remake(T[:, :-1])
    with pytest.raises(ContactError, match="constraints must be"):
        one.remake("periodic")
    matrix = PETSc.Mat().createAIJ(T.shape, csr=(T.indptr, T.indices, T.data))
    matrix.assemble()
    one.remake(matrix)
    assert one.press(steps=1)

"""Blocks written straight to the entries of an AIJ matrix, against MatSetValues."""

from petsc4py import PETSc

import numpy as np
import pytest
from problems import COMM, build, fix, stack, worst

import raymortar

BLOCKS = {"divisions": (3, 4), "widths": [1.0, 0.8], "gaps": [0.0, -0.02]}


def clamped_sides(V, scene):
    """Conditions on nodes of the contact surfaces too, on both sides."""
    return [fix(V, scene, ["left_0", "left_1"], 0), fix(V, scene, "bottom")]


def touching(cell, degree=1, method=None, bcs=None, **options):
    """Blocks that overlap, at a displacement without symmetry."""
    case = build(stack(cell, **BLOCKS), degree, method=method, bcs=bcs, **options)
    case.u.interpolate(lambda x: 0.01 * np.sin(3 * x[: case.dim] + x[0]))
    if case.contact.multiplier is not None:
        case.contact.multiplier.interpolate(
            lambda x: -1 - np.tile(x[0], (case.contact.layout.components, 1)).squeeze()
        )
    return case


def dense_matrix(contact):
    """Matrix of a type without compressed rows: PETSc's own insertion."""
    n = contact.layout.size
    D = PETSc.Mat().createDense(((n, None), (n, None)), comm=COMM)
    D.setUp()
    return D


def assembled(contact, A, bcs):
    A.zeroEntries()
    contact.assemble_matrix(A, bcs)
    A.assemble()
    return A


def rows_of(A):
    """Owned rows as a dense array."""
    begin, end = A.getOwnershipRange()
    columns = np.arange(A.getSize()[1], dtype=PETSc.IntType)
    return A.getValues(np.arange(begin, end, dtype=PETSc.IntType), columns)


@pytest.mark.mpi
@pytest.mark.quick
@pytest.mark.parametrize(
    "cell,degree,method",
    [
        ("triangle", 2, raymortar.AugmentedLagrangian(100.0, multiplier="vector")),
        ("quadrilateral", 1, raymortar.Penalty(100.0)),
        ("tetrahedron", 2, raymortar.AugmentedLagrangian(100.0)),
        ("hexahedron", 1, raymortar.AugmentedLagrangian(100.0)),
    ],
)
@pytest.mark.parametrize("bcs", [None, clamped_sides])
def test_entries_are_those_of_petsc(cell, degree, method, bcs):
    case = touching(cell, degree, method, bcs)
    contact, problem = case.contact, case.problem
    A = assembled(contact, problem.create_matrix(), problem.bcs)
    D = assembled(contact, dense_matrix(contact), problem.bcs)
    direct, reference = rows_of(A), rows_of(D)
    assert worst(reference) > 1.0
    assert worst(direct - reference) < 1e-13 * worst(reference)


@pytest.mark.mpi
def test_places_are_looked_up_once():
    case = touching("tetrahedron")
    contact, A = case.contact, case.problem.create_matrix()
    assembled(contact, A, ())
    first = contact.statistics
    assert first.lookups == first.tangent_blocks > 0
    assembled(contact, A, ())
    second = contact.statistics
    assert second.tangent_blocks == 2 * first.tangent_blocks
    assert second.lookups == first.lookups
    # Another matrix has the same pattern in other memory
    copy = A.duplicate()
    reference = rows_of(A)
    assembled(contact, copy, ())
    assert contact.statistics.lookups == 2 * first.lookups
    # Parts of other ranks are added as they arrive, in any order
    assert worst(rows_of(copy) - reference) <= 1e-15 * worst(reference)


@pytest.mark.mpi
def test_a_new_pattern_is_followed():
    """The upper block jumps to masters it has never met."""
    case = touching("triangle")
    contact, A = case.contact, case.problem.create_matrix()
    assembled(contact, A, ())
    upper = case.scene.cell_tags.find(case.scene.bodies["1"])
    case.u.interpolate(lambda x: np.vstack([0 * x[0] + 0.3, 0 * x[0]]), upper)
    case.u.x.scatter_forward()
    contact.update()
    assert contact.make_room(A)
    direct = rows_of(assembled(contact, A, ()))
    reference = rows_of(assembled(contact, dense_matrix(contact), ()))
    assert worst(direct - reference) < 1e-13 * worst(reference)


def test_a_matrix_without_room_is_an_error():
    case = touching("triangle")
    case.contact.update()
    small = case.contact.layout.create_matrix()
    small.setPreallocationNNZ(1)
    small.assemble()
    with pytest.raises(Exception, match="MatSetValues"):
        case.contact.assemble_matrix(small)

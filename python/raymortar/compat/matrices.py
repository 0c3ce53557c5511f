"""Forms assembled into vectors and matrices."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from petsc4py import PETSc

import dolfinx.fem.petsc  # noqa: F401 (makes the C++ module)
import numpy as np
import numpy.typing as npt
from dolfinx import cpp as _cpp

from .generation import Array, Indices, unwrap


def assemble_residual(b: Array, L: Any) -> None:
    """Add a compiled linear form into a ghosted array; ghosts are not sent home."""
    L = unwrap(L)
    constants, coefficients = _cpp.fem.pack_constants(L), _cpp.fem.pack_coefficients(L)
    _cpp.fem.assemble_vector(b, L, constants, coefficients)


def assemble_jacobian(A: PETSc.Mat, a: Any, bcs: Sequence[Any]) -> None:
    """Add a compiled bilinear form into the displacement block of a matrix.

    Constrained rows and columns are left out, and their owned diagonal set to 1.
    Collective, but the final assembly is the caller's; in between, values may be
    inserted or added.

    Parameters
    ----------
    A
        Coupled matrix. Its local-to-global map starts with the ghosted dofs of the
        form's space, unrolled; what follows them is not touched.
    a
        Compiled bilinear form with the same test and trial space.
    bcs
        Dirichlet conditions on that space.
    """
    a, bcs = unwrap(a), [unwrap(bc) for bc in bcs]
    constants, coefficients = _cpp.fem.pack_constants(a), _cpp.fem.pack_coefficients(a)
    # Unrolled: the multiplier's rows leave the matrix no common block size.
    _cpp.fem.petsc.assemble_matrix(A, a, constants, coefficients, bcs, True)
    # PETSc refuses to mix adding and inserting without a flush between them.
    A.assemble(PETSc.Mat.AssemblyType.FLUSH)
    _cpp.fem.petsc.insert_diagonal(A, a.function_spaces[0], bcs, 1.0)
    A.assemble(PETSc.Mat.AssemblyType.FLUSH)


def assemble_blocks(
    A: PETSc.Mat,
    a: Sequence[Sequence[Any]],
    bcs: Sequence[Any],
    starts: npt.NDArray[np.int64],
    fixed: Indices,
) -> None:
    """Add compiled bilinear forms of several unknowns into a matrix.

    As `assemble_jacobian`, which does the same for one.

    Parameters
    ----------
    A
        Coupled matrix. Its local-to-global map has the ghosted dofs of all unknowns,
        one after the other, unrolled.
    a
        Forms by test and trial space; None: zero.
    bcs
        Dirichlet conditions on any of the spaces.
    starts
        First local dof of each unknown, then their number.
    fixed
        Rows of the constrained owned dofs, global.
    """
    bcs = [unwrap(bc) for bc in bcs]
    sets = [
        PETSc.IS().createGeneral(np.arange(*ends, dtype=PETSc.IntType), PETSc.COMM_SELF)
        for ends in zip(starts, starts[1:])
    ]
    for rows, forms in zip(sets, a):
        for columns, one in zip(sets, forms):
            if one is None:
                continue
            part, one = A.getLocalSubMatrix(rows, columns), unwrap(one)
            packed = _cpp.fem.pack_constants(one), _cpp.fem.pack_coefficients(one)
            _cpp.fem.petsc.assemble_matrix(part, one, *packed, bcs, True)
            A.restoreLocalSubMatrix(rows, columns, part)
    for one in sets:
        one.destroy()
    # PETSc refuses to mix adding and inserting without a flush between them.
    A.assemble(PETSc.Mat.AssemblyType.FLUSH)
    for row in fixed:
        A.setValue(row, row, 1.0, PETSc.InsertMode.INSERT_VALUES)
    A.assemble(PETSc.Mat.AssemblyType.FLUSH)

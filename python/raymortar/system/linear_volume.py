"""Volumes whose forms are linear in the unknowns: the tangent is made once and kept."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from petsc4py import PETSc

import numpy as np
import numpy.typing as npt
import ufl

from .. import _cpp
from ..compat import Array

_SAME = PETSc.Mat.Structure.SAME_NONZERO_PATTERN
_PART = PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN


class Inputs:
    """Values that forms depend on, besides the unknowns.

    Parameters
    ----------
    forms
        UFL forms.
    functions
        The unknowns.
    """

    def __init__(self, forms: Sequence[ufl.Form], functions: Sequence[Any]) -> None:
        found = {id(c): c for form in forms for c in form.coefficients()}
        self.has_unknowns = any(id(f) in found for f in functions)
        self._others = [c for key, c in found.items() if key not in _ids(functions)]
        self._constants = list(
            {id(c): c for F in forms for c in F.constants()}.values()
        )
        meshes = [f.function_space.mesh for f in functions]
        self._meshes = list({id(mesh): mesh for mesh in meshes}.values())
        self._last: list[Array] = []

    def share_memory_with(self, functions: Sequence[Any]) -> bool:
        """Whether a Function of the forms is a part of an unknown."""
        return any(
            np.may_share_memory(c.x.array, f.x.array)
            for c in self._others
            for f in functions
        )

    def have_changed(self) -> bool:
        """Whether values differ, on this rank, from those of the last call."""
        now = [np.asarray(c.value) for c in self._constants]
        now += [c.x.array for c in self._others]
        now += [mesh.geometry.x for mesh in self._meshes]
        same = len(self._last) == len(now) and all(map(np.array_equal, self._last, now))
        if not same:
            self._last = [values.copy() for values in now]
        return not same


def _ids(things: Sequence[Any]) -> set[int]:
    return {id(thing) for thing in things}


class LinearVolume:
    """The forms' residual K u + l, and K. Collective.

    K is kept in two parts. The first has the entries between free unknowns, and ones on
    the diagonal for prescribed unknowns: this part goes into the coupled tangent. The
    second has the other entries, in rows or columns of prescribed unknowns.

    Parameters
    ----------
    contact
        Contact, or several.
    pattern
        Of the tangent.
    of_residual, of_tangent
        What they depend on.
    is_whole
        Whether K has about all entries of the pattern, and not those of some bodies.

    Attributes
    ----------
    revision
        Number of tangents so far.
    """

    def __init__(
        self,
        contact: Any,
        pattern: Any,
        of_residual: Inputs,
        of_tangent: Inputs,
        is_whole: bool = True,
    ) -> None:
        self._contact, self._comm = contact, contact.layout.comm
        self._pattern, self._is_whole = pattern, is_whole
        self._of_residual, self._of_tangent = of_residual, of_tangent
        self._fixed: npt.NDArray[np.bool_] = np.zeros(0, dtype=bool)
        self._at: tuple[Any, ...] = ()
        self._free: PETSc.Mat | None = None
        self._others: PETSc.Mat | None = None
        self._constant: Array = np.zeros(0)
        self.revision = 0

    @property
    def tangent(self) -> PETSc.Mat:
        """K between free unknowns, and ones for the others, after `renew`."""
        return self._free

    def renew(
        self,
        fixed: npt.NDArray[np.bool_],
        assemble: Callable[[PETSc.Mat], None],
        forces: Callable[[], Array],
    ) -> None:
        """Make anew what has changed since the last call. Collective.

        Parameters
        ----------
        fixed
            Whether conditions prescribe an owned unknown of the host.
        assemble
            Adds the tangent without conditions to a matrix.
        forces
            Gives the assembled residual of the owned unknowns.
        """
        layout = self._contact.layout
        at = layout.n, layout.begin, layout.size
        anew = self._of_tangent.have_changed() or at != self._at
        anew = anew or not np.array_equal(fixed, self._fixed)
        changed = np.array([anew, self._of_residual.have_changed() or anew], dtype=int)
        anew, forces_too = self._comm.allreduce(changed)
        if anew:
            self._fixed, self._at = fixed.copy(), at
            self._make(assemble)
        if forces_too:
            self._constant = self._at_rest(forces)

    def _make(self, assemble: Callable[[PETSc.Mat], None]) -> None:
        """K, in its two parts. Collective."""
        self.destroy()
        self.revision += 1
        K = self._contact.layout.create_matrix()
        rows = self._pattern.offsets, self._pattern.columns
        _cpp.preallocate(K.handle, *rows, [], [])
        assemble(K)
        K.assemble()
        free = K.copy()
        fixed = self._contact.layout.begin + np.flatnonzero(self._fixed)
        free.zeroRowsColumns(fixed.astype(PETSc.IntType), diag=0.0)
        K.axpy(-1.0, free, _SAME)
        self._others = _without_zeros(K)
        K.destroy()
        diagonal = free.getDiagonal()
        diagonal.array[: len(self._fixed)][self._fixed] = 1.0
        free.setDiagonal(diagonal)
        diagonal.destroy()
        self._free = free if self._is_whole else _without_zeros(free)
        if not self._is_whole:
            free.destroy()

    def _at_rest(self, forces: Callable[[], Array]) -> Array:
        """The residual where all unknowns are zero: at a present iterate it would depend
        on the order of calls. Collective."""
        functions = self._contact.host.functions
        kept = [f.x.array.copy() for f in functions]
        try:
            for f in functions:
                f.x.array[:] = 0.0
            return forces()
        finally:
            for f, values in zip(functions, kept):
                f.x.array[:] = values

    def forces(self, values: Array) -> Array:
        """Residual of the owned unknowns at their values. Collective."""
        assert self._free is not None and self._others is not None
        n = self._contact.layout.n
        x, y = self._free.createVecs()
        x.array[:n] = np.where(self._fixed, 0.0, values)
        self._free.mult(x, y)
        x.array[:n] = values
        self._others.multAdd(x, y, y)
        found: Array = y.array_r[:n] + self._constant
        x.destroy()
        y.destroy()
        return found

    def add_tangent(self, A: PETSc.Mat) -> None:
        """Add K between free unknowns, and ones for the others. Collective."""
        A.axpy(1.0, self._free, _PART)

    def destroy(self) -> None:
        """Free the matrices. Collective."""
        for matrix in (self._free, self._others):
            if matrix is not None:
                matrix.destroy()
        self._free = self._others = None


def _without_zeros(K: PETSc.Mat) -> PETSc.Mat:
    """Entries of a matrix that are not zero."""
    offsets, columns, values = K.getValuesCSR()
    found = values != 0.0
    before = np.concatenate([[0], np.cumsum(found)])
    rows = before[offsets].astype(PETSc.IntType), columns[found], values[found]
    A = PETSc.Mat().createAIJ(K.getSizes(), csr=rows, comm=K.comm)
    A.assemble()
    return A

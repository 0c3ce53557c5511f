"""Linear forms, whose tangent is made once and kept until their inputs change."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import ufl
from ufl.algorithms import expand_derivatives
from ufl.corealg.traversal import unique_pre_traversal

from .. import _cpp
from ..core.compat import Array, Mask
from ..core.discretization.forms import derivative
from ..core.discretization.ranks import destroy
from ..entries import without_zeros

_SAME = PETSc.Mat.Structure.SAME_NONZERO_PATTERN
_PART = PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN


class Inputs:
    """Remembers the values that forms depend on, besides the unknowns."""

    def __init__(
        self,
        coefficients: Iterable[Any],
        constants: Iterable[Any],
        functions: Sequence[Any],
    ) -> None:
        unknowns = {id(f) for f in functions}
        found = _each_once(coefficients)
        self.functions = [c for c in found if id(c) not in unknowns]
        self._constants = _each_once(constants)
        self._meshes = _each_once(f.function_space.mesh for f in functions)
        self._last: list[Array] = []

    def have_changed(self) -> bool:
        """Compare values on this rank with those of the last call."""
        now = [np.asarray(c.value) for c in self._constants]
        now += [c.x.array for c in self.functions]
        now += [mesh.geometry.x for mesh in self._meshes]
        same = len(self._last) == len(now) and all(map(np.array_equal, self._last, now))
        if not same:
            self._last = [values.copy() for values in now]
        return not same


def _each_once(things: Iterable[Any]) -> list[Any]:
    """Leave out objects that have occurred before."""
    return list({id(thing): thing for thing in things}.values())


def inputs_of(forms: Sequence[Any]) -> tuple[list[Any], list[Any]]:
    """Coefficients and constants of forms, None for zero."""
    given = [form for form in forms if form is not None]
    coefficients = [c for form in given for c in form.coefficients()]
    return coefficients, [c for form in given for c in form.constants()]


def inputs_if_linear(
    forms: Sequence[ufl.Form], functions: Sequence[Any]
) -> tuple[Inputs, Inputs] | None:
    """Find what residuals and their tangents depend on, None where the derivatives of
    some residual depend on the unknowns. Collective."""
    of_residual = Inputs(*inputs_of(forms), functions)
    shares = any(
        np.may_share_memory(c.x.array, f.x.array)
        for c in of_residual.functions
        for f in functions
    )
    comm: MPI.Comm = functions[0].function_space.mesh.comm
    if comm.allreduce(shares, op=MPI.LOR):
        return None
    coefficients, constants = [], []
    for form in forms:
        found = _inputs_of_derivatives(form, functions)
        if found is None:
            return None
        coefficients += found[0]
        constants += found[1]
    return of_residual, Inputs(coefficients, constants, functions)


# Places of what derivatives depend on, among a form's coefficients and constants, by
# signature and places of the unknowns. UFL takes longer to find them than a small solve
_PLACES: dict[tuple[str, tuple[int, ...]], tuple[list[int], list[int]] | None] = {}


def _inputs_of_derivatives(
    form: ufl.Form, functions: Sequence[Any]
) -> tuple[list[Any], list[Any]] | None:
    """Coefficients and constants of the derivatives of a form by functions, None where
    they depend on one of these or the form has a condition on it."""
    coefficients, constants = form.coefficients(), form.constants()
    at = _places(functions, coefficients)
    key = form.signature(), tuple(at)
    if key not in _PLACES:
        unknowns = [coefficients[i] for i in at]
        found, fixed = inputs_of([derivative(form, f, True) for f in unknowns])
        is_linear = not _places(found, unknowns) and not _has_condition_on(
            expand_derivatives(form), unknowns
        )
        places = _places(found, coefficients), _places(fixed, constants)
        _PLACES[key] = places if is_linear else None
    known = _PLACES[key]
    if known is None:
        return None
    return [coefficients[i] for i in known[0]], [constants[i] for i in known[1]]


def _places(some: Sequence[Any], things: Sequence[Any]) -> list[int]:
    """Indices of the things that are among some."""
    names = {id(one) for one in some}
    return [i for i, thing in enumerate(things) if id(thing) in names]


def _has_condition_on(form: ufl.Form, functions: Sequence[Any]) -> bool:
    """Find a `ufl.conditional` that compares a value of the functions.

    Such a form may jump, and its derivative is zero where both branches are constant:
    the derivative alone would let it pass as linear. In the form derivatives are
    expanded, as `abs` and `max_value` have conditions only then.
    """
    unknowns = {id(f) for f in functions}
    return any(
        id(operand) in unknowns
        for part in form.integrals()
        for node in unique_pre_traversal(part.integrand())
        if isinstance(node, ufl.classes.Condition)
        for operand in unique_pre_traversal(node)
    )


class Kept:
    """The residual K u + l of linear forms, and K, made once. Collective.

    K is kept in two parts. The first has the entries between free unknowns, and ones on
    the diagonal for prescribed unknowns: this part goes into the coupled tangent. The
    second has the other entries, in rows or columns of prescribed unknowns.

    Attributes
    ----------
    revision
        Number of tangents so far.
    tangent
        K between free unknowns, and ones for the others, after `renew`.
    """

    def __init__(
        self,
        contact: Any,
        forms: Any,
        pattern: Any,
        of_residual: Inputs,
        of_tangent: Inputs,
    ) -> None:
        self._contact, self._comm = contact, contact.layout.comm
        self._forms, self._pattern = forms, pattern
        self._of_residual, self._of_tangent = of_residual, of_tangent
        self._fixed: Mask = np.zeros(0, dtype=bool)
        self._at: tuple[Any, ...] = ()
        self._constant: Array = np.zeros(0)
        self.tangent: PETSc.Mat | None = None
        self._others: PETSc.Mat | None = None
        self._x: Any = None
        self._y: Any = None
        self.revision = 0

    def renew(self, fixed: Mask) -> None:
        """Make anew what has changed, given which owned unknowns are prescribed."""
        layout = self._contact.layout
        at = layout.n, layout.begin, layout.size
        anew = self._of_tangent.have_changed() or at != self._at
        anew = anew or not np.array_equal(fixed, self._fixed)
        changed = np.array([anew, self._of_residual.have_changed() or anew], dtype=int)
        anew, forces_too = self._comm.allreduce(changed)
        if anew:
            self._fixed, self._at = fixed.copy(), at
            self._assemble()
        if forces_too:
            self._constant = self._at_rest()

    def _assemble(self) -> None:
        """Assemble K, and divide it into its two parts."""
        destroy(self.tangent, self._others, self._x, self._y)
        self.revision += 1
        K = self._contact.layout.create_matrix()
        _cpp.preallocate(K.handle, self._pattern.offsets, self._pattern.columns, [], [])
        self._forms.add_tangent(K, (), np.zeros(0, dtype=bool))
        K.assemble()
        free = K.copy()
        fixed = self._contact.layout.begin + np.flatnonzero(self._fixed)
        free.zeroRowsColumns(fixed.astype(PETSc.IntType), diag=0.0)
        K.axpy(-1.0, free, _SAME)
        self._others = without_zeros(K)
        K.destroy()
        diagonal = free.getDiagonal()
        diagonal.array[: len(self._fixed)][self._fixed] = 1.0
        free.setDiagonal(diagonal)
        diagonal.destroy()
        self.tangent = free
        self._x, self._y = self.tangent.createVecs()

    def _at_rest(self) -> Array:
        """Assemble the residual where all unknowns are zero.

        At a present iterate it would depend on the order of calls.
        """
        unknowns = self._contact.unknowns
        with unknowns.lent():
            for f in unknowns.functions:
                f.x.array[:] = 0.0
            found: Array = self._forms.residual()
        return found

    def forces(self, values: Array) -> Array:
        """Residual of the owned unknowns at their values."""
        assert self.tangent is not None and self._others is not None
        x, y, n = self._x, self._y, len(values)
        x.array[:n] = np.where(self._fixed, 0.0, values)
        self.tangent.mult(x, y)
        x.array[:n] = values
        self._others.multAdd(x, y, y)
        return y.array_r[:n] + self._constant

    def add_tangent(self, A: PETSc.Mat) -> None:
        """Add K between free unknowns, and ones for the others."""
        A.axpy(1.0, self.tangent, _PART)


def keeper(contact: Any, assembled: Any, pattern: Any, forms: Any) -> Kept | None:
    """Make what keeps the tangent of forms that are linear, from their assembler and the
    pattern of the tangent; None where they are not."""
    inputs = inputs_if_linear(forms, contact.unknowns.functions)
    return None if inputs is None else Kept(contact, assembled, pattern, *inputs)

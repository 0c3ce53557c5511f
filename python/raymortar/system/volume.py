"""The user's forms: residual and tangent of everything but contact."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import ufl
from ufl.algorithms import expand_derivatives
from ufl.corealg.traversal import unique_pre_traversal

from .. import _cpp, compat
from ..compat import Array, Mask
from ..discretization.forms import derivative
from ..discretization.ranks import destroy
from ..discretization.unknowns import Unknowns
from ..errors import together
from .entries import without_zeros


class Forms:
    """Assembles compiled forms of all unknowns of the forms. Collective.

    Forms of several unknowns are lists, in which None is zero. An only tangent may be
    None too.
    """

    def __init__(self, contact: Any, L: Any, a: Any) -> None:
        self._contact, self._unknowns = contact, contact.unknowns
        self.has_several = isinstance(L, list)
        self._a = a
        maps = [compat.unknowns_of(f) for f in self._unknowns.functions]
        vectors = [compat.create_la_vector(*one) for one in maps]
        forms, table = (L, a) if self.has_several else ([L], [[a]])
        # By test space, with views of arrays and of their owned parts
        starts = self._unknowns.owned_starts
        self._found = np.zeros(starts[-1])
        owned = np.split(self._found, starts[1:-1])
        self._rows = [
            (form, blocks, r, r.array, part)
            for form, blocks, r, part in zip(forms, table, vectors, owned)
        ]
        self._alone = self._unknowns.comm.size == 1

    def residual(
        self, bcs: Sequence[Any] = (), increment: Array | None = None
    ) -> Array:
        """Assemble the owned rows, with the effect of prescribed increments if given."""
        lifts = increment is not None and len(increment.nonzero()[0]) > 0
        for form, blocks, r, array, owned in self._rows:
            array[:] = 0.0
            if form is not None:
                compat.assemble_residual(array, form)
            if lifts:
                self._lift(array, blocks, bcs, increment)
            if not self._alone:
                compat.scatter_reverse_add(r)
            owned[:] = array[: len(owned)]
        return self._found.copy()

    def _lift(
        self, r: Array, blocks: Sequence[Any], bcs: Sequence[Any], increment: Any
    ) -> None:
        """Add the effect of prescribed increments to the rows of one test space."""
        unknowns = self._unknowns
        parts = np.split(increment, unknowns.starts[1:-1])
        each = zip(parts, blocks, unknowns.functions, unknowns.conditions(bcs))
        for part, block, f, of_f in each:
            # Takes the tangents of all cells with constrained dofs
            if block is not None and part.any():
                compat.apply_lifting(r, block, of_f, f.x.array, -1.0)

    def add_tangent(self, A: PETSc.Mat, bcs: Sequence[Any], fixed: Mask) -> None:
        """Add the tangent, and set the diagonal of constrained unknowns to one."""
        if self.has_several:
            rows = self._contact.layout.begin + np.flatnonzero(fixed)
            starts = self._unknowns.starts
            compat.assemble_blocks(A, self._a, bcs, starts, rows.astype(np.int32))
        elif self._a is not None:
            compat.assemble_jacobian(A, self._a, bcs)


class Updated:
    """Calls the user's function once for each state of the unknowns. Collective."""

    def __init__(self, unknowns: Unknowns, function: Callable[[], object]) -> None:
        self._unknowns, self._function = unknowns, function
        # Unknowns of the last call; None: it has to be called again
        self._last: Array | None = None
        self._is_new = False

    def bring(self) -> None:
        """Call the function if the unknowns have changed since its last call."""
        comm, now = self._unknowns.comm, self._unknowns.values()
        changed = self._last is None or not np.array_equal(self._last, now)
        if not comm.allreduce(changed, op=MPI.LOR):
            return
        self._last = None
        with together(comm):
            self._function()
        self._last, self._is_new = now, True

    def bring_for_residual(self) -> None:
        """As `bring`, and again where a residual has been assembled before: only a new
        solve asks for it at the same unknowns, and loads may have changed."""
        if not self._is_new:
            self._last = None
        self.bring()
        self._is_new = False

    def forget(self) -> None:
        """Call the function next time though the unknowns stay the same."""
        self._last = None


class Volume:
    """Residual and tangent of compiled forms, of all unknowns of the forms. Collective.

    Parameters
    ----------
    contact
        Contact, or several.
    L, a
        Compiled residual and tangent, as lists where there are several unknowns.
    forms
        The residual in UFL, if the tangent is its derivative: where that does not depend
        on the unknowns, it is assembled once, and the residual is a product with it.
        Else None.
    pattern
        Of the tangent, where it may be kept.
    updated
        What the user's function has set of the forms' coefficients. Then nothing of the
        forms is kept: their derivatives do not show how coefficients change.

    Attributes
    ----------
    kept
        What is kept of linear forms, as of the last residual or tangent. None: nothing.
    inertia_terms
        None: forms alone have no inertia, see `dynamics.MovingVolume`.
    """

    inertia_terms: Array | None = None

    def __init__(
        self,
        contact: Any,
        L: Any,
        a: Any,
        forms: Any = None,
        pattern: Any = None,
        updated: Updated | None = None,
    ) -> None:
        self.contact, self.L, self.a = contact, L, a
        self.updated = updated
        self.has_several = isinstance(L, list)
        self.kept: Kept | None = None
        self._forms = Forms(contact, L, a)
        if forms is not None and updated is None:
            forms = forms if self.has_several else [forms]
            inputs = inputs_if_linear(forms, contact.unknowns.functions)
            if inputs is not None:
                self.kept = Kept(contact, self._forms, pattern, *inputs)

    @property
    def is_linear(self) -> bool:
        """Whether the tangent is kept."""
        return self.kept is not None

    def with_form_of_u(self, L: Any, a: Any) -> tuple[Any, Any]:
        """Replace the forms in the displacement's test function by L and a."""
        if not self.has_several:
            return L, a
        at = self.contact.unknowns.only.at
        forms, table = list(self.L), list(map(list, self.a))
        forms[at], table[at][at] = L, a
        return forms, table

    def forces(self, bcs: Sequence[Any]) -> Array:
        """Residual at the present state, of the owned unknowns. Collective."""
        return self.residual(bcs, None)

    def residual(self, bcs: Sequence[Any], increment: Array | None) -> Array:
        """Residual of the owned unknowns, with the effect of prescribed increments if
        they are given. Collective."""
        if self.updated is not None:
            self.updated.bring()
        if self.kept is None:
            return self._forms.residual(bcs, increment)
        unknowns = self.contact.unknowns
        self.kept.renew(unknowns.owned_prescribed(bcs))
        values = unknowns.owned_values()
        if increment is not None:
            values += unknowns.owned_part(increment)
        return self.kept.forces(values)

    def add_tangent(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        """Add the tangent, with ones for constrained unknowns. Collective."""
        if self.updated is not None:
            self.updated.bring()
        fixed = self.contact.unknowns.owned_prescribed(bcs)
        if self.kept is None:
            self._forms.add_tangent(A, bcs, fixed)
        else:
            self.kept.renew(fixed)
            self.kept.add_tangent(A)


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
        functions = self._contact.unknowns.functions
        kept = [f.x.array.copy() for f in functions]
        try:
            for f in functions:
                f.x.array[:] = 0.0
            return self._forms.residual()
        finally:
            for f, values in zip(functions, kept):
                f.x.array[:] = values

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

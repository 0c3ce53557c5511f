"""Forms split into integrals that are linear in the unknowns, and the others."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from ufl.algorithms import expand_derivatives
from ufl.corealg.traversal import unique_pre_traversal

from ..compat import Array
from ..discretization.forms import derivative
from ..discretization.unknowns import Unknowns
from ..errors import together


class Inputs:
    """Remembers the values that forms depend on, besides the unknowns."""

    def __init__(self, forms: Iterable[Any], functions: Sequence[Any]) -> None:
        given = [form for form in forms if form is not None]
        found = _each_once(c for form in given for c in form.coefficients())
        unknowns = {id(f) for f in functions}
        self.functions = [c for c in found if id(c) not in unknowns]
        self.has_unknowns = len(self.functions) < len(found)
        self._constants = _each_once(c for form in given for c in form.constants())
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


def split(
    forms: Sequence[ufl.Form], functions: Sequence[Any]
) -> tuple[list[Any], list[Any]]:
    """Split residuals into their linear integrals and the rest, None for zero.

    Integrals over the same subdomain stay together: they are one kernel, which takes
    little longer for a linear integral besides. Collective.
    """
    linear, rest = [], []
    for form in forms:
        kernels: dict[Any, list[Any]] = {}
        for part in form.integrals():
            place = part.ufl_domain(), part.integral_type(), part.subdomain_id()
            kernels.setdefault(place, []).append(part)
        parts: dict[bool, list[Any]] = {True: [], False: []}
        for kernel in kernels.values():
            parts[_is_linear(ufl.Form(kernel), functions)] += kernel
        linear.append(ufl.Form(parts[True]) if parts[True] else None)
        rest.append(ufl.Form(parts[False]) if parts[False] else None)
    return linear, rest


def _is_linear(form: ufl.Form, functions: Sequence[Any]) -> bool:
    """Check that derivatives do not depend on the unknowns. Collective."""
    shares = any(
        np.may_share_memory(c.x.array, f.x.array)
        for c in Inputs([form], functions).functions
        for f in functions
    )
    comm: MPI.Comm = functions[0].function_space.mesh.comm
    if comm.allreduce(shares, op=MPI.LOR):
        return False
    if _has_condition_on(expand_derivatives(form), functions):
        return False
    return not Inputs(tangents([form], functions)[0], functions).has_unknowns


def tangents(forms: Sequence[Any], functions: Sequence[Any]) -> list[list[Any]]:
    """Differentiate residuals by the unknowns, expanded, None for zero."""
    table = [
        [None if form is None else derivative(form, f) for f in functions]
        for form in forms
    ]
    return [[J and expand_derivatives(J) for J in row] for row in table]


def has_cells(table: Iterable[Iterable[Any]]) -> bool:
    """Check that some form of a table has an integral over cells."""
    return any(
        part.integral_type() == "cell"
        for row in table
        for form in row
        if form is not None
        for part in form.integrals()
    )


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

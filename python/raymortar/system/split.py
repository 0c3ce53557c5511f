"""Forms split into integrals that are linear in the unknowns, and the others."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from mpi4py import MPI

import ufl
from ufl.algorithms import expand_derivatives
from ufl.corealg.traversal import unique_pre_traversal

from ..host.forms import derivative
from .linear_volume import Inputs


class Split:
    """Residuals, and their tangents, in two parts. Collective.

    An integral is linear where its derivatives do not depend on the unknowns. It stays
    with the others where one of them is over the same subdomain: they are one kernel,
    which takes little longer with it than without.

    Parameters
    ----------
    forms
        UFL residuals by unknown.
    functions
        The unknowns.

    Attributes
    ----------
    linear, rest
        UFL residuals of each part by unknown, None where they are zero.
    """

    def __init__(self, forms: Sequence[ufl.Form], functions: Sequence[Any]) -> None:
        self._functions = functions
        marked = [list(self._marked(form)) for form in forms]
        self.linear = [_sum(part for part, alone in row if alone) for row in marked]
        self.rest = [_sum(part for part, alone in row if not alone) for row in marked]

    def _marked(self, form: ufl.Form) -> Iterator[tuple[Any, bool]]:
        """Integrals, and whether they are linear and no other is over the same
        subdomain. Collective."""
        parts = form.integrals()
        linear = [self._is_linear(ufl.Form([part])) for part in parts]
        others = {_place(part) for part, one in zip(parts, linear) if not one}
        return ((part, _place(part) not in others) for part in parts)

    def _is_linear(self, form: ufl.Form) -> bool:
        """Whether a form is linear. Collective."""
        inputs = Inputs([form], self._functions)
        shares = inputs.share_memory_with(self._functions)
        if self._functions[0].function_space.mesh.comm.allreduce(shares, op=MPI.LOR):
            return False
        if has_condition_on([expand_derivatives(form)], self._functions):
            return False
        tangents = without_zeros(self.tangents([form])[0])
        return not Inputs(tangents, self._functions).has_unknowns

    def tangents(self, forms: Sequence[Any]) -> list[list[Any]]:
        """Derivatives of residuals by the unknowns, expanded, None where they are
        zero."""
        return [
            [None if form is None else _expanded(form, f) for f in self._functions]
            for form in forms
        ]

    @property
    def pays(self) -> bool:
        """Whether the linear part has a stiffness of cells. A matrix of facets is not
        worth its addition to the tangent."""
        return any(
            part.integral_type() == "cell"
            for row in self.tangents(self.linear)
            for one in without_zeros(row)
            for part in one.integrals()
        )


def _place(part: Any) -> tuple[Any, ...]:
    """Where an integral is."""
    return part.ufl_domain(), part.integral_type(), part.subdomain_id()


def without_zeros(forms: Iterable[Any]) -> list[Any]:
    """Forms but those that are None."""
    return [form for form in forms if form is not None]


def _expanded(form: ufl.Form, f: Any) -> ufl.Form | None:
    J = derivative(form, f)
    return None if J is None else expand_derivatives(J)


def _sum(parts: Iterable[Any]) -> ufl.Form | None:
    """A form of some integrals, None of none."""
    found = list(parts)
    return ufl.Form(found) if found else None


def has_condition_on(forms: Sequence[ufl.Form], functions: Sequence[Any]) -> bool:
    """Whether a `ufl.conditional` in the forms compares a value of the functions.

    Such a form may jump, and its derivative is zero where both branches are constant:
    the derivative alone would let it pass as linear.

    Parameters
    ----------
    forms
        With their derivatives expanded: `abs` and `max_value` have conditions only then.
    functions
        The unknowns.
    """
    known = {id(f) for f in functions}
    conditions = (
        node
        for form in forms
        for part in form.integrals()
        for node in unique_pre_traversal(part.integrand())
        if isinstance(node, ufl.classes.Condition)
    )
    return any(
        id(node) in known
        for condition in conditions
        for node in unique_pre_traversal(condition)
    )

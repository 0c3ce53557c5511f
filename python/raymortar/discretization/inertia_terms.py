"""A sign of inertia in a user's form, which contact would make gain energy."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from typing import Any

import ufl
from dolfinx.fem import Function
from ufl.algorithms import expand_derivatives

from .. import compat
from ..errors import ContactWarning
from .forms import derivative

_MESSAGE = (
    "F looks as if it had inertia: over cells it has {u} and {other} of its space, neither "
    "differentiated. If so, leave it out of F and give it to dynamics.Inertia: implicit "
    "schemes multiply the energy of an impact by 3 and more where nodes of contact "
    "surfaces have mass (docs/dynamics.md)"
)


def warn_of_inertia(
    F: Sequence[Any], functions: Sequence[Function], stacklevel: int
) -> None:
    """Warn where residuals of displacements seem to have inertia. The level of
    `warnings.warn` is seen from the caller."""
    for form, f in zip(F, functions):
        other = _earlier_state(form, f)
        if other is not None:
            text = _MESSAGE.format(u=f.name, other=other.name)
            warnings.warn(text, ContactWarning, stacklevel=stacklevel + 1)
            return


def _earlier_state(form: ufl.Form, f: Function) -> Function | None:
    """Find another Function of the space of f that is in a term over cells, where this
    term has f and the test function and differentiates none of the three.

    Inertia has velocities or displacements of earlier steps there. Springs to a fixed
    place have none.
    """
    for part in form.integrals():
        plain = _undifferentiated(part.integrand())
        others = [
            c
            for c in plain
            if isinstance(c, Function)
            and c is not f
            and compat.is_same_space(c.function_space, f.function_space)
        ]
        if part.integral_type() != "cell" or not others or f not in plain:
            continue
        J = derivative(ufl.Form([part]), f)
        if J is not None and _is_mass_like(expand_derivatives(J)):
            return others[0]
    return None


def _is_mass_like(J: ufl.Form) -> bool:
    """Whether a term of a bilinear form differentiates neither argument."""
    arguments = set(J.arguments())
    return any(
        arguments <= _undifferentiated(term)
        for part in J.integrals()
        for term in _terms(part.integrand())
    )


def _terms(expression: Any) -> Iterator[Any]:
    """Yield the terms of a sum, also within sums over an index."""
    kind = type(expression).__name__
    if kind == "Sum":
        for operand in expression.ufl_operands:
            yield from _terms(operand)
    elif kind == "IndexSum":
        yield from _terms(expression.ufl_operands[0])
    else:
        yield expression


def _undifferentiated(expression: Any) -> set[Any]:
    """Collect Functions and arguments of an expression that are outside of derivatives."""
    found, left = set(), [expression]
    while left:
        one = left.pop()
        if isinstance(one, ufl.classes.Derivative):
            continue
        if isinstance(one, (ufl.classes.Coefficient, ufl.classes.Argument)):
            found.add(one)
        left.extend(one.ufl_operands)
    return found

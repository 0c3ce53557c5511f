"""A problem that has been made: pairs that its contacts share, inertia in its forms."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import ufl
from dolfinx.fem import Function

from ..core import compat
from ..core.discretization.forms import derivative
from ..core.errors import warn
from ..core.problem import CoupledProblem

_MESSAGE = (
    "F looks as if it had inertia: over cells it has {u} and {other}, neither "
    "differentiated. If so, give it to dynamics.Inertia instead"
)


def warn_of_shared_pairs(problem: CoupledProblem) -> None:
    """Say where several multipliers stand for the traction of one pair."""
    contacts = problem.contact.contacts
    known: dict[frozenset[Any], int] = {}
    for i, contact in enumerate(contacts):
        if contact.assembly.surfaces.multiplier is None:
            continue
        for pair in contact.pairs:
            sides = frozenset((pair.slave, pair.master))
            if sides in known:
                slave = contact.zones[pair.surface].facets.spoken
                other = pair.master_name or pair.master
                warn(
                    f"contact[{known[sides]}] and contact[{i}] both have multipliers "
                    f"on {slave} and master {other}: only their sum "
                    "is determined. Give the pair to one of them, or one a Penalty",
                )
            known[sides] = i


def warn_of_inertia(problem: CoupledProblem) -> None:
    """Warn where residuals of displacements seem to have inertia."""
    unknowns, (F, _) = problem.contact.unknowns, problem.forms
    forms = F if isinstance(F, (list, tuple)) else [F]
    for k in sorted({one.at for one in unknowns.displacements}):
        f = unknowns.functions[k]
        other = _earlier_state(forms[k], f)
        if other is not None:
            text = _MESSAGE.format(u=f.name, other=other.name)
            warn(text, page="fields")
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
        J = derivative(ufl.Form([part]), f, expanded=True)
        # Whether a term of it differentiates neither argument
        if J is not None and any(
            set(J.arguments()) <= _undifferentiated(term)
            for one in J.integrals()
            for term in _terms(one.integrand())
        ):
            return others[0]
    return None


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

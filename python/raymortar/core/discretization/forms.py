"""The forms and conditions of a problem, and what it solves for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import ufl
from dolfinx.fem import Function
from ufl.algorithms import expand_derivatives

from .. import compat
from ..errors import ContactError
from ..hooks import hooks
from .joined import Displacement
from .unknowns import Unknowns


def list_of_conditions(bcs: Any) -> list[Any]:
    """Dirichlet conditions as a new list."""
    try:
        return [] if bcs is None else list(bcs)
    except TypeError:
        raise ContactError(
            f"bcs must be a list of Dirichlet conditions, not {type(bcs).__name__}"
        ) from None


def find_unknowns(F: Any, J: Any, u: Any, unknowns: Unknowns) -> list[Function]:
    """The Functions that a problem solves for, after checks of its forms.

    F and J are a UFL residual and its Jacobian or None, or lists of them by unknown; u
    is None, a Function or a list.
    """
    for check in hooks.on_forms:
        check(F, J, u, unknowns)
    return list(u) if isinstance(F, (list, tuple)) else [single(F, unknowns.only)]


def single(F: Any, only: Displacement) -> Function:
    """The displacement as the only unknown, or the mixed Function that it is a part of."""
    for f in F.coefficients():
        if isinstance(f, Function) and compat.same_values(f, only.given):
            return f
    if only.component is None:
        return only.given
    return Function(F.arguments()[0].ufl_function_space(), only.given.x)


def is_table(given: Any, n: int) -> bool:
    """Whether forms are n lists of n."""
    lists = [given, *given] if isinstance(given, (list, tuple)) else [given]
    return all(isinstance(row, (list, tuple)) and len(row) == n for row in lists)


def jacobians(F: Any, u: Sequence[Function], unknowns: Unknowns) -> Any:
    """Derivative of a residual by the unknown; of several residuals a list of lists,
    None for zero, or an error."""
    if not isinstance(F, (list, tuple)):
        (w,) = u
        return ufl.derivative(F, w, ufl.TrialFunction(w.function_space))
    table = [[derivative(form, f) for f in u] for form in F]
    for d in unknowns.displacements:
        if table[d.at][d.at] is None:
            raise ContactError(
                f"F[{d.at}] does not depend on the displacement {d.given.name}: write "
                "it in that Function, or give J"
            )
    return table


def derivative(form: Any, f: Function, expanded: bool = False) -> Any:
    """Derivative of a form by a Function, None for zero; expanded by UFL if asked."""
    if not any(coefficient is f for coefficient in form.coefficients()):
        return None
    J = ufl.derivative(form, f, ufl.TrialFunction(f.function_space))
    found = expand_derivatives(J)
    return None if found.empty() else found if expanded else J


def extended(F: Any, J: Any, count: int) -> tuple[Any, Any]:
    """Forms and their derivatives as lists, with none for further unknowns."""
    forms = list(F) if isinstance(F, (list, tuple)) else [F]
    table = [list(row) for row in J] if isinstance(F, (list, tuple)) else [[J]]
    none = [None] * count
    rows = [row + none for row in table]
    return forms + none, rows + [[None] * (len(forms) + count) for _ in none]

"""Checks of the forms and conditions that a user gives. All are collective."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import ufl
from dolfinx.fem import FunctionSpace

from .. import compat
from ..errors import ContactError

_RESIDUAL = (
    "a linear form in the test function of contact.u.function_space; where the "
    "displacement is a part of a mixed Function w, give Contact that part, as w.sub(0)"
)
_JACOBIAN = "a bilinear form in test and trial function of contact.u.function_space"


def check_form(
    name: str, form: Any, rank: int, wanted: str, *spaces: FunctionSpace
) -> None:
    """Raise unless a UFL form has a given rank and given spaces: one for each argument,
    or one for all."""
    if not isinstance(form, ufl.Form):
        raise ContactError(
            f"{name} must be one UFL form, {wanted}, not {type(form).__name__}"
        )
    arguments = form.arguments()
    if len(arguments) != rank:
        raise ContactError(
            f"{name} is a form of rank {len(arguments)}: it must be {wanted}"
        )
    if len(spaces) == 1:
        spaces = spaces * len(arguments)
    for argument, V in zip(arguments, spaces):
        if not compat.is_same_space(argument.ufl_function_space(), V):
            raise ContactError(
                f"{name} has a test or trial function in another space: it must be "
                f"{wanted}"
            )


def check_forms(F: Any, J: Any, u: Any) -> None:
    """Raise unless F is a residual of u and J, if there is one, a Jacobian of it.

    Raises
    ------
    ContactError
        If F or J is no form, of another rank, in another space, or if F does not depend
        on u and there is no J: its derivative would be zero.
    """
    V = u.function_space
    check_form("F", F, 1, _RESIDUAL, V)
    if J is not None:
        check_form("J", J, 2, _JACOBIAN, V)
    elif not any(coefficient is u for coefficient in F.coefficients()):
        raise ContactError(
            "F does not depend on the displacement that Contact was given, but on "
            f"{[str(c) for c in F.coefficients()]}: write it in contact.u, or give J"
        )


def list_of_conditions(bcs: Any) -> list[Any]:
    """Dirichlet conditions as a new list."""
    try:
        return [] if bcs is None else list(bcs)
    except TypeError:
        raise ContactError(
            f"bcs must be a list of Dirichlet conditions, not {type(bcs).__name__}"
        ) from None


def check_supports(name: str, supports: Any) -> dict[str, list[Any]]:
    """Conditions as a list by name of the support, or an error."""
    supports = {} if supports is None else supports
    if not isinstance(supports, Mapping):
        raise ContactError(
            f"{name} must be Dirichlet conditions by name of the support, not "
            f"{type(supports).__name__}"
        )
    found = {}
    for support, bcs in supports.items():
        found[support] = list(bcs) if isinstance(bcs, (list, tuple)) else [bcs]
        for bc in found[support]:
            if not hasattr(bc, "dof_indices"):
                raise ContactError(
                    f"{name} has {bc!r} for {support!r}, which is no Dirichlet "
                    "condition"
                )
    return found


def check_compiled(a: Any, count: int = 1) -> None:
    """Raise unless `a` is a compiled bilinear form, or for several unknowns a table of
    them."""
    if count > 1:
        rows = a if isinstance(a, list) else []
        if len(rows) != count or any(len(row) != count for row in rows):
            raise ContactError(f"a must be {count} lists of {count} forms each")
        for one in (one for row in rows for one in row if one is not None):
            check_compiled(one)
        return
    rank = compat.compiled_rank(a)
    if rank != 2:
        found = type(a).__name__ if rank is None else f"a form of rank {rank}"
        raise ContactError(
            f"a must be a compiled bilinear form (dolfinx.fem.form), not {found}"
        )

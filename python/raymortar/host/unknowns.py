"""What a nonlinear problem solves for, from the forms and Functions it is given."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import ufl
from dolfinx.fem import Function

from .. import compat
from ..errors import ContactError
from .forms import check_form, check_forms
from .host import Host


def find_unknowns(F: Any, J: Any, u: Any, host: Host) -> list[Function]:
    """The Functions that a problem solves for, after checks of its forms.

    Parameters
    ----------
    F, J
        UFL residual and Jacobian, or lists of them by unknown; J may be None.
    u
        What the user names as unknowns: None, a Function or a list.
    host
        Of the contact.

    Raises
    ------
    ContactError
        If forms and unknowns do not fit to each other, or the displacement is none of
        them.
    """
    if isinstance(F, (list, tuple)):
        return _several(F, J, u, host)
    if len(host.displacements) > 1:
        raise ContactError(
            f"the displacements {host.name} are on meshes of their own: F must be a "
            "list of residuals, with u= a list of what they are solved for"
        )
    only = host.displacements[0]
    if only.component is None:
        check_forms(F, J, only.given)
        _check_named(u, only.given)
        return [only.given]
    whole = _whole(F, J, host)
    _check_named(u, whole)
    return [whole]


def _check_named(u: Any, found: Function) -> None:
    """Raise if u is given and names other unknowns than were found."""
    named = list(u) if isinstance(u, (list, tuple)) else [u]
    if u is not None and (len(named) != 1 or named[0] is not found):
        raise ContactError(
            f"u must be the one Function that F is a residual of, {found.name}: of "
            "several unknowns F is a list too, by unknown"
        )


def _whole(F: Any, J: Any, host: Host) -> Function:
    """The mixed Function that has the displacement as a part."""
    check_form("F", F, 1, "a linear form in the test functions of the mixed space")
    W = F.arguments()[0].ufl_function_space()
    given = host.displacements[0].given
    part = given.function_space
    if not compat.contains(W, part):
        raise ContactError(
            "F has a test function in another space than the mixed one that the "
            f"displacement {given.name} is a part of"
        )
    if J is not None:
        wanted = "a bilinear form in test and trial functions of the mixed space"
        check_form("J", J, 2, wanted, W)
    for f in F.coefficients():
        if isinstance(f, Function) and compat.same_values(f, given):
            return f
    if J is None:
        raise ContactError(
            f"F does not depend on the mixed Function that {given.name} is a part "
            f"of, but on {[str(c) for c in F.coefficients()]}: write it in that one "
            "(ufl.split), or give J"
        )
    return Function(W, given.x)


def _several(F: Sequence[Any], J: Any, u: Any, host: Host) -> list[Function]:
    """Unknowns of a list of residuals."""
    if not isinstance(u, (list, tuple)):
        raise ContactError(
            "F must be one UFL form, or a list of them by unknown with these in a list "
            f"u=, not list with u={u!r}"
        )
    for f in u:
        if not isinstance(f, Function):
            raise ContactError(f"u must be a list of Functions, not of {f!r}")
    if len(F) != len(u):
        raise ContactError(
            f"{len(F)} forms for {len(u)} unknowns: F must have one for each"
        )
    _check_spaces(u)
    for i, (form, f) in enumerate(zip(F, u)):
        wanted = f"a linear form in the test function of {f.name}'s space"
        check_form(f"F[{i}]", form, 1, wanted, f.function_space)
    givens = [d.given for d in host.displacements]
    if not all(any(compat.same_values(f, given) for f in u) for given in givens):
        raise ContactError(host.absence(u))
    if J is not None:
        _check_table(J, u)
    return list(u)


def _check_spaces(u: Sequence[Function]) -> None:
    """Raise if two unknowns have one space: conditions on one could not be told from
    those on the other."""
    for i, f in enumerate(u):
        if compat.element_info(f.function_space).is_sub_space:
            raise ContactError(
                f"u has {f.name}, a part of a mixed Function: name the whole"
            )
        for g in u[:i]:
            if compat.is_same_space(f.function_space, g.function_space):
                raise ContactError(
                    f"the unknowns {g.name} and {f.name} are on one space: make the "
                    "second on V.clone(), or conditions on one would hold the other"
                )


def _check_table(J: Any, u: Sequence[Function]) -> None:
    """Raise unless J is a table of Jacobians by test and trial space."""
    n = len(u)
    rows = list(J) if isinstance(J, (list, tuple)) else []
    if len(rows) != n or any(
        not isinstance(row, (list, tuple)) or len(row) != n for row in rows
    ):
        raise ContactError(
            f"J must be {n} lists of {n} forms, by test and trial space, None for zero"
        )
    for i, row in enumerate(rows):
        for j, form in enumerate(row):
            if form is None:
                continue
            wanted = f"bilinear, in {u[i].name}'s test and {u[j].name}'s trial space"
            spaces = u[i].function_space, u[j].function_space
            check_form(f"J[{i}][{j}]", form, 2, wanted, *spaces)


def jacobians(F: Sequence[Any], u: Sequence[Function], host: Host) -> list[list[Any]]:
    """Derivatives of residuals by unknowns, None for zero.

    Raises
    ------
    ContactError
        If the displacement's residual does not depend on it.
    """
    table = [[derivative(form, f) for f in u] for form in F]
    for d in host.displacements:
        if table[d.at][d.at] is None:
            raise ContactError(
                f"F[{d.at}] does not depend on the displacement {d.given.name}: write "
                "it in that Function, or give J"
            )
    return table


def derivative(form: Any, f: Function) -> Any:
    """Derivative of a form by a Function, None for zero."""
    if not any(coefficient is f for coefficient in form.coefficients()):
        return None
    J = ufl.derivative(form, f, ufl.TrialFunction(f.function_space))
    return None if ufl.algorithms.expand_derivatives(J).empty() else J

"""The forms and conditions of a problem, after checks, and what it solves for."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, product
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import Function, FunctionSpace
from ufl.algorithms import expand_derivatives
from ufl.algorithms.analysis import extract_type
from ufl.constantvalue import ComplexValue

from .. import compat
from ..errors import ContactError, described
from .joined import Displacement
from .unknowns import Unknowns

_RESIDUAL = (
    "a linear form in the test function of contact.u.function_space; where the "
    "displacement is a part of a mixed Function w, give Contact that part, as w.sub(0)"
)
_JACOBIAN = "a bilinear form in test and trial function of contact.u.function_space"
_MIXED_RESIDUAL = "a linear form in the test functions of the mixed space"
_MIXED_JACOBIAN = "a bilinear form in test and trial functions of the mixed space"


def check_form(
    name: str, form: Any, rank: int, wanted: str, *spaces: FunctionSpace
) -> None:
    """Raise unless a UFL form has a given rank and given spaces: one for each argument,
    or one for all."""
    if not isinstance(form, ufl.Form):
        raise ContactError(
            f"{name} must be one UFL form, {wanted}, not {type(form).__name__}"
        )
    if _is_complex(form):
        raise ContactError(f"{name} has complex values: contact needs real ones")
    arguments = form.arguments()
    if len(arguments) != rank:
        raise ContactError(
            f"{name} is a form of rank {len(arguments)}: it must be {wanted}"
        )
    for argument, V in zip(arguments, spaces * rank if len(spaces) == 1 else spaces):
        if not compat.is_same_space(argument.ufl_function_space(), V):
            raise ContactError(
                f"{name} has a test or trial function in another space: it must be "
                f"{wanted}"
            )


def _is_complex(form: ufl.Form) -> bool:
    """Whether a form has complex numbers, Constants or Functions."""
    values = [c.value for c in form.constants() if isinstance(c, fem.Constant)]
    values += [c.x.array for c in form.coefficients() if isinstance(c, Function)]
    return bool(extract_type(form, ComplexValue)) or any(map(np.iscomplexobj, values))


def list_of_conditions(bcs: Any) -> list[Any]:
    """Dirichlet conditions as a new list."""
    try:
        return [] if bcs is None else list(bcs)
    except TypeError:
        raise ContactError(
            f"bcs must be a list of Dirichlet conditions, not {type(bcs).__name__}"
        ) from None


# Unknowns


def find_unknowns(F: Any, J: Any, u: Any, unknowns: Unknowns) -> list[Function]:
    """The Functions that a problem solves for, after checks of its forms.

    F and J are a UFL residual and its Jacobian or None, or lists of them by unknown; u
    is None, a Function or a list.
    """
    if isinstance(F, (list, tuple)):
        return _several(F, J, u, unknowns)
    if len(unknowns.displacements) > 1:
        raise ContactError(
            f"the displacements {unknowns.name} are on meshes of their own: F must be a "
            "list of residuals, with u= a list of what they are solved for"
        )
    found = _single(F, J, unknowns.only)
    named = list(u) if isinstance(u, (list, tuple)) else [u]
    if u is not None and (len(named) != 1 or named[0] is not found):
        raise ContactError(
            f"u must be the one Function that F is a residual of, {found.name}: of "
            "several unknowns F is a list too, by unknown"
        )
    return [found]


def _single(F: Any, J: Any, only: Displacement) -> Function:
    """The displacement as the only unknown, or the mixed Function that it is a part of."""
    V, wanted = only.given.function_space, (_RESIDUAL, _JACOBIAN)
    what, where = "the displacement that Contact was given", "contact.u"
    if only.component is not None:
        wanted = _MIXED_RESIDUAL, _MIXED_JACOBIAN
        what = f"the mixed Function that {only.given.name} is a part of"
        where = "that one (ufl.split)"
        check_form("F", F, 1, wanted[0])
        V = F.arguments()[0].ufl_function_space()
        if not compat.contains(V, only.given.function_space):
            raise ContactError(
                "F has a test function in another space than the mixed one that the "
                f"displacement {only.given.name} is a part of"
            )
    check_form("F", F, 1, wanted[0], V)
    if J is not None:
        check_form("J", J, 2, wanted[1], V)
    for f in F.coefficients():
        if isinstance(f, Function) and compat.same_values(f, only.given):
            return f
    if J is None:
        raise ContactError(
            f"F does not depend on {what}, but on "
            f"{[str(c) for c in F.coefficients()]}: write it in {where}, or give J"
        )
    return only.given if only.component is None else Function(V, only.given.x)


def _several(F: Sequence[Any], J: Any, u: Any, unknowns: Unknowns) -> list[Function]:
    """Unknowns of a list of residuals; two on one space could share conditions."""
    if not isinstance(u, (list, tuple)):
        raise ContactError(
            "F must be one UFL form, or a list of them by unknown with these in a list "
            f"u=, not list with u={described(u)}"
        )
    for f in u:
        if not isinstance(f, Function):
            raise ContactError(f"u must be a list of Functions, not of {described(f)}")
    if len(F) != len(u):
        raise ContactError(
            f"{len(F)} forms for {len(u)} unknowns: F must have one for each"
        )
    for f in u:
        if compat.element_info(f.function_space).is_sub_space:
            raise ContactError(
                f"u has {f.name}, a part of a mixed Function: name the whole"
            )
    for g, f in combinations(u, 2):
        if compat.is_same_space(f.function_space, g.function_space):
            raise ContactError(
                f"the unknowns {g.name} and {f.name} are on one space: make the "
                "second on V.clone(), or conditions on one would hold the other"
            )
    for i, (form, f) in enumerate(zip(F, u)):
        wanted = f"a linear form in the test function of {f.name}'s space"
        check_form(f"F[{i}]", form, 1, wanted, f.function_space)
    if any(d.place_among(u) is None for d in unknowns.displacements):
        raise ContactError(unknowns.absence(u))
    if J is None:
        return list(u)
    if not is_table(J, len(u)):
        raise ContactError(
            f"J must be {len(u)} lists of {len(u)} forms, by test and trial space, None "
            "for zero"
        )
    for (i, f), (j, g) in product(enumerate(u), repeat=2):
        if J[i][j] is not None:
            wanted = f"bilinear, in {f.name}'s test and {g.name}'s trial space"
            spaces = f.function_space, g.function_space
            check_form(f"J[{i}][{j}]", J[i][j], 2, wanted, *spaces)
    return list(u)


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

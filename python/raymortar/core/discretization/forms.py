"""The forms and conditions of a problem, after checks, and what it solves for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain, combinations, product
from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import Function, FunctionSpace
from ufl.algorithms import expand_derivatives
from ufl.algorithms.analysis import extract_type
from ufl.constantvalue import ComplexValue

from .. import compat
from ..errors import ContactError, described, warn
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


def check_functional(name: str, given: Any) -> list[ufl.Form]:
    """UFL forms without arguments as a list: one, a list of one for each mesh, or None
    for none.

    Raises
    ------
    ContactError
        If it is anything else.
    """
    forms = list(given) if isinstance(given, (list, tuple)) else [given]
    found = [form for form in forms if form is not None]
    if not all(isinstance(form, ufl.Form) and not form.arguments() for form in found):
        raise ContactError(
            f"{name} must be a UFL functional: a form without test function, or a list "
            "of one for each mesh"
        )
    return found


def functional(forms: Sequence[ufl.Form], comm: MPI.Comm) -> Callable[[], float]:
    """Compile functionals; what is returned finds their sum. Collective."""
    compiled = [compat.form(form) for form in forms]

    def value() -> float:
        return float(comm.allreduce(sum(map(fem.assemble_scalar, compiled))))

    return value


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
    if not isinstance(supports or {}, Mapping):
        raise ContactError(
            f"{name} must be Dirichlet conditions by name of the support, not "
            f"{type(supports).__name__}"
        )
    found = {
        support: list(bcs) if isinstance(bcs, (list, tuple)) else [bcs]
        for support, bcs in (supports or {}).items()
    }
    for support, bc in ((support, bc) for support, bcs in found.items() for bc in bcs):
        if not hasattr(bc, "dof_indices"):
            raise ContactError(
                f"{name} has {described(bc)} for {support!r}, which is no Dirichlet "
                "condition"
            )
    return found


def check_compiled(a: Any, unknowns: Unknowns) -> None:
    """Raise unless `a` is a compiled bilinear form on the space of the displacement, or
    on a mixed one that has it; for several unknowns a table of forms."""
    count = len(unknowns.functions)
    if count > 1 and not _is_table(a, count):
        raise ContactError(f"a must be {count} lists of {count} forms each")
    forms = [a] if count == 1 else [one for one in chain(*a) if one is not None]
    for one in forms:
        rank = compat.compiled_rank(one)
        if rank != 2:
            found = type(one).__name__ if rank is None else f"a form of rank {rank}"
            raise ContactError(
                f"a must be a compiled bilinear form (dolfinx.fem.form), not {found}"
            )
    for d in unknowns.displacements:
        block = a if count == 1 else a[d.at][d.at]
        spaces = [] if block is None else compat.compiled_spaces(block)
        if not all(compat.contains(V, d.given.function_space) for V in spaces):
            raise ContactError(
                f"a has a test or trial function in another space than the displacement "
                f"{d.given.name} that Contact was given, or the mixed Function that it "
                "is a part of"
            )


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
    if not _is_table(J, len(u)):
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


def _is_table(given: Any, n: int) -> bool:
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


_MESSAGE = (
    "F looks as if it had inertia: over cells it has {u} and {other}, neither "
    "differentiated. If so, give it to dynamics.Inertia instead"
)


def warn_of_inertia(F: Any, functions: Sequence[Function], unknowns: Unknowns) -> None:
    """Warn where residuals of displacements seem to have inertia. The level of
    `warnings.warn` is seen from the caller."""
    forms = F if isinstance(F, (list, tuple)) else [F]
    for k in sorted({one.at for one in unknowns.displacements}):
        f = functions[k]
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


def extended(F: Any, J: Any, count: int) -> tuple[Any, Any]:
    """Forms and their derivatives as lists, with none for further unknowns."""
    forms = list(F) if isinstance(F, (list, tuple)) else [F]
    table = [list(row) for row in J] if isinstance(F, (list, tuple)) else [[J]]
    none = [None] * count
    rows = [row + none for row in table]
    return forms + none, rows + [[None] * (len(forms) + count) for _ in none]

"""The forms of a problem: unknowns that they fit, numbers gamma and turns that fit them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, product
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import Function, FunctionSpace
from ufl.algorithms.analysis import extract_type
from ufl.constantvalue import ComplexValue

from ..core import compat
from ..core.discretization.forms import is_table, single
from ..core.discretization.joined import Displacement
from ..core.discretization.unknowns import Unknowns
from ..core.errors import ContactError, described, is_real_number, warn
from ..core.system.coupled import CoupledSystem

_RESIDUAL = (
    "a linear form in the test function of contact.u.function_space; where the "
    "displacement is a part of a mixed Function w, give Contact that part, as w.sub(0)"
)
_JACOBIAN = "a bilinear form in test and trial function of contact.u.function_space"
_MIXED_RESIDUAL = "a linear form in the test functions of the mixed space"
_MIXED_JACOBIAN = "a bilinear form in test and trial functions of the mixed space"

# Largest ratio of gamma to the stiffness, and of a penalty the inverse of the least:
# beyond, one of the two is lost in the rounding errors of the other
FROM_STIFFNESS = 1e10
# Least ratio with a multiplier. Without friction 1e-100 solves as 1 does, and 1e-200 has
# errors of 1e-11, as squares of the unknowns overflow
LEAST_AUGMENTATION = 1e-100
# Ratios with a multiplier from which on Newton's method may fail: with friction it does
# at 1e-6 and 1e3, without at 1e4 to 1e8
DOUBTFUL = 1e-5, 1e3

# A force below this share of the stiffness is rounding error, if all radii grow by one
_NO_HOOPS = 1e6 * float(np.finfo(float).eps)


def check_forms(F: Any, J: Any, u: Any, unknowns: Unknowns) -> None:
    """Raise unless forms, and what they are to be solved for, fit the displacement; see
    `find_unknowns`."""
    if isinstance(F, (list, tuple)):
        _check_several(F, J, u, unknowns)
        return
    if len(unknowns.displacements) > 1:
        raise ContactError(
            f"the displacements {unknowns.name} are on meshes of their own: F must be a "
            "list of residuals, with u= a list of what they are solved for"
        )
    _check_single(F, J, unknowns.only)
    found = single(F, unknowns.only)
    named = list(u) if isinstance(u, (list, tuple)) else [u]
    if u is not None and (len(named) != 1 or named[0] is not found):
        raise ContactError(
            f"u must be the one Function that F is a residual of, {found.name}: of "
            "several unknowns F is a list too, by unknown"
        )


def _check_single(F: Any, J: Any, only: Displacement) -> None:
    """Raise unless a form is a residual of the displacement as the only unknown, or of
    the mixed Function that it is a part of."""
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
    elif single(F, only) not in F.coefficients():
        raise ContactError(
            f"F does not depend on {what}, but on "
            f"{[str(c) for c in F.coefficients()]}: write it in {where}, or give J"
        )


def _check_several(F: Sequence[Any], J: Any, u: Any, unknowns: Unknowns) -> None:
    """Raise unless forms are residuals of a list of unknowns; two on one space could
    share conditions."""
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
        return
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


def check_coefficients(system: CoupledSystem, bcs: Sequence[Any]) -> None:
    """Raise for a number gamma that no solve can do with, warn of one with which
    Newton's method may fail. Collective."""
    for part in system.parts:
        tables = part.contact_stiffness(bcs)
        if tables is None or not is_real_number(part.gamma):
            continue
        stiffness = min(float(table.min()) for table in tables)
        ratio = part.gamma_scale / stiffness
        has_multiplier = part.surfaces.multiplier is not None
        least = LEAST_AUGMENTATION if has_multiplier else 1.0 / FROM_STIFFNESS
        text = (
            f"gamma = {part.gamma_scale:.3g} is {ratio:.1e} times the stiffness of the "
            f"bodies over the area of their facets, {stiffness:.3g} here: leave gamma out"
        )
        if not least < ratio < FROM_STIFFNESS:
            raise ContactError(text)
        is_usual = DOUBTFUL[0] <= ratio <= DOUBTFUL[1]
        if has_multiplier and not (part.surfaces.tied or is_usual):
            warn(f"{text}, as Newton's method may fail with it", page="contact")


def warn_of_plane_form(system: CoupledSystem, bcs: Sequence[Any]) -> None:
    """Warn if the form of a solid of revolution does not resist a growth of the radius,
    as hoops do. Collective."""
    if not system.axisymmetric:
        return
    # Forces when all radii grow by 1, and the stiffness, at this rank's dofs
    forces, diagonal = system.volume.translation[0], system.stiffness_diagonal
    sums = np.array([forces @ forces, diagonal @ diagonal])
    hoops, stiffness = np.sqrt(system.comm.allreduce(sums))
    if stiffness > 0.0 and hoops <= _NO_HOOPS * stiffness:
        warn(
            "axisymmetric=True, but the form resists no growth of the radius: it needs "
            "the hoop strain u_r / r and the weight 2 pi r in all of its integrals",
        )

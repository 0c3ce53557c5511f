"""Checks of forms, conditions, matrices and vectors of a user's own assembly."""

from __future__ import annotations

from itertools import chain
from typing import Any

from petsc4py import PETSc

import numpy as np

from ..core import compat
from ..core.discretization.forms import is_table, list_of_conditions
from ..core.discretization.unknowns import Unknowns
from ..core.errors import (
    ContactError,
    is_real_number,
    raise_everywhere,
    require_agreement,
    together,
)
from ..core.system.coupled import CoupledSystem

# Turn of a free body within a step, rad, beyond which its sum with others loses digits
MOST_TURNED = 1e6


def require_no_terms(contacts: Any) -> None:
    """Raise where a problem alone assembles all of a contact."""
    for one in contacts:
        for term in one.terms:
            raise ContactError(
                f"your own assembly has no {term.spoken}: a NonlinearProblem "
                "assembles it, by F(x, b) and J(x, A) for your own solver"
            )


def _require_compiled(name: str, form: Any, rank: int) -> None:
    """Raise unless a form is compiled, and of a rank."""
    found = compat.compiled_rank(form)
    if found != rank:
        kind = ("linear", "bilinear")[rank - 1]
        given = type(form).__name__ if found is None else f"a form of rank {found}"
        raise ContactError(
            f"{name} must be a compiled {kind} form (dolfinx.fem.form), not {given}"
        )


def check_bilinear(a: Any, unknowns: Unknowns) -> None:
    """Raise unless `a` is a compiled bilinear form on the space of the displacement, or
    on a mixed one that has it; for several unknowns a table of forms."""
    count = len(unknowns.functions)
    if count > 1 and not is_table(a, count):
        raise ContactError(f"a must be {count} lists of {count} forms each")
    forms = [a] if count == 1 else [one for one in chain(*a) if one is not None]
    for one in forms:
        _require_compiled("a", one, 2)
    for d in unknowns.displacements:
        block = a if count == 1 else a[d.at][d.at]
        spaces = [] if block is None else compat.compiled_spaces(block)
        own = d.given.function_space
        if not all(compat.contains(V, own) or compat.is_like(V, own) for V in spaces):
            raise ContactError(
                f"a has a test or trial function in another space than the displacement "
                f"{d.given.name} that Contact was given, or the mixed Function that it "
                "is a part of"
            )


def check_linear(L: Any) -> None:
    """Raise unless L is a compiled linear form, a list of them, or None."""
    for one in L if isinstance(L, (list, tuple)) else [L]:
        if one is not None:
            _require_compiled("L", one, 1)


def require_alpha(system: CoupledSystem, alpha: Any) -> None:
    """Raise unless a factor is a number, the same on all ranks. Collective."""
    message = f"alpha must be a number, not {alpha!r}"
    fits = is_real_number(alpha) and np.isfinite(alpha)
    raise_everywhere(system.comm, None if fits else message)
    require_agreement(system.comm, alpha=float(alpha))


def require(system: CoupledSystem, name: str, thing: Any, kind: Any) -> None:
    """Raise unless a method may be called now, and with this object. Collective."""
    message = None
    if system.parts[0].volume is None and name == "make_room":
        message = "make_room needs the volume's pattern: call create_matrix(a) first"
    elif system.updates == 0:
        message = f"{name} needs pairs: call update first"
    elif any(part.gamma is None for part in system.parts):
        message = (
            f"{name} needs gamma: give one, or make a problem or create_matrix(a), "
            "which sets it"
        )
    raise_everywhere(system.comm, message)
    require_rows(system, name, thing, kind)


def require_rows(system: CoupledSystem, name: str, thing: Any, kind: Any) -> None:
    """Raise for all but a matrix or vector over the unknowns. Collective."""
    message = None
    if not isinstance(thing, kind):
        message = (
            f"{name} needs a PETSc {kind.__name__} over [u, multiplier], not "
            f"{type(thing).__name__}"
        )
    else:
        # A matrix has rows and columns
        sizes = np.ravel(thing.getLocalSize())
        if (sizes != system.layout.size).any():
            found = " x ".join(map(str, sizes))
            message = (
                f"{name} needs {system.layout.size} rows on this rank, those of [u, "
                f"multiplier], and was given {found}: use create_matrix or "
                "create_vector"
            )
    raise_everywhere(system.comm, message)


def require_turns(system: CoupledSystem, x: PETSc.Vec) -> None:
    """Raise where nothing has stopped the turn of a free rigid body. Collective."""
    message, begin = None, x.getOwnershipRange()[0]
    for body in system.layout.own_bodies:
        step = x.array_r[system.layout.body_rows[body] - begin]
        angle = float(np.linalg.norm(step[body.freedom.is_turn]))
        if angle >= MOST_TURNED:
            message = (
                f"the rigid {body.name} turns by {angle:.3g} rad in this step: nothing "
                "resists that where all points slip. Give it stiffness, or take LoadSteps"
            )
    raise_everywhere(system.comm, message)


def require_conditions(system: CoupledSystem, bcs: Any) -> list[Any]:
    """Dirichlet conditions as a list, or an error on all ranks. Collective."""
    with together(system.comm):
        found = list_of_conditions(bcs)
        system.unknowns.conditions(found)
    require_agreement(system.comm, number_of_conditions=len(found))
    return found

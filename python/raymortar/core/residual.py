"""Residual of a problem."""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

import numpy as np

from .compat import Array


def assemble_residual(
    problem: Any, b: PETSc.Vec, contact: bool = True
) -> tuple[Array, Array, Array, Array]:
    """Assemble the residual of a problem at its last iterate, with contact's forces or
    without, and return its norms. Collective."""
    system, constraints = problem.contact.system, problem.constraints
    lacking = problem.contact.unknowns.lacking(problem.bcs)
    volume = problem.volume.residual(problem.bcs, lacking.increment)
    for term in problem.terms:
        if contact or not term.is_of_contact:
            volume += term.residual(problem.bcs, lacking)
    norms: tuple[Array, Array, Array, Array] = system.assemble_residual(
        b, problem.bcs, volume, lacking, contact
    )
    changed = bool(problem.terms) and contact and _add_behind(problem.terms, b)
    if constraints is not None:
        constraints.reduce(b)
    elif not changed:
        return norms
    free = b.array_r.copy()
    free[: len(lacking.fixed)][lacking.fixed] = 0.0
    if constraints is not None:
        free[constraints.own] = 0.0
    free_norms = np.sqrt(problem.convergence.groups.sum(free**2))
    return free_norms, norms[1], norms[2], norms[3]


def _add_behind(terms: Any, b: PETSc.Vec) -> bool:
    """Add what terms have in rows behind those of the forms. Whether any has."""
    found = [one for t in terms if (one := t.multiplier_residual()) is not None]
    for one in found:
        b.array[len(b.array_r) - len(one) :] += one
    return bool(found)

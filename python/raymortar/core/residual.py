"""Residual of a problem, and the reactions of its supports."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from petsc4py import PETSc

import numpy as np

from .compat import Array
from .discretization.forms import check_supports
from .errors import together


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


def reactions(problem: Any, supports: Mapping[str, Any]) -> dict[str, Array]:
    """Forces by which conditions hold the bodies: see `CoupledProblem.reactions`."""
    contact = problem.contact
    for part in contact.parts:
        part.present.require_results()
    with together(problem.comm):
        supports = check_supports("supports", supports)
    forces, n_u = problem.forces(), contact.system.layout.n_u
    dim = contact.u.function_space.mesh.geometry.dim
    local = []
    for bcs in supports.values():
        held, _ = contact.unknowns.prescribed_u(bcs)
        on = held[:n_u] == 1
        local.append(np.where(on, forces, 0.0).reshape(-1, dim).sum(0))
    total = problem.comm.allreduce(np.array(local).reshape(-1, dim))
    return dict(zip(supports, total))

"""Loads of bodies: forces of the forms, their resultants, and whether places change them."""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives

from ..core.compat import Array, Mask
from ..core.problem import CoupledProblem
from ..diagnose.holding import sums_by_body

# Share of all forces of a body that is noise
NOISE = 1e-3
# Change of a load, over the load, from which it depends on the place
CHANGES = 0.3


def forces_on(problem: CoupledProblem) -> Array:
    """Assemble the forces of the forms on the owned dofs of u. Force. Collective."""
    forces = -problem.volume.forces(problem.bcs)
    return np.asarray(forces[problem.contact.unknowns.u_owned])


def resultants(problem: CoupledProblem, forces: Array) -> tuple[Array, Array]:
    """Sum up forces at the owned dofs of u by body: vectors (bodies, d), and amounts,
    (bodies,). Force. Collective."""
    dim = problem.contact.u.function_space.dofmap.index_map_bs
    along = np.tile(np.eye(dim), len(forces) // dim)
    sums = sums_by_body(problem, np.array([*(forces * along), np.abs(forces)]))
    *load, every = problem.comm.allreduce(sums)
    return np.array(load).T, every


def have_changed(problem: CoupledProblem, before: Array, moved: Mask) -> bool:
    """Whether the resultants of bodies that have moved are others than before,
    (bodies, d). Collective."""
    load, amounts = resultants(problem, forces_on(problem))
    change = np.linalg.norm(load - before, axis=1)
    most = CHANGES * np.linalg.norm(before, axis=1) + NOISE * amounts
    return bool((moved & (change > most)).any())


def depend_on_place(problem: CoupledProblem) -> bool:
    """Whether a translation may change the forces of the forms: an unknown counts in them
    by its value, and not by its derivatives alone, or a function sets coefficients."""
    if problem.volume.updated is not None:
        return True
    form, unknowns = problem.form_of_u[0], problem.u
    if problem.volume.has_several:
        unknowns = [unknowns[problem.contact.unknowns.only.at]]
    else:
        unknowns = [unknowns]
    plain = apply_derivatives(apply_algebra_lowering(form))
    seen: dict[Any, bool] = {}
    return any(
        _has_value(integral.integrand(), unknowns, seen)
        for integral in plain.integrals()
    )


def _has_value(expression: Any, unknowns: list[Any], seen: dict[Any, bool]) -> bool:
    """Whether an unknown is in an expression other than under a gradient."""
    if expression in seen:
        return seen[expression]
    if isinstance(expression, ufl.differentiation.Grad):
        found = False
    elif isinstance(expression, ufl.Coefficient):
        found = any(expression == one for one in unknowns)
    else:
        found = any(_has_value(e, unknowns, seen) for e in expression.ufl_operands)
    seen[expression] = found
    return found

"""Loads that nothing can bear, as no body is held."""

from __future__ import annotations

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from ..core.compat import Array
from ..core.discretization.ranks import destroy
from ..core.problem import CoupledProblem
from .failure import FAILURES
from .holding import AXES, unheld_axes

# Resultant that is rounding error, over the sum of the sizes of all forces
ROUNDING = 1e-8

# Translations of all bodies, over the size of the largest one. Some foundations bear only
# bodies that are near, some only bodies that have moved far enough
TRANSLATIONS = 1.0, -1.0, 0.03, -0.03, 1e-3, -1e-3

# Change of the resultant that is none, over the resultant
NO_CHANGE = 1e-6


def unborne_loads(problem: CoupledProblem) -> str | None:
    """Tell how large the present loads are along axes on which nothing bears them; None
    if there is no such axis. Collective.

    Forces within bodies and between them add up to zero. So must the loads along an axis
    on which no condition or rigid body holds any body. Springs, masses and foundations
    show themselves by a sum that changes as all bodies are moved along the axis.
    """
    contact = problem.contact
    has_tools = any(zone.facets.bodies for zone in contact.zones)
    has_more = problem.constraints is not None or not contact.unknowns.is_plain
    if has_tools or problem.terms or has_more:
        return None
    axes = unheld_axes(problem, problem.constrained).all(axis=0)
    if contact.system.axisymmetric:  # hoops
        axes[0] = False
    if not axes.any():
        return None
    x = problem.create_vector()
    contact.system.to_vector(x)
    resultant, sizes = _resultant(problem, x)
    loaded = np.flatnonzero(axes & (np.abs(resultant) > ROUNDING * sizes.max()))
    lost = [i for i in loaded if not _changes(problem, x, resultant, i)]
    problem.form(x)
    destroy(x)
    if not lost:
        return None
    along = " and ".join(f"{resultant[i]:.3g} along {AXES[i]}" for i in lost)
    return (
        f"nothing bears the loads, which sum up to {along}: no condition, spring or rigid "
        "body holds any body there. Give conditions (dirichletbc, or tools.prescribe)"
    )


def _resultant(problem: CoupledProblem, x: PETSc.Vec) -> Array:
    """Sum up the loads at x, and their sizes, along each axis, (2, d). Collective."""
    b, layout = problem.create_vector(), problem.contact.system.layout
    problem.form(x)
    problem.loads(b)
    dim = problem.contact.u.function_space.dofmap.index_map_bs
    forces = b.array_r[: layout.n_u].reshape(-1, dim)
    sums = np.array([-forces.sum(axis=0), np.abs(forces).sum(axis=0)])
    destroy(b)
    problem.comm.Allreduce(MPI.IN_PLACE, sums)
    return sums


def _changes(problem: CoupledProblem, x: PETSc.Vec, before: Array, axis: int) -> bool:
    """Whether the resultant along an axis is another one, or no number, where all bodies
    have been moved along that axis. Collective."""
    groups, n = problem.convergence.groups, problem.contact.system.layout.n_u
    size = groups.size[: groups.bodies].max()
    most = NO_CHANGE * abs(before[axis])
    for share in TRANSLATIONS:
        moved = x.copy()
        moved.array[:n].reshape(-1, len(before))[:, axis] += share * size
        try:
            changed = abs(_resultant(problem, moved)[0, axis] - before[axis])
        except FAILURES:
            changed = np.inf
        destroy(moved)
        if not changed <= most:
            return True
    return False

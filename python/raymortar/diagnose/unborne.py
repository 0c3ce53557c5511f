"""Loads that nothing can bear, as no body is held."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np

from ..core.discretization.ranks import destroy
from ..core.problem import CoupledProblem
from .holding import AXES, free_axes

# Resultant that is rounding error, over the sum of the sizes of all forces
ROUNDING = 1e-8


def unborne_loads(problem: CoupledProblem) -> str | None:
    """Tell how large the present loads are along axes on which nothing bears them; None
    if there is no such axis. Collective.

    Forces within bodies and between them add up to zero. So must the loads along an axis
    on which no condition, spring, mass or rigid body holds any body.
    """
    contact = problem.contact
    has_tools = any(zone.facets.bodies for zone in contact.zones)
    has_more = problem.constraints is not None or not contact.unknowns.is_plain
    if has_tools or problem.terms or has_more:
        return None
    axes = free_axes(problem).all(axis=1)
    if not axes.any():
        return None
    b, x = problem.create_vector(), problem.create_vector()
    contact.system.to_vector(x)
    problem.form(x)
    problem.loads(b)
    forces = b.array_r[: contact.system.layout.n_u].reshape(-1, len(axes))
    sums = np.array([-forces.sum(axis=0), np.abs(forces).sum(axis=0)])
    destroy(b, x)
    problem.comm.Allreduce(MPI.IN_PLACE, sums)
    resultant, size = sums
    lost = np.flatnonzero(axes & (np.abs(resultant) > ROUNDING * size.max()))
    if not len(lost):
        return None
    along = " and ".join(f"{resultant[i]:.3g} along {AXES[i]}" for i in lost)
    return (
        f"nothing bears the loads, which sum up to {along}: no condition, spring or rigid "
        "body holds any body there. Give conditions (dirichletbc, or tools.prescribe)"
    )

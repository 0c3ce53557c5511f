"""Forces by which conditions hold bodies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..core.compat import Array
from ..core.errors import ContactError, described, together


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


def reactions(problem: Any, supports: Mapping[str, Any]) -> dict[str, Array]:
    """Forces by which conditions hold the bodies: see `NonlinearProblem.reactions`."""
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

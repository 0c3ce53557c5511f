"""Names of the groups of rows by which residuals are judged."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import numpy as np

from ..core.convergence.balance import Groups
from ..core.errors import format_point
from ..core.system.coupled import CoupledSystem


def names_of(system: CoupledSystem, groups: Groups) -> list[str]:
    """Name bodies and patches of contact by their places, the others as the user does.
    Collective."""
    layout, V, of_row = system.layout, system.u.function_space, groups.of_row
    comm, fields, d = layout.comm, groups.fields, V.mesh.geometry.dim
    bs = V.dofmap.index_map_bs
    # Owned nodes of spaces, and their groups
    mine: Any = slice(layout.n_u // bs)
    nodes, begin = [(V, mine, of_row[fields[0].rows][::bs])], layout.n
    for part in system.parts:
        if part.surfaces.multiplier is not None:
            own, c = part.layout.owned_multipliers, part.layout.components
            W, end = part.surfaces.multiplier.function_space, begin + c * len(own)
            nodes.append((W, own, of_row[begin:end:c]))
            begin = end
    sums, size = np.zeros((groups.forces - groups.free, 4)), 0.0
    for space, places, numbers in nodes:
        X = space.tabulate_dof_coordinates()[places]
        size = max(size, np.abs(X).max(initial=0.0))
        np.add.at(sums, numbers, np.column_stack([X, np.ones(len(X))]))
    found, others = [], [comm.allreduce(size, op=MPI.MAX)]
    for k, (*centre, number) in enumerate(comm.allreduce(sums)):
        kind = "the body" if k < groups.bodies else "the contact"
        middle = np.array(centre[:d]) / number
        found.append(f"{kind} around {format_point(middle, others, 3)}")
    found += [f"the rigid {body.name}" for body in layout.bodies]
    return found + [f"the unknown {field.name}" for field in fields[1:]]

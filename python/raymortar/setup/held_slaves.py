"""Slaves whose displacement is prescribed, so that nothing gives way or is free."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np

from ..core.compat import Mask
from ..core.discretization.ranks import sums_at
from ..core.errors import SetUpError, format_point, raise_everywhere
from ..core.interface.contact_surfaces import ContactSurfaces
from ..core.interface.point_results import CLOSED
from ..core.interface.slave_nodes import fixed_components


def refuse_held_on_tools(surfaces: ContactSurfaces, marker: Mask) -> None:
    """Raise for slaves prescribed throughout on rigid bodies that are not free.

    Nothing could give way. Collective.
    """
    for zone in surfaces.zones:
        bodies = zone.facets.bodies
        if not bodies or any(body.is_free for body in bodies):
            continue
        held = bool(fixed_components(zone.facets.slave_surface, marker).all())
        if surfaces.comm.allreduce(held, op=MPI.LAND):
            names = ", ".join(body.name for body in bodies)
            raise SetUpError(
                f"{zone.facets.spoken} is prescribed throughout, and what it "
                f"meets is rigid ({names}): nothing can give way. Leave some of its "
                "displacement free, or free the rigid body"
            )


def refuse_held(surfaces: ContactSurfaces, unfelt: Mask | None) -> None:
    """Raise where the pressure is in no equation. Collective.

    That is where contact is closed all around a node of the multiplier, between facets
    whose displacement is prescribed on both sides, and no damped facet ties it to
    another node; or where nothing is free along the normal (nodes are marked, None: none
    is).
    """
    assert surfaces.multiplier is not None
    W, shares, ties = surfaces.multiplier.function_space, [], []
    for zone in surfaces.zones:
        points, table = zone.cpp.points(), zone.multiplier_table
        shut = points["status"] >= CLOSED
        # Points on uncovered parts integrate nothing
        free = ((zone.cpp.free_points() == 1) | ~shut) & (points["seed"] >= 0)
        for which, columns in ((free, [1.0, 0.0]), (shut, [0.0, 1.0])):
            shares.append((np.unique(table[points["slave"][which]]), columns))
        share = zone.cpp.segments()["covered"]
        partly = np.flatnonzero((share > 0.0) & (share < 1.0))
        ties.append(table[np.union1d(zone.cpp.held_facets(), partly)])
    known, closed = sums_at(W.dofmap.index_map, 2, *shares).T
    if unfelt is not None:
        known[unfelt] = 0.0
    for rows in ties:  # mark nodes that share a damped facet with a marked one
        known[rows[(known[rows] > 0.0).any(axis=1)]] = 1.0
    every, n = np.arange(len(known)), W.dofmap.index_map.size_local
    known = sums_at(W.dofmap.index_map, 1, (every, known[:, None]))[:, 0]
    held = np.flatnonzero((known[:n] == 0.0) & (closed[:n] > 0.0))
    count, message = surfaces.comm.allreduce(len(held)), None
    if len(held):
        X = W.tabulate_dof_coordinates()[:, : W.mesh.geometry.dim]
        message = (
            f"{count} node(s) of the contact traction, for example the one at "
            f"{format_point(X[held[0]], X)}, are between facets whose displacement is "
            "prescribed on both sides: leave these out of the slave's tag, or use "
            "a penalty"
        )
    raise_everywhere(surfaces.comm, message)

"""Masters of a tie: where the slave has none, or turns round a corner."""

from __future__ import annotations

import numpy as np
from dolfinx.fem import Function

from ..core.discretization.facets import middle_normals, units
from ..core.discretization.ranks import sums_at
from ..core.errors import format_point, raise_everywhere, warn
from ..core.interface.contact_surfaces import ContactSurfaces
from ..core.interface.point_results import OPEN, nodal_average
from ..core.interface.slave_nodes import STRAIGHT

# Share of the area of a node that masters must cover
ENOUGH = 0.5
# Largest number of nodes that a message names
NAMED = 10


def require_masters(tie: ContactSurfaces, partial: bool) -> None:
    """Raise for slave nodes of a paired tie without a master. Collective.

    If it is partial, one at least must have a master.
    """
    comm, V, covered = tie.comm, tie.scalar, Function(tie.scalar)
    nodal_average(tie.zones, lambda p: p["status"] >= OPEN, covered, hits_only=False)
    n, dim = V.dofmap.index_map.size_local, V.mesh.geometry.dim
    on = np.flatnonzero(np.isfinite(covered.x.array[:n]))
    share = covered.x.array[on]
    if partial and comm.allreduce(int((share > 0.0).any())):
        return
    x = V.tabulate_dof_coordinates()[on, :dim]
    bad = [(s, tuple(at)) for s, at in zip(share, x) if s < ENOUGH]
    # The least covered first
    found = sorted(sum(comm.allgather(bad), []))
    total = comm.allreduce(len(share))
    if not found:
        return
    places = [at for _, at in found]
    named = ", ".join(f"{format_point(at, places)}: {s:.2g}" for s, at in found[:NAMED])
    more = ", ..." if len(found) > NAMED else ""
    raise_everywhere(
        comm,
        f"{len(found)} of {total} slave nodes of {tie.tags} have no master for most of "
        f"what they stand for (node: covered share): {named}{more}. Move or enlarge a "
        "master, take a larger Search(reach=), or leave them free with partial=True",
    )


def warn_of_corners(tie: ContactSurfaces) -> None:
    """Warn of corners of a slave surface: one multiplier cannot be the traction on two
    faces. Collective."""
    assert tie.multiplier is not None
    W, shares = tie.multiplier.function_space, []
    dim, n = W.mesh.geometry.dim, W.dofmap.index_map.size_local
    for zone in tie.zones:
        side = zone.facets.slave_surface
        normals = units(middle_normals(side.shape, side.node_degree, side.nodes))
        # The last column counts facets
        rows = np.pad(normals, ((0, 0), (0, 1)), constant_values=1.0)
        shares.append((zone.multiplier_table, rows[:, None]))
    owned = sums_at(W.dofmap.index_map, dim + 1, *shares)[:n]
    length = np.linalg.norm(owned[:, :dim], axis=1)
    sharp = np.flatnonzero(length < STRAIGHT * owned[:, dim])
    found = W.tabulate_dof_coordinates()[sharp, :dim]
    places = [x for part in tie.comm.allgather(found) for x in part]
    if places:
        warn(
            f"the slave of {tie.tags} turns by more than 60 degrees at "
            f"{len(places)} node(s), as at {format_point(places[0], places)}. Give each "
            "face its own tag and Tie",
        )

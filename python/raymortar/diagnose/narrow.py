"""Contact narrower than a facet that moves from facet to facet, by which forces jump."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np
from dolfinx.fem import FunctionSpace

from ..compat import Array, Mask
from ..discretization.ranks import sums_at
from ..errors import format_point
from ..interface.point_results import CLOSED
from ..interface.zone_data import ZoneData

# Angle between the normals of two facets from which forces jump by more than a few percent
# (docs/measured/few_facets). Degrees
JUMP = 6.0
# Part of a surface's force that has to be on facets that carry alone
PART = 0.2
# Contact that moves on was on at most two facets for one now, and keeps more than half of
# its force
TWO, KEPT = 2.0, 0.5


def jump(
    zone: ZoneData, points: dict[str, Array], W: FunctionSpace, by_gamma: bool
) -> tuple[float, str]:
    """Find by how much the normal of contact has jumped since the accepted step, where one
    facet at a time carries it; and say so. 0 if contact has not moved so, or the normal
    has turned by less than `JUMP`. Degrees. Collective.

    `W` is the space of scalar results. `by_gamma`: whether gamma chooses among results,
    and is no part of them, as it is with a penalty.
    """
    facets, comm = len(zone.result_table), zone.comm
    force = forces_on_facets(zone, points)
    was = np.zeros(facets) if zone.carried is None else zone.carried
    zone.carried = force
    alone = (force > 0.0) & _are_alone(zone, force > 0.0, W)
    left = (was > 0.0) & (force == 0.0)
    numbers = [(force > 0.0).sum(), (was > 0.0).sum(), left.sum()]
    sums = [force.sum(), was.sum(), force[alone].sum(), *numbers]
    now, before, on_alone, carrying, carried, went = comm.allreduce(np.array(sums))
    # Contact has moved on, rather than come, grown, or gone
    moved = went > 0 and carrying <= carried <= TWO * carrying and now > KEPT * before
    if not (moved and on_alone > PART * now):
        return 0.0, ""
    place, normal = _middles(zone, points, facets)
    x, n = (_of_all(comm, values[left]) for values in (place, normal))
    X, y, m = (
        _of_all(comm, v[alone]) for v in (undeformed_middles(zone), place, normal)
    )
    nearest = [int(np.argmin(((x - one) ** 2).sum(axis=1))) for one in y]
    cosine = np.einsum("fi,fi->f", m, n[nearest])
    angle = np.rad2deg(np.arccos(np.clip(cosine, -1.0, 1.0)))
    k = int(np.argmax(angle))
    if angle[k] <= JUMP:
        return 0.0, ""
    choosing, other = "the steps", ""
    if by_gamma:
        choosing = "gamma and the steps"
        other = ". The law at nodes leaves gamma out of that, but jumps as much"
    return float(angle[k]), (
        f"contact of {zone.facets.spoken} is narrower than a facet, and has moved to one, "
        f"at the undeformed {format_point(X[k], X)}, whose normal differs by "
        f"{angle[k]:.2g} degrees: the force jumps by as much from facet to facet, and near "
        f"a jump several results hold, of which {choosing} choose one. Make facets there "
        f"{np.ceil(angle[k] / JUMP):.0f} times smaller{other}"
    )


def forces_on_facets(zone: ZoneData, points: dict[str, Array]) -> Array:
    """Normal force on each slave facet, by its closed points, (facets,)."""
    closed, facets = points["status"] >= CLOSED, len(zone.result_table)
    return _sum(points, closed, np.abs(points["weight"] * points["pressure"]), facets)


def _sum(points: dict[str, Array], at: Mask, values: Array, facets: int) -> Array:
    """Add up values of chosen points, by slave facet."""
    return np.asarray(np.bincount(points["slave"][at], values[at], facets), dtype=float)


def _are_alone(zone: ZoneData, carries: Mask, W: FunctionSpace) -> Mask:
    """Tell on which facets no other facet that carries shares a node. Collective."""
    table = zone.result_table
    share = carries.astype(float)[:, None, None]
    count = sums_at(W.dofmap.index_map, 1, (table, share))[:, 0]
    return np.asarray((count[table] < 1.5).all(axis=1))


def _middles(
    zone: ZoneData, points: dict[str, Array], facets: int
) -> tuple[Array, Array]:
    """Means over the points of each facet: deformed place and unit normal of the law,
    (facets, d)."""
    every, n = np.full(len(points["slave"]), True), points["contact_normal"]
    count = np.maximum(_sum(points, every, np.ones(len(n)), facets), 1.0)
    place, normal = (
        np.stack([_sum(points, every, one, facets) for one in values.T], axis=1)
        for values in (points["x"], n)
    )
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    return place / count[:, None], normal / np.maximum(size, np.finfo(float).tiny)


def undeformed_middles(zone: ZoneData) -> Array:
    """Undeformed middles of the slave facets, (facets, d)."""
    surface = zone.facets.slave_surface
    return np.asarray(surface.X[surface.facet_nodes].mean(axis=1))


def _of_all(comm: MPI.Comm, rows: Array) -> Array:
    """Rows of all ranks. Collective."""
    return np.concatenate(comm.allgather(rows))

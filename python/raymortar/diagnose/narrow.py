"""Contact narrower than a facet that moves from facet to facet, by which forces jump."""

from __future__ import annotations

import numpy as np
from dolfinx.fem import FunctionSpace

from ..core.compat import Array, Mask
from ..core.discretization.ranks import sums_at
from ..core.finding import placed
from ..core.interface.point_results import CLOSED
from ..core.interface.zone_data import ZoneData

# Angle between the normals of two facets from which forces jump by more than a few percent
# (docs/measured/few_facets). Degrees
JUMP = 6.0
# Angle from which on the size of forces jumps, where the law has the normal of a smooth
# tool. From the other one on, facets meet at a corner of the body
ON_SMOOTH, CORNER = 12.0, 60.0
# Part of a surface's force that has to be on facets that carry alone
PART = 0.2
# Contact that moves on was on at most two facets for one now, and keeps more than half of
# its force
TWO, KEPT = 2.0, 0.5
NO_JUMP: tuple[float, tuple[float, ...], str, str] = (0.0, (), "", "")


def jump(
    zone: ZoneData, points: dict[str, Array], W: FunctionSpace
) -> tuple[float, tuple[float, ...], str, str]:
    """Find by how much the normal of contact has jumped since the accepted step, where one
    facet at a time carries it; with the place, what it means, and a remedy. 0 if contact
    has not moved so, or the normal has turned by less than `JUMP`. Degrees. Collective.

    `W` is the space of scalar results.
    """
    facets, comm = len(zone.result_table), zone.comm
    force = forces_on_facets(zone, points)
    was = np.zeros(facets) if zone.carried is None else zone.carried
    zone.carried = force
    alone = (force > 0.0) & (_others(zone, force > 0.0, W) == 0.0)
    left = (was > 0.0) & (force == 0.0)
    numbers = [(force > 0.0).sum(), (was > 0.0).sum(), left.sum()]
    sums = [force.sum(), was.sum(), force[alone].sum(), *numbers]
    now, before, on_alone, carrying, carried, went = comm.allreduce(np.array(sums))
    # Contact has moved on, rather than come, grown, or gone
    moved = went > 0 and carrying <= carried <= TWO * carrying and now > KEPT * before
    if not (moved and on_alone > PART * now):
        return NO_JUMP
    # Other contact on the same surface may have stayed where it was
    came = alone & ((was == 0.0) | (_others(zone, left, W) > 0.0))
    place, of_law, own = (
        _means(zone, points, name) for name in ("x", "contact_normal", "normal")
    )
    of_law, own = _units(of_law), _units(own)
    seen = np.stack([place, of_law, own], axis=1)
    kinks, X = _kinks(zone, points, own, W)[came], undeformed_middles(zone)[came]
    before, now, kinks, X = (
        np.concatenate(comm.allgather(one))
        for one in (seen[left], seen[came], kinks, X)
    )
    # Contact may not have passed all corners of a facet. Masters that are flat or smooth
    # have a normal that turns less than the facets': then the force jumps in size alone
    kinks[kinks > CORNER] = 0.0
    by_law, by_facets = np.minimum(kinks, _turned(before, now))
    kinks = np.maximum(by_law, by_facets * (by_facets > ON_SMOOTH))
    if kinks.max(initial=0.0) <= JUMP:
        return NO_JUMP
    k = int(np.argmax(kinks))
    return (
        float(kinks[k]),
        placed(X[k], X),
        f"contact is narrower than a facet, and the force jumps by {kinks[k]:.2g} degrees "
        "from facet to facet",
        f"Make facets there {np.ceil(kinks[k] / JUMP):.0f} times smaller",
    )


def forces_on_facets(zone: ZoneData, points: dict[str, Array]) -> Array:
    """Normal force on each slave facet, by its closed points, (facets,)."""
    closed, facets = points["status"] >= CLOSED, len(zone.result_table)
    return _sum(points, closed, np.abs(points["weight"] * points["pressure"]), facets)


def _sum(points: dict[str, Array], at: Mask, values: Array, facets: int) -> Array:
    """Add up values of chosen points, by slave facet."""
    return np.asarray(np.bincount(points["slave"][at], values[at], facets), dtype=float)


def _others(zone: ZoneData, marked: Mask, W: FunctionSpace) -> Array:
    """Count the marked facets that share most with each facet but itself, at a node.
    Collective."""
    table, mine = zone.result_table, marked.astype(float)
    count = sums_at(W.dofmap.index_map, 1, (table, mine[:, None, None]))[:, 0]
    return np.asarray((count[table] - mine[:, None]).max(axis=1))


def _means(zone: ZoneData, points: dict[str, Array], name: str) -> Array:
    """Means over the points of each slave facet, (facets, d); 0 without points."""
    of, facets = points["slave"].astype(int), len(zone.result_table)
    sums = np.zeros((facets, points[name].shape[1]))
    np.add.at(sums, of, points[name])
    return sums / np.maximum(np.bincount(of, minlength=facets), 1)[:, None]


def _kinks(
    zone: ZoneData, points: dict[str, Array], normal: Array, W: FunctionSpace
) -> Array:
    """Angle between the normals of each slave facet and those beside it, the largest over
    its nodes, less what both turn within. Degrees. Collective."""
    table, of = zone.result_table, points["slave"].astype(int)
    within = np.ones(len(table))
    np.minimum.at(within, of, np.einsum("qi,qi->q", points["normal"], normal[of]))
    index_map, d = W.dofmap.index_map, normal.shape[1]
    mean = _units(sums_at(index_map, d, (table, normal[:, None, :])))
    cosine = np.einsum("fki,fi->fk", mean[table], normal)
    half = np.arccos(np.clip(cosine.min(axis=1), -1.0, 1.0))
    turning = np.arccos(np.clip(within, -1.0, 1.0))
    return np.rad2deg(2.0 * np.maximum(half - turning, 0.0))


def _turned(before: Array, now: Array) -> Array:
    """Angles of normals of facets now, (facets, 3, d) with their place, the law's normal and
    their own, to those of the nearest facet before, (2, facets). Degrees."""
    x, y = before[:, 0], now[:, 0]
    nearest = [int(np.argmin(((x - one) ** 2).sum(axis=1))) for one in y]
    cosines = np.einsum("fki,fki->kf", now[:, 1:], before[nearest, 1:])
    return np.asarray(np.rad2deg(np.arccos(np.clip(cosines, -1.0, 1.0))))


def _units(vectors: Array) -> Array:
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.maximum(size, np.finfo(float).tiny))


def undeformed_middles(zone: ZoneData) -> Array:
    """Undeformed middles of the slave facets, (facets, d)."""
    surface = zone.facets.slave_surface
    return np.asarray(surface.X[surface.facet_nodes].mean(axis=1))

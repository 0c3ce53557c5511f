"""Rigid tools that have passed through a slave in one step.

Seen from a tool, each slave point moves along a line. A point has passed if its line
crosses the tool's solid and leaves it forwards, the way in which the slave's normal
points: contact resists this motion. Sliding points and points that lift off leave the
solid backwards. A point has also passed if it is inside, beyond the middle of the solid
along its normal.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

from mpi4py import MPI

import numpy as np

from ..core.compat import Array, Mask
from ..core.discretization.facets import N_CORNERS, facet_nodes
from ..core.interaction import Interaction
from ..core.interface.point_results import CLOSED
from ..core.interface.zone_data import ZoneData, positions, unit_normals
from ..core.target import Target
from ..rigid.turning import directions_across, rotation_matrix, rotation_vector

# Depth inside a tool that contact does not leave, of the depth that counts as contact: a
# tenth and a quarter of a facet by default. The first is for lines from outside to
# outside, the second for points that begin or end inside
DEEPER, DEEP = 0.05, 0.125
# Cosine between the slave's normal and the way of points that pass forwards
FORWARDS = 0.5
# Seen from a tool that turns, ways are bent: distance from the straight lines that stand
# for them, of the depth that counts as contact, and the most lines of a step
BEND, MOST_LINES = 0.02, 128
# Places on the inner part of a line where depths are measured, of its length
PLACES = (0.1, 0.3, 0.5, 0.7, 0.9)
# Directions around a point in the plane, and around a line in 3D: along no edge, as
# users draw them
_ANGLES = 0.3 + np.arange(8) * np.pi / 4.0
AROUND = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES), np.zeros(8)])
# Directions in space: to faces, edges and corners of a cube
_CUBE = np.array([n for n in product((-1.0, 0.0, 1.0), repeat=3) if any(n)])
_TURNED = _CUBE @ rotation_matrix(np.array([0.3, 0.2, 0.1]))
EVERYWHERE = _TURNED / np.linalg.norm(_TURNED, axis=1)[:, None]


@dataclass(frozen=True)
class Slave:
    """Points of a rank's slave facets, (n, 3), padded with 0 in 2D. Lengths.

    Positions at the accepted step and at present, present outward normals, and the
    depth that counts as contact, (n,).
    """

    gdim: int
    old: Array
    now: Array
    normals: Array
    depth: Array


def have_gone_through(zone: ZoneData, contact: Interaction) -> bool:
    """Whether a tool has passed through the slave since the accepted step. Collective.

    Motions are straight, turns uniform. The contact is the same afterwards.
    """
    comm, bodies, points = contact.layout.comm, zone.motions.bodies, zone.points()
    was, now = zone.motions.old, zone.motions.present()
    closed, slave = points["status"] >= CLOSED, _slave(zone, contact)
    # Tools may have gone in and out again, or are deep inside
    drift = np.linalg.norm((now - was)[:, :3], axis=1).max()
    far = drift + np.linalg.norm(slave.now - slave.old, axis=1).max(initial=0.0)
    least = np.minimum(DEEP * zone.distance("depth"), 0.5 * zone.thickness[0])
    gap, depth = points["gap"][closed], zone.distance("depth")[points["slave"][closed]]
    state = np.zeros(1 + len(bodies), dtype=bool)
    state[0] = np.any(now[:, 3:] != was[:, 3:]) or far > least.min(initial=np.inf)
    state[0] |= np.any(-gap > DEEP * depth)
    state[1 + points["master"][closed]] = True
    comm.Allreduce(MPI.IN_PLACE, state, op=MPI.LOR)
    found = bool(state[0]) and any(
        _passed(body, start, end, slave, bool(touches))
        for body, touches, start, end in zip(bodies, state[1:], was, now)
    )
    return bool(comm.allreduce(found, op=MPI.LOR))


def _slave(zone: ZoneData, contact: Interaction) -> Slave:
    """Integration points and corners of the slave's facets."""
    surface, points = zone.facets.slave_surface, zone.points()
    count, gdim = len(surface.facet_ids), surface.gdim
    corners = np.tile(facet_nodes(surface.shape, 1), (count, 1))
    numbers = np.repeat(np.arange(count), N_CORNERS[surface.shape])
    facet = np.concatenate([points["slave"], numbers]).astype(np.int32)
    at = surface, facet, np.concatenate([points["xi"], corners])
    old, now = (u.reshape(-1, gdim) for u in (contact.states.u_old, contact.u.x.array))
    found = positions(*at, old), positions(*at, now), unit_normals(*at, now)
    old, now, normals = (np.pad(values, ((0, 0), (0, 3 - gdim))) for values in found)
    return Slave(gdim, old, now, normals, zone.distance("depth")[facet])


def _passed(
    body: Target, start: Array, end: Array, slave: Slave, touches: bool
) -> bool:
    """Whether a body has passed points of this rank between two motions."""
    ways = _ways(body, start, end, slave)
    x, n = ways[-1]
    into, ahead = cast(body, x, n), cast(body, x, -n)
    # Nearer to the far side than to the side that the normals point away from
    beyond = np.isfinite(into) & (ahead < 0.0) & (-ahead < -into)
    beyond &= -into > DEEP * slave.depth
    if np.any(beyond):
        return True
    out = (into >= 0.0) | (ahead >= 0.0)
    depth = slave.depth[out]
    return any(
        _crosses(body, a[out], b[out], n[out], depth, touches, slave.gdim)
        for (a, _), (b, n) in zip(ways[:-1], ways[1:])
    )


def _ways(
    body: Target, start: Array, end: Array, slave: Slave
) -> list[tuple[Array, Array]]:
    """Places and present normals of the slave's points seen from a body, at the ends of
    the straight lines that stand for their way, (n, 3) each."""
    Q, last = (motion[6:].reshape(3, 3) for motion in (start, end))
    spin = rotation_vector(last @ Q.T)
    angle = float(np.linalg.norm(spin) + np.linalg.norm(end[3:6] - start[3:6]))
    count = 1
    if angle > 0.0 and len(slave.old):
        first, last = (
            x - body.centre - motion[:3]
            for x, motion in ((slave.old, start), (slave.now, end))
        )
        away = np.linalg.norm([first, last], axis=-1).max()
        way = np.linalg.norm(last - first, axis=1).max()
        # A line of the share s is off by s^2 / 8 times the acceleration
        acceleration = angle * (angle * away + 2.0 * way)
        lines = np.sqrt(acceleration / (8.0 * BEND * slave.depth.min()))
        count = int(np.clip(np.ceil(lines), 1, MOST_LINES))
    places = []
    for share in np.linspace(0.0, 1.0, count + 1):
        motion = start + share * (end - start)
        motion[6:] = (rotation_matrix(share * spin) @ Q).ravel()
        x = slave.old + share * (slave.now - slave.old)
        R, shift = body.pose_of(motion)
        places.append(((x - shift) @ R, slave.normals @ R))
    return places


def _crosses(
    body: Target, a: Array, b: Array, n: Array, depth: Array, touches: bool, gdim: int
) -> bool:
    """Whether a line from a to b goes through a body as no contact does.

    Lines along the slave, or backwards, count where the body touches nothing in the end
    and was deeper below the slave than contact is.
    """
    way = np.linalg.norm(b - a, axis=1)
    along = (b - a) / np.maximum(way, np.finfo(float).tiny)[:, None]
    forwards = np.einsum("nd,nd->n", along, n) > FORWARDS
    ahead, behind = cast(body, a, along), cast(body, b, -along)
    met = (np.minimum(ahead, behind) < way) & (forwards | (not touches))
    # Without an entry ahead the end is inside, or outside as its depth tells
    first, last = (
        np.where(np.isfinite(one), np.clip(one, 0.0, way), 0.0)[met]
        for one in (ahead, behind)
    )
    inside = np.maximum(way[met] - last - first, 0.0)
    whole = np.isfinite(ahead) & (ahead >= 0.0) & np.isfinite(behind) & (behind >= 0.0)
    least = np.where(whole, DEEPER, DEEP) * depth
    a, along, n, depth, least = (v[met] for v in (a, along, n, depth, least))
    whole, forwards = whole[met], forwards[met]
    for place in PLACES:
        x = a + (first + place * inside)[:, None] * along
        deep = _depths(body, x, along, whole, gdim)
        below = np.where(deep > 0.0, -cast(body, x, n), 0.0)
        if np.any(np.where(forwards, deep > least, below > depth)):
            return True
    return False


def cast(body: Target, x: Array, n: Array) -> Array:
    """Find distances at which rays enter a body, (n,): negative from inside, infinite
    for none. Length."""
    x, n = np.ascontiguousarray(x), np.ascontiguousarray(n)
    return np.asarray(body.tool.distances_along(x, n))


def _depths(body: Target, x: Array, along: Array, whole: Mask, gdim: int) -> Array:
    """Depths of points on lines inside a body, (n,): 0 outside, infinite where it has
    no end. Depths on lines that cross the whole body are measured across the lines, as
    the body may be a thin plate. Length."""
    if gdim == 2:
        flat = np.cross([0.0, 0.0, 1.0], along)
        across = [flat, -flat]
    else:
        one, other = directions_across(along)
        across = [c * one + s * other for c, s, _ in AROUND]
    found = np.array([cast(body, x, n) for n in (*across, along, -along)])
    behind = np.where(found < 0.0, -found, np.inf)
    ahead = np.isfinite(found) & (found >= 0.0)
    # A ray through an edge may err: the others outvote it
    inside = (found < 0.0).sum(axis=0) > ahead.sum(axis=0)
    nearest = np.where(whole, behind[: len(across)].min(axis=0), behind.min(axis=0))
    return np.where(inside, nearest, 0.0)


def distance_to(body: Target, middle: Array) -> float:
    """Estimate the distance of a body from a point: along some directions, or of its
    centre where that is less. Length."""
    R, shift = body.pose_of(body.motion())
    ways = AROUND if body.shape.gdim == 2 else EVERYWHERE
    along = np.abs(cast(body, np.tile((middle - shift) @ R, (len(ways), 1)), ways))
    return float(min(along.min(), np.linalg.norm(middle - body.place)))

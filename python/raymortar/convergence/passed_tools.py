"""Rigid tools that have passed through a slave within one step.

Seen from a tool, each slave point moves along a line. A point has passed if its line
crosses the tool's solid and leaves it forwards, the way in which the slave's normal
points: contact resists this motion. Sliding points and points that lift off leave the
solid backwards. A point has also passed if it is inside, beyond the middle of the solid
along its normal.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

from mpi4py import MPI

import numpy as np

from ..compat import Array, Mask
from ..host.reference_facets import N_CORNERS, facet_nodes
from ..interface.faced import positions, unit_normals
from ..interface.point_results import CLOSED
from ..rigid.turning import directions_across, rotation_matrix, rotation_vector

if TYPE_CHECKING:
    from ..interaction import Interaction
    from ..interface.zone_data import ZoneData
    from ..rigid.body import Body

# Depth inside a tool that contact does not leave, of the depth that counts as contact: a
# tenth and a quarter of a facet by default. The first is for lines from outside to
# outside, the second for points that begin or end inside
DEEPER, DEEP = 0.05, 0.125
# Cosine between the slave's normal and the way of points that pass forwards
FORWARDS = 0.5
# Seen from a tool that turns, ways are bent: distance from the straight lines that stand
# for them, of the depth that counts as contact, and the most lines of a step
BEND, MOST_LINES = 0.02, 128
# Where depths are measured on the part of a line that is inside, of its length
PLACES = (0.1, 0.3, 0.5, 0.7, 0.9)
# Directions around a point in the plane, and around a line in 3D: along no edge, as
# users draw them
_ANGLES = 0.3 + np.arange(8) * np.pi / 4.0
AROUND = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES), np.zeros(8)])
# Those in space: to faces, edges and corners of a cube
_CUBE = np.array([n for n in product((-1.0, 0.0, 1.0), repeat=3) if any(n)])
_TURNED = _CUBE @ rotation_matrix(np.array([0.3, 0.2, 0.1]))
EVERYWHERE = _TURNED / np.linalg.norm(_TURNED, axis=1)[:, None]


@dataclass(frozen=True)
class Slave:
    """Points of a rank's slave facets, in 2D padded with 0. Lengths.

    Attributes
    ----------
    gdim
        Dimension of the space.
    old, now
        Their positions at the accepted step and at present, (n, 3).
    normals
        Present outward unit normals, (n, 3).
    depth
        That counts as contact, (n,).
    """

    gdim: int
    old: Array
    now: Array
    normals: Array
    depth: Array


def have_gone_through(zone: ZoneData, contact: Interaction) -> bool:
    """Whether a tool has passed through the slave since the accepted step. Collective.

    Motions are straight, turns uniform. The contact is the same afterwards.

    Parameters
    ----------
    zone
        A zone of the contact.
    contact
        `Contact`.
    """
    comm, bodies = contact.layout.comm, zone.motions.bodies
    state = np.array([_is_far(zone, contact), _is_deep(zone)], dtype=np.int32)
    comm.Allreduce(MPI.IN_PLACE, state, op=MPI.MAX)
    if not state.any():
        return False
    closed, slave = _touched(zone, len(bodies), comm), _slave(zone, contact)
    was, now = zone.motions.old, zone.motions.present()
    found = any(
        _passed(body, start, end, slave, bool(touches))
        for body, touches, start, end in zip(bodies, closed, was, now)
    )
    return bool(comm.allreduce(int(found), op=MPI.MAX))


def _is_deep(zone: ZoneData) -> bool:
    """Whether a point of this rank is deep inside a tool that it touches."""
    points = zone.points()
    gap = np.where(points["status"] >= CLOSED, points["gap"], 0.0)
    return bool(np.any(-gap > DEEP * zone.distance("depth")[points["slave"]]))


def _is_far(zone: ZoneData, contact: Interaction) -> bool:
    """Whether a tool may have gone into this rank's slave facets and out again."""
    surface = zone.facets.slave_surface
    u = (contact.u.x.array - contact.u_old).reshape(-1, surface.gdim)[surface.dofs]
    way = zone.motions.present() - zone.motions.old
    drift = np.linalg.norm(way[:, :3], axis=1).max()
    far = drift + np.linalg.norm(u, axis=1).max(initial=0.0)
    least = np.minimum(DEEP * zone.distance("depth"), 0.5 * zone.thickness[0])
    return bool(np.any(way[:, 3:]) or far > least.min(initial=np.inf))


def _touched(zone: ZoneData, count: int, comm: MPI.Comm) -> Array:
    """Whether each tool touches the slave now, (count,). Collective."""
    points = zone.points()
    touched = np.zeros(count)
    touched[points["master"][points["status"] >= CLOSED]] = 1.0
    comm.Allreduce(MPI.IN_PLACE, touched, op=MPI.MAX)
    return touched


def _slave(zone: ZoneData, contact: Interaction) -> Slave:
    """Integration points and corners of the slave's facets. Collective."""
    surface, points = zone.facets.slave_surface, zone.points()
    count = len(surface.facet_ids)
    corners = facet_nodes(surface.shape, 1)
    at = np.concatenate([points["xi"], np.tile(corners, (count, 1))])
    numbers = np.repeat(np.arange(count), N_CORNERS[surface.shape])
    facet = np.concatenate([points["slave"], numbers]).astype(np.int32)
    pad = ((0, 0), (0, 3 - surface.gdim))
    u_old, u_now = (
        u.reshape(-1, surface.gdim) for u in (contact.u_old, contact.u.x.array)
    )
    old, now, normals = (
        np.pad(values, pad)
        for values in (
            positions(surface, facet, at, u_old),
            positions(surface, facet, at, u_now),
            unit_normals(surface, facet, at, u_now),
        )
    )
    return Slave(surface.gdim, old, now, normals, zone.distance("depth")[facet])


def _passed(body: Body, start: Array, end: Array, slave: Slave, touches: bool) -> bool:
    """Whether a body has passed points of this rank between two motions."""
    ways = _ways(body, start, end, slave)
    x, n = ways[-1]
    if np.any(_is_beyond_middle(body, x, n, DEEP * slave.depth)):
        return True
    out = (_cast(body, x, n) >= 0.0) | (_cast(body, x, -n) >= 0.0)
    depth = slave.depth[out]
    return any(
        _crosses(body, a[out], b[out], n[out], depth, touches, slave.gdim)
        for (a, _), (b, n) in zip(ways[:-1], ways[1:])
    )


def _is_beyond_middle(body: Body, x: Array, n: Array, least: Array) -> Mask:
    """Whether points inside a body by more than a depth are nearer to its far side than
    to the side that their normals point away from, (n,)."""
    inside, ahead = -_cast(body, x, n), -_cast(body, x, -n)
    beyond: Mask = np.isfinite(inside) & (ahead > 0.0) & (ahead < inside)
    return beyond & (inside > least)


def _ways(
    body: Body, start: Array, end: Array, slave: Slave
) -> list[tuple[Array, Array]]:
    """Places and present normals of the slave's points seen from a body, at the ends of
    the straight lines that stand for their way, (n, 3) each."""
    Q, last = (motion[6:].reshape(3, 3) for motion in (start, end))
    spin = rotation_vector(last @ Q.T)
    angle = float(np.linalg.norm(spin) + np.linalg.norm(end[3:6] - start[3:6]))
    places = []
    count = _lines(angle, start, end, body.centre, slave)
    for share in np.linspace(0.0, 1.0, count + 1):
        motion = start + share * (end - start)
        motion[6:] = (rotation_matrix(share * spin) @ Q).ravel()
        x = slave.old + share * (slave.now - slave.old)
        R, shift = body.pose_of(motion)
        places.append(((x - shift) @ R, slave.normals @ R))
    return places


def _lines(angle: float, start: Array, end: Array, centre: Array, slave: Slave) -> int:
    """Number of straight lines that stand for the way of points seen from a body that
    turns by an angle."""
    if angle == 0.0 or not len(slave.old):
        return 1
    first, last = slave.old - centre - start[:3], slave.now - centre - end[:3]
    away = max(np.linalg.norm(one, axis=1).max() for one in (first, last))
    way = np.linalg.norm(last - first, axis=1).max()
    # A line of the share s is off by s^2 / 8 times the acceleration
    acceleration = angle * (angle * away + 2.0 * way)
    count = np.sqrt(acceleration / (8.0 * BEND * slave.depth.min()))
    return int(np.clip(np.ceil(count), 1, MOST_LINES))


def _crosses(
    body: Body, a: Array, b: Array, n: Array, depth: Array, touches: bool, gdim: int
) -> bool:
    """Whether a line from a to b goes through a body as no contact does.

    Lines along the slave, or backwards, count where the body touches nothing in the end
    and was deeper below the slave than contact is.
    """
    way = np.linalg.norm(b - a, axis=1)
    along = (b - a) / np.maximum(way, np.finfo(float).tiny)[:, None]
    forwards = np.einsum("nd,nd->n", along, n) > FORWARDS
    ahead, behind = _cast(body, a, along), _cast(body, b, -along)
    met = (np.minimum(ahead, behind) < way) & (forwards | (not touches))
    # Where no entry is ahead the end is inside, or outside as its depth tells
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
        below = np.where(deep > 0.0, -_cast(body, x, n), 0.0)
        if np.any(np.where(forwards, deep > least, below > depth)):
            return True
    return False


def _cast(body: Body, x: Array, n: Array) -> Array:
    """Where rays enter a body, (n,): negative from inside, infinite for none. Length."""
    found: Array = body.tool.distances_along(
        np.ascontiguousarray(x), np.ascontiguousarray(n)
    )
    return found


def _depths(body: Body, x: Array, along: Array, whole: Mask, gdim: int) -> Array:
    """How deep points on lines are inside a body, (n,): 0 outside, infinite where it has
    no end. Depths on lines that cross the whole body are measured across the lines, as
    the body may be a thin plate. Length."""
    directions = _across(along, gdim)
    rays, sides = [*directions, along, -along], len(directions)
    found = np.array([_cast(body, x, n) for n in rays])
    behind = np.where(found < 0.0, -found, np.inf)
    ahead = np.isfinite(found) & (found >= 0.0)
    # A ray through an edge may err: the others outvote it
    inside = (found < 0.0).sum(axis=0) > ahead.sum(axis=0)
    nearest = np.where(whole, behind[:sides].min(axis=0), behind.min(axis=0))
    return np.where(inside, nearest, 0.0)


def _across(along: Array, gdim: int) -> list[Array]:
    """Directions across others, (n, 3) each; in 2D those in the plane."""
    flat = np.column_stack([-along[:, 1], along[:, 0], np.zeros(len(along))])
    if gdim == 2:
        return [flat, -flat]
    one, other = directions_across(along)
    return [c * one + s * other for c, s, _ in AROUND]

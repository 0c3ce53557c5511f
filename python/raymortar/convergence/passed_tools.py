"""Rigid tools that went through a slave and out of it again within one step.

Seen from a tool, each slave point goes along a line. Where rays along it, from both ends,
meet the tool, the point was inside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

from mpi4py import MPI

import numpy as np

from ..compat import Array, Mask
from ..host.bodies import bodies_of_facets
from ..host.extents import ends_of
from ..host.reference_facets import N_CORNERS, facet_nodes
from ..interface.faced import positions
from ..interface.point_results import CLOSED
from ..rigid.turning import directions_across, rotation_matrix, rotation_vector

if TYPE_CHECKING:
    from ..interaction import Interaction
    from ..interface.zones import ZoneData
    from ..rigid.body import Body

# By how much deeper than at the start a point has to get to have been inside, of the
# depth that counts as contact: a tenth of a facet by default
DEEPER = 0.05
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
    shifts
        Motions of the slave's bodies between which those of all their points are, the
        corners of a box, (m, 3).
    depth
        That counts as contact, (n,).
    least
        Length of the shortest way into the slave and out of reach of its rays, (n,).
    """

    gdim: int
    old: Array
    now: Array
    shifts: Array
    depth: Array
    least: Array


def have_gone_through(zone: ZoneData, contact: Interaction) -> bool:
    """Whether a tool that touches nothing now was inside the slave on its way.
    Collective.

    It is asked only where a tool or the slave has moved since the accepted step, by more
    than a depth that counts as contact or half of the slave's thickness. Motions are
    straight, turns uniform. The contact is the same afterwards.

    Parameters
    ----------
    zone
        A zone of the contact.
    contact
        `Contact`.
    """
    comm, bodies = contact.layout.comm, zone.motions.bodies
    if not comm.allreduce(int(_is_far(zone, contact)), op=MPI.MAX):
        return False
    closed, slave = _touched(zone, len(bodies), comm), _slave(zone, contact)
    was, now = zone.motions.old, zone.motions.present()
    found = False
    for body, touches, start, end in zip(bodies, closed, was, now):
        if not touches:
            found = _went_through(body, start, end, slave, comm) or found
    return found


def _least_way(zone: ZoneData) -> Array:
    """Shortest way of a tool into this rank's slave facets and out of reach of their
    rays, (n,). Length."""
    way: Array = np.minimum(zone.distance("depth"), 0.5 * zone.thickness[0])
    return way


def _is_far(zone: ZoneData, contact: Interaction) -> bool:
    """Whether a tool may have gone into this rank's slave facets and out again."""
    surface = zone.facets.slave_surface
    u = (contact.u.x.array - contact.u_old).reshape(-1, surface.gdim)[surface.dofs]
    way = zone.motions.present() - zone.motions.old
    drift = np.linalg.norm(way[:, :3], axis=1).max()
    far = drift + np.linalg.norm(u, axis=1).max(initial=0.0)
    return bool(np.any(way[:, 3:]) or far > _least_way(zone).min(initial=np.inf))


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
    old, now = (
        np.pad(positions(surface, facet, at, u.reshape(-1, surface.gdim)), pad)
        for u in (contact.u_old, contact.u.x.array)
    )
    depth, least = zone.distance("depth")[facet], _least_way(zone)[facet]
    return Slave(surface.gdim, old, now, _shifts(zone, contact), depth, least)


def _shifts(zone: ZoneData, contact: Interaction) -> Array:
    """`Slave.shifts`. Collective."""
    comm, surface = contact.layout.comm, zone.facets.slave_surface
    mine = np.unique(bodies_of_facets(contact.bodies, surface)).tolist()
    slaves = sorted(set().union(*comm.allgather(mine)))
    u = (contact.u.x.array - contact.u_old).reshape(-1, surface.gdim)
    u = u[np.isin(contact.bodies.dofs, slaves)]
    corners = np.array(list(product(*ends_of(u, comm).T)))
    return np.pad(corners, ((0, 0), (0, 3 - surface.gdim)))


def _went_through(
    body: Body, start: Array, end: Array, slave: Slave, comm: MPI.Comm
) -> bool:
    """Whether a body has gone through slave points between two motions. Collective."""
    seen = np.array(_ways(body, start, end, slave))
    length = np.linalg.norm(np.diff(seen, axis=0), axis=2).sum(axis=0)
    moved = length > slave.least
    allowed = DEEPER * slave.depth[moved]
    too_deep = max(
        _too_deep(body, a[moved], b[moved], allowed, slave.gdim)
        for a, b in zip(seen[:-1], seen[1:])
    )
    too_deep = comm.allreduce(too_deep, op=MPI.MAX)
    if too_deep <= 0.0:
        return False
    # What was in contact springs back, while the tool is still near: it is as deep as
    # the slave of now would be there, without its motion as a whole
    back = [_seen_from(body, start, slave.now - shift) for shift in slave.shifts]
    begin = max(_deepest(body, x, slave.gdim) for x in (seen[0], *back))
    return bool(too_deep > comm.allreduce(begin, op=MPI.MAX))


def _ways(body: Body, start: Array, end: Array, slave: Slave) -> list[Array]:
    """Places of the slave's points seen from a body, at the ends of the straight lines
    that stand for their way, (n, 3) each."""
    Q, R = (motion[6:].reshape(3, 3) for motion in (start, end))
    spin = rotation_vector(R @ Q.T)
    angle = float(np.linalg.norm(spin) + np.linalg.norm(end[3:6] - start[3:6]))
    places = []
    count = _lines(angle, start, end, body.centre, slave)
    for share in np.linspace(0.0, 1.0, count + 1):
        motion = start + share * (end - start)
        motion[6:] = (rotation_matrix(share * spin) @ Q).ravel()
        x = slave.old + share * (slave.now - slave.old)
        places.append(_seen_from(body, motion, x))
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


def _seen_from(body: Body, motion: Array, x: Array) -> Array:
    """Points (n, 3) in the coordinates in which a body was made."""
    R, shift = body.pose_of(motion)
    seen: Array = (x - shift) @ R
    return seen


def _too_deep(body: Body, a: Array, b: Array, allowed: Array, gdim: int) -> float:
    """Largest depth inside a body on lines from a to b, less what is allowed. Length.

    Parameters
    ----------
    a, b
        Ends of the lines, (n, 3).
    allowed
        (n,). Length.
    """
    length = np.linalg.norm(b - a, axis=1)
    lines = length > 0.0
    a, b, length, allowed = a[lines], b[lines], length[lines], allowed[lines]
    along = (b - a) / length[:, None]
    ahead, behind = _cast(body, a, along), _cast(body, b, -along)
    met = np.minimum(ahead, behind) < length
    a, along, length, allowed = a[met], along[met], length[met], allowed[met]
    # Where no entry is ahead the end is inside, or outside as its depth tells
    first, last = (
        np.where(np.isfinite(one[met]), np.clip(one[met], 0.0, length), 0.0)
        for one in (ahead, behind)
    )
    # A point that leaves from inside is as deep as its way out is long
    leaves = (first == 0.0) & (last > 0.0)
    worst = 0.0
    for place in PLACES:
        inside = np.maximum(length - last - first, 0.0)
        g = first + place * inside
        deep = _depths_across(body, a + g[:, None] * along, along, gdim)
        deep = np.where(leaves, np.minimum(deep, (1.0 - place) * inside), deep)
        worst = max(worst, float((deep - allowed).max(initial=0.0)))
    return worst


def _cast(body: Body, x: Array, n: Array) -> Array:
    """Where rays enter a body, (n,): negative from inside, infinite for none. Length."""
    found: Array = body.tool.distances_along(
        np.ascontiguousarray(x), np.ascontiguousarray(n)
    )
    return found


def _depths_across(body: Body, x: Array, along: Array, gdim: int) -> Array:
    """How deep points are inside a body, measured across directions, (n,): 0 outside,
    infinite where it has no end. Length."""
    directions = _across(along, gdim)
    nearest, inside = _nearest(body, x, [*directions, along, -along], len(directions))
    return np.where(inside, nearest, 0.0)


def _across(along: Array, gdim: int) -> list[Array]:
    """Directions across others, (n, 3) each; in 2D those in the plane."""
    flat = np.column_stack([-along[:, 1], along[:, 0], np.zeros(len(along))])
    if gdim == 2:
        return [flat, -flat]
    one, other = directions_across(along)
    return [c * one + s * other for c, s, _ in AROUND]


def _deepest(body: Body, x: Array, gdim: int) -> float:
    """Depth of the deepest of some points inside a body. Length."""
    directions = AROUND if gdim == 2 else EVERYWHERE
    rays = [np.tile(n, (len(x), 1)) for n in directions]
    nearest, inside = _nearest(body, x, rays, len(rays))
    return float(nearest[inside & np.isfinite(nearest)].max(initial=0.0))


def _nearest(
    body: Body, x: Array, rays: Sequence[Array], count: int
) -> tuple[Array, Mask]:
    """Distance of points inside a body from its surface, along the first so many rays,
    and whether they are inside, (n,) each. A ray through an edge may err: the others
    outvote it."""
    found = np.array([_cast(body, x, n) for n in rays])
    entries_behind = np.where(found < 0.0, -found, np.inf)[:count]
    ahead = np.isfinite(found) & (found >= 0.0)
    inside: Mask = (found < 0.0).sum(axis=0) > ahead.sum(axis=0)
    return entries_behind.min(axis=0, initial=np.inf), inside

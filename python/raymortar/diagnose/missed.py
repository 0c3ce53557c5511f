"""Masters that a slave meets on no path: of a wrong tag, in another unit, or beside it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

from mpi4py import MPI

import numpy as np
from scipy.spatial import cKDTree

from ..core import on_demand
from ..core.compat import Array, Indices
from ..core.convergence.balance import largest_by
from ..core.discretization.facets import facet_nodes
from ..core.discretization.ranks import ends_of, of_all
from ..core.discretization.surfaces import Surface
from ..core.errors import format_point, warn
from ..core.interaction import Interaction
from ..core.interface.point_results import OPEN
from ..core.interface.zone_data import (
    ZoneData,
    nodes_of_facets,
    positions,
    unit_normals,
)
from ..core.problem import CoupledProblem
from ..core.target import Target

# Few problems have tools
_distance_to = on_demand.function(f"{__package__}.tools.distance_to")
# Distance, in sizes of the mesh, beyond which a tool at rest does not merely wait for a
# later path
FAR = 10.0
# Cosine between a master's normal and the way to the slave nearest to it, below which the
# slave is behind the master, and not beside its edge
BEHIND = -0.5
# After one solve: distance, in sizes of the largest body, and in motions of this solve,
# beyond which a slave is not on its way to its master
AWAY, MANY = 2.0, 20.0
# Motion of a solve of which nothing follows, in sizes of the largest body
AT_REST = 1e-9
# Cosine between normals of slave and master above which they do not face each other
FACING = -0.1
# Times that a message is about
ON_PATH, SO_FAR = "on this path", "so far"
# Most of the equally near nodes whose ways are looked at; relative error of a place
WAYS, ROUNDING = 50, 1e-9


class MastersOnPath:
    """The masters of a problem that its slaves have met on no path so far.

    A master is met where the ray of an integration point hits it within reach. A slave
    that meets one of its masters with facets counts as meeting all of them. Free rigid
    bodies are left out, as a solve fails where nothing is ahead of them, and so are
    surfaces that meet themselves, which may never fold. It is made at the start of a
    path.
    """

    def __init__(self, contact: Interaction) -> None:
        self._contact, self._comm = contact, contact.layout.comm
        self._start = [zone.motions.present() for zone in contact.zones]
        self._u = contact.u.x.array.copy()

    def look(self) -> None:
        """See which masters are met at present. Collective."""
        for zone in self._contact.zones:
            bodies = zone.facets.bodies
            known = [body.is_free or k in zone.met for k, body in enumerate(bodies)]
            if all(known or [0 in zone.met or zone.tied or zone.facets.meets_itself]):
                continue
            points, met = zone.points(), np.zeros(len(bodies) or 1, dtype=bool)
            hit = points["status"] >= OPEN
            met[points["master"][hit] if bodies else np.zeros(hit.sum(), int)] = True
            self._comm.Allreduce(MPI.IN_PLACE, met, op=MPI.LOR)
            zone.met.update(np.flatnonzero(met).tolist())

    def warn(self) -> None:
        """Warn of masters that were met on no path: of rigid bodies that have moved on
        this one, or are far away; of facets, once, where bodies have moved and either
        no slave met anything or the slave is behind its master. Collective."""
        zones, u = self._contact.zones, self._contact.u.x.array
        has_moved = self._comm.allreduce(bool(np.any(u != self._u)), op=MPI.LOR)
        is_met = any(zone.met for zone in zones)
        for start, zone in zip(self._start, zones):
            if zone.facets.bodies:
                self._warn_of_tools(start, zone)
            elif has_moved and _is_open(zone):
                found = _nearest(zone, u)
                if found.is_behind or not is_met:
                    zone.met.add(0)  # told once
                    warn(_text_of_facets(zone, found, ON_PATH))

    def _warn_of_tools(self, start: Array, zone: ZoneData) -> None:
        """Warn of the rigid bodies that a slave has not met. Collective."""
        for k, body in enumerate(zone.facets.bodies):
            if body.is_free or k in zone.met:
                continue
            box = _box(zone)
            x = self._contact.u.function_space.mesh.geometry.x
            size = np.linalg.norm(np.ptp(ends_of(x, self._comm), axis=0))
            moved = bool(np.any(body.motion() != start[k]))
            if moved or _distance_to(body, box.mean(axis=0)) > FAR * size:
                warn(_text(zone, body, box, ON_PATH))


def warn_of_missed_masters(problem: CoupledProblem) -> None:
    """Warn, after a solve that is no part of a path, of slaves that have crossed a master
    out of reach. Where nothing has been met so far, warn too of slaves that do not face
    their masters, or are too far off for steps as this one. Collective."""
    contact = problem.contact
    MastersOnPath(contact).look()
    waits = any(zone.met for zone in contact.zones)
    way, size = _way(contact), _largest_body(contact)
    moves, far = way > AT_REST * size, max(AWAY * size, MANY * way)
    for zone in contact.zones:
        if zone.facets.bodies:
            if moves and not (waits or zone.tied):
                _warn_of_far_tools(zone, far)
        elif _is_open(zone):
            found = _nearest(zone, contact.u.x.array)
            is_off = moves and (not found.faces or found.distance > far)
            if found.has_crossed(contact.states.u_old) or (is_off and not waits):
                zone.met.add(0)  # told once
                warn(_text_of_facets(zone, found, SO_FAR))


def _way(contact: Interaction) -> float:
    """Find the largest motion of a node or of a tool since the accepted step. Length.
    Collective."""
    ways = [np.abs(contact.u.x.array - contact.states.u_old).max(initial=0.0)]
    for zone in contact.zones:
        moved = zone.motions.present() - zone.motions.old
        ways += [float(np.linalg.norm(one[:3])) for one in moved]
    return float(contact.layout.comm.allreduce(max(ways), op=MPI.MAX))


def _largest_body(contact: Interaction) -> float:
    """Find the diagonal of the largest body's undeformed box. Length. Collective."""
    bodies, X = (
        contact.system.bodies,
        contact.u.function_space.tabulate_dof_coordinates(),
    )
    ends = np.stack([largest_by(bodies.dofs, x, bodies.count) for x in (X, -X)])
    contact.layout.comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MAX)
    return float(np.linalg.norm(ends.sum(axis=0), axis=1).max())


def _warn_of_far_tools(zone: ZoneData, far: float) -> None:
    """Warn of rigid bodies that are farther from their slave than a length. Collective."""
    box = _box(zone)
    for k, body in enumerate(zone.facets.bodies):
        known = body.is_free or k in zone.met
        if not known and _distance_to(body, box.mean(axis=0)) > far:
            zone.met.add(k)  # told once
            warn(_text(zone, body, box, SO_FAR))


def _is_open(zone: ZoneData) -> bool:
    """Whether a slave has met no facet so far, of masters that it ought to meet."""
    return not (zone.met or zone.tied or zone.facets.meets_itself)


@dataclass(frozen=True)
class Nearest:
    """The corner of a slave facet that is nearest to one of its masters.

    Attributes
    ----------
    place, distance
        Of the corner, and from the master. Lengths.
    is_behind
        Whether it is behind the master.
    faces
        Whether normals of the slave there and of the master are opposed.
    """

    place: Array
    distance: float
    is_behind: bool
    faces: bool
    zone: ZoneData
    # Of this rank: local corners of the slave as near as this, and their places
    _close: Indices
    _x: Array
    _masters: Array

    def has_crossed(self, before: Array) -> bool:
        """Whether it is behind the master, and its way from a displacement before has
        crossed that. Collective."""
        if not self.is_behind:
            return False
        slave, master = self.zone.sides
        corners, d = len(facet_nodes(master.shape, 1)), self._x.shape[1]
        facets = self._masters[:, :d].reshape(-1, corners, d)
        start = _corners(slave, before)[self._close, :d]
        some = range(0, len(self._close), 1 + len(self._close) // WAYS)
        crossed = any(_is_crossed(facets, start[i], self._x[i]) for i in some)
        return bool(self.zone.comm.allreduce(crossed, op=MPI.LOR))


def _nearest(zone: ZoneData, u: Array) -> Nearest:
    """Find the corner of a slave facet that is nearest to one of its masters.
    Collective."""
    slave, master = (_corners(side, u) for side in zone.sides)
    d = slave.shape[1] // 2
    (masters,) = of_all(zone.comm, master)
    tree = cKDTree(masters[:, :d])
    distances, which = tree.query(slave[:, :d])
    distance = zone.comm.allreduce(distances.min(initial=np.inf), op=MPI.MIN)
    reach = distance * (1.0 + ROUNDING)
    close = np.flatnonzero(distances <= reach)
    x, other = slave[close, :d], masters[which[close]]
    height = np.einsum("nd,nd->n", x - other[:, :d], other[:, d:])
    (found,) = of_all(zone.comm, np.column_stack([height, x]))
    lowest, *place = min(found.tolist())
    # Facets of a corner have several normals
    around = tree.query_ball_point(x, reach)
    cosines = [
        float((masters[at, d:] @ n).min()) for at, n in zip(around, slave[close, d:])
    ]
    least = zone.comm.allreduce(min(cosines, default=1.0), op=MPI.MIN)
    return Nearest(
        np.array(place),
        float(distance),
        bool(lowest < BEHIND * distance),
        bool(least < FACING),
        zone,
        close,
        x,
        masters,
    )


def _is_crossed(facets: Array, begin: Array, end: Array) -> bool:
    """Whether the straight line between two points crosses one of the facets, (n, corners,
    d), which count with all simplices of their corners."""
    d = len(begin)
    chosen = list(combinations(range(facets.shape[1]), d))
    simplices = facets[:, chosen].reshape(-1, d, d)
    first = simplices[:, 0]
    spans = np.concatenate(
        [simplices[:, 1:] - first[:, None], np.full((len(first), 1, d), begin - end)],
        axis=1,
    )
    sizes = np.linalg.norm(spans, axis=2).prod(axis=1)
    met = np.abs(np.linalg.det(spans)) > ROUNDING * sizes  # not along the facet
    shares = np.linalg.solve(
        spans[met].transpose(0, 2, 1), (begin - first[met])[..., None]
    )[..., 0]
    inside = (shares > -ROUNDING).all(axis=1) & (shares[:, -1] < 1.0 + ROUNDING)
    return bool((inside & (shares[:, :-1].sum(axis=1) < 1.0 + ROUNDING)).any())


def _corners(side: Surface, u: Array) -> Array:
    """Deformed corners of the facets of this rank, each with its normal, (n, 2 d)."""
    facets, at = nodes_of_facets(side, 1)
    of_nodes = u.reshape(-1, side.gdim)
    x = positions(side, facets, at, of_nodes)
    return np.hstack([x, unit_normals(side, facets, at, of_nodes)])


def _box(zone: ZoneData) -> Array:
    """Find the two ends of the box around a slave, (2, 3). Length. Collective."""
    slave = zone.facets.slave_surface
    box = ends_of(slave.X[np.unique(slave.facet_nodes)], zone.comm)
    return np.pad(box, ((0, 0), (0, 3 - slave.gdim)))


def _text_of_facets(zone: ZoneData, found: Nearest, when: str) -> str:
    """Tell where a slave is that has met none of its masters."""
    masters = " or ".join(zone.facets.spoken_masters)
    side, other = "away", "a length in another unit"
    if found.is_behind:
        side, other = "behind", "has a step gone through"
    return (
        f"{zone.facets.spoken} has met no facet of {masters} {when}: it ends "
        f"{found.distance:.2g} {side}, at {format_point(found.place)}. Is a tag that of "
        f"another face, or {other}?"
    )


def _text(zone: ZoneData, body: Target, box: Array, when: str) -> str:
    """Tell where a body is, and where the slave is that has not met it."""
    gdim = zone.facets.slave_surface.gdim
    places = [format_point(x[:gdim], box, 4) for x in (body.place, *box)]
    return (
        f"the rigid {body.name} has met no facet of {zone.facets.spoken} "
        f"{when}: its centre is at {places[0]}, the slave between {places[1]} "
        f"and {places[2]}. Is a length in another unit?"
    )

"""Masters that a slave meets on no path: of a wrong tag, in another unit, or beside it."""

from __future__ import annotations

from itertools import combinations, product

from mpi4py import MPI

import numpy as np
from scipy.spatial import cKDTree

from ..compat import Array
from ..discretization.facets import facet_nodes
from ..discretization.ranks import ends_of, of_all
from ..discretization.surfaces import Surface
from ..errors import format_point, warn
from ..interactions import Interaction
from ..interface.point_results import OPEN
from ..interface.zone_data import ZoneData, positions, unit_normals
from ..rigid.body import Body
from ..rigid.turning import rotation_matrix
from .tools import AROUND, cast

# Directions in space: to faces, edges and corners of a cube
_CUBE = np.array([n for n in product((-1.0, 0.0, 1.0), repeat=3) if any(n)])
_TURNED = _CUBE @ rotation_matrix(np.array([0.3, 0.2, 0.1]))
EVERYWHERE = _TURNED / np.linalg.norm(_TURNED, axis=1)[:, None]
# Distance, in sizes of the mesh, beyond which a tool at rest does not merely wait for a
# later path
FAR = 10.0
# Cosine between a master's normal and the way to the slave nearest to it, below which the
# slave is behind the master, and not beside its edge
BEHIND = -0.5
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
                place, distance, is_behind = _nearest(zone, u)
                if is_behind or not is_met:
                    zone.met.add(0)  # told once
                    text = _text_of_facets(zone, place, distance, is_behind)
                    warn(text)

    def _warn_of_tools(self, start: Array, zone: ZoneData) -> None:
        """Warn of the rigid bodies that a slave has not met. Collective."""
        for k, body in enumerate(zone.facets.bodies):
            if body.is_free or k in zone.met:
                continue
            slave = zone.facets.slave_surface
            box = ends_of(slave.X[np.unique(slave.facet_nodes)], self._comm)
            box = np.pad(box, ((0, 0), (0, 3 - slave.gdim)))
            x = self._contact.u.function_space.mesh.geometry.x
            size = np.linalg.norm(np.ptp(ends_of(x, self._comm), axis=0))
            moved = bool(np.any(body.motion() != start[k]))
            if moved or _distance(body, box.mean(axis=0)) > FAR * size:
                warn(_text(zone, body, box))


def warn_of_passed_masters(contact: Interaction) -> None:
    """Warn, after a solve that is no part of a path, of slaves that were in front of a
    master out of reach and are behind it now. Collective."""
    MastersOnPath(contact).look()
    for zone in contact.zones:
        if not zone.facets.bodies and _is_open(zone):
            place, distance, is_behind = _nearest(
                zone, contact.u.x.array, contact.u_old
            )
            if is_behind:
                zone.met.add(0)  # told once
                text = _text_of_facets(zone, place, distance, True, "so far")
                warn(text)


def _is_open(zone: ZoneData) -> bool:
    """Whether a slave has met no facet so far, of masters that it ought to meet."""
    return not (zone.met or zone.tied or zone.facets.meets_itself)


def _nearest(
    zone: ZoneData, u: Array, before: Array | None = None
) -> tuple[Array, float, bool]:
    """Find the corner of a slave facet that is nearest to one of its masters.
    Collective.

    Returns
    -------
    Its place, its distance, and whether it is behind the master; with a displacement
    before, only if its way from there has crossed the master.
    """
    slave, master = (_corners(side, u) for side in zone.sides)
    d = slave.shape[1] // 2
    (masters,) = of_all(zone.comm, master)
    distances, which = cKDTree(masters[:, :d]).query(slave[:, :d])
    distance = zone.comm.allreduce(distances.min(initial=np.inf), op=MPI.MIN)
    close = np.flatnonzero(distances <= distance * (1.0 + 1e-9))
    x, other = slave[close, :d], masters[which[close]]
    height = np.einsum("nd,nd->n", x - other[:, :d], other[:, d:])
    (found,) = of_all(zone.comm, np.column_stack([height, x]))
    lowest, *place = min(found.tolist())
    is_behind = bool(lowest < BEHIND * distance)
    if is_behind and before is not None:
        corners = len(facet_nodes(zone.sides[1].shape, 1))
        facets = masters[:, :d].reshape(-1, corners, d)
        start = _corners(zone.sides[0], before)[close, :d]
        some = range(0, len(close), 1 + len(close) // WAYS)
        crossed = any(_is_crossed(facets, start[i], x[i]) for i in some)
        is_behind = zone.comm.allreduce(crossed, op=MPI.LOR)
    return np.array(place), float(distance), is_behind


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
    at, count = facet_nodes(side.shape, 1), len(side.facet_dofs)
    facets, at = np.repeat(np.arange(count), len(at)), np.tile(at, (count, 1))
    of_nodes = u.reshape(-1, side.gdim)
    x = positions(side, facets, at, of_nodes)
    return np.hstack([x, unit_normals(side, facets, at, of_nodes)])


def _text_of_facets(
    zone: ZoneData,
    place: Array,
    distance: float,
    is_behind: bool,
    when: str = "on the whole path",
) -> str:
    """Tell where a slave is that has met none of its masters."""
    masters = " or ".join(zone.facets.spoken_masters)
    behind, other = "", "a place, a size or a motion in another unit than the mesh"
    if is_behind:
        behind = "behind it, "
        other = f"has a step gone through the {zone.facets.hit_role}"
    return (
        f"{zone.facets.spoken} has met no facet of {masters} {when}: it ends "
        f"{behind}{distance:.2g} away, at {format_point(place)}. Is a tag of the pair "
        f"that of another face, or {other}?"
    )


def _distance(body: Body, middle: Array) -> float:
    """Estimate the distance of a body from a point: along some directions, or of its
    centre where that is less. Length."""
    R, shift = body.pose_of(body.motion())
    ways = AROUND if body.shape.gdim == 2 else EVERYWHERE
    along = np.abs(cast(body, np.tile((middle - shift) @ R, (len(ways), 1)), ways))
    return float(min(along.min(), np.linalg.norm(middle - body.place)))


def _text(zone: ZoneData, body: Body, box: Array) -> str:
    """Tell where a body is, and where the slave is that has not met it."""
    gdim = zone.facets.slave_surface.gdim
    places = [format_point(x[:gdim], box, 4) for x in (body.place, *box)]
    return (
        f"the rigid {body.name} has met no facet of {zone.facets.spoken} on "
        f"the whole path: its centre is at {places[0]}, and the undeformed slave "
        f"between {places[1]} and {places[2]}. Is its place, its size or its motion "
        "in another unit than the mesh?"
    )

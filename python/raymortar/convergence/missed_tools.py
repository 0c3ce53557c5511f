"""Rigid tools that a slave does not meet on a whole path."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

from mpi4py import MPI

import numpy as np

from ..compat import Array
from ..errors import ContactWarning
from ..host.extents import ends_of
from ..interface.point_results import OPEN
from .passed_tools import AROUND, EVERYWHERE

if TYPE_CHECKING:
    from ..interaction import Interaction
    from ..interface.zone_data import ZoneData
    from ..rigid.body import Body

# Distance, in sizes of the mesh, beyond which a tool at rest does not merely wait for a
# later path
FAR = 10.0


class ToolsOnPath:
    """The rigid bodies of a problem that its slaves have met on no path so far.

    A body is met where the ray of an integration point hits it within reach. Bodies that
    are free are not looked at: where nothing is ahead of them, a solve fails.

    Parameters
    ----------
    contact
        `Contact`, at the start of a path.
    """

    def __init__(self, contact: Interaction) -> None:
        self._contact = contact
        self._start = [zone.motions.present() for zone in contact.zones]

    def look(self) -> None:
        """See which bodies are met at present. Collective."""
        unmet = self._unmet()
        if not unmet:
            return
        points = {id(zone): zone.points() for _, zone, _ in unmet}
        met = np.array([_is_met(points[id(zone)], k) for _, zone, k in unmet], np.int32)
        self._contact.layout.comm.Allreduce(MPI.IN_PLACE, met, op=MPI.MAX)
        for (_, zone, k), is_met in zip(unmet, met):
            if is_met:
                zone.met.add(k)

    def warn(self) -> None:
        """Warn of bodies that have moved on this path, or are far away, and were met on
        none. Collective."""
        for start, zone, k in self._unmet():
            body = zone.facets.bodies[k]
            box = _slave_box(zone, self._contact)
            moved = bool(np.any(body.motion() != start[k]))
            if moved or _distance(body, box) > FAR * _size(self._contact):
                warnings.warn(_text(zone, body, box), ContactWarning, stacklevel=4)

    def _unmet(self) -> list[tuple[Array, ZoneData, int]]:
        """For each body that is not met: the motions of its zone's bodies at the start,
        the zone, and its number there."""
        return [
            (start, zone, k)
            for start, zone in zip(self._start, self._contact.zones)
            for k, body in enumerate(zone.facets.bodies)
            if not body.is_free and k not in zone.met
        ]


def _is_met(points: dict[str, Array], k: int) -> bool:
    """Whether any of a zone's points on this rank meets body k within reach."""
    return bool(np.any((points["master"] == k) & (points["status"] >= OPEN)))


def _slave_box(zone: ZoneData, contact: Interaction) -> Array:
    """Ends of the box around the undeformed slave, (2, 3). Length. Collective."""
    surface = zone.facets.slave_surface
    x = surface.X[np.unique(surface.facet_nodes)]
    padded = np.pad(x, ((0, 0), (0, 3 - surface.gdim)))
    return ends_of(padded, contact.layout.comm)


def _size(contact: Interaction) -> float:
    """Diagonal of the box around the mesh. Length. Collective."""
    x = contact.u.function_space.mesh.geometry.x
    return float(np.linalg.norm(np.ptp(ends_of(x, contact.layout.comm), axis=0)))


def _distance(body: Body, box: Array) -> float:
    """About the distance of a body from the middle of a box (2, 3): along some
    directions, or of its centre where that is less. Length."""
    R, shift = body.pose_of(body.motion())
    middle = box.mean(axis=0)
    ways = np.ascontiguousarray(AROUND if body.shape.gdim == 2 else EVERYWHERE)
    starts = np.tile((middle - shift) @ R, (len(ways), 1))
    along = np.abs(body.tool.distances_along(starts, ways))
    return float(min(along.min(), np.linalg.norm(middle - body.place)))


def _text(zone: ZoneData, body: Body, box: Array) -> str:
    gdim = zone.facets.slave_surface.gdim

    def place(point: Array) -> str:
        rounding = 1e-9 * np.abs(box).max()
        shown = np.where(np.abs(point) > rounding, point, 0.0)
        return ", ".join(f"{value:.4g}" for value in shown[:gdim])

    return (
        f"the rigid {body.name} has met no facet of slave tag {zone.facets.slave_tag} on "
        f"the whole path: its centre is at ({place(body.place)}), and the undeformed "
        f"slave between ({place(box[0])}) and ({place(box[1])}). Is its place, its size "
        "or its motion in another unit than the mesh?"
    )

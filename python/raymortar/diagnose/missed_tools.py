"""Rigid tools that a slave does not meet on a whole path."""

from __future__ import annotations

import warnings

from mpi4py import MPI

import numpy as np

from ..compat import Array
from ..errors import ContactWarning
from ..host.extents import ends_of
from ..interaction import Interaction
from ..interface.point_results import OPEN
from ..interface.zones import ZoneData
from ..rigid.body import Body
from .passed_tools import AROUND, EVERYWHERE

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
        self._contact, self._comm = contact, contact.layout.comm
        self._start = [zone.motions.present() for zone in contact.zones]

    def look(self) -> None:
        """See which bodies are met at present. Collective."""
        for zone in self._contact.zones:
            bodies = zone.facets.bodies
            if not all(body.is_free or k in zone.met for k, body in enumerate(bodies)):
                points, met = zone.points(), np.zeros(len(bodies), dtype=bool)
                met[points["master"][points["status"] >= OPEN]] = True
                self._comm.Allreduce(MPI.IN_PLACE, met, op=MPI.LOR)
                zone.met.update(np.flatnonzero(met).tolist())

    def warn(self) -> None:
        """Warn of bodies that have moved on this path, or are far away, and were met on
        none. Collective."""
        for start, zone in zip(self._start, self._contact.zones):
            for k, body in enumerate(zone.facets.bodies):
                if body.is_free or k in zone.met:
                    continue
                slave = zone.facets.slave_surface
                box = ends_of(slave.X[np.unique(slave.facet_nodes)], self._comm)
                box = np.pad(box, ((0, 0), (0, 3 - slave.gdim)))
                moved = bool(np.any(body.motion() != start[k]))
                if moved or _distance(body, box) > FAR * self._size():
                    warnings.warn(_text(zone, body, box), ContactWarning, stacklevel=4)

    def _size(self) -> float:
        """Diagonal of the box around the mesh. Length. Collective."""
        x = self._contact.u.function_space.mesh.geometry.x
        return float(np.linalg.norm(np.ptp(ends_of(x, self._comm), axis=0)))


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
    """Tell where a body is, and where the slave is that has not met it."""
    gdim, rounding = zone.facets.slave_surface.gdim, 1e-9 * np.abs(box).max()
    places = [
        ", ".join(f"{x if abs(x) > rounding else 0.0:.4g}" for x in point[:gdim])
        for point in (body.place, *box)
    ]
    return (
        f"the rigid {body.name} has met no facet of slave tag {zone.facets.slave_tag} on "
        f"the whole path: its centre is at ({places[0]}), and the undeformed slave "
        f"between ({places[1]}) and ({places[2]}). Is its place, its size or its motion "
        "in another unit than the mesh?"
    )

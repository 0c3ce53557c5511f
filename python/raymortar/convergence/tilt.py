"""Warnings about facets that press on a master askew: forces turn with the facets."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

from mpi4py import MPI

import numpy as np

from ..compat import Array
from ..errors import ContactWarning
from ..interface.point_results import CLOSED
from ..rigid.body import Body

if TYPE_CHECKING:
    from ..interaction import Interaction
    from ..interface.zone_data import ZoneData

# Degrees by which a force may be turned without a word
ALLOWED = 2.0
# Pairs with less of the largest pair's force are not worth a word
COUNTS = 0.01


class TiltedFacets:
    """Warns once of each pair whose slave facets are tilted against the master.

    Pairs count where the slave's normal is that of the law [theory (2.14)].

    Parameters
    ----------
    contact
        `Contact`.
    """

    def __init__(self, contact: Interaction) -> None:
        self._contact = contact
        self._told: set[tuple[int, int]] = set()

    def warn(self, stacklevel: int) -> None:
        """Warn on every rank of the present state. Collective.

        Parameters
        ----------
        stacklevel
            Of `warnings.warn`, seen from the caller.
        """
        zones = self._contact.zones
        forces, angles = zip(*(_tilts(z, self._contact.layout.comm) for z in zones))
        least = COUNTS * max(force.max(initial=0.0) for force in forces)
        for number, zone in enumerate(zones):
            for k in np.flatnonzero(
                (angles[number] > ALLOWED) & (forces[number] > least)
            ):
                if (number, k) not in self._told:
                    self._told.add((number, k))
                    text = _text(zone, k, angles[number][k])
                    warnings.warn(text, ContactWarning, stacklevel=stacklevel + 1)


def warn_of_tilt(contact: Interaction) -> None:
    """Warn of tilted facets after a solve by itself. Collective."""
    TiltedFacets(contact).warn(stacklevel=4)


def _tilts(zone: ZoneData, comm: MPI.Comm) -> tuple[Array, Array]:
    """Sum of the pressures' forces on each master, and the angle by which the slave's
    normals turn them against the master's, (masters,). Degrees. Collective."""
    points = zone.points()
    n, n_m = points["normal"], points["master_normal"]
    counts = (points["status"] >= CLOSED) & (points["contact_normal"] == n).all(axis=1)
    counts &= n_m.any(axis=1)  # ties have none
    force = np.abs(points["weight"] * points["pressure"])[counts]
    values = force * np.vstack([np.ones_like(force), n[counts].T, -n_m[counts].T])
    sums = np.zeros((zone.master_tags.count, len(values)))
    np.add.at(sums, zone.masters_of(points)[counts], values.T)
    comm.Allreduce(MPI.IN_PLACE, sums)
    size, mine, right = np.split(sums, [1, 1 + n.shape[1]], axis=1)
    along = np.linalg.norm(right, axis=1, keepdims=True)
    along = np.divide(right, along, out=np.zeros_like(right), where=along > 0.0)
    aside = mine - np.einsum("mi,mi->m", mine, along)[:, None] * along
    share = np.divide(aside, size, out=np.zeros_like(aside), where=size > 0.0)
    sine = np.minimum(np.linalg.norm(share, axis=1), 1.0)
    angles: Array = np.rad2deg(np.arcsin(sine))
    return size[:, 0], angles


def _text(zone: ZoneData, k: int, angle: float) -> str:
    master = zone.facets.master_tags[k]
    name = master.name if isinstance(master, Body) else f"master tag {master}"
    return (
        f"the facets of slave tag {zone.facets.slave_tag} that press on {name} are "
        f"tilted against it by {angle:.2g} degrees in the mean, and the force is turned "
        "by as much: give Contact(frame='master') where the master is flat or smooth, "
        "make that side the slave, or round the slave's corner"
    )

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
    from ..interface.zones import ZoneData

# Degrees by which a force may be turned without a word
ALLOWED = 2.0


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
        for number, zone in enumerate(self._contact.zones):
            for k, angle in enumerate(_tilts(zone, self._contact.layout.comm)):
                if angle > ALLOWED and (number, k) not in self._told:
                    self._told.add((number, k))
                    text = _text(zone, k, angle)
                    warnings.warn(text, ContactWarning, stacklevel=stacklevel + 1)


def warn_of_tilt(contact: Interaction) -> None:
    """Warn of tilted facets after a solve by itself. Collective."""
    TiltedFacets(contact).warn(stacklevel=4)


def _tilts(zone: ZoneData, comm: MPI.Comm) -> Array:
    """Mean angle of the slave's normals against the reversed ones of each master,
    weighted by forces, (masters,). Degrees. Collective."""
    points = zone.points()
    n, n_m = points["normal"], points["master_normal"]
    counts = (points["status"] >= CLOSED) & (points["contact_normal"] == n).all(axis=1)
    counts &= n_m.any(axis=1)  # ties have none
    force = np.abs(points["weight"] * points["pressure"])[counts]
    lack = force[:, None] * (n + n_m)[counts]
    sums = np.zeros((zone.master_tags.count, 1 + n.shape[1]))
    np.add.at(sums, zone.masters_of(points)[counts], np.column_stack([force, lack]))
    comm.Allreduce(MPI.IN_PLACE, sums)
    mean, force = np.linalg.norm(sums[:, 1:], axis=1), sums[:, 0]
    mean = np.divide(mean, force, out=np.zeros_like(mean), where=force > 0.0)
    angles: Array = np.rad2deg(2.0 * np.arcsin(np.minimum(0.5 * mean, 1.0)))
    return angles


def _text(zone: ZoneData, k: int, angle: float) -> str:
    master = zone.facets.master_tags[k]
    name = master.name if isinstance(master, Body) else f"master tag {master}"
    return (
        f"the facets of slave tag {zone.facets.slave_tag} that press on {name} are "
        f"tilted against it by {angle:.2g} degrees in the mean, and the force is turned "
        "by as much: refine the slave's corner to 3 facets in contact, round it, or make "
        "the flat or smooth side the slave"
    )

"""Rigid tools that went through a slave and out of it again within one step."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mpi4py import MPI

import numpy as np

from ..compat import Array
from ..interface.point_results import OPEN

if TYPE_CHECKING:
    from ..interaction import Interaction
    from ..interface.zones import ZoneData

# Shares of a step's way at which the tools are looked at: the first of them after a
# hundredth of the size of a tool where the way is ten of its sizes
SHARES = np.concatenate([2.0 ** -np.arange(10.0, 3.0, -1.0), np.arange(1.0, 8.0) / 8.0])
# By how much deeper than at the start a tool has to get to have gone in, of the depth
# that counts as contact: a tool that leaves gets no deeper
DEEPER = 0.25


def have_gone_through(zone: ZoneData, contact: Interaction) -> bool:
    """Whether a tool that no ray hits now was inside the slave on its way. Collective.

    It is asked only where tools have moved since the accepted step, by more than a
    depth that counts as contact, and nothing hits them. The way is straight; the slave
    is where it is now.

    Parameters
    ----------
    zone
        A zone of the contact.
    contact
        `Contact`, which is the same afterwards.
    """
    motions, comm = zone.motions, contact.layout.comm
    was, now = motions.old, motions.present()
    hits = int(np.count_nonzero(zone.points()["status"] >= OPEN))
    if comm.allreduce(hits) or not comm.allreduce(int(_is_far(zone, now - was))):
        return False
    try:
        begin = _depths(zone, was, comm)
        # No more points deep inside than at the start, and none deeper by a step
        most = begin + np.array([0.0, 1.0])
        return any(
            bool(np.any(_depths(zone, was + share * (now - was), comm) > most))
            for share in SHARES
        )
    finally:
        contact.update()


def _is_far(zone: ZoneData, way: Array) -> bool:
    """Whether tools may have gone into this rank's slave facets and out again. After a
    shorter way rays still find them."""
    depth = zone.distance("depth").min(initial=np.inf)
    shifts, others = np.linalg.norm(way[:, :3], axis=1), way[:, 3:]
    return bool(np.any(others)) or bool(np.any(shifts > depth))


def _depths(zone: ZoneData, motion: Array, comm: MPI.Comm) -> Array:
    """Number of points deep inside tools at a pose, and the largest depth of the
    others, in units of `DEEPER` times the depth that counts as contact."""
    zone.motions.show(zone.cpp, motion)
    zone.cpp.pair()
    points = zone.points()
    hit = points["status"] >= OPEN
    step = DEEPER * zone.distance("depth")[points["slave"][hit]]
    depth = -points["gap"][hit] / step
    mine = np.array([len(zone.cpp.sunk_points()), depth.max(initial=0.0)])
    most = np.empty_like(mine)
    comm.Allreduce(mine, most, op=MPI.MAX)
    return most

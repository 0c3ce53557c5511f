"""Corners between slave surfaces of a contact, whose faces share a multiplier."""

from __future__ import annotations

import numpy as np

from ..contact import Contact
from ..discretization.ranks import marked_everywhere
from ..errors import format_point
from ..interface.point_results import CLOSED
from ..interface.slave_nodes import corners_between


def corner_between(one: Contact, pressed: int) -> str | None:
    """Tell of a corner between slave surfaces of which so many, at least, press there.
    Collective."""
    zones = one.zones
    if one.multiplier is None or one.tied is not None or len(zones) == 1:
        return None
    W, comm, press = one.multiplier.function_space, one.layout.comm, []
    for zone in zones:
        points = zone.points()
        facets = np.unique(points["slave"][points["status"] >= CLOSED])
        press.append(marked_everywhere(W, zone.multiplier_table[facets].ravel()))
    enough = np.sum(press, axis=0) >= pressed
    if not comm.allreduce(int(enough.any())):
        return None
    at = np.flatnonzero(enough & corners_between(zones, W))
    meet = [np.isin(at, zone.multiplier_nodes).tolist() for zone in zones]
    X = W.tabulate_dof_coordinates()[at, : W.mesh.geometry.dim].tolist()
    # A rank may know a corner by some of its faces alone
    found = sorted(sum(comm.allgather(list(zip(X, zip(*meet)))), []))
    if not found:
        return None
    place = found[0][0]
    faces = np.any([meets for x, meets in found if x == place], axis=0)
    named = " and ".join(zone.facets.spoken for zone, on in zip(zones, faces) if on)
    return f"{named} share a corner at {format_point(place, [x for x, _ in found])}"


"""Corners at which two slave surfaces of a contact press: they share a multiplier."""

from __future__ import annotations

import numpy as np

from ..contact import Contact
from ..discretization.ranks import marked_everywhere
from ..errors import format_point
from ..interface.point_results import CLOSED
from ..interface.slave_nodes import corners_between


def corner_pressed_twice(one: Contact) -> str | None:
    """Tell of a corner whose faces both press, and have one multiplier. Collective."""
    zones = one.zones
    if one.multiplier is None or one.tied is not None or len(zones) == 1:
        return None
    W, comm, pressed = one.multiplier.function_space, one.layout.comm, []
    for zone in zones:
        points = zone.points()
        facets = np.unique(points["slave"][points["status"] >= CLOSED])
        pressed.append(marked_everywhere(W, zone.multiplier_table[facets].ravel()))
    sharp = np.sum(pressed, axis=0) > 1
    if not comm.allreduce(int(sharp.any())):
        return None
    found = np.flatnonzero(sharp & corners_between(zones, W))
    X = W.tabulate_dof_coordinates()[:, : W.mesh.geometry.dim]
    mine = [(tuple(X[i]), [bool(on[i]) for on in pressed]) for i in found]
    places = sorted(sum(comm.allgather(mine), []))
    if not places:
        return None
    place, which = places[0]
    names = [zone.facets.spoken for zone, on in zip(zones, which) if on]
    return (
        f"{' and '.join(names)} both press at the corner that they share, for example at "
        f"the undeformed {format_point(place, [x for x, _ in places])}, where one "
        "multiplier is not the traction on two faces: forces are off by up to a few "
        "percent. Give each slave surface a Contact of its own"
    )

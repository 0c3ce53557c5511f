"""Warnings about points that a converged solve leaves deep inside the master."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

from mpi4py import MPI

import numpy as np

from ..errors import ContactWarning
from ..options.methods import AugmentedLagrangian

if TYPE_CHECKING:
    from ..interaction import Interaction
    from ..interface.zones import ZoneData

# Of a slave facet's size. Multipliers close gaps in the mean: what is left at a point is
# a few hundredths where facets resolve the surfaces
ALLOWED = 0.25


def _deepest(zone: ZoneData) -> tuple[float, str]:
    """Largest penetration of a pressed point over its facet's size, and a sentence."""
    points = zone.points()
    surface = zone.facets.slave_surface
    pressed = np.flatnonzero((points["pressure"] < 0.0) & (points["gap"] < 0.0))
    if not len(pressed):
        return 0.0, ""
    nodes = surface.X[surface.facet_nodes[points["slave"][pressed]]]
    share = -points["gap"][pressed] / np.linalg.norm(np.ptp(nodes, axis=1), axis=1)
    worst = int(np.argmax(share))
    q = pressed[worst]
    place = ", ".join(f"{x:.6g}" for x in points["x"][q])
    text = (
        f"converged with a point of slave tag {zone.facets.slave_tag} "
        f"{-points['gap'][q]:.3e} deep in the master, {share[worst]:.2g} of its facet, at "
        f"({place}): the facets do not resolve what touches there (a face beside a sharp "
        "corner, a step): refine it, or leave it out of the slave's tag"
    )
    return float(share[worst]), text


def _sunk(zone: ZoneData) -> tuple[float, str]:
    """Depth of the deepest point that is too deep for contact, and a sentence."""
    sunk = zone.cpp.sunk_points()
    if not len(sunk):
        return 0.0, ""
    points = zone.points()
    q = sunk[np.argmin(points["gap"][sunk])]
    place = ", ".join(f"{x:.6g}" for x in points["x"][q])
    text = (
        f"converged with a point of slave tag {zone.facets.slave_tag} "
        f"{-points['gap'][q]:.3e} deep in the master, at ({place}), where it is not "
        "seen: take smaller steps, or a larger depth in Search"
    )
    return float(-points["gap"][q]), text


def warn_of_penetration(contact: Interaction) -> None:
    """Warn on every rank of the deepest points. Collective.

    One warning is about points that are too deep for contact, the other about pressed
    points that the multiplier leaves inside the master.
    """
    comm = contact.layout.comm
    depth, text = max(map(_sunk, contact.zones))
    depth, rank = comm.allreduce((depth, comm.rank), op=MPI.MAXLOC)
    if depth > 0.0:
        warnings.warn(comm.bcast(text, root=rank), ContactWarning, stacklevel=4)
    zones = [
        zone
        for one in contact.contacts
        if isinstance(one.method, AugmentedLagrangian)
        for zone in one.zones
    ]
    if not zones:
        return
    share, text = max(map(_deepest, zones))
    share, rank = comm.allreduce((share, comm.rank), op=MPI.MAXLOC)
    if share > ALLOWED:
        warnings.warn(comm.bcast(text, root=rank), ContactWarning, stacklevel=4)

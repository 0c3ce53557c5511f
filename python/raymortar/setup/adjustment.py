"""Surfaces that should touch, and whose meshes leave small gaps or overlaps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.compat import Array
from ..core.contact import Contact
from ..core.discretization.facets import shape_functions
from ..core.discretization.ranks import largest
from ..core.errors import ContactError, positive, require_agreement, together
from ..core.interface.zone_data import ZoneData


@dataclass(frozen=True)
class Adjustment:
    """Changes that `Contact.adjust` has made, on all ranks.

    Attributes
    ----------
    facets
        Slave facets that have been adjusted.
    largest
        Largest change of a gap at their nodes. Length.
    """

    facets: int
    largest: float


def adjust(contact: Contact, within: float) -> Adjustment:
    """Make near surfaces just touch; see `Contact.adjust`. Collective."""
    comm, zones = contact.surfaces.comm, contact.zones
    with together(comm):
        if np.any(contact.surfaces.u.x.array):
            raise ContactError(
                "adjust is for the undeformed start, and the displacement is not zero: "
                "call it before the first step"
            )
        positive("within", within)
    require_agreement(comm, within=within)
    contact.update()
    changes = [adjustment(zone, float(within)) for zone in zones]
    for zone, change in zip(zones, changes):
        known = zone.adjustment
        zone.adjustment = change if known is None else known + change
    for zone in zones:
        zone.send_offset()
    contact.assembly.present.note_change()
    facets = sum(int(change.any(axis=1).sum()) for change in changes)
    most = max(float(np.abs(change).max(initial=0.0)) for change in changes)
    return Adjustment(comm.allreduce(facets), largest(comm, most))


def adjustment(zone: ZoneData, within: float) -> Array:
    """Change of a zone's offset with which near surfaces just touch, (facets, nodes).

    On each facet with points whose gap is at most `within`, a polynomial of the
    displacement's degree is fitted to minus the gap, and raised until no point
    overlaps. So the start is free of stress. Between points a clearance is left: the
    part of the gap that such a polynomial cannot represent.
    """
    surface, points = zone.facets.slave_surface, zone.points()
    slave, gap = points["slave"], zone.gap_without_offset(points)
    N, _ = shape_functions(surface.shape, surface.displacement_degree, points["xi"])
    near = np.flatnonzero((points["status"] > 0) & (np.abs(gap) <= within))
    change = np.zeros((len(surface.facet_dofs), N.shape[1]))
    # Points come in the order of their slave facets
    facets, first = np.unique(slave[near], return_index=True)
    for facet, at in zip(facets, np.split(near, first[1:])):
        # Fit the deviation from the mean: where points do not determine all nodes, the
        # others get the mean
        mean = -gap[at].mean()
        fit, *_ = np.linalg.lstsq(N[at], -gap[at] - mean, rcond=1e-8)
        above = float(np.max(-gap[at] - N[at] @ (mean + fit)))
        change[facet] = mean + fit + max(0.0, above)
    return change

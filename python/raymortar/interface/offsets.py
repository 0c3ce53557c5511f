"""Lengths that are added to the gaps of a contact: clearances, interferences,
adjustments that make surfaces touch which their meshes hold apart."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from mpi4py import MPI

import numpy as np

from ..checked import is_real_number
from ..compat import Array
from ..errors import ContactError, ContactWarning, require_agreement, together
from ..host.reference_facets import shape_functions
from ..host.slave_fields import OFFSET, FieldValue, check_field, on_facets
from .contact_surfaces import ContactSurfaces
from .overlap import excess_of_interference, gap_without_offset
from .zone_data import ZoneData


@dataclass(frozen=True)
class Adjustment:
    """What `Contact.adjust` has changed, on all ranks.

    Attributes
    ----------
    facets
        Slave facets that have been adjusted.
    largest
        Largest change of a gap at their nodes. Length.
    """

    facets: int
    largest: float


def require_start(u: Array, within: Any) -> None:
    """Raise unless surfaces can be adjusted: at the start, by a positive length."""
    if np.any(u):
        raise ContactError(
            "adjust is for the undeformed start, and the displacement is not "
            "zero: call it before the first step"
        )
    if not (is_real_number(within) and np.isfinite(within) and within > 0.0):
        raise ContactError(f"within = {within!r} must be a positive number")


def adjustment(zone: ZoneData, within: float) -> Array:
    """Change of a zone's offset with which near surfaces just touch.

    On each facet with points whose gap is at most `within`, a polynomial of the
    displacement's degree is fitted to minus the gap, and raised until no point
    overlaps. So the start is free of stress. Between points a clearance is left: the
    part of the gap that such a polynomial cannot represent.

    Parameters
    ----------
    zone
        Paired at the state that is to be free of stress.
    within
        Gaps and overlaps up to this are closed. Length.

    Returns
    -------
    Nodal values, (slave facets, nodes per facet). Length.
    """
    surface = zone.facets.slave_surface
    points = zone.points()
    slave = points["slave"]
    shape, degree = surface.shape, surface.displacement_degree
    N, _ = shape_functions(shape, degree, points["xi"])
    gap = gap_without_offset(zone, points)
    near = np.flatnonzero((points["status"] > 0) & (np.abs(gap) <= within))
    change = np.zeros((len(surface.facet_dofs), N.shape[1]))
    # Points come in the order of their slave facets
    facets, first = np.unique(slave[near], return_index=True)
    for facet, at in zip(facets, np.split(near, first[1:])):
        change[facet] = _touching(N[at], gap[at])
    return change


def _touching(N: Array, gap: Array) -> Array:
    """Nodal values whose polynomial lies closest above minus the gap."""
    mean = -gap.mean()
    # Fit the deviation from the mean: where points do not determine all nodes, the
    # others get the mean
    fit, *_ = np.linalg.lstsq(N, -gap - mean, rcond=1e-8)
    nodal = mean + fit
    return np.asarray(nodal + max(0.0, float(np.max(-gap - N @ nodal))))


def summed(comm: MPI.Comm, changes: Sequence[Array]) -> Adjustment:
    """Counts of nodal changes over all zones and ranks. Collective."""
    facets = sum(int(np.count_nonzero(change.any(axis=1))) for change in changes)
    largest = max(float(np.abs(change).max(initial=0.0)) for change in changes)
    return Adjustment(
        comm.allreduce(facets), float(comm.allreduce(largest, op=MPI.MAX))
    )


class Offsets:
    """Sets offset and adjustments of the zones of a contact. Collective.

    Attributes
    ----------
    value
        The offset as it was given; None: nothing.
    excess
        A message on an interference for which no body is thick enough; else None.
    """

    def __init__(self, surfaces: ContactSurfaces) -> None:
        self._surfaces = surfaces
        self.value: FieldValue | None = None
        self.excess: str | None = None

    def set(self, offset: FieldValue) -> None:
        """Set what is added to the gap; see `Contact.set_offset`."""
        zones, comm = self._surfaces.zones, self._surfaces.comm
        with together(comm):
            check_field(OFFSET, offset, self._surfaces.slave_u.function_space.mesh)
        require_agreement(comm, offset=offset)
        nodal = [on_facets(OFFSET, offset, zone.facets, comm) for zone in zones]
        for zone, values in zip(zones, nodal):
            zone.offset = values
        self.value = offset
        before, self.excess = self.excess, excess_of_interference(self._surfaces)
        if self.excess is not None and before is None:
            warnings.warn(self.excess, ContactWarning, stacklevel=3)
        self._send()

    def require_start(self, within: Any) -> None:
        """Raise unless surfaces can be adjusted by a length. Collective."""
        with together(self._surfaces.comm):
            require_start(self._surfaces.u.x.array, within)
        require_agreement(self._surfaces.comm, within=within)

    def adjust(self, within: float) -> Adjustment:
        """Make near surfaces just touch, after an update; see `Contact.adjust`."""
        zones, comm = self._surfaces.zones, self._surfaces.comm
        changes = [adjustment(zone, float(within)) for zone in zones]
        for zone, change in zip(zones, changes):
            known = zone.adjustment
            zone.adjustment = change if known is None else known + change
        self._send()
        return summed(comm, changes)

    def _send(self) -> None:
        """Send offsets and adjustments to the zones."""
        for zone in self._surfaces.zones:
            offset = zone.whole_offset
            if offset is not None:
                zone.cpp.set_offset(offset)

"""Interferences that are larger than the bodies, such as an offset in a wrong unit."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

from mpi4py import MPI

import numpy as np

from ..errors import ContactWarning
from ..host.joined import parts_of
from ..host.thickness import Cells, thickness_behind
from .contact_surfaces import ContactSurfaces
from .zone_data import ZoneData

# Thickness is measured up to this multiple of what is asked for: a growing interference
# then needs few measurements
FURTHER = 4.0
# Share of an interference that counts as rounding error
_ROUNDING = 1e-6


class Behind:
    """Thickness of the body behind the thinner side of a zone, as far as it is
    measured.

    Parameters
    ----------
    zone
        Of a contact. Collective.
    meshes
        Meshes of its sides, by part.
    comm
        Communicator of the meshes.
    """

    def __init__(self, zone: ZoneData, meshes: Sequence[Any], comm: MPI.Comm) -> None:
        self._zone, self._meshes, self._comm = zone, meshes, comm
        self._known = self._limit = self._thinner(zone.thickness)

    def _thinner(self, thickness: Any) -> float:
        """The smaller one of the two sides' largest thicknesses. Collective."""
        # A rigid tool has no thickness that counts
        sides = thickness[:1] if self._zone.facets.bodies else thickness
        most = np.array([side.max(initial=0.0) for side in sides])
        self._comm.Allreduce(MPI.IN_PLACE, most, op=MPI.MAX)
        return float(most.min())

    def up_to(self, length: float) -> float:
        """The thickness if it is below a length, else a larger number. Collective."""
        if self._known >= length or self._known < self._limit:
            return self._known
        facets, limit = self._zone.facets, FURTHER * length
        sides = (
            (facets.slave_part, facets.slave),
            (facets.master_part, facets.master),
        )
        measured = [
            thickness_behind(Cells(self._meshes[part]), side, limit)
            for part, side in sides
        ]
        self._known, self._limit = self._thinner(measured), limit
        return self._known


def excess(zone: ZoneData, behind: Behind, comm: MPI.Comm) -> str | None:
    """A message on an interference for which no body is thick enough; None if it fits.
    Collective."""
    mine = 0.0 if zone.offset is None else float((-zone.offset).max(initial=0.0))
    overlap = float(comm.allreduce(mine, op=MPI.MAX))
    if overlap == 0.0:
        return None
    there = behind.up_to(overlap)
    if overlap <= there * (1.0 + _ROUNDING):
        return None
    return (
        f"the argument offset makes an interference of {overlap:.4g} on slave tag "
        f"{zone.facets.slave_tag}, more than the {there:.4g} of body that lies behind "
        "the thinner side: it is a length in the unit of the mesh, negative where "
        "bodies overlap"
    )


class Interferences:
    """Compares the offset of a contact with the thickness of its bodies.

    Parameters
    ----------
    surfaces
        Of the contact.

    Attributes
    ----------
    excess
        A message on the present offset if it is too large, else None.
    """

    def __init__(self, surfaces: ContactSurfaces) -> None:
        self._surfaces = surfaces
        self._behind: list[Behind] | None = None
        self.excess: str | None = None

    def look(self) -> None:
        """Look at the present offset. Warn if it is too large and the last one was not.
        Collective."""
        zones, comm = self._surfaces.zones, self._surfaces.comm
        if self._behind is None:
            parts = parts_of(self._surfaces.u)
            meshes = [part.function_space.mesh for part in parts]
            self._behind = [Behind(zone, meshes, comm) for zone in zones]
        found = [excess(zone, b, comm) for zone, b in zip(zones, self._behind)]
        text = "; ".join(filter(None, found)) or None
        if text is not None and self.excess is None:
            warnings.warn(text, ContactWarning, stacklevel=4)
        self.excess = text

"""Interferences that are larger than the bodies: an offset in another unit, say."""

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
from .zones import ZoneData

# Bodies are measured this much further than is asked for, so that an interference that
# grows asks seldom
FURTHER = 4.0
# Of an interference: what lies behind is as much
_ROUNDING = 1e-6


class Behind:
    """How much body lies behind the thinner side of a zone, as far as it is known.

    Parameters
    ----------
    zone
        Of a contact. Collective.
    meshes
        Those that its sides are on, by part.
    comm
        Communicator of the meshes.
    """

    def __init__(self, zone: ZoneData, meshes: Sequence[Any], comm: MPI.Comm) -> None:
        self._zone, self._meshes, self._comm = zone, meshes, comm
        self._known = self._limit = self._thinner(zone.thickness)

    def _thinner(self, thickness: Any) -> float:
        """The lesser of both sides' largest thickness. Collective."""
        # Behind a rigid tool there is as much as it takes
        sides = thickness[:1] if self._zone.facets.bodies else thickness
        most = np.array([side.max(initial=0.0) for side in sides])
        self._comm.Allreduce(MPI.IN_PLACE, most, op=MPI.MAX)
        return float(most.min())

    def up_to(self, length: float) -> float:
        """The thickness, where it is less than a length, else more. Collective."""
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
    """What to say of an interference that no body is thick enough for. Collective."""
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
    """Watches whether the offset of a contact is more than its bodies are thick.

    Parameters
    ----------
    surfaces
        Of the contact.

    Attributes
    ----------
    excess
        What to say of the offset that is set, if it is too much; else None.
    """

    def __init__(self, surfaces: ContactSurfaces) -> None:
        self._surfaces = surfaces
        self._behind: list[Behind] | None = None
        self.excess: str | None = None

    def look(self) -> None:
        """Look at an offset that has been set, and warn of it if it is too much and
        was not before. Collective."""
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

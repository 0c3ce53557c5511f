"""Points, segments and resultants of one contact or several."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from ..checked import is_whole_number
from ..compat import Array
from ..errors import ContactError, ContactWarning, as_path, together
from ..host.joined import parts_of
from ..interface.pairs import PairTable
from ..interface.point_places import places
from ..interface.point_results import (
    Resultant,
    added,
    resultant,
    resultant_on,
    resultants,
)
from ..interface.present import PresentState
from ..interface.zone_data import ZoneData
from ..rigid.body import Body
from .segments import write_segments


class PointResults:
    """Results at the integration points of all zones, and their sums.

    `Contact` documents its methods.

    Parameters
    ----------
    zones
        Of all contacts, one after the other.
    pairs
        Of all contacts.
    presents
        Present state of each contact.
    u
        Displacement.
    comm
        Communicator of the mesh.
    """

    def __init__(
        self,
        zones: Sequence[ZoneData],
        pairs: PairTable,
        presents: Sequence[PresentState],
        u: Function,
        comm: MPI.Comm,
    ) -> None:
        self.zones, self.pairs = list(zones), pairs
        self._presents, self._u, self._comm = presents, u, comm
        self._says_unsolved = True

    def points(self, zone: int) -> dict[str, Array]:
        """Arrays over this rank's integration points of a zone."""
        data = self._zone(zone)
        points: dict[str, Any] = data.points()
        # What comes after the last stands for no master
        number = np.array([*self._pairs_of(zone), -1], dtype=np.int32)
        points["pair"] = number[data.masters_of(points)]
        mesh = parts_of(self._u)[data.facets.slave_part].function_space.mesh
        return points | places(data, points, mesh)

    def _pairs_of(self, zone: int) -> list[int]:
        """Number of the pair that each master of a slave surface makes with it."""
        surface = range(len(self.zones))[zone]
        masters = self.zones[surface].facets.master_tags
        return self.pairs.of_surface(surface, masters)

    def _zone(self, i: int) -> ZoneData:
        """Zone of a number, with results."""
        self._require_results()
        n = len(self.zones)
        if not (is_whole_number(i) and -n <= i < n):
            raise self.pairs.no_surface(i)
        return self.zones[i]

    def _require_results(self) -> None:
        for present in self._presents:
            present.require_results()

    def warn_if_unsolved(self) -> None:
        """Say once that forces are those of a start which nothing was solved from."""
        unsolved = all(p.updates == p.updates_for_room for p in self._presents)
        if unsolved and self._says_unsolved:
            self._says_unsolved = False
            warnings.warn(
                "nothing has been solved yet: contact forces are those of the start, "
                "zero but for a penalty's in overlaps",
                ContactWarning,
                stacklevel=4,
            )

    def write_segments(self, path: str | Path) -> None:
        """Segments and points as VTK files. Collective."""
        with together(self._comm):
            self._require_results()
            file = as_path(path)
        write_segments(self.zones, self._u, self._comm, file)

    def resultant(self, slave: int | str, master: int | str | Body | None) -> Resultant:
        """Contact force on a slave surface, or of a pair. Collective."""
        if master is None and not isinstance(slave, str):
            with together(self._comm):
                zone = self._zone(slave)
                return resultant(zone, self._comm)
        with together(self._comm):
            self._require_results()
            found = self.pairs.find(slave, master)
        if master is None:
            surfaces = dict.fromkeys(self.pairs.pairs[k].surface for k in found)
            return added([resultant(self.zones[i], self._comm) for i in surfaces])
        of_pairs = self.resultants()
        return added([of_pairs[k] for k in found])

    def resultants(self) -> list[Resultant]:
        """`resultant` of every pair. Collective."""
        with together(self._comm):
            self._require_results()
        found: dict[int, Resultant] = {}
        for i, zone in enumerate(self.zones):
            found |= zip(self._pairs_of(i), resultants(zone, self._comm))
        return [found[k] for k in range(len(self.pairs.pairs))]

    def resultant_on(self, body: Body) -> Resultant:
        """Contact force on a rigid body. Collective."""
        with together(self._comm):
            self._require_results()
            if not any(body in zone.facets.bodies for zone in self.zones):
                raise ContactError(f"{body!r} is the master of no pair")
        return resultant_on(self.zones, body, self._comm)

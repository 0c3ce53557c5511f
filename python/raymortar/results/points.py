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
from ..interface.point_results import places
from ..interface.present import PresentState
from ..interface.zone_data import ZoneData
from ..rigid.body import Body
from .segments import write_segments
from .sums import Resultant, added, resultant, resultant_on


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
        self._require_results()
        surface = self._surface(zone)
        data = self.zones[surface]
        points: dict[str, Any] = data.points()
        numbers = self.pairs.of_surface(surface, data.facets.master_tags)
        # The last one is for points that hit no master
        points["pair"] = np.array([*numbers, -1], np.int32)[data.masters_of(points)]
        mesh = parts_of(self._u)[data.facets.slave_part].function_space.mesh
        return points | places(data, points, mesh)

    def _surface(self, i: Any) -> int:
        """Check the number of a slave surface; a negative one counts from the end."""
        n = len(self.zones)
        if not (is_whole_number(i) and -n <= i < n):
            raise self.pairs.no_surface(i)
        return int(i) % n

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
        with together(self._comm):
            self._require_results()
            if master is None and not isinstance(slave, str):
                surfaces = [self._surface(slave)]
            else:
                found = self.pairs.find(slave, master)
                surfaces = sorted({self.pairs.pairs[k].surface for k in found})
        if master is None:
            return added([resultant(self.zones[i], self._comm) for i in surfaces])
        return added([self.of_pair(k) for k in found])

    def of_pair(self, k: int) -> Resultant:
        """Sum up the forces of the pair with a number. Collective."""
        pair = self.pairs.pairs[k]
        zone = self.zones[pair.surface]
        master = zone.facets.master_tags.index(pair.master)
        return resultant(zone, self._comm, master)

    def resultants(self) -> list[Resultant]:
        """`resultant` of every pair. Collective."""
        with together(self._comm):
            self._require_results()
        return [self.of_pair(k) for k in range(len(self.pairs.pairs))]

    def resultant_on(self, body: Body) -> Resultant:
        """Contact force on a rigid body. Collective."""
        with together(self._comm):
            self._require_results()
            if not any(body in zone.facets.bodies for zone in self.zones):
                raise ContactError(f"{body!r} is the master of no pair")
        return resultant_on(self.zones, body, self._comm)

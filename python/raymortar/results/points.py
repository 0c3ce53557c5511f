"""Results of contacts: arrays at points, forces, segments."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from ..compat import Array
from ..discretization.joined import parts_of
from ..errors import ContactError, ContactWarning, as_path, is_whole_number, together
from ..interface import point_results as at_points
from ..interface.pairs import PairTable, as_label
from ..interface.present import PresentState
from ..interface.zone_data import ZoneData
from ..rigid.body import Body
from .meetings import Meeting, chosen_parts, meetings, names_of
from .segments import write_segments
from .sums import Resultant, added, mutual, resultant, resultant_on


class PointResults:
    """Results at the integration points of all zones, and their sums.

    Zones and pairs are those of all contacts, one after the other. `Contact` documents
    the methods.
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

    def points(
        self, slave: int | str, master: int | str | Body | None = None
    ) -> dict[str, Array]:
        """Arrays over this rank's integration points of a slave surface, or of a pair."""
        self._require_results()
        if master is None and not isinstance(slave, str):
            return self._points_of(self._surface(slave))
        surface, parts, pairs = self._one_surface(slave, master)
        points = self._points_of(surface)
        if parts:
            mine, theirs = parts
            own, met = self.zones[surface].parts_of(points)
            chosen = np.isin(own, mine)
            if theirs is not None:
                chosen &= np.isin(met, theirs)
        elif master is None:
            return points
        else:
            chosen = np.isin(points["pair"], pairs)
        return {name: values[chosen] for name, values in points.items()}

    def _one_surface(
        self, slave: Any, master: Any
    ) -> tuple[int, tuple[list[int], list[int] | None] | None, list[int]]:
        """Find the slave surface of a name or a pair, its parts, and numbers of pairs."""
        chosen = chosen_parts(self.zones, self.pairs, slave, master)
        pairs = [] if chosen else self.pairs.find(slave, master)
        of = [i for i, *_ in chosen] or [self.pairs.pairs[k].surface for k in pairs]
        if len(set(of)) > 1:
            asked = repr(slave) if master is None else f"({slave!r}, {master!r})"
            raise ContactError(
                f"{asked} is of several slave surfaces, {', '.join(map(str, of))}: ask "
                "for points of one by its number"
            )
        return of[0], (chosen[0][1:] if chosen else None), pairs

    def _points_of(self, surface: int) -> dict[str, Array]:
        """Arrays over this rank's integration points of a slave surface."""
        data = self.zones[surface]
        points: dict[str, Any] = data.points()
        numbers = self.pairs.of_surface(surface, data.facets.master_tags)
        # The last one is for points that hit no master
        points["pair"] = np.array([*numbers, -1], np.int32)[data.masters_of(points)]
        mesh = parts_of(self._u)[data.facets.slave_part].function_space.mesh
        return points | at_points.places(data, points, mesh)

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
        """Warn once that nothing has been solved yet."""
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
            parts = chosen_parts(self.zones, self.pairs, slave, master)
            if parts:
                pass
            elif master is None and not isinstance(slave, str):
                surfaces = [self._surface(slave)]
            else:
                found = self.pairs.find(slave, master)
                surfaces = sorted({self.pairs.pairs[k].surface for k in found})
        if parts:
            return added([mutual(self.zones[i], *of) for i, *of in parts])
        if master is None:
            return added([resultant(self.zones[i]) for i in surfaces])
        return added([self.of_pair(k) for k in found])

    def of_pair(self, k: int) -> Resultant:
        """Sum up the forces of the pair with a number. Collective."""
        pair = self.pairs.pairs[k]
        zone = self.zones[pair.surface]
        master = zone.facets.master_tags.index(pair.master)
        return resultant(zone, master)

    def resultants(self) -> list[Resultant]:
        """`resultant` of every pair. Collective."""
        self._require_results()
        return [self.of_pair(k) for k in range(len(self.pairs.pairs))]

    def parts(self) -> list[tuple[str, Callable[[], Resultant]]]:
        """Name the tags and bodies of all facets, with functions for the force on each."""
        found: list[tuple[str, Callable[[], Resultant]]] = []
        for i, zone in enumerate(self.zones):
            if isinstance(zone.facets.slave_tag, str) and zone.facets.meets_itself:
                found += [
                    (as_label(name), partial(self.resultant, name, None))
                    for name in names_of(self.zones, self.pairs, i)
                ]
        return found

    def meetings(self) -> list[Meeting]:
        """Surfaces that are in contact, by name. Collective."""
        self._require_results()
        return meetings(self.zones, self.pairs)

    def resultant_on(self, body: Body) -> Resultant:
        """Contact force on a rigid body. Collective."""
        with together(self._comm):
            self._require_results()
            if not any(body in zone.facets.bodies for zone in self.zones):
                raise ContactError(f"{body!r} is the master of no pair")
        return resultant_on(self.zones, body)

"""Results at points, and what has met."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.mesh import Mesh

from ..arguments import as_path
from ..core.compat import Array
from ..core.discretization.facets import interpolate, reference_corners
from ..core.discretization.joined import parts_of
from ..core.discretization.tagged import Part
from ..core.errors import ContactError, is_whole_number, together, warn
from ..core.interface.pairs import PairTable, as_label, names_by_tag
from ..core.interface.point_results import CLOSED, accumulated_slip, undeformed
from ..core.interface.zone_data import ZoneData
from ..core.target import Target
from .segments import write_segments
from .sums import (
    Resultant,
    Statistics,
    added,
    mutual,
    resultant,
    resultant_on,
    statistics,
)
from .tractions import seen_points


@dataclass(frozen=True)
class Meeting:
    """Two surfaces in contact.

    Attributes
    ----------
    one, other
        Their names: the user's, else the tag as text. A tag of several bodies has the
        number of the body added, ``skin_2``, and facets without a tag belong to
        ``body_0``, ``body_1``, ..., in the order of the middles of the bodies' boxes.
    points
        Integration points in contact, on both.
    area
        Area in contact, by `Contact`'s measure.
    resultant
        Force and moment on the first one. Zero where both are the same.
    """

    one: str
    other: str
    points: int
    area: float
    resultant: Resultant

    def __str__(self) -> str:
        force = ", ".join(f"{x:.4g}" for x in self.resultant.force)
        return f"{self.one} and {self.other}: {self.points} points, force ({force})"


def names_of(zones: Sequence[ZoneData], pairs: PairTable, i: int) -> list[str]:
    """Names of the parts of a slave surface, in their order."""
    known = names_by_tag(pairs.names_at(i))
    found = []
    for part in zones[i].facets.parts:
        name = "body" if part.tag is None else str(known.get(part.tag, part.tag))
        found.append(name if part.body is None else f"{name}_{part.body}")
    return found


def chosen_parts(
    zones: Sequence[ZoneData], pairs: PairTable, one: Any, other: Any
) -> list[tuple[int, list[int], list[int] | None]]:
    """Numbers of surfaces with the parts that two names or tags stand for.

    Surfaces that are a tag alone have no parts to choose from.
    """
    found: list[tuple[int, list[int], list[int] | None]] = []
    for i, zone in enumerate(zones):
        if not isinstance(zone.facets.slave_tag, str):
            continue
        names = names_of(zones, pairs, i)
        mine, theirs = (_matching(zone.facets.parts, names, of) for of in (one, other))
        if mine and other is None:
            found.append((i, mine, None))
        elif mine and theirs and zone.facets.meets_itself:
            found.append((i, mine, theirs))
    return found


def _matching(parts: Sequence[Part], names: Sequence[str], of: Any) -> list[int]:
    """Parts that a name stands for, or the name or number of their tag."""
    found = []
    for k, (part, name) in enumerate(zip(parts, names)):
        plain = name if part.body is None else name.rsplit("_", 1)[0]
        by_name = isinstance(of, str) and (of == name or of == plain != "body")
        by_tag = not isinstance(of, (str, type(None))) and of == part.tag
        if by_name or by_tag:
            found.append(k)
    return found


def meetings(zones: Sequence[ZoneData], pairs: PairTable) -> list[Meeting]:
    """Surfaces in contact, in the order of pairs and parts. Collective."""
    found = []
    for i, zone in enumerate(zones):
        points = zone.points()
        if zone.facets.meets_itself:
            names, (own, met) = names_of(zones, pairs, i), zone.parts_of(points)
            tables = _tables(zone, points, own, met, (len(names), len(names)))
            # Either may be the slave
            counts, areas = (np.triu(t) + np.tril(t, -1).T for t in tables)
            for a, b in zip(*np.nonzero(counts)):
                force = mutual(zone, [int(a)], [int(b)])
                found.append(_met(names[a], names[b], counts[a, b], areas[a, b], force))
            continue
        met, shape = zone.masters_of(points), (1, len(zone.facets.master_tags))
        count, area = _tables(zone, points, np.zeros_like(met), met, shape)
        for b in np.flatnonzero(count[0]):
            pair = pairs.pairs[pairs.of_surface(i, zone.facets.master_tags)[b]]
            one = str(pair.slave_name or pair.slave)
            other = str(pair.master_name or pair.master)
            force = resultant(zone, int(b))
            found.append(_met(one, other, count[0, b], area[0, b], force))
    return found


def _met(one: str, other: str, count: float, area: float, force: Resultant) -> Meeting:
    return Meeting(one, other, int(count), float(area), force)


def _tables(
    zone: ZoneData, points: Mapping[str, Array], own: Any, met: Any, shape: Any
) -> Array:
    """Points in contact and their area, by part and by what they hit. Collective."""
    tables, closed = np.zeros((2, *shape)), points["status"] >= CLOSED
    at = own[closed], met[closed]
    np.add.at(tables[0], at, 1.0)
    np.add.at(tables[1], at, points["weight"][closed])
    zone.comm.Allreduce(MPI.IN_PLACE, tables)
    return tables


class Results:
    """Results at the integration points of contacts, and their sums.

    Parameters
    ----------
    contact
        One, or several in one problem, whose zones are then numbered through.
    """

    def __init__(self, contact: Any) -> None:
        self._contact = contact
        self.zones: list[ZoneData] = contact.zones
        self.parts: tuple[Any, ...] = contact.parts
        self.pair_table: PairTable = contact.pair_table
        self._comm: MPI.Comm = contact.unknowns.comm
        self._says_unsolved = True

    def points(
        self, zone: int | str = 0, master: int | str | Target | None = None
    ) -> dict[str, Array]:
        """See `Contact.points`."""
        self._require_results()
        if master is None and not isinstance(zone, str):
            return self._points_of(self._surface(zone))
        surface, parts, pairs = self._one_surface(zone, master)
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
        chosen = chosen_parts(self.zones, self.pair_table, slave, master)
        pairs = [] if chosen else self.pair_table.find(slave, master)
        of = [i for i, *_ in chosen] or [
            self.pair_table.pairs[k].surface for k in pairs
        ]
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
        points: dict[str, Any] = seen_points(data)
        for own in ("dual", "dissipated", "elastic_energy"):
            points.pop(own, None)
        numbers = self.pair_table.of_surface(surface, data.facets.master_tags)
        # The last one is for points that hit no master
        points["pair"] = np.array([*numbers, -1], np.int32)[data.masters_of(points)]
        mesh = parts_of(self.parts[0].surfaces.u)[
            data.facets.slave_part
        ].function_space.mesh
        return points | places(data, points, mesh)

    def _surface(self, i: Any) -> int:
        """Check the number of a slave surface; a negative one counts from the end."""
        n = len(self.zones)
        if not (is_whole_number(i) and -n <= i < n):
            raise self.pair_table.no_surface(i)
        return int(i) % n

    def _require_results(self) -> None:
        for part in self.parts:
            part.present.require_results()

    def warn_if_unsolved(self) -> None:
        """Warn once that nothing has been solved yet."""
        presents = [part.present for part in self.parts]
        unsolved = all(one.updates == one.updates_for_room for one in presents)
        if unsolved and self._says_unsolved:
            self._says_unsolved = False
            warn(
                "nothing has been solved yet: contact forces are of the start, "
                "zero but for a penalty's in overlaps",
                page="use",
            )

    def write_segments(self, path: str | Path) -> None:
        """Segments and integration points as VTK files for ParaView. Collective.

        Writes ``<path>`` with one polygon (line in 2D) for each part of a slave facet
        that faces one master facet, in the deformed configuration, and
        ``<stem>_points.vtu`` with the integration points; in parallel, one piece of
        each per rank and a ``.pvtu`` file that joins them.

        Parameters
        ----------
        path
            File name that ends in ``.vtu``.
        """
        with together(self._comm):
            self._require_results()
            file = as_path(path)
        write_segments(self.zones, self.parts[0].surfaces.u, self._comm, file)

    def resultant(
        self, slave: int | str = 0, master: int | str | Target | None = None
    ) -> Resultant:
        """See `Contact.resultant`. Collective."""
        self.warn_if_unsolved()
        with together(self._comm):
            self._require_results()
            parts = chosen_parts(self.zones, self.pair_table, slave, master)
            if parts:
                pass
            elif master is None and not isinstance(slave, str):
                surfaces = [self._surface(slave)]
            else:
                found = self.pair_table.find(slave, master)
                surfaces = sorted({self.pair_table.pairs[k].surface for k in found})
        if parts:
            return added([mutual(self.zones[i], *of) for i, *of in parts])
        if master is None:
            return added([resultant(self.zones[i]) for i in surfaces])
        return added([self.of_pair(k) for k in found])

    def of_pair(self, k: int) -> Resultant:
        """Sum up the forces of the pair with a number. Collective."""
        pair = self.pair_table.pairs[k]
        zone = self.zones[pair.surface]
        master = zone.facets.master_tags.index(pair.master)
        return resultant(zone, master)

    def resultants(self) -> list[Resultant]:
        """`resultant` of every pair, in the order of `pairs`. Collective."""
        self.warn_if_unsolved()
        self._require_results()
        return [self.of_pair(k) for k in range(len(self.pair_table.pairs))]

    def parts_of_all(self) -> list[tuple[str, Callable[[], Resultant]]]:
        """Name the tags and bodies of all facets, with functions for the force on each."""
        found: list[tuple[str, Callable[[], Resultant]]] = []
        for i, zone in enumerate(self.zones):
            if isinstance(zone.facets.slave_tag, str) and zone.facets.meets_itself:
                found += [
                    (as_label(name), partial(self.resultant, name, None))
                    for name in names_of(self.zones, self.pair_table, i)
                ]
        return found

    def meetings(self) -> list[Meeting]:
        """Surfaces that are in contact at the last `update`, by name. Collective.

        For ``pairs="all"`` and a surface that meets itself, these are the tags and
        bodies that touch; for other pairs, those with closed points.
        """
        self._require_results()
        return meetings(self.zones, self.pair_table)

    def resultant_on(self, body: Target) -> Resultant:
        """Contact force on a rigid body, moment about its centre where that is, and
        parts of the force, from all slaves that it meets. Collective.

        The opposite of `resultant`, whose moments are about the origin.

        Raises
        ------
        ContactError
            If no slave meets it.
        """
        self.warn_if_unsolved()
        with together(self._comm):
            self._require_results()
            if not any(body in zone.facets.bodies for zone in self.zones):
                raise ContactError(f"{body!r} is the master of no pair")
        return resultant_on(self.zones, body)

    @property
    def statistics(self) -> Statistics:
        """Counts and seconds over all zones and ranks: see `Statistics`. Collective."""
        counts = statistics(self.zones, self._contact.layout)
        counts.preallocations = self._contact.system.preallocations
        return counts


def places(zone: ZoneData, points: dict[str, Array], mesh: Mesh) -> dict[str, Array]:
    """Name the facet, the cell and the places of points, as `Contact.points`."""
    facet, xi, facets = points["slave"], points["xi"], zone.facets.slave
    surface, corners = zone.facets.slave_surface, reference_corners(mesh, facets)
    found = {
        "X": undeformed(surface, facet, xi),
        "facet": facets.facets[facet],
        "cell": facets.cells[facet],
        "reference": interpolate(surface.shape, 1, corners[facet], xi),
    }
    if zone.slip is not None:
        found["accumulated_slip"] = accumulated_slip(zone, facet, xi)
    return found

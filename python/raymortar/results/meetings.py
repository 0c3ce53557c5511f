"""Surfaces that have found each other, and the forces between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mpi4py import MPI

import numpy as np

from ..compat import Array
from ..discretization.folded import Part
from ..interface.pairs import PairTable
from ..interface.point_results import CLOSED
from ..interface.zone_data import ZoneData
from .sums import Resultant, mutual, resultant


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


def part_name(part: Part, names: Mapping[str, Any]) -> str:
    """Name a part of a surface."""
    if part.tag is None:
        return f"body_{part.body}"
    known = {tag: name for name, tag in reversed(list(names.items()))}
    name = str(known.get(part.tag, part.tag))
    return name if part.body is None else f"{name}_{part.body}"


def names_of(zones: Sequence[ZoneData], pairs: PairTable, i: int) -> list[str]:
    """Names of the parts of a slave surface, in their order."""
    names = pairs.names_at(i)
    return [part_name(part, names) for part in zones[i].facets.parts]


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

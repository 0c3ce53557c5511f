"""Laws of contact, linearised where a linear step leads."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from petsc4py import PETSc

import numpy as np

from ..core.compat import Array, Indices, Mask
from ..core.interface.point_results import OPEN
from ..core.interface.zone_data import ZoneData
from .rows_of_nodes import RowsOfNodes

# Part of a step over which points are moved to find how gaps and slips change with it
SHARE = 1e-4

# Entries of rows, and the same rows of the residual
System = tuple[Array, Array]


@dataclass
class Zone:
    """A zone whose law gives rows of multipliers, and the number of its contact."""

    contact: int
    part: Any
    zone: ZoneData

    @property
    def rows(self) -> Indices:
        """Global rows of the nodes' multipliers, (nodes, components)."""
        first = self.part.layout.multiplier_rows[self.zone.multiplier_nodes]
        rows: Indices = first[:, None] + np.arange(self.part.layout.components)
        return rows


class LawAhead(ABC):
    """The law of some zones, which can be linearised at the end of a step. Collective.

    Attributes
    ----------
    zones
        Those of this rank.
    casts
        Whether `begin` casts rays again. The rows of the system then lack how segments
        move.
    """

    casts = False

    def __init__(self, problem: Any, zones: list[Zone]) -> None:
        self._problem, self.zones = problem, zones

    def statuses(self) -> bytes:
        """Statuses on this rank."""
        return b"".join(self._of(one)["status"].tobytes() for one in self.zones)

    @abstractmethod
    def _of(self, one: Zone) -> dict[str, Array]:
        """Fields of the nodes or points of a zone, by name."""

    @abstractmethod
    def begin(
        self, rows: RowsOfNodes, x: PETSc.Vec, system: Callable[[bool], System]
    ) -> None:
        """Note the present state, x. `system` gives entries and residuals of the rows,
        and leaves contact out of the residuals if it is given False."""

    @abstractmethod
    def linearise(self, step: Array, met: Array) -> bytes:
        """Linearise where a step leads; return the statuses on this rank. `met` has the
        step's values in the columns of the rows."""

    @abstractmethod
    def changed(self, differ: Mask) -> Mask:
        """Tell which rows of all ranks change with statuses. `differ` tells whose
        entries do, of this rank's."""

    @abstractmethod
    def end(self) -> None:
        """Linearise at the present state again."""


class NodesAhead(LawAhead):
    """Laws at nodes. They know integrals of gaps and slips, whose rows are exact."""

    def _of(self, one: Zone) -> dict[str, Array]:
        return one.zone.cpp.nodes()

    def begin(
        self, rows: RowsOfNodes, x: PETSc.Vec, system: Callable[[bool], System]
    ) -> None:
        for one in self.zones:
            one.zone.cpp.set_node_changes(np.empty(0), measures=True)
        entries, self._lifted = system(False)
        self.end()
        self._rows, self._measures = rows, rows.matrix(entries)
        self._places = [rows.places(one.rows) for one in self.zones]
        self._at_begin = self._by_row()

    def linearise(self, step: Array, met: Array) -> bytes:
        gaps = self._rows.joined(self._measures @ met + self._lifted)
        multipliers = self._rows.of_columns(met)
        for one, at in zip(self.zones, self._places):
            self._set(one, multipliers[at], gaps[at])
        return self.statuses()

    def _set(self, one: Zone, multipliers: Array, gaps: Array) -> None:
        """Linearise at a change of the multipliers, as unknowns, and of the integrals of
        gaps and slips, as rows, (nodes, components) each."""
        cpp, scale = self._problem.contact.system.cpp, one.part.gamma_scale
        areas = np.asarray(cpp.node_weights(one.contact)[0])
        areas = areas[one.zone.multiplier_nodes, None]
        means = gaps / scale / np.where(areas > 0.0, areas, 1.0)
        if means.shape[1] == 1:
            means = means * self._of(one)["normal"]
        values = np.hstack([scale * multipliers, means])
        one.zone.cpp.set_node_changes(values.ravel())

    def changed(self, differ: Mask) -> Mask:
        return np.asarray(self._by_row() != self._at_begin)

    def _by_row(self) -> Array:
        """Statuses of the nodes of all rows."""
        known, statuses = [], []
        for one in self.zones:
            known.append(one.rows.ravel())
            status = self._of(one)["status"]
            statuses.append(np.repeat(status, one.part.layout.components))
        return self._rows.spread(np.concatenate(known), np.concatenate(statuses))

    def end(self) -> None:
        for one in self.zones:
            one.zone.cpp.set_node_changes(np.empty(0))


class PointsAhead(LawAhead):
    """Laws at points with a multiplier. Rays that are cast a small part of a step ahead
    tell how gaps and slips change with it."""

    casts = True

    def _of(self, one: Zone) -> dict[str, Array]:
        return one.zone.cpp.points()

    def begin(
        self, rows: RowsOfNodes, x: PETSc.Vec, system: Callable[[bool], System]
    ) -> None:
        self._rows, self._x, self._begin = rows, x, x.array_r.copy()
        self._go(self._begin)
        self._here = [self._of(one) for one in self.zones]

    def linearise(self, step: Array, met: Array) -> bytes:
        self._go(self._begin + SHARE * step)
        there = [self._of(one) for one in self.zones]
        self._go(self._begin)
        for one, here, end in zip(self.zones, self._here, there):
            changes = _changes(here, end)
            one.zone.cpp.set_point_changes(changes.ravel())
            # Newton's step is right for those that keep their status
            changes[self._of(one)["status"] == here["status"]] = 0.0
            one.zone.cpp.set_point_changes(changes.ravel())
        return self.statuses()

    def _go(self, values: Array) -> None:
        """Cast rays where the unknowns have some values on this rank."""
        system = self._problem.contact.system
        self._x.array[:] = values
        system.cpp.set_unknowns(self._x.handle, system.scales, True)
        if not system.unknowns.is_plain:
            system.unknowns.pull()
        system.cpp.pair(True)

    def changed(self, differ: Mask) -> Mask:
        return np.asarray(self._rows.joined(differ), dtype=bool)

    def end(self) -> None:
        for one in self.zones:
            one.zone.cpp.set_point_changes(np.empty(0))


def _changes(here: dict[str, Array], end: dict[str, Array]) -> Array:
    """Changes by a whole step, from points where it begins and where they have gone
    `SHARE` of it: of the multiplier, and of the gap along the normal less the slip
    across it, (points, 2 d)."""
    n = here["contact_normal"]
    traction = end["traction"] - here["traction"]
    way = (end["gap"] - here["gap"])[:, None] * n
    if "slip" in here:
        slip = end["slip"] - here["slip"]
        way -= slip - np.einsum("qi,qi->q", slip, n)[:, None] * n
    changes = np.hstack([traction, way]) / SHARE
    changes[(here["status"] < OPEN) | (end["status"] < OPEN)] = 0.0
    return changes


def laws_ahead(problem: Any) -> NodesAhead | PointsAhead | None:
    """The law of the contacts with a multiplier; None if some hold at nodes and others
    at points, or if constraints combine unknowns. A user's friction at points is left
    out: its bounds are known at points that are closed now."""
    at_nodes: list[Zone] = []
    at_points: list[Zone] = []
    for k, (one, part) in enumerate(
        zip(problem.contact.contacts, problem.contact.parts)
    ):
        if one.multiplier is None or part.surfaces.tied is not None:
            continue
        sends_bounds = one.friction is not None and one.friction.sends_bounds
        for zone in one.zones:
            if zone.has_law_at_nodes:
                at_nodes.append(Zone(k, part, zone))
            elif not sends_bounds:
                at_points.append(Zone(k, part, zone))
    if problem.constraints is not None or (at_nodes and at_points):
        return None
    if at_nodes:
        return NodesAhead(problem, at_nodes)
    return PointsAhead(problem, at_points) if at_points else None

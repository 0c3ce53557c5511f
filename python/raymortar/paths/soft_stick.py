"""Soft stick: slip fronts that move through many facets in an iteration."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from ..compat import Array
from ..discretization.surfaces import surface_areas
from ..interface.point_results import PointStatus
from ..interface.zone_data import ZoneData
from ..options.friction import Stick

# Factor on the share of slip from one tangent to the next
HARDENS = 0.5

# Facets that a traction has to reach over, more than the next one
LEAST_REACH = 2.0


class SoftStick:
    """Tangents between those of stick and of slip at nodes that stick. Collective.

    With stick as it is the excess of friction at a slip front is a force on one node,
    and the front moves by one facet in each iteration. With a share of the tangent of
    slip it spreads along the surface, and the front moves as far as it reaches [theory
    (5.17)]. The share is 1, 1/2, 1/4 in a solve's first tangents, as long as it reaches
    beyond the next facet and nodes change between open, stick and slip.

    It acts on laws at nodes alone, whose gamma is as soft as the surface. Where bodies
    do not bend, a traction reaches no further than a facet, and nothing is softened.
    """

    def __init__(self, problem: Any) -> None:
        self._problem = problem
        contacts = problem.contact.contacts
        self._zones = [
            (part, zone, _areas(zone))
            for one, part in zip(contacts, problem.contact.parts)
            if one.friction is not None
            and not isinstance(one.friction, Stick)
            and getattr(one.method, "condition", "points") == "nodes"
            for zone in one.zones
        ]
        stiffness = {part.number: part.stiffness() for part, _, _ in self._zones}
        self._stiffness = {number: k for number, k in stiffness.items() if k}
        self._count, self._last = 0, np.empty(0)

    @contextmanager
    def acting(self) -> Iterator[None]:
        """Soften the first tangents of the solve within."""
        problem, self._count = self._problem, 0
        problem.soften = self._add if self._softened() else None
        try:
            yield
        finally:
            problem.soften = None

    def _softened(self) -> list[tuple[Any, ZoneData, Array]]:
        """Find the zones whose traction still reaches beyond the next facet."""
        share = HARDENS**self._count
        return [
            one
            for one in self._zones
            if share * self._stiffness.get(one[0].number, 0.0)
            > LEAST_REACH**2 * one[0].gamma_scale
        ]

    def _add(self, A: PETSc.Mat) -> None:
        """Add to the tangent of the present iterate. Collective."""
        zones, first = self._softened(), self._count == 0
        if not zones:
            return
        found = [zone.cpp.nodes() for _, zone, _ in zones]
        status = np.concatenate([one["status"] for one in found])
        moves = first or len(status) != len(self._last) or (status != self._last).any()
        share, self._last = HARDENS**self._count, status
        self._count += 1
        if not self._problem.comm.allreduce(bool(moves), op=MPI.LOR):
            return
        for (part, zone, areas), one in zip(zones, found):
            sticks = np.flatnonzero(one["status"] == PointStatus.STICK)
            scale = part.gamma_scale
            size = share * areas[sticks] * scale * scale / one["gamma"][sticks]
            n = one["normal"][sticks]
            along = np.eye(n.shape[1]) - n[:, :, None] * n[:, None, :]
            begin = part.layout.multiplier_rows[zone.multiplier_nodes[sticks]]
            for row, block in zip(begin, -size[:, None, None] * along):
                rows = (row + np.arange(len(block))).astype(PETSc.IntType)
                A.setValues(rows, rows, block, addv=True)


def _areas(zone: ZoneData) -> Array:
    """Share of each node in its facets here, (nodes,). Area."""
    table = np.asarray(zone.multiplier_table)
    own = surface_areas(zone.facets.slave_surface) / max(table.shape[1], 1)
    found = np.zeros(len(zone.multiplier_nodes))
    np.add.at(found, np.searchsorted(zone.multiplier_nodes, table), own[:, None])
    return found

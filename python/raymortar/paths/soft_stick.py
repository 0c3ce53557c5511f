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

# Factor on the share of slip from one tangent to the next, and most soft tangents of a
# solve (docs/measured/slip_fronts.md)
HARDENS, MOST = 0.5, 8


class SoftStick:
    """Tangents between those of stick and of slip at nodes that stick. Collective.

    With stick as it is the excess of friction at a slip front is a force on one node,
    and the front moves by one facet in each iteration. With a share of the tangent of
    slip the traction spreads along the surface, and the front moves as far as it
    reaches [theory (5.17)]. The share is 1, 1/2, 1/4 in a solve's first tangents, and
    none as soon as no node changes between open, stick and slip.

    It is of laws at nodes, whose gamma goes by what the surface yields.
    """

    def __init__(self, problem: Any) -> None:
        self._problem, self._parts = problem, problem.contact.parts
        self._zones = [
            (part, zone, _areas(zone))
            for one, part in zip(problem.contact.contacts, self._parts)
            if one.friction is not None
            and not isinstance(one.friction, Stick)
            and getattr(one.method, "condition", "points") == "nodes"
            for zone in one.zones
        ]
        self._count, self._last = 0, np.empty(0)

    @contextmanager
    def acting(self) -> Iterator[None]:
        """Soften the first tangents of the solve within."""
        problem = self._problem
        self._count = 0
        problem.soften = self._add if self._zones else None
        try:
            yield
        finally:
            problem.soften = None

    def _add(self, A: PETSc.Mat) -> None:
        """Add to the tangent of the present iterate. Collective."""
        found = [zone.cpp.nodes() for _, zone, _ in self._zones]
        status = np.concatenate([one["status"] for one in found])
        share, first = HARDENS**self._count, self._count == 0
        moves = float(first or (status != self._last).any())
        self._count, self._last = self._count + 1, status
        if self._count > MOST:
            return
        if not self._problem.comm.allreduce(moves, op=MPI.MAX):
            return
        for (part, zone, areas), one in zip(self._zones, found):
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

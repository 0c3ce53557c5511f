"""Soft contact: fronts of slip and of opening that move through many facets at once."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from ..compat import Array, Mask
from ..discretization.surfaces import surface_areas
from ..interface.point_results import PointStatus
from ..interface.zone_data import ZoneData
from ..options.friction import Stick

# Factor on the share of slip from one tangent to the next
HARDENS = 0.5

# Share of opening in the first tangent, and the factor from one to the next: a beam on
# springs spreads a force by the fourth root of what they yield, slip by the square root
OPENS, CLOSES = 10.0, 0.3

# Facets that a traction has to reach over, more than the next one
LEAST_REACH = 2.0

# Share of the largest traction from which a node is closed when a solve begins
TRACTION = 1e-9


class SoftStick:
    """Tangents between those of stick and slip, or closed and open nodes. Collective.

    With stick as it is the excess of friction at a slip front is a force on one node,
    and the front moves by one facet in each iteration. With a share of the tangent of
    slip it spreads along the surface, and the front moves as far as it reaches [theory
    (5.17)]. The share is 1, 1/2, 1/4 in a solve's first tangents, as long as it reaches
    beyond the next facet and nodes change between open, stick and slip.

    So does the front of a body that bends and peels off a tool, which has come down on
    many nodes at once: those that were open when the last step ended, and are closed
    where the solve begins, have a share of the tangent of open ones.

    It acts on laws at nodes alone, whose gamma is as soft as the surface. Where bodies
    do not bend, a traction reaches no further than a facet, and nothing is softened.
    """

    def __init__(self, problem: Any) -> None:
        self._problem = problem
        contacts = problem.contact.contacts
        self._zones = [
            (part, zone, _areas(zone), slips(one.friction))
            for one, part in zip(contacts, problem.contact.parts)
            if getattr(one.method, "condition", "points") == "nodes"
            for zone in one.zones
        ]
        stiffness = {part.number: part.stiffness() for part, *_ in self._zones}
        # Reach of a traction in facets, squared
        self._reach = {
            part.number: (stiffness[part.number] or 0.0) / part.gamma_scale
            for part, *_ in self._zones
        }
        self._count, self._last = 0, np.empty(0)
        # Nodes without a traction at the start of the solve
        self._free: list[Mask] = []

    @contextmanager
    def acting(self, opens: bool = False) -> Iterator[None]:
        """Soften the first tangents of the solve within, and, if it `opens`, those of
        nodes that have no traction yet. Collective."""
        problem, self._count = self._problem, 0
        self._free = [~_closed(part, zone) for part, zone, *_ in self._zones if opens]
        self._new = [~m & m for m in self._free]
        problem.soften = self._add if self._softened() else None
        try:
            yield
        finally:
            problem.soften = None

    def _shares(self, part: Any, slips: bool) -> tuple[float, float]:
        """Shares of slip and of opening in the next tangent, 0 where they reach no
        further than the next facet."""
        reach = self._reach[part.number] / LEAST_REACH**2
        slip = HARDENS**self._count if slips else 0.0
        opening = OPENS * CLOSES**self._count if self._free and reach > 1.0 else 0.0
        return slip * (slip * reach > 1.0), opening * (opening * reach > 1.0)

    def _softened(self) -> list[int]:
        """Find the zones whose traction still reaches beyond the next facet."""
        shares = [self._shares(part, slips) for part, _, _, slips in self._zones]
        return [i for i, share in enumerate(shares) if any(share)]

    def _add(self, A: PETSc.Mat) -> None:
        """Add to the tangent of the present iterate. Collective."""
        softened, first = self._softened(), self._count == 0
        if not softened:
            return
        found = [self._zones[i][1].cpp.nodes() for i in softened]
        status = np.concatenate([one["status"] for one in found])
        moves = first or len(status) != len(self._last) or (status != self._last).any()
        shares = [self._shares(self._zones[i][0], self._zones[i][3]) for i in softened]
        self._last = status
        self._count += 1
        if not self._problem.comm.allreduce(bool(moves), op=MPI.LOR):
            return
        # Residuals that soft tangents leave tell nothing of exact ones
        self._problem.convergence.norms.clear()
        for i, one, (slip, opening) in zip(softened, found, shares):
            part, zone, areas, _ = self._zones[i]
            sticks = slip * (one["status"] == PointStatus.STICK)
            yields = np.zeros(len(areas))
            if opening:
                closed = one["status"] >= PointStatus.STICK
                if self._count <= 2:
                    self._new[i] |= closed & self._free[i]
                yields = opening * (closed & self._new[i])
            at = np.flatnonzero(sticks + yields)
            scale, d = part.gamma_scale, part.layout.components
            size = areas[at] * scale * scale / one["gamma"][at]
            n = one["normal"][at]
            across = (
                n[:, :, None] * n[:, None, :] if d > 1 else np.ones((len(at), 1, 1))
            )
            along = np.eye(d) - across
            blocks = sticks[at, None, None] * along + yields[at, None, None] * across
            begin = part.layout.multiplier_rows[zone.multiplier_nodes[at]]
            for row, block in zip(begin, -size[:, None, None] * blocks):
                rows = (row + np.arange(d)).astype(PETSc.IntType)
                A.setValues(rows, rows, block, addv=True)


def slips(friction: Any) -> bool:
    """Whether a law of friction lets nodes stick and slip."""
    return friction is not None and not isinstance(friction, Stick)


def _closed(part: Any, zone: ZoneData) -> Mask:
    """Whether each node has a traction, (nodes,). Collective."""
    values = part.layout.multiplier.x.array.reshape(-1, part.layout.components)
    size = np.linalg.norm(values[zone.multiplier_nodes], axis=1)
    largest = zone.comm.allreduce(float(size.max(initial=0.0)), op=MPI.MAX)
    return np.asarray(size > TRACTION * largest)


def _areas(zone: ZoneData) -> Array:
    """Share of each node in its facets here, (nodes,). Area."""
    table = np.asarray(zone.multiplier_table)
    own = surface_areas(zone.facets.slave_surface) / max(table.shape[1], 1)
    found = np.zeros(len(zone.multiplier_nodes))
    np.add.at(found, np.searchsorted(zone.multiplier_nodes, table), own[:, None])
    return found

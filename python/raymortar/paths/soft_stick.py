"""Soft contact: fronts of slip and of opening that move through many facets at once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from ..core.compat import Array, Mask
from ..core.discretization.facets import shape_functions
from ..core.discretization.surfaces import surface_areas
from ..core.interface.point_results import Status
from ..core.interface.zone_data import ZoneData
from ..core.options.friction import Stick
from ..core.terms import Term

# Factor on the share of slip from one tangent to the next
HARDENS = 0.5

# Share of opening in the first tangent, and the factor from one to the next: a beam on
# springs spreads a force by the fourth root of what they yield, slip by the square root
OPENS, CLOSES = 10.0, 0.3

# Facets that a traction has to reach over, more than the next one
LEAST_REACH = 2.0

# Least stiffness of neighbouring nodes over that of the surface in bodies that bend. Of a
# half-plane 400 times as wide as the contact it is 7, of strips 18 and more
BENDS = 12.0

# Share of the largest traction from which a node is closed when a solve begins
TRACTION = 1e-9

# Periods of cycles that are looked for, relative difference of residuals that repeat, and
# number of shorter steps in a solve
PERIODS, REPEATS, SHORT_STEPS = range(1, 7), 1e-2, 3


@dataclass
class _Softened:
    """Nodes of a zone: the part it is of, and what tangents are softened by."""

    part: Any
    zone: ZoneData
    areas: Array  # of the nodes
    slips: bool
    is_nodal: bool  # whether its law holds at nodes
    stiffness: float  # over area, traction per length


class SoftStick(Term):
    """Tangents between those of stick and slip, or closed and open nodes. Collective.

    With stick as it is the excess of friction at a slip front is a force on one node,
    and the front moves by one facet in each iteration. With a share of the tangent of
    slip it spreads along the surface, and the front moves as far as it reaches [theory
    (5.17)]. The share is 1, 1/2, 1/4 in a solve's first tangents, as long as it reaches
    beyond the next facet and nodes change between open, stick and slip.

    So does the front of a body that bends and peels off a tool, which has come down on
    many nodes at once: those that were open when the last step ended, and are closed
    where the solve begins, have a share of the tangent of open ones. In compact bodies
    this takes two or three iterations more, and is left out.

    At points a few may open and close in turn, and the same iterates come again: a step
    of half the length leaves them, or one of a quarter, or an eighth.

    It acts on laws whose gamma is as soft as the surface: those at nodes, and those at
    points that have the gamma of such a one. Where bodies do not bend, a traction reaches
    no further than a facet, and nothing is softened.
    """

    spoken = "softened tangents"
    is_linear = True  # it softens rows of contact alone

    def __init__(self, problem: Any) -> None:
        self._problem = problem
        self._all = [
            _Softened(
                part,
                zone,
                _areas(zone),
                slips(one.friction),
                getattr(one.method, "condition", "points") == "nodes",
                part.stiffness() or 0.0,
            )
            for one, part in zip(problem.contact.contacts, problem.contact.parts)
            if one.multiplier is not None and part.surfaces.tied is None
            for zone in one.zones
        ]
        self._zones: list[_Softened] = []
        self._count, self._short_steps, self._last = 0, 0, np.empty(0)
        # Nodes without a traction at the start of the solve
        self._free: list[Mask] = []

    @contextmanager
    def acting(self, opens: bool = False) -> Iterator[None]:
        """Soften the first tangents of the solve within, and, if it `opens`, those of
        nodes that have no traction yet. Collective."""
        problem, self._count, self._short_steps = self._problem, 0, 0
        self._zones = [z for z in self._all if z.is_nodal or z.part.gamma_is_soft]
        self._free = [_free(z.part, z.zone) for z in self._zones if opens]
        self._new = [~m & m for m in self._free]
        if not self._softened():
            yield
            return
        with problem.extended_by(self):
            yield

    def _shares(self, zone: _Softened) -> tuple[float, float]:
        """Shares of slip and of opening in the next tangent, 0 where they reach no
        further than the next facet."""
        reach, least = zone.stiffness / zone.part.gamma_scale, LEAST_REACH**2
        slip = HARDENS**self._count if zone.slips else 0.0
        opening = OPENS * CLOSES**self._count if self._free and reach > BENDS else 0.0
        return slip * (slip * reach > least), opening * (opening * reach > least)

    def _softened(self) -> list[int]:
        """Find the zones whose traction still reaches beyond the next facet."""
        return [i for i, zone in enumerate(self._zones) if any(self._shares(zone))]

    def _shortens(self, A: PETSc.Mat) -> bool:
        """Scale the tangent if the last two residuals repeat earlier ones after a period,
        which shortens the step; return whether they are. Collective."""
        norms = self._problem.convergence.norms
        at_points = not all(zone.is_nodal for zone in self._zones)
        if not at_points or self._short_steps == SHORT_STEPS or not _repeat(norms):
            return False
        A.assemble()
        self._short_steps += 1
        A.scale(2.0**self._short_steps)
        norms.clear()
        return True

    def add_tangent(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        """Add to the tangent of the present iterate. Collective."""
        if self._shortens(A):
            return
        softened, first = self._softened(), self._count == 0
        if not softened:
            return
        found = [_contact_at_nodes(self._zones[i]) for i in softened]
        status = np.concatenate([one["status"] for one in found])
        moves = first or len(status) != len(self._last) or (status != self._last).any()
        shares = [self._shares(self._zones[i]) for i in softened]
        self._last = status
        self._count += 1
        if not self._problem.comm.allreduce(bool(moves), op=MPI.LOR):
            return
        # Residuals that soft tangents leave tell nothing of exact ones
        self._problem.convergence.norms.clear()
        for i, one, (slip, opening) in zip(softened, found, shares):
            at, part = self._zones[i], self._zones[i].part
            sticks = slip * one["sticks"]
            yields = np.zeros(len(at.areas))
            if opening:
                if self._count <= 2:
                    self._new[i] |= (one["closed"] > 0.0) & self._free[i]
                yields = opening * one["closed"] * self._new[i]
            nodes = np.flatnonzero(sticks + yields)
            scale, d = part.gamma_scale, part.layout.components
            size = at.areas[nodes] * scale * scale / one["gamma"][nodes]
            n = one["normal"][nodes]
            across = (
                n[:, :, None] * n[:, None, :] if d > 1 else np.ones((len(nodes), 1, 1))
            )
            along = np.eye(d) - across
            blocks = sticks[nodes, None, None] * along
            blocks += yields[nodes, None, None] * across
            begin = part.layout.multiplier_rows[at.zone.multiplier_nodes[nodes]]
            for row, block in zip(begin, -size[:, None, None] * blocks):
                rows = (row + np.arange(d)).astype(PETSc.IntType)
                A.setValues(rows, rows, block, addv=True)


def _repeat(norms: Sequence[float]) -> bool:
    """Whether the last two residuals repeat earlier ones after a period."""
    for period in PERIODS:
        if len(norms) > period + 1:
            last, before = np.array(norms[-2:]), np.array(norms[-2 - period : -period])
            if (np.abs(last - before) < REPEATS * before).all():
                return True
    return False


def _contact_at_nodes(at: _Softened) -> dict[str, Any]:
    """Find what of each node is closed and what sticks, from 0 to 1, its normal and its
    gamma; ``status`` changes where any of this does. Of a law at points, means of the
    points here, weighted by their areas times the square of the node's function."""
    zone = at.zone
    if at.is_nodal:
        found: dict[str, Any] = zone.nodes()
        status = found["status"]
        found["closed"] = 1.0 * (status >= Status.STICK)
        found["sticks"] = 1.0 * (status == Status.STICK)
        return found
    points = zone.cpp.points()
    hit = points["status"] >= Status.OPEN
    status, table = points["status"][hit], np.asarray(zone.multiplier_table)
    shape, degree = zone.facets.slave_surface.shape, zone.multiplier_degree
    N, _ = shape_functions(shape, degree, points["xi"][hit])
    weights = points["weight"][hit, None] * N**2
    nodes = np.searchsorted(zone.multiplier_nodes, table[points["slave"][hit]])
    columns = [
        np.ones((len(status), 1)),
        1.0 * (status >= Status.STICK)[:, None],
        1.0 * (status == Status.STICK)[:, None],
        points["gamma"][hit, None],
        points["contact_normal"][hit],
    ]
    values = np.concatenate(columns, axis=1)
    sums = np.zeros((len(at.areas), values.shape[1]))
    np.add.at(sums, nodes, weights[..., None] * values[:, None])
    met = sums[:, 0] > 0.0
    means = sums / np.where(met, sums[:, 0], 1.0)[:, None]
    length = np.linalg.norm(means[:, 4:], axis=1, keepdims=True)
    return {
        "status": points["status"],
        "closed": means[:, 1],
        "sticks": means[:, 2],
        "gamma": np.where(met, means[:, 3], 1.0),
        "normal": means[:, 4:] / np.where(length > 0.0, length, 1.0),
    }


def slips(friction: Any) -> bool:
    """Whether a law of friction lets nodes stick and slip."""
    return friction is not None and not isinstance(friction, Stick)


def _free(part: Any, zone: ZoneData) -> Mask:
    """Whether each node has no traction, (nodes,). Collective."""
    values = part.layout.multiplier.x.array.reshape(-1, part.layout.components)
    size = np.linalg.norm(values[zone.multiplier_nodes], axis=1)
    largest = zone.comm.allreduce(float(size.max(initial=0.0)), op=MPI.MAX)
    return np.asarray(size <= TRACTION * largest)


def _areas(zone: ZoneData) -> Array:
    """Share of each node in its facets here, (nodes,). Area."""
    table = np.asarray(zone.multiplier_table)
    own = surface_areas(zone.facets.slave_surface) / max(table.shape[1], 1)
    found = np.zeros(len(zone.multiplier_nodes))
    np.add.at(found, np.searchsorted(zone.multiplier_nodes, table), own[:, None])
    return found

"""Landing: bodies that nothing touches move along their loads, up to what bears them."""

from __future__ import annotations

from collections.abc import Callable

from mpi4py import MPI

import numpy as np

from ..core.compat import Array, Indices, Mask
from ..core.discretization.surfaces import bodies_of_facets
from ..core.interface.point_results import OPEN
from ..core.interface.zone_data import ZoneData
from ..core.problem import CoupledProblem
from ..diagnose.lost_contact import free_axes, touched

# Largest number of moves of one landing, and of halves of the last one of a body
MOVES, HALVES = 200, 10
# Share of all its forces up to which a body's resultant is noise
NOISE = 1e-3
# Largest depth of a body that has landed, in largest moves
DEEPEST = 0.2


class Landing:
    """Moves bodies that nothing touches as rigid ones, before a solve. Collective.

    All of them move along the resultants of their forms, by at most `limit` at once, as
    contact is found no further. One has landed where its penetration, times gamma, bears
    the resultant: there enough points are in contact for a solve without viscous forces
    to begin. This takes pairings, and no tangents.
    """

    def __init__(self, problem: CoupledProblem, loose: Mask, limit: float) -> None:
        self._problem, self._contact = problem, problem.contact
        self._loose, self._limit = loose, limit

    def land(self) -> float | None:
        """Move all bodies that fall; return the work of their loads, None if there are
        none, or if one meets nothing."""
        contact = self._contact
        contact.update()
        falls = self._loose & ~touched(contact, len(self._loose))
        if not falls.any():
            return None
        load, noise = self._resultants()
        size = np.linalg.norm(load, axis=1)
        falls &= size > noise
        begin, work = contact.state(), 0.0
        for _ in range(MOVES * falls.any()):
            way = load * (falls / np.where(falls, size, 1.0))[:, None]
            moved = self._move(way, lambda: falls & self._bears(size))
            work += moved * float(size[falls].sum())
            falls &= ~self._bears(size)
            if not falls.any():
                self._accept_places()
                return work
        contact.restore(begin)
        return None

    def _accept_places(self) -> None:
        """Take the present places for accepted ones: a fall is no slip."""
        state = self._contact.state()
        state["accepted 0"] = self._contact.u.x.array.copy()
        self._contact.restore(state)

    def _resultants(self) -> tuple[Array, Array]:
        """Find the resultant of each body's form, along axes on which nothing holds it,
        (bodies, d), and the size that is noise, (bodies,). Force."""
        problem, contact = self._problem, self._contact
        forces = -problem.volume.forces(problem.bcs)[contact.unknowns.u_owned]
        by_node = forces.reshape(-1, contact.u.function_space.dofmap.index_map_bs)
        of = contact.system.bodies.dofs[: len(by_node)]
        sums = [
            _by_body(of, part, len(self._loose))
            for part in (*by_node.T, np.abs(by_node).sum(axis=1))
        ]
        *load, every = problem.comm.allreduce(np.array(sums))
        return np.where(free_axes(problem), load, 0.0).T, NOISE * every

    def _move(self, way: Array, landed: Callable[[], Mask]) -> float:
        """Move bodies by the limit along their ways, (bodies, d), or as far as the first
        of them lands; return how far. Length."""
        unknowns, system = self._contact.unknowns, self._contact.system
        before, path = unknowns.values(), way[system.bodies.dofs].ravel()

        def lands(distance: float) -> bool:
            values = before.copy()
            values[unknowns.u_local] += distance * path
            unknowns.set_values(values)
            self._contact.update()
            return bool(landed().any())

        low, high = 0.0, self._limit
        if lands(high):
            for _ in range(HALVES):
                middle = 0.5 * (low + high)
                low, high = (low, middle) if lands(middle) else (middle, high)
            lands(high)
        return high

    def _bears(self, size: Array) -> Mask:
        """Whether penetrations bear loads of a size on each body, or are deep."""
        count = len(size)
        force, depth = np.zeros(count), np.zeros(count)
        for zone in self._contact.zones:
            points = zone.points()
            hit = points["status"] >= OPEN
            deep = np.maximum(-points["gap"][hit], 0.0)
            pressed = points["weight"][hit] * points["gamma"][hit] * deep
            for body in self._bodies_at(zone, points, hit):
                force += _by_body(body, pressed, count)
                np.maximum.at(depth, body, deep)
        found = np.array([force, depth])
        # A body is on several ranks: the sum of depths is not below the largest one
        force, depth = self._problem.comm.allreduce(found)
        return np.asarray((force >= size) | (depth >= DEEPEST * self._limit))

    def _bodies_at(
        self, zone: ZoneData, points: dict[str, Array], hit: Mask
    ) -> list[Indices]:
        """Bodies of the slave and, but for tools, of the master at points that are hit."""
        of = self._contact.system.bodies
        slave = bodies_of_facets(of, zone.facets.slave_surface)[points["slave"][hit]]
        if zone.facets.bodies:
            return [slave]
        return [slave, zone.cpp.master_bodies()[points["master"][hit]]]


def _by_body(body: Indices, values: Array, count: int) -> Array:
    """Sum values by body, (count,)."""
    return np.asarray(np.bincount(body, values, count), dtype=float)

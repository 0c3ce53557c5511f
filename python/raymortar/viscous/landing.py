"""Landing: bodies that nothing touches move along their loads, up to what bears them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from mpi4py import MPI

import numpy as np

from ..core.compat import Array, Indices, Mask
from ..core.interface.point_results import OPEN
from ..core.problem import CoupledProblem
from ..diagnose.holding import bodies_at
from .bearing import bearing
from .loads import NOISE, depend_on_place, have_changed
from .rigid_moves import (
    DEEPEST,
    MOVES,
    accept_place,
    in_flight,
    loads_of,
    longest_move,
    may_move,
    thinnest,
)

# Largest number of halves of a move in which a body lands
HALVES = 10
# Parts of a move where places change loads: they may hold a body on the way
PARTS = 4


class _Facing(NamedTuple):
    """Points that face another body.

    Attributes
    ----------
    bodies
        Of slave and master; the number of a tool is the number of bodies, (2, n).
    gap
        Length, (n,).
    stiffness
        gamma times the area of each point. Force per length, (n,).
    """

    bodies: Indices
    gap: Array
    stiffness: Array


class Landing:
    """Moves bodies that nothing touches as rigid ones, before a solve. Collective.

    Each body moves along the resultant of its form, by at most `limit` at once, as
    contact is found no further away. It has landed where its penetration, times gamma,
    bears the resultant: enough points are then in contact for a solve without viscous
    forces to begin. If what bears it has not landed itself, both go on as one body. This
    takes pairings, and no tangents. An object serves one landing; `has_failed` tells
    whether bodies have fallen, and are back, as nothing has borne them.
    """

    def __init__(self, problem: CoupledProblem, loose: Mask, limit: float) -> None:
        self._problem, self._contact = problem, problem.contact
        self._limit = limit
        # Bodies that have not landed. Bodies that move as one have the same number
        self._free, self._group = loose, np.arange(len(loose))
        self.has_failed = False
        # Whether each body may move along each axis
        self._axes = np.ones((len(loose), 1), dtype=bool)

    def land(self) -> float | None:
        """Move all bodies that fall; return the work of their loads, None if no body
        falls, if one meets nothing or its load depends on the place, or if none `may_move`.
        """
        contact, problem = self._contact, self._problem
        contact.update()
        pairs = bearing(problem, self._free, self._limit)
        if not in_flight(pairs, self._free)[0].any() or not may_move(problem):
            return None
        begin, work = contact.state(), 0.0
        loads = loads_of(problem, self._limit)
        load, noise, self._axes = loads.free, NOISE * loads.amounts, loads.axes
        may_fall = self._free & self._axes.any(axis=1)
        self._free, self._group = in_flight(pairs, may_fall)
        falling, is_watched = self._free.copy(), depend_on_place(problem)
        parts = PARTS if is_watched else 1
        least, most = self._range_of_moves()
        range_of_moves = min(least, most / parts), most / parts
        for move in range(MOVES * parts):
            ways, size = self._ways(load, noise)
            if not ways.any():
                if not move:
                    break
                accept_place(contact)
                return work
            moved = self._move(ways, size, range_of_moves)
            work += moved * float((ways * load).sum())
            self._land_or_join(size)
            if is_watched and have_changed(problem, loads.every, falling):
                break
        contact.restore(begin)
        self.has_failed = work > 0.0
        return None

    def _ways(self, load: Array, noise: Array) -> tuple[Array, Array]:
        """Find the direction in which each body falls, (bodies, d), 0 where it does not,
        and the resultant of its group, (bodies,)."""
        together = self._together
        along = ~(together @ ~self._axes)  # all of a group may move
        force, least = along * (together @ load), together @ noise
        size = np.linalg.norm(force, axis=1)
        falls = self._free & (size > least)
        return force * (falls / np.where(falls, size, 1.0))[:, None], size

    @property
    def _together(self) -> Mask:
        """Whether two bodies move as one, (bodies, bodies)."""
        return np.asarray(self._group[:, None] == self._group)

    def _range_of_moves(self) -> tuple[float, float]:
        """Find the least and the largest move: contact is found within the largest, and
        no thin body is passed by the least. Length."""
        most = longest_move(self._contact, self._limit)
        thin = thinnest(self._contact, self._limit)
        return DEEPEST * min(most, thin), most

    def _move(
        self, ways: Array, size: Array, range_of_moves: tuple[float, float]
    ) -> float:
        """Move bodies along their ways by half of the least gap to what they face, as two
        may approach each other, or until the first of them lands; return how far.
        Length."""
        unknowns, falls = self._contact.unknowns, ways.any(axis=1)
        before = unknowns.values()
        path = ways[self._contact.system.bodies.dofs].ravel()

        def lands(distance: float) -> bool:
            values = before.copy()
            values[unknowns.u_local] += distance * path
            unknowns.set_values(values)
            self._contact.update()
            return bool((falls & self._borne_by(size).any(axis=1)).any())

        low, high = 0.0, float(np.clip(0.5 * self._least_gap(falls), *range_of_moves))
        if lands(high):
            for _ in range(HALVES):
                middle = 0.5 * (low + high)
                low, high = (low, middle) if lands(middle) else (middle, high)
            lands(high)
        return high

    def _least_gap(self, falls: Mask) -> float:
        """Find the least gap between bodies that fall and others; inf without one."""
        gap, falls = np.inf, np.append(falls, False)
        for points in self._facing():
            near = points.gap[falls[points.bodies].any(axis=0)]
            gap = near.min(initial=gap)
        return float(self._problem.comm.allreduce(gap, op=MPI.MIN))

    def _borne_by(self, size: Array) -> Mask:
        """Find which other bodies, the last of them tools, touch each body whose group
        is borne: all penetrations times gamma are a load of this size, or the body is
        deep in one of them, (bodies, bodies + 1)."""
        count = len(size)
        force, depth = np.zeros((2, count + 1, count + 1))
        for points in self._facing():
            deep = np.maximum(-points.gap, 0.0)
            for i, j in (points.bodies, points.bodies[::-1]):
                np.add.at(force, (i, j), points.stiffness * deep)
                np.maximum.at(depth, (i, j), deep)
        comm = self._problem.comm
        comm.Allreduce(MPI.IN_PLACE, force, op=MPI.SUM)
        comm.Allreduce(MPI.IN_PLACE, depth, op=MPI.MAX)
        on_group = self._together @ force[:count]
        is_deep = depth[:count].max(axis=1) >= DEEPEST * self._limit
        is_borne = (on_group.sum(axis=1) >= size) | is_deep
        return np.asarray(is_borne[:, None] & (on_group > 0.0))

    def _facing(self) -> Iterator[_Facing]:
        """Yield the points of each zone on this rank that face a body of another group."""
        contact = self._contact
        group = np.append(self._group, len(self._group))
        for zone in contact.zones:
            points = zone.points()
            hit = np.flatnonzero(points["status"] >= OPEN)
            bodies = bodies_at(contact, zone, points, hit)
            is_other = group[bodies[0]] != group[bodies[1]]
            at = hit[is_other]
            stiffness = points["weight"][at] * points["gamma"][at]
            yield _Facing(bodies[:, is_other], points["gap"][at], stiffness)

    def _land_or_join(self, size: Array) -> None:
        """Note which bodies are borne by what has landed or is held, and let others move
        as one with what bears them."""
        borne_by = self._borne_by(size)
        free = np.append(self._free, False)
        for body in np.flatnonzero(self._free & borne_by.any(axis=1)):
            others = np.flatnonzero(borne_by[body])
            if free[others].all():
                for other in others:
                    same = self._group == self._group[other]
                    self._group[same] = self._group[body]
            else:
                self._free &= self._group != self._group[body]

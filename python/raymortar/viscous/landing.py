"""Landing: bodies that nothing touches move along their loads, up to what bears them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from mpi4py import MPI

import numpy as np

from ..core.compat import Array, Indices, Mask
from ..core.discretization.surfaces import bodies_of_facets
from ..core.interface.point_results import OPEN
from ..core.problem import CoupledProblem
from ..diagnose.lost_contact import free_axes, touched

# Largest number of moves of one landing, and of halves of one in which a body lands
MOVES, HALVES = 200, 10
# Share of all its forces up to which a body's resultant is noise
NOISE = 1e-3
# Depth of a body that has landed, and the least move, in largest moves
DEEPEST = 0.2
# Distances of a zone within which its contact is found
_SEEN = "reach", "depth"


class _Seen(NamedTuple):
    """Points that face a master: bodies of slave and master, the last number for tools,
    gaps, and gamma over their areas. Lengths; force per length."""

    bodies: Indices  # (2, n)
    gap: Array  # (n,)
    stiffness: Array  # (n,)


class Landing:
    """Moves bodies that nothing touches as rigid ones, before a solve. Collective.

    All of them move along the resultants of their forms, by at most `limit` at once, as
    contact is found no further. One has landed where its penetration, times gamma, bears
    the resultant: there enough points are in contact for a solve without viscous forces
    to begin. Where another one that falls, or would, bears it, they go on as one. This
    takes pairings, and no tangents.
    """

    def __init__(self, problem: CoupledProblem, loose: Mask, limit: float) -> None:
        self._problem, self._contact = problem, problem.contact
        self._loose, self._most = loose, limit
        # Whether each body has not landed, and a body of those with which it moves
        self._free, self._lead = loose, np.arange(len(loose))

    def land(self) -> float | None:
        """Move all bodies that fall; return the work of their loads, None if there are
        none, if one meets nothing, or if this step moves supports or tools."""
        contact = self._contact
        contact.update()
        self._free = self._loose & ~touched(contact, len(self._loose))
        if not self._free.any() or self._moves_others():
            return None
        self._lead = np.arange(len(self._loose))
        begin, work, loads = contact.state(), 0.0, self._resultants()
        for move in range(MOVES):
            ways, size = self._ways(*loads)
            if not ways.any():
                if not move:
                    break
                self._accept_places()
                return work
            moved = self._move(ways, size)
            work += moved * float((ways * loads[0]).sum())
            self._land_or_join(size)
        contact.restore(begin)
        return None

    def _moves_others(self) -> bool:
        """Whether this step moves supports or tools: a body lands where they end."""
        problem, contact = self._problem, self._contact
        lacking = contact.unknowns.lacking(problem.bcs).owned.any()
        moves = any(zone.motions.have_moved() for zone in contact.zones)
        return bool(problem.comm.allreduce(int(lacking or moves)))

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
            np.bincount(of, part, len(self._loose))
            for part in (*by_node.T, np.abs(by_node).sum(axis=1))
        ]
        *load, every = problem.comm.allreduce(np.array(sums, dtype=float))
        return np.where(free_axes(problem), load, 0.0).T, NOISE * every

    def _ways(self, load: Array, noise: Array) -> tuple[Array, Array]:
        """Find the direction in which each body falls, (bodies, d), 0 where it does not,
        and the resultant of those that move as one with it, (bodies,)."""
        together = self._lead[:, None] == self._lead
        force, least = together @ load, together @ noise
        size = np.linalg.norm(force, axis=1)
        falls = self._free & (size > least)
        return force * (falls / np.where(falls, size, 1.0))[:, None], size

    def _move(self, ways: Array, size: Array) -> float:
        """Move bodies along their ways, up to what they see, or as far as the first of
        them lands; return how far. Length."""
        unknowns, falls = self._contact.unknowns, ways.any(axis=1)
        before = unknowns.values()
        path = ways[self._contact.system.bodies.dofs].ravel()

        def lands(distance: float) -> bool:
            values = before.copy()
            values[unknowns.u_local] += distance * path
            unknowns.set_values(values)
            self._contact.update()
            return bool((falls & self._bears(size).any(axis=1)).any())

        low, high = 0.0, self._step(falls)
        if lands(high):
            for _ in range(HALVES):
                middle = 0.5 * (low + high)
                low, high = (low, middle) if lands(middle) else (middle, high)
            lands(high)
        return high

    def _step(self, falls: Mask) -> float:
        """Find how far bodies may move at once: half of the least gap to what they face,
        as two may move, and at least a share of the limit and of thin bodies. Length.
        """
        most = thin = self._most
        for zone in self._contact.zones:
            sees = min(zone.distance(name).min(initial=most) for name in _SEEN)
            most = min(most, sees)
            thin = min(thin, *(each.min(initial=thin) for each in zone.thickness))
        gap, falls = 2.0 * most, np.append(falls, False)
        for seen in self._seen():
            near = seen.gap[falls[seen.bodies].any(axis=0)]
            gap = min(gap, near.min(initial=gap))
        comm = self._problem.comm
        most, thin, gap = (comm.allreduce(one, op=MPI.MIN) for one in (most, thin, gap))
        return float(np.clip(0.5 * gap, DEEPEST * min(most, thin), most))

    def _bears(self, size: Array) -> Mask:
        """Whether penetrations bear loads of a size on each body, or are deep, by each
        other one, (bodies, bodies + 1); the last are tools."""
        count = len(size)
        force, depth = np.zeros((2, count + 1, count + 1))
        for seen in self._seen():
            deep = np.maximum(-seen.gap, 0.0)
            for i, j in (seen.bodies, seen.bodies[::-1]):
                np.add.at(force, (i, j), seen.stiffness * deep)
                np.maximum.at(depth, (i, j), deep)
        comm = self._problem.comm
        comm.Allreduce(MPI.IN_PLACE, force, op=MPI.SUM)
        comm.Allreduce(MPI.IN_PLACE, depth, op=MPI.MAX)
        force[:count] = (self._lead[:, None] == self._lead) @ force[:count]
        borne = force[:count].sum(axis=1) >= size
        deep = depth[:count].max(axis=1) >= DEEPEST * self._most
        return np.asarray((borne | deep)[:, None] & (force[:count] > 0.0))

    def _seen(self) -> Iterator[_Seen]:
        """Points of this rank that face bodies other than those that move with theirs."""
        of, tool = self._contact.system.bodies, len(self._loose)
        lead = np.append(self._lead, tool)
        for zone in self._contact.zones:
            points = zone.points()
            hit = points["status"] >= OPEN
            slave = bodies_of_facets(of, zone.facets.slave_surface)[points["slave"]]
            master = np.full(len(slave), tool)
            if not zone.facets.bodies:
                master[hit] = zone.cpp.master_bodies()[points["master"][hit]]
            hit &= lead[slave] != lead[master]
            stiffness = points["weight"][hit] * points["gamma"][hit]
            bodies = np.array([slave[hit], master[hit]])
            yield _Seen(bodies, points["gap"][hit], stiffness)

    def _land_or_join(self, size: Array) -> None:
        """Note which bodies have landed on what does not fall, and let those that bear
        each other go on as one."""
        bears = self._bears(size)
        free = np.append(self._free, False)
        for body in np.flatnonzero(self._free & bears.any(axis=1)):
            others = np.flatnonzero(bears[body])
            if free[others].all():
                for other in others:
                    self._lead[self._lead == self._lead[other]] = self._lead[body]
            else:
                self._free &= self._lead != self._lead[body]

"""Settling: bodies that have landed turn and slide as rigid ones until they rest."""

from __future__ import annotations

from typing import NamedTuple

from mpi4py import MPI

import numpy as np

from ..core.compat import Array, Indices, Mask
from ..core.interface.point_results import OPEN
from ..core.interface.zone_data import ZoneData
from ..core.problem import CoupledProblem
from ..diagnose.holding import bodies_at, sums_by_body, touching
from .bearing import carried
from .grip import coefficient, grips, has_friction
from .loads import NOISE, forces_on, have_changed, resultants
from .placement import Placement, placement_of, turned
from .rigid_moves import (
    DEEPEST,
    MOVES,
    accept_place,
    bodies_of,
    loads_of,
    longest_move,
    may_move,
    thinnest,
)

# Largest number of moves that are not cut, and of bodies
CLOSE, MOST_BODIES = 50, 100
# Largest move, in distances within which contact is found
LONGEST = 0.5
# Largest number of halves of a move that needs energy, and the share of what contact
# stores that it may need all the same: directions of rays turn, which is left out
HALVES, NEEDS = 20, 0.3
# Depth at which a facet bears the largest load on soft springs, in facets, and share of
# the thickness of a body up to which others may go into it
SOFT, HALFWAY = 0.05, 0.5
# Share of gamma from which on soft springs would gain nothing
STIFF = 0.1
# Largest number of rests on springs of gamma, on which bodies come out of what they have
# sunk into, and the share of the energy that one has to leave for the next to be of no use
RESTS, LEFT = 50, 0.9
# Move below which a body rests, in facets
AT_REST = 1e-6
# Share of the load that resists a motion over a facet, where nothing else does
DRAG = 1e-2


class _Pressed(NamedTuple):
    """Points of a zone that are closed between bodies, one of which moves.

    Attributes
    ----------
    bodies
        Of slave and master, (2, n).
    x
        Length, (n, d).
    depth
        Length, (n,).
    way
        Of the slave on the master's springs. Length, (n, d).
    stiffness
        Force per length, (n, d, d).
    """

    bodies: Indices
    x: Array
    depth: Array
    way: Array
    stiffness: Array


class Settling:
    """Moves loose bodies that touch others as rigid ones, before a solve. Collective.

    Newton's method for the rigid motions of all bodies at once: the loads act, contact is
    pressed by penetration times gamma and sticks where it has friction, and a drag resists
    what nothing else does. A body rests once it moves no further. This takes pairings, and
    no tangents. Bodies on springs or bonds stay, and so do those on which contact carries
    something at the begin. An object serves one step.
    """

    def __init__(self, problem: CoupledProblem, loose: Mask, limit: float) -> None:
        self._problem, self._contact = problem, problem.contact
        self._limit, self._count, self._softness = limit, len(loose), 1.0
        self._contact.update()
        self._thin = thinnest(self._contact, limit)
        # Zones, and whether bodies stick to each other there
        self._zones = [
            (zone, coefficient(one.friction) > 0.0)
            for one in self._contact.contacts
            for zone in one.zones
        ]
        self._let_move(loose & ~self._is_kept())

    def _let_move(self, bodies: Mask) -> None:
        """Note which bodies move, (bodies,)."""
        self._moving = np.flatnonzero(bodies)
        # Place among the bodies that move; of all others, and of tools, the one behind
        self._at = np.full(self._count + 1, len(self._moving))
        self._at[self._moving] = np.arange(len(self._moving))

    def settle(self) -> float | None:
        """Move bodies that touch others until they rest; return the work of their loads,
        None if none moves, if one does not come to rest, if loads depend on the place, or
        if none `may_move`."""
        contact = self._contact
        contact.update()
        # A body that touches nothing has not landed, and stays
        meets = touching(contact, self._count, inside=True).any(axis=1)[:-1]
        self._let_move(meets & self._moves())
        if not 0 < len(self._moving) <= MOST_BODIES or not may_move(self._problem):
            return None
        begin, forces = contact.state(), forces_on(self._problem)
        before, _ = resultants(self._problem, forces)
        work = self._settle(forces) if self._is_gripped(forces) else None
        if work is None or have_changed(self._problem, before, self._moves()):
            contact.restore(begin)
            return None
        return work

    def _moves(self) -> Mask:
        """Whether each body moves, (bodies,)."""
        return np.asarray(self._at[:-1] < len(self._moving))

    def _is_gripped(self, forces: Array) -> bool:
        """Whether friction may hold all bodies that move: what sticks here would turn
        over what slides."""
        if not has_friction(self._contact):
            return True
        load = self._load(placement_of(self._problem, forces), forces)
        dim = self._contact.u.function_space.dofmap.index_map_bs
        return grips(self._contact, self._at, load[:, :dim])

    def _settle(self, forces: Array) -> float | None:
        """Move bodies until they rest on soft springs, which a stiff body needs to roll
        on, and from there on springs of gamma."""
        self._soften(forces)
        work = self._move_to_rest(forces)
        if work is not None and self._softness < 1.0:
            self._softness = 1.0
            work = self._let_out(work, forces)
        if work is None or self._stored()[1] > DEEPEST * self._limit:
            return None
        return work

    def _let_out(self, work: float, forces: Array) -> float | None:
        """Move bodies out of what they have sunk into on soft springs, as long as that
        sets energy free: where friction wedges them, each rest lets out a part."""
        left, _ = self._stored()
        for _ in range(RESTS):
            stored, more = left, self._move_to_rest(forces)
            if more is None:
                return None
            work += more
            left, _ = self._stored()
            if left > LEFT * stored:
                break
        return work

    def _soften(self, forces: Array) -> None:
        """Set the share of gamma with which a facet bears the largest load, 1 if that is
        not much softer."""
        contact, dim = self._contact, self._contact.u.function_space.dofmap.index_map_bs
        gamma = max(zone.points()["gamma"].max(initial=0.0) for zone in contact.zones)
        gamma = self._problem.comm.allreduce(gamma, op=MPI.MAX)
        load = self._load(placement_of(self._problem, forces), forces)[:, :dim]
        largest = np.linalg.norm(load, axis=1).max()
        share = largest / (SOFT * gamma * self._limit**dim)
        self._softness = share if share < STIFF else 1.0

    def _move_to_rest(self, forces: Array) -> float | None:
        """Move bodies until they rest; return the work of forces at the owned dofs of u,
        None if one does not come to rest."""
        contact, work, close = self._contact, 0.0, 0
        longest = LONGEST * min(self._thin, longest_move(contact, self._limit))
        for _ in range(MOVES):
            placement = placement_of(self._problem, forces)
            step = self._step(placement, self._load(placement, forces))
            far = self._farthest(placement, step)
            if not 0.0 < far < np.inf or close == CLOSE:
                break
            is_cut = far > longest
            done = self._go_down(placement, min(1.0, longest / far) * step, forces)
            rests = done is None or far <= AT_REST * self._limit
            work += done or 0.0
            if rests or is_cut:  # what a body rolls or falls is no slip
                accept_place(contact)
            if rests:
                return work
            close += not is_cut
        return None

    def _go_down(
        self, placement: Placement, step: Array, forces: Array
    ) -> float | None:
        """Move bodies by a step, or by the first half of it, half of that and so on that
        needs no energy and goes into no thin body; return the work of forces, None if
        each does, and bodies stay."""
        owned = forces.size
        stored, deepest = self._stored()
        deepest = max(HALFWAY * self._thin, deepest)
        for _ in range(HALVES):
            self._move(placement, step)
            way = self._contact.u.x.array[:owned] - placement.u.ravel()[:owned]
            work = self._problem.comm.allreduce(float(forces @ way))
            energy, deep = self._stored()
            if energy - stored - work <= NEEDS * stored and deep <= deepest:
                return work
            step = 0.5 * step
        self._move(placement, 0.0 * step)
        return None

    def _stored(self) -> tuple[float, float]:
        """Find the energy that contact stores as springs, and the largest penetration of
        bodies that move. Length."""
        energy = deepest = 0.0
        for zone, sticks in self._zones:
            points = self._pressed(zone, sticks)
            each = np.einsum("nd,nde,ne->n", points.way, points.stiffness, points.way)
            energy += 0.5 * float(each.sum())
            deepest = points.depth.max(initial=deepest)
        comm = self._problem.comm
        return comm.allreduce(energy), float(comm.allreduce(deepest, op=MPI.MAX))

    def _is_kept(self) -> Mask:
        """Whether springs, hoops, masses or bonds keep each body, or contact carries more
        than noise of it, (bodies,)."""
        problem, contact = self._problem, self._contact
        if contact.system.axisymmetric:
            return np.ones(self._count, dtype=bool)
        kept = np.zeros(self._count)
        for one in contact.contacts:
            for zone in one.zones:
                if one.tied is not None or one.bond is not None:
                    kept[bodies_of(zone, contact)] = 1.0
        kept, forces = problem.comm.allreduce(kept), carried(contact).sum(axis=1)
        loads = loads_of(problem, self._limit)
        held = ~loads.axes.all(axis=1)
        return np.asarray(held | (kept > 0.0) | (forces[:-1] > NOISE * loads.amounts))

    def _load(self, placement: Placement, forces: Array) -> Array:
        """Find forces at the owned dofs of u along the rigid motions of the bodies that
        move, (moving, motions)."""
        owned = forces.size // placement.x.shape[1]
        of = self._contact.system.bodies.dofs[:owned]
        modes = placement.motions(placement.x[:owned], of)
        modes = modes.reshape(len(modes), forces.size)
        sums = self._problem.comm.allreduce(sums_by_body(self._problem, modes * forces))
        return np.asarray(sums.T[self._moving])

    def _step(self, placement: Placement, load: Array) -> Array:
        """Find Newton's step for the rigid motions, (moving, motions). Length."""
        force, stiffness = self._springs(placement)
        dim = placement.x.shape[1]
        drag = DRAG * np.linalg.norm(load[:, :dim], axis=1).max() / self._limit
        r = (load + force).ravel()
        K = stiffness.reshape(r.size, r.size) + drag * np.eye(r.size)
        return np.linalg.lstsq(K, r, rcond=None)[0].reshape(load.shape)

    def _springs(self, placement: Placement) -> tuple[Array, Array]:
        """Find what contact does to the rigid motions of the bodies that move: forces
        (moving, motions), and their stiffness (moving, motions, moving, motions)."""
        n, motions = len(self._moving) + 1, 3 * (placement.x.shape[1] - 1)
        force, stiffness = np.zeros((n, motions)), np.zeros((n, n, motions, motions))
        for zone, sticks in self._zones:
            points = self._pressed(zone, sticks)
            at = self._at[points.bodies]
            # A tool has no motions
            slave, master = np.minimum(points.bodies, self._count - 1)
            modes = np.array(
                [
                    placement.motions(points.x, slave),
                    -placement.motions(points.x, master),
                ]
            )
            back = -np.einsum("nde,ne->nd", points.stiffness, points.way)
            pushed = np.einsum("nde,smne->smnd", points.stiffness, modes)
            pairs, pair_of = np.unique(at, axis=1, return_inverse=True)
            for k, pair in enumerate(pairs.T):
                here = np.ravel(pair_of) == k
                one = modes[:, :, here].reshape(2 * motions, -1)
                each = one @ pushed[:, :, here].reshape(2 * motions, -1).T
                force[pair] += (one @ back[here].ravel()).reshape(2, motions)
                each = each.reshape(2, motions, 2, motions).transpose(0, 2, 1, 3)
                stiffness[pair[:, None], pair[None]] += each
        comm = self._problem.comm
        comm.Allreduce(MPI.IN_PLACE, force, op=MPI.SUM)
        comm.Allreduce(MPI.IN_PLACE, stiffness, op=MPI.SUM)
        return force[:-1], stiffness[:-1, :-1].transpose(0, 2, 1, 3)

    def _pressed(self, zone: ZoneData, sticks: bool) -> _Pressed:
        """Find what penetration and friction do to bodies at the points of a zone on this
        rank."""
        points = zone.points()
        closed = np.flatnonzero((points["status"] >= OPEN) & (points["gap"] < 0.0))
        bodies = bodies_at(self._contact, zone, points, closed)
        at = self._at[bodies]
        moves = (bodies[0] != bodies[1]) & (at < len(self._moving)).any(axis=0)
        closed = closed[moves]
        # A corner is pressed along the normal of the face that it is on, and that is the
        # gradient of the gap
        n = -points["master_normal"][closed]
        depth = points["gap"][closed] * np.einsum(
            "nd,nd->n", n, points["contact_normal"][closed]
        )
        normal = np.einsum("nd,ne->nde", n, n)
        way, along = -depth[:, None] * n, normal
        if sticks:
            along = np.broadcast_to(np.eye(n.shape[1]), normal.shape)
            slip = points["slip"][closed]
            way = way + slip - np.einsum("nde,ne->nd", normal, slip)
        k = self._softness * points["weight"][closed] * points["gamma"][closed]
        x = points["x"][closed]
        return _Pressed(bodies[:, moves], x, -depth, way, k[:, None, None] * along)

    def _at_nodes(self, step: Array) -> Array:
        """Motions of the body of each of this rank's nodes, (nodes, motions)."""
        every = np.zeros((self._count, step.shape[1]))
        every[self._moving] = step
        return every[self._contact.system.bodies.dofs]

    def _farthest(self, placement: Placement, step: Array) -> float:
        """Find how far a step moves a node. Length."""
        of = self._contact.system.bodies.dofs
        way = np.einsum(
            "nm,mnd->nd", self._at_nodes(step), placement.motions(placement.x, of)
        )
        far = np.linalg.norm(way, axis=1).max(initial=0.0)
        return float(self._problem.comm.allreduce(far, op=MPI.MAX))

    def _move(self, placement: Placement, step: Array) -> None:
        """Turn and slide bodies without changing their shapes."""
        contact, dim = self._contact, placement.x.shape[1]
        of = contact.system.bodies.dofs
        motions = self._at_nodes(step)
        arm = placement.x - placement.centre[of]
        turned_by = turned(arm, motions[:, dim:] / placement.radius[of][:, None])
        moved = placement.u + motions[:, :dim] + turned_by - arm
        values = contact.unknowns.values()
        values[contact.unknowns.u_local] = moved.ravel()
        contact.unknowns.set_values(values)
        contact.update()

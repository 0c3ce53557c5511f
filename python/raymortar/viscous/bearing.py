"""Bodies that bear each other, among those that touch: others let each other fall."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np

from ..core.compat import Array, Mask
from ..core.interaction import Interaction
from ..core.interface.point_results import CLOSED, OPEN
from ..core.problem import CoupledProblem
from ..diagnose.holding import bodies_at, touching
from .grip import coefficient
from .loads import NOISE
from .rigid_moves import Loads, bodies_of, in_flight, loads_of

# Cosine between a load and a normal from which on the load presses on what is there
PRESSES = 1e-3


def bearing(problem: CoupledProblem, loose: Mask, facet: float) -> Mask:
    """Find which bodies, the last of them tools, touch and bear each other, (bodies + 1,
    bodies + 1), given which are loose and the size of a facet. Collective.

    Loads are assembled only where a loose body touches others and presses on none yet.
    """
    pairs, forces = touching(problem.contact, len(loose)), carried(problem.contact)
    presses = pairs & (forces > NOISE * forces.max(initial=0.0))
    if (in_flight(presses, loose)[0] & ~in_flight(pairs, loose)[0]).any():
        pairs &= _bear(problem, loads_of(problem, facet), forces)
    return pairs


def carried(contact: Interaction) -> Array:
    """Sum the sizes of the tractions between bodies, the last of them tools, (bodies + 1,
    bodies + 1). Force. Collective."""
    count = contact.system.bodies.count + 1
    found = np.zeros((count, count))
    for zone in contact.zones:
        points = zone.points()
        hit = np.flatnonzero(points["status"] >= OPEN)
        force = np.abs(points["traction"][hit]).sum(axis=1) * points["weight"][hit]
        slave, master = bodies_at(contact, zone, points, hit)
        np.add.at(found, (slave, master), force)
        np.add.at(found, (master, slave), force)
    contact.layout.comm.Allreduce(MPI.IN_PLACE, found, op=MPI.SUM)
    return found


def _bear(problem: CoupledProblem, loads: Loads, forces: Array) -> Mask:
    """Whether each body bears another that it touches: a load presses one on the other,
    contact carries something of it, or one may move and has no load. Collective."""
    size, noise = np.linalg.norm(loads.free, axis=1), NOISE * loads.amounts
    may_move, is_loaded = loads.axes.any(axis=1), size > noise
    least = np.append(np.where(may_move, noise, np.inf), np.inf)
    found = _pressing(
        problem.contact, loads.free / np.where(is_loaded, size, np.inf)[:, None]
    )
    found |= forces > np.minimum.outer(least, least)
    is_idle = np.append(may_move & ~is_loaded, False)
    return np.asarray(found | is_idle | is_idle[:, None])


def _pressing(contact: Interaction, ways: Array) -> Mask:
    """Whether the load of one of two bodies presses it on the other where they touch, or
    friction, a tie or a bond may hold them, (bodies + 1, bodies + 1), given the
    directions of the loads, (bodies, d). Collective."""
    ways = np.vstack([ways, np.zeros_like(ways[:1])])
    found = np.zeros((len(ways), len(ways)), dtype=bool)
    for one in contact.contacts:
        for zone in one.zones:
            # Pressure that other loads bring may let friction bear this one
            is_held = one.tied is not None or one.bond is not None
            if is_held or coefficient(one.friction) > 0.0:
                held = np.append(bodies_of(zone, contact), True)
                found |= held & held[:, None]
                continue
            points = zone.points()
            closed = np.flatnonzero(points["status"] >= CLOSED)
            slave, master = bodies_at(contact, zone, points, closed)
            nearing = np.array([-ways[slave], ways[master]])
            n = points["master_normal"][closed]
            at = (np.einsum("snd,nd->sn", nearing, n) > PRESSES).any(axis=0)
            found[slave[at], master[at]] = found[master[at], slave[at]] = True
    contact.layout.comm.Allreduce(MPI.IN_PLACE, found, op=MPI.LOR)
    return found

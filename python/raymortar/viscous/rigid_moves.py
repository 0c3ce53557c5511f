"""Moves of loose bodies as rigid ones, by pairings and without a tangent."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np

from ..core.compat import Mask
from ..core.discretization.surfaces import bodies_of_facets
from ..core.interaction import Interaction
from ..core.interface.zone_data import ZoneData
from ..core.problem import CoupledProblem

# Largest number of moves
MOVES = 200
# Depth of a body that has landed or rests, in largest moves
DEEPEST = 0.2
# Share of all forces of a body that is noise
NOISE = 1e-3
# Distances of a zone within which its contact is found
_SIGHT = "reach", "depth"


def longest_move(contact: Interaction, limit: float) -> float:
    """Find the largest move up to a limit within which contact is found. Length.
    Collective."""
    most = limit
    for zone in contact.zones:
        most = min(zone.distance(name).min(initial=most) for name in _SIGHT)
    return float(contact.layout.comm.allreduce(most, op=MPI.MIN))


def thinnest(contact: Interaction, limit: float) -> float:
    """Find the thickness of the thinnest body up to a limit: a longer move may pass it.
    Length. Collective."""
    thin = limit
    for zone in contact.zones:
        thin = min(each.min(initial=thin) for each in zone.thickness)
    return float(contact.layout.comm.allreduce(thin, op=MPI.MIN))


def accept_place(contact: Interaction) -> None:
    """Take the present place for the accepted one: a fall is no slip. Collective."""
    state = contact.state()
    state["accepted 0"] = contact.u.x.array.copy()
    contact.restore(state)


def moves_others(problem: CoupledProblem) -> bool:
    """Whether this step moves supports or tools: bodies rest where these end. Collective."""
    contact = problem.contact
    lacking = contact.unknowns.lacking(problem.bcs).owned.any()
    moves = any(zone.motions.have_moved() for zone in contact.zones)
    return bool(problem.comm.allreduce(int(lacking or moves)))


def bodies_of(zone: ZoneData, contact: Interaction) -> Mask:
    """Whether slave or masters of a zone are on each body on this rank, (bodies,)."""
    bodies, facets = contact.system.bodies, zone.facets
    found = np.zeros(bodies.count, dtype=bool)
    for surface in (facets.slave_surface, facets.master_surface):
        found[bodies_of_facets(bodies, surface)] = True
    return found

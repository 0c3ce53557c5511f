"""Moves of loose bodies as rigid ones, by pairings and without a tangent."""

from __future__ import annotations

from typing import NamedTuple

from mpi4py import MPI

import numpy as np
from scipy.sparse.csgraph import connected_components

from ..core.compat import Array, Indices, Mask
from ..core.discretization.surfaces import bodies_of_facets
from ..core.interaction import Interaction
from ..core.interface.zone_data import ZoneData
from ..core.problem import CoupledProblem
from ..diagnose.holding import on_springs, spring_stiffness, unheld_axes
from .loads import forces_on, resultants

# Largest number of moves
MOVES = 200
# Depth of a body that has landed or rests, in largest moves
DEEPEST = 0.2
# Share of a body's load that springs bear over a facet, up to which they do not hold it
WEAK = 1e-2
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


def may_move(problem: CoupledProblem) -> bool:
    """Whether bodies may move as rigid ones: no constraints link their nodes, and this
    step moves neither supports nor tools, as bodies rest where these end. Collective.
    """
    contact = problem.contact
    lacking = contact.unknowns.lacking(problem.bcs).of_u.any()
    moves = bool(lacking) or any(zone.motions.have_moved() for zone in contact.zones)
    return problem.constraints is None and not problem.comm.allreduce(moves, op=MPI.LOR)


class Loads(NamedTuple):
    """Loads of bodies, and where they may move.

    Attributes
    ----------
    every, amounts
        Resultants, and the sums of all forces by their amounts. Force, (bodies, d) and
        (bodies,).
    axes
        Whether each body may move along each axis: no condition holds it, nor do springs
        that bear a share of its load over a facet, (bodies, d).
    """

    every: Array
    amounts: Array
    axes: Mask

    @property
    def free(self) -> Array:
        """Resultants along the axes on which nothing holds bodies, (bodies, d). Force."""
        return np.where(self.axes, self.every, 0.0)


def loads_of(problem: CoupledProblem, facet: float) -> Loads:
    """Find the loads of all bodies at present. Collective."""
    every, amounts = resultants(problem, forces_on(problem))
    axes, springs = unheld_axes(problem, problem.constrained), on_springs(problem).T
    if (axes & springs).any():
        borne = facet * spring_stiffness(problem).T
        springs &= borne > WEAK * np.linalg.norm(every, axis=1)[:, None]
    return Loads(every, amounts, np.asarray(axes & ~springs))


def in_flight(pairs: Mask, loose: Mask) -> tuple[Mask, Indices]:
    """Find loose bodies that touch nothing but each other, (bodies,), and a number that
    those have in common which touch, (bodies,), given which bodies and tools do."""
    _, group = connected_components(pairs, directed=False)
    held = group[np.append(~loose, True)]
    return loose & ~np.isin(group[:-1], held), group[:-1]


def bodies_of(zone: ZoneData, contact: Interaction) -> Mask:
    """Whether slave or masters of a zone are on each body on this rank, (bodies,)."""
    bodies, facets = contact.system.bodies, zone.facets
    found = np.zeros(bodies.count, dtype=bool)
    for surface in (facets.slave_surface, facets.master_surface):
        found[bodies_of_facets(bodies, surface)] = True
    return found

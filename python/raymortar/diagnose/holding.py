"""Conditions, springs, masses and contact that hold bodies."""

from __future__ import annotations

from mpi4py import MPI

import numpy as np

from ..core.compat import Array, Indices, Mask
from ..core.convergence.balance import EPS, largest_by
from ..core.discretization.surfaces import bodies_of_facets
from ..core.interaction import Interaction
from ..core.interface.point_results import CLOSED, OPEN
from ..core.interface.zone_data import ZoneData
from ..core.problem import CoupledProblem

AXES = "xyz"
# Force of a unit translation that is rounding error, over the body's stiffness
_NO_SPRING = 1e6 * EPS


def free_axes(problem: CoupledProblem) -> Mask:
    """Whether neither conditions nor springs hold a body along each axis, (d, bodies).
    Collective."""
    axes = unheld_axes(problem, problem.constrained).T
    return np.asarray(axes & ~on_springs(problem)) if axes.any() else axes


def unheld_axes(problem: CoupledProblem, held: Mask) -> Mask:
    """Whether no dof of a body that is held keeps it along each axis, (bodies, d), given
    which owned dofs of u are held. Collective."""
    dim = problem.contact.u.function_space.dofmap.index_map_bs
    along = np.tile(np.eye(dim), len(held) // dim)
    return np.asarray(
        problem.comm.allreduce(sums_by_body(problem, held * along)) == 0.0
    ).T


def spring_stiffness(problem: CoupledProblem) -> Array:
    """Sum up the forces by which springs, masses and hoops resist a unit translation of
    each body along each axis, by their amounts, (d, bodies). Force per length.
    Collective."""
    groups, volume = problem.convergence.groups, problem.contact.system.volume
    sums = groups.sum(*(groups.on_rows(np.abs(part)) for part in volume.translation))
    return np.asarray(sums[:, : groups.bodies])


def has_no_springs(problem: CoupledProblem) -> Mask:
    """Whether a body is on no springs, and has no masses, (bodies,). Collective."""
    # Hoops may resist a growth of the radius
    axes = slice(int(problem.contact.system.axisymmetric), None)
    return ~on_springs(problem)[axes].any(axis=0)


def on_springs(problem: CoupledProblem) -> Mask:
    """Whether masses, springs or hoops resist a body's translation along each axis, (d,
    bodies). Collective."""
    groups, contact = problem.convergence.groups, problem.contact
    parts = contact.system.stiffness_diagonal, *contact.system.volume.translation
    sums = groups.sum(*(groups.on_rows(part**2) for part in parts))
    sizes = np.sqrt(sums[:, : groups.bodies])
    return np.asarray(sizes[1:] > _NO_SPRING * sizes[0])


def touched(contact: Interaction, count: int) -> Mask:
    """Whether each body has a point in contact, or one that adhesion holds. Collective."""
    return np.asarray(touching(contact, count).any(axis=1)[:count])


def touching(contact: Interaction, count: int, inside: bool = False) -> Mask:
    """Whether two bodies, the last of them tools, have a point in contact, or one that
    adhesion holds; or one that is `inside` the other, (bodies + 1, bodies + 1).
    Collective."""
    found = np.zeros((count + 1, count + 1), dtype=bool)
    seen = [(zone, zone.points()) for zone in contact.zones]
    bonds = [one.bond for one in contact.contacts if one.bond is not None]
    for zone, points in [*seen, *(pair for one in bonds for pair in one.holding())]:
        slave, master = bodies_at(contact, zone, points, met(points, inside))
        found[slave, master] = found[master, slave] = True
    contact.layout.comm.Allreduce(MPI.IN_PLACE, found, op=MPI.LOR)
    return found


def met(points: dict[str, Array], inside: bool) -> Mask:
    """Whether each point is in contact, or `inside` the master: a law at nodes closes in
    the mean only, where a corner may be inside."""
    found = points["status"] >= CLOSED
    if inside:
        found |= (points["status"] >= OPEN) & (points["gap"] < 0.0)
    return np.asarray(found)


def bodies_at(
    contact: Interaction, zone: ZoneData, points: dict[str, Array], at: Mask | Indices
) -> Indices:
    """Bodies of the slave and of the master at some points of a zone, all of which face
    one, (2, n). The number of a tool is the number of bodies."""
    bodies = contact.system.bodies
    slave = bodies_of_facets(bodies, zone.facets.slave_surface)[points["slave"][at]]
    if zone.facets.bodies:
        return np.array([slave, np.full(len(slave), bodies.count)])
    return np.array([slave, zone.cpp.master_bodies()[points["master"][at]]])


def sums_by_body(problem: CoupledProblem, values: Array) -> Array:
    """Sum values at the owned nodes or dofs of u over this rank's part of each body,
    (values, bodies)."""
    contact, n = problem.contact, problem.convergence.groups.bodies
    owned = contact.u.function_space.dofmap.index_map.size_local
    of = contact.system.bodies.dofs[:owned]
    of = np.repeat(of, values.shape[1] // max(owned, 1))
    return np.array([np.bincount(of, each, n) for each in values], dtype=float)


def largest_motions(contact: Interaction, u: Array) -> Array:
    """Find the largest component of the motion from u to the present of each body.
    Length. Collective."""
    change = np.abs(contact.u.x.array - u)
    by_node = change.reshape(-1, contact.u.function_space.dofmap.index_map_bs)
    most = largest_by(
        contact.system.bodies.dofs, by_node, contact.system.bodies.count
    ).max(axis=1)
    contact.layout.comm.Allreduce(MPI.IN_PLACE, most, op=MPI.MAX)
    return most

"""Bodies in contact that may move along it, as neither conditions nor friction hold them."""

from __future__ import annotations

from collections.abc import Iterator

from mpi4py import MPI

import numpy as np

from ..core.compat import Array
from ..core.discretization.surfaces import bodies_of_facets
from ..core.finding import Finding
from ..core.interaction import Interaction
from ..core.interface.point_results import CLOSED
from ..core.problem import CoupledProblem
from .failure import part_of
from .holding import AXES, free_axes

# Sum of the squared cosines between normals and a direction, of all closed points, below
# which contact does not hold a body along it: normals that differ by half a degree
HOLDS = 1e-4


def sliding_bodies(problem: CoupledProblem) -> Iterator[Finding]:
    """Find bodies that touch others without friction, and that nothing holds along them.
    Collective.

    Inertia, terms of others and viscous forces hold bodies in ways of their own.
    """
    contact = problem.contact
    if problem.terms or not part_of(problem).get("may_be_viscous", True):
        return
    free = free_axes(problem)
    if not free.any():
        return
    normals, names = (
        _normals(contact, free.shape[1]),
        problem.convergence.groups.names(),
    )
    for body in np.flatnonzero(free.any(axis=0)):
        total = float(np.trace(normals[body]))
        axes = np.flatnonzero(free[:, body])
        values, ways = np.linalg.eigh(normals[body][np.ix_(axes, axes)])
        none = ways[:, values <= HOLDS * total]
        if total > 0.0 and none.shape[1]:
            along = np.linalg.norm(none, axis=1) > np.sqrt(0.5) - HOLDS
            yield Finding(
                names[body],
                (),
                "nothing holds it along "
                f"{', '.join(AXES[i] for i in axes[along])}, so that its place is arbitrary",
                "Prescribe it there, or give friction",
                1.0,
                about=("sliding", body),
            )


def _normals(contact: Interaction, count: int) -> Array:
    """Sum the products of the normals at closed points with themselves by the bodies that
    they hold, (bodies, d, d); friction and ties hold along the surface, too. Collective.
    """
    dim = contact.u.function_space.dofmap.index_map_bs
    sums = np.zeros((count, dim, dim))
    for one in contact.contacts:
        holds_all = one.friction is not None or one.tied is not None
        for zone in one.zones:
            points = zone.points()
            closed = points["status"] >= CLOSED
            n = points["normal"][closed]
            each = n[:, :, None] * n[:, None, :]
            if holds_all:
                each = np.broadcast_to(np.eye(dim), each.shape)
            each = each * points["weight"][closed][:, None, None]
            slaves = bodies_of_facets(contact.system.bodies, zone.facets.slave_surface)
            slave = slaves[points["slave"][closed]]
            if zone.facets.bodies:
                np.add.at(sums, slave, each)
                continue
            master = zone.cpp.master_bodies()[points["master"][closed]]
            other = slave != master
            np.add.at(sums, slave[other], each[other])
            np.add.at(sums, master[other], each[other])
    contact.layout.comm.Allreduce(MPI.IN_PLACE, sums, op=MPI.SUM)
    return sums

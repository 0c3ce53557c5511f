"""Bodies in contact that may move along it, as neither conditions nor friction hold them."""

from __future__ import annotations

from collections.abc import Iterator

from mpi4py import MPI

import numpy as np

from ..core.compat import Array, Indices, Mask
from ..core.finding import Finding
from ..core.interaction import Interaction
from ..core.interface.point_results import CLOSED, OPEN
from ..core.problem import CoupledProblem
from .failure import part_of
from .holding import AXES, bodies_at, free_axes

# Sum of the squared cosines between normals and a direction, of all closed points, below
# which contact does not hold a body along it: normals that differ by half a degree
HOLDS = 1e-4
# Cosine of the angle between the surfaces at a closed point below which it is at an edge
SMOOTH = 0.9


def sliding_bodies(problem: CoupledProblem) -> Iterator[Finding]:
    """Find bodies that touch others without friction, and that nothing holds along them,
    one finding for all that are free along the same axes. Collective.

    Inertia, terms of others and viscous forces hold bodies in ways of their own.
    """
    contact = problem.contact
    if problem.terms or not part_of(problem).get("may_be_viscous", True):
        return
    free = free_axes(problem)
    if not free.any():
        return
    pressed, faced = _normals(contact, free.shape[1])
    names = problem.convergence.groups.names()
    sliding: dict[str, list[int]] = {}
    for body in np.flatnonzero(free.any(axis=0)):
        if not np.trace(pressed[body]) > 0.0:
            continue
        axes = np.flatnonzero(free[:, body])
        # A ball slides along a straight groove, whose normals stay the same
        along = _along(pressed[body], axes) | _along(faced[body], axes)
        if along.any():
            sliding.setdefault(", ".join(AXES[i] for i in axes[along]), []).append(body)
    for directions, (first, *others) in sliding.items():
        text = f"nothing holds it along {directions}, so that its place is arbitrary"
        if len(others) == 1:
            text += f", and that of {names[others[0]]}"
        elif others:
            text += f", and those of {len(others)} others"
        yield Finding(
            names[first],
            (),
            text,
            "Prescribe it there, or give friction",
            1.0,
            about=("sliding", directions),
        )


def _along(normals: Array, axes: Indices) -> Mask:
    """Whether contact with these normals holds nothing along each of some axes."""
    values, ways = np.linalg.eigh(normals[np.ix_(axes, axes)])
    total = np.trace(normals)
    none = ways[:, (values <= HOLDS * total) & (total > 0.0)]
    return np.asarray(np.linalg.norm(none, axis=1) > np.sqrt(0.5) - HOLDS)


def _normals(contact: Interaction, count: int) -> Array:
    """Sum the products of normals with themselves by the bodies that they hold, (2,
    bodies, d, d): of slaves at closed points, and of what all points face, where no edge
    between facets ends a slide; friction and ties hold along the surface, too.
    Collective.
    """
    dim = contact.u.function_space.dofmap.index_map_bs
    sums = np.zeros((2, count + 1, dim, dim))
    for one in contact.contacts:
        holds_all = one.friction is not None or one.tied is not None
        for zone in one.zones:
            points = zone.points()
            cosine = -np.einsum("nd,nd->n", points["normal"], points["master_normal"])
            # An edge that is in contact may hold bodies along the surface
            is_edge = (points["status"] >= CLOSED) & (cosine < SMOOTH)
            for total, name, least in zip(
                sums, ("normal", "master_normal"), (CLOSED, OPEN)
            ):
                at = points["status"] >= least
                n = points[name][at]
                each = n[:, :, None] * n[:, None, :]
                each[is_edge[at] | holds_all] = np.eye(dim)
                each = each * points["weight"][at][:, None, None]
                bodies = bodies_at(contact, zone, points, at)
                differ = bodies[0] != bodies[1]
                for of in bodies:
                    np.add.at(total, of[differ], each[differ])
    contact.layout.comm.Allreduce(MPI.IN_PLACE, sums)
    return sums[:, :-1]

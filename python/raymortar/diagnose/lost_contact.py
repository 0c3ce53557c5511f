"""Contact that a solve has lost: surfaces that passed each other, bodies set free.

A body that lifts off has not lost contact: its gap is open, or was open when the body
left.
"""

from __future__ import annotations

from mpi4py import MPI

import numpy as np

from ..compat import Array, Mask
from ..host.facets import format_point
from ..interaction import Interaction
from ..interface.faced import Path, path
from ..interface.point_results import CLOSED, OPEN
from ..interface.zones import ZoneData
from ..problem import CoupledProblem
from .passed_tools import have_gone_through
from .unheld import unheld

# Of a ray, see Contact.points
TOO_DEEP = 6


def lost_contact(problem: CoupledProblem, led: Mask | None = None) -> str | None:
    """How a converged solve has lost contact since the accepted step. Collective.

    Parameters
    ----------
    led
        As of `unheld`.

    Returns
    -------
    A sentence, the same on all ranks; None if contact is not lost.
    """
    contact = problem.contact
    found = [
        _passed_by_tools(zone, contact) if zone.facets.bodies else _lost(zone, contact)
        for zone in contact.zones
    ]
    return "; ".join([*filter(None, found), *unheld(problem, led)]) or None


def _lost(zone: ZoneData, contact: Interaction) -> str:
    """Tell how many facets have lost the master that they hit at the accepted step, and
    which is the farthest; "" for none. Collective."""
    comm, dim = contact.layout.comm, zone.facets.slave_surface.gdim
    way = path(zone, zone.faced, contact.u.x.array.reshape(-1, dim), comm)
    through, across = _distances(zone, way, comm)
    facets = comm.allreduce(int(np.count_nonzero(through + across)))
    if not facets:
        return ""
    ends = [(0.0, "")]
    for distances, verb in (
        (through, "passed into or through what they faced"),
        (across, "slid past the end of what they faced"),
    ):
        if distances.any():
            k = int(np.argmax(distances))
            text = f"{verb}, by up to {distances[k]:.3e}, at {format_point(way.x[k])}"
            ends.append((float(distances[k]), text))
    _, text = max(comm.allgather(max(ends)))
    return f"{facets} facets of slave tag {zone.facets.slave_tag} have {text}"


def _distances(zone: ZoneData, way: Path, comm: MPI.Comm) -> tuple[Array, Array]:
    """How far points are out of contact's reach: the depth behind the master that they
    hit at the accepted step, and the distance across. Zero where contact is not lost.
    Collective."""
    last, points = zone.faced, zone.points()
    hit = points["status"] >= OPEN
    sees = np.isin(last.facet, points["slave"][hit])
    is_inside = np.isin(last.facet, points["slave"][points["ray"] == TOO_DEEP])
    closed = bool(np.any(points["status"] >= CLOSED))
    is_apart = not comm.allreduce(closed, op=MPI.LOR)
    behind = 0.5 * (way.thickness + zone.thickness[0][last.facet])
    depth = zone.distance("depth")[last.facet]
    if zone.depth_is_default:
        depth = np.minimum(depth, np.minimum(way.thickness, behind))
    # Facets that are in contact again count by what they have sunk in this step
    sunk = np.where(sees, np.minimum(last.gap, 0.0) - way.gap, -way.gap)
    # While something is in contact, facets may hang beside a master's edge, below it,
    # and a slide may leave some behind
    lost = sees | is_inside | is_apart
    through = np.where(lost & (sunk > np.maximum(depth, way.slide)), sunk, 0.0)
    reach = np.maximum(zone.distance("reach")[last.facet], depth)
    lifted = way.gap >= way.slide
    torn = is_apart & last.closed & ~sees & ~lifted & (way.slide > reach)
    return through, np.where(torn, way.slide, 0.0)


def _passed_by_tools(zone: ZoneData, contact: Interaction) -> str:
    """Tell of slave facets that a rigid body has passed; "" for none. Collective."""
    facets = np.unique(zone.points()["slave"][zone.cpp.sunk_points()])
    count = contact.layout.comm.allreduce(len(facets))
    names = ", ".join(body.name for body in zone.facets.bodies)
    if count:
        return (
            f"{count} facets of slave tag {zone.facets.slave_tag} are on the wrong side "
            f"of a rigid body ({names}): it has passed through them, or its solid is not "
            "where it should be (the way of its normal or axis, hollow)"
        )
    if have_gone_through(zone, contact):
        return (
            f"a rigid body ({names}) has gone through slave tag {zone.facets.slave_tag}, "
            "or half through it: the slave's facets are too coarse for it or cannot give "
            "way any more, or its motion in this step is larger than the slave, or in "
            "another unit than the mesh"
        )
    return ""

"""Contact that a solve has lost: surfaces that passed each other, bodies set free.

A body that lifts off has not lost contact: its gap is open, or was open when the body
left.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from ..compat import Array, Mask
from ..host.bodies import bodies_of_facets
from ..interface.faced import Path, path
from ..interface.point_results import CLOSED, OPEN
from .balance import EPS, largest_by
from .passed_tools import have_gone_through

if TYPE_CHECKING:
    from ..interaction import Interaction
    from ..interface.zone_data import ZoneData
    from ..problem import CoupledProblem

AXES = "xyz"
# Of a ray, see Contact.points
TOO_DEEP = 6
# Force of a unit translation that is rounding error, over the body's stiffness
_NO_SPRING = 1e6 * EPS
# Displacement of a body that has not moved, over its size
_AT_REST = 1e-9


@dataclass(frozen=True)
class Loss:
    """Slave facets of one zone that have lost their master.

    Attributes
    ----------
    facets
        How many, on all ranks.
    distance
        Largest distance by which a facet has gone into the master or beside it. Length.
    what
        What happened to the worst facet: a sentence without its subject.
    """

    facets: int
    distance: float
    what: str


@dataclass(frozen=True)
class Now:
    """Where slave facets that faced a master are at the end of a solve.

    Attributes
    ----------
    seen
        Whether they hit a master, (n,).
    inside
        Whether one of their rays meets a master that is too deep, (n,).
    apart
        Whether nothing of the zone is in contact any more.
    """

    seen: npt.NDArray[np.bool_]
    inside: npt.NDArray[np.bool_]
    apart: bool

    @classmethod
    def of_zone(cls, zone: ZoneData, comm: MPI.Comm) -> Now:
        """Collective."""
        points, facet = zone.points(), zone.faced.facet
        closed = comm.allreduce(int(np.count_nonzero(points["status"] >= CLOSED)))
        return cls(
            np.isin(facet, points["slave"][points["status"] >= OPEN]),
            np.isin(facet, points["slave"][points["ray"] == TOO_DEEP]),
            closed == 0,
        )


def _distances(zone: ZoneData, way: Path, now: Now) -> tuple[Array, Array]:
    """How far points are out of contact's reach: the depth behind the master that they
    faced, and the distance across. Zero where contact is not lost."""
    faced = zone.faced
    behind = 0.5 * (way.thickness + zone.thickness[0][faced.facet])
    depth = zone.distance("depth")[faced.facet]
    if zone.depth_is_default:
        depth = np.minimum(depth, np.minimum(way.thickness, behind))
    # Facets that are in contact again count by what they have sunk in this step
    sunk = np.where(now.seen, np.minimum(faced.gap, 0.0) - way.gap, -way.gap)
    # While something is in contact, facets may hang beside a master's edge, below it,
    # and a slide may leave some behind
    lost = now.seen | now.inside | now.apart
    through = np.where(lost & (sunk > np.maximum(depth, way.slide)), sunk, 0.0)
    reach = np.maximum(zone.distance("reach")[faced.facet], depth)
    lifted = way.gap >= way.slide
    torn = now.apart & faced.closed & ~now.seen & ~lifted & (way.slide > reach)
    return through, np.where(torn, way.slide, 0.0)


def _loss(zone: ZoneData, u: Array, comm: MPI.Comm) -> Loss | None:
    """What a zone has lost since the accepted step. Collective."""
    way = path(zone, zone.faced, u, comm)
    through, across = _distances(zone, way, Now.of_zone(zone, comm))
    worst, mine = 0.0, ""
    for distances, verb in (
        (through, "passed into or through what they faced"),
        (across, "slid past the end of what they faced"),
    ):
        if distances.max(initial=0.0) > worst:
            k = int(np.argmax(distances))
            worst = float(distances[k])
            place = ", ".join(f"{x:.6g}" for x in way.x[k])
            mine = f"{verb}, by up to {worst:.3e}, at ({place})"
    facets = comm.allreduce(int(np.count_nonzero(through + across)))
    if not facets:
        return None
    distance, rank = comm.allreduce((worst, comm.rank), op=MPI.MAXLOC)
    return Loss(facets, distance, comm.bcast(mine, root=rank))


def _passed_by_tools(zone: ZoneData, contact: Interaction) -> list[str]:
    """Sentences on slave facets that a rigid body has passed. Collective."""
    comm, points = contact.layout.comm, zone.points()
    facets = np.unique(points["slave"][zone.cpp.sunk_points()])
    count = comm.allreduce(len(facets))
    names = ", ".join(body.name for body in zone.facets.bodies)
    if not count and have_gone_through(zone, contact):
        return [
            f"a rigid body ({names}) has gone through slave tag {zone.facets.slave_tag}, "
            "or half through it: the slave's facets are too coarse for it or cannot give "
            "way any more, or its motion in this step is larger than the slave, or in "
            "another unit than the mesh"
        ]
    if not count:
        return []
    return [
        f"{count} facets of slave tag {zone.facets.slave_tag} are on the wrong side of "
        f"a rigid body ({names}): it has passed through them, or its solid is not where "
        "it should be (the way of its normal or axis, hollow)"
    ]


def _lost_surfaces(contact: Interaction) -> list[str]:
    """Sentences on the zones that have lost contact. Collective."""
    comm = contact.layout.comm
    u = contact.u.x.array.reshape(-1, contact.u.function_space.mesh.geometry.dim)
    found = []
    for zone in contact.zones:
        if zone.facets.bodies:
            found += _passed_by_tools(zone, contact)
            continue
        loss = _loss(zone, u, comm)
        if loss is not None:
            found.append(
                f"{loss.facets} facets of slave tag {zone.facets.slave_tag} have "
                f"{loss.what}"
            )
    return found


def touched(contact: Interaction, count: int) -> Mask:
    """Whether each body has a point in contact. Collective."""
    found = np.zeros(count)
    for zone in contact.zones:
        points = zone.points()
        closed = points["status"] >= CLOSED
        slaves = bodies_of_facets(contact.bodies, zone.facets.slave_surface)
        found[slaves[points["slave"][closed]]] = 1.0
        if not zone.facets.bodies:
            found[zone.cpp.master_bodies()[points["master"][closed]]] = 1.0
    contact.layout.comm.Allreduce(MPI.IN_PLACE, found, op=MPI.MAX)
    return found > 0.0


def _moved(contact: Interaction, sizes: Array) -> Array:
    """Whether each body has moved since the accepted step. Collective."""
    change = np.abs(contact.u.x.array - contact.u_old)
    by_node = change.reshape(-1, contact.u.function_space.dofmap.index_map_bs)
    most = largest_by(contact.bodies.dofs, by_node, len(sizes)).max(axis=1)
    contact.layout.comm.Allreduce(MPI.IN_PLACE, most, op=MPI.MAX)
    return most > _AT_REST * sizes


def _springs(problem: CoupledProblem) -> npt.NDArray[np.bool_]:
    """Whether masses, springs or hoops resist a body's translation along each axis, (d,
    bodies). Collective."""
    groups, contact = problem.convergence.groups, problem.contact
    parts = [contact.stiffness_diagonal**2]
    parts += [forces**2 for forces in contact.translation_forces]
    sums = np.sqrt(groups.sum(*map(groups.on_rows, parts))[:, : groups.bodies])
    found: npt.NDArray[np.bool_] = sums[1:] > _NO_SPRING * sums[0]
    return found


def has_springs(problem: CoupledProblem) -> npt.NDArray[np.bool_]:
    """Whether a body is on springs, or has masses, (bodies,). Collective."""
    # What resists a growth of the radius may be hoops
    axes = slice(int(problem.contact.axisymmetric), None)
    found: npt.NDArray[np.bool_] = _springs(problem)[axes].any(axis=0)
    return found


def unheld(problem: CoupledProblem, led: Mask | None = None) -> list[str]:
    """Bodies that no condition, spring or contact holds and that have moved, with their
    directions. Collective.

    Parameters
    ----------
    led
        Whether each owned dof of u is part of the controlled displacement, which counts
        as prescribed.
    """
    groups = problem.convergence.groups
    dim, n = problem.contact.u.function_space.dofmap.index_map_bs, groups.bodies
    held = problem.constrained if led is None else problem.constrained | led
    component = np.arange(len(held)) % dim
    parts = [groups.on_rows(held & (component == i)) for i in range(dim)]
    fixed = np.atleast_2d(groups.sum(*parts))[:, :n]
    free = fixed == 0.0
    if free.any():
        free &= ~_springs(problem)
    if not free.any():
        return []
    free &= ~touched(problem.contact, n)
    free &= _moved(problem.contact, groups.size[:n])
    names = groups.names() if free.any() else []
    return [
        f"{names[body]} is held by nothing along "
        + ", ".join(AXES[i] for i in np.flatnonzero(free[:, body]))
        for body in np.flatnonzero(free.any(axis=0))
    ]


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
    return "; ".join(_lost_surfaces(problem.contact) + unheld(problem, led)) or None

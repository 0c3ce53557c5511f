"""Contact that a solve has lost: surfaces that passed each other, bodies set free.

A body that lifts off has not lost contact: its gap is open, or was open when the body
left.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from mpi4py import MPI

import numpy as np

from .. import _cpp
from ..core import on_demand
from ..core.compat import Array, Indices, Mask
from ..core.discretization.ranks import index_among, of_all
from ..core.discretization.surfaces import Surface, bodies_of_facets
from ..core.errors import format_point
from ..core.interaction import Interaction
from ..core.interface.point_results import CLOSED, OPEN
from ..core.interface.zone_data import (
    OppositePoints,
    ZoneData,
    nodes_of_facets,
    positions,
    unit_normals,
)
from ..core.problem import CoupledProblem
from .holding import (
    AXES,
    has_no_springs,
    largest_motions,
    on_springs,
    sums_by_body,
    touched,
    unheld_axes,
)

# Value of a point's ``ray`` where the master is too deep, see `Contact.points`
TOO_DEEP = 6
# Few solves need these modules
_have_gone_through = on_demand.function(f"{__package__}.tools.have_gone_through")
_rigid_motions = on_demand.function(f"{__package__}.rigid_motions.rigid_motions")
_places = on_demand.function(f"{__package__}.rigid_motions.places")
_grip_of = on_demand.function(f"{__package__}.rigid_motions.grip_of")
# Stiffness of conditions that counts as none, over the largest against a rigid motion
_NO_STIFFNESS = 1e-9
# Part of a unit motion that counts as none
_NO_PART = 1e-6
# Displacement of a body that has not moved, and of one that is far off, over its size
_AT_REST, _FAR_OFF = 1e-9, 0.01


def lost_contact(problem: CoupledProblem, led: Mask | None = None) -> str | None:
    """Tell how a converged solve has lost contact since the accepted step, None if it
    has not. The sentence is the same on all ranks. Collective."""
    return "; ".join([*passed_surfaces(problem), *unheld(problem, led)]) or None


def passed_surfaces(problem: CoupledProblem) -> list[str]:
    """Tell which surfaces have passed each other since the accepted step. Collective."""
    contact = problem.contact
    found = [
        _passed_by_tools(zone, contact) if zone.facets.bodies else _lost(zone, contact)
        for zone in contact.zones
        if not zone.tied
    ]
    return [*filter(None, found)]


def _lost(zone: ZoneData, contact: Interaction) -> str:
    """Tell how many facets have lost the master that they hit at the accepted step, and
    which is the farthest; "" for none. Collective."""
    comm, dim = contact.layout.comm, zone.facets.slave_surface.gdim
    u = contact.u.x.array.reshape(-1, dim)
    way = path(zone, zone.opposite, u)
    through, across = _distances(zone, contact, way)
    most = np.maximum(through, across)
    facets, farthest = comm.allreduce(int(np.count_nonzero(most))), (0.0, "")
    if most.any():
        k = int(np.argmax(most))
        slid = across[k] > through[k]
        verb = "slid past the end of" if slid else "passed into or through"
        place = f"by up to {most[k]:.3e}, at {format_point(way.x[k], way.x)}"
        place = f"{verb} what they faced, {place}"
        farthest = float(most[k]), place
    _, text = max(comm.allgather(farthest))
    return f"{facets} facets of {zone.facets.spoken} have {text}" if facets else ""


def _distances(zone: ZoneData, contact: Interaction, way: Path) -> tuple[Array, Array]:
    """Distances of points out of contact's reach: the depth behind the master that they
    hit at the accepted step, and the distance across. Zero where contact is not lost.
    Collective."""
    last, points = zone.opposite, zone.points()
    sees = np.isin(last.facet, points["slave"][points["status"] >= OPEN])
    is_inside = np.isin(last.facet, points["slave"][points["ray"] == TOO_DEEP])
    closed = bool(np.any(points["status"] >= CLOSED))
    is_apart = not zone.comm.allreduce(closed, op=MPI.LOR)
    behind = 0.5 * (way.thickness + zone.thickness[0][last.facet])
    depth = zone.distance("depth")[last.facet]
    if zone.depth_is_default:
        depth = np.minimum(depth, np.minimum(way.thickness, behind))
    # Facets that are in contact again count by how much deeper they are than before the step
    penetration = np.where(sees, np.minimum(last.gap, 0.0) - way.gap, -way.gap)
    # While something is in contact, facets may hang beside a master's edge, below it,
    # and a slide may leave some behind
    deep = penetration > np.maximum(depth, way.slide)
    lost = deep & (sees | is_inside | is_apart)
    lost |= _are_below(zone, contact, way, deep & last.closed & ~lost)
    reach = np.maximum(zone.distance("reach")[last.facet], depth)
    lifted = way.gap >= way.slide
    torn = is_apart & last.closed & ~sees & ~lifted & (way.slide > reach)
    return np.where(lost, penetration, 0.0), np.where(torn, way.slide, 0.0)


def _are_below(zone: ZoneData, contact: Interaction, way: Path, asked: Mask) -> Mask:
    """Tell which of the points that are asked for lie below a master, at any depth.
    Masters of bodies that none of them faced at the accepted step do not count. Points
    that hang beside an edge are not below. Collective."""
    found, comm = np.zeros_like(asked), zone.comm
    if zone.facets.meets_itself or not comm.allreduce(bool(asked.any())):
        return found
    _, master = zone.sides
    (ids,) = of_all(comm, zone.opposite.master[asked])
    faced = index_among(master.facet_ids, ids)
    bodies = bodies_of_facets(contact.system.bodies, master)
    (counting,) = of_all(comm, bodies[faced[faced >= 0]])
    counts = np.isin(bodies, counting)
    nodes = nodes_of_facets(master, master.node_degree)
    u = contact.u.x.array.reshape(-1, master.gdim)
    x = positions(master, *nodes, u).reshape(*master.facet_nodes.shape, -1)
    solid = _as_solid(master, x[counts], comm)
    more = ((0, 0), (0, 3 - way.x.shape[1]))
    x, n = (np.pad(part[asked], more) for part in (way.x, way.n))
    found[asked] = solid.distances_along(x, n) < 0.0
    return found


def _passed_by_tools(zone: ZoneData, contact: Interaction) -> str:
    """Tell of slave facets that a rigid body has passed; "" for none. Collective."""
    comm = contact.layout.comm
    facets = np.unique(zone.points()["slave"][passed_points(zone, comm)])
    count = comm.allreduce(len(facets))
    names = ", ".join(body.name for body in zone.facets.bodies)
    if count:
        return (
            f"{count} facets of {zone.facets.spoken} are on the wrong side "
            f"of a rigid body ({names}), perhaps by normal, axis or hollow"
        )
    if _have_gone_through(zone, contact):
        return (
            f"a rigid body ({names}) has gone through {zone.facets.spoken}, "
            "or half: its facets are too coarse, or a unit is wrong"
        )
    return ""


def unheld(problem: CoupledProblem, led: Mask | None = None) -> list[str]:
    """Name bodies that have moved and that nothing holds, with their directions.
    Collective.

    Owned dofs of u that are `led` count as prescribed.
    """
    held = problem.constrained if led is None else problem.constrained | led
    return _sentences(
        problem, [(one, False) for one in unheld_axes(problem, held)], _moved
    )


def far_on_springs(problem: CoupledProblem) -> list[str]:
    """Name bodies that have moved far on springs alone, not by their inertia. Collective."""
    if problem.inertia is not None:
        return []
    groups, contact = problem.convergence.groups, problem.contact
    count, springs = contact.system.bodies.count, on_springs(problem)
    free = unheld_axes(problem, problem.constrained)
    most, names = largest_motions(contact, contact.states.u_old), groups.names()
    found = []
    for body in np.flatnonzero(most > _FAR_OFF * groups.size[:count]):
        axes = free[body] & springs[:, body]
        axes[0] &= not contact.system.axisymmetric  # hoops
        along = ", ".join(AXES[i] for i in np.flatnonzero(axes))
        if along:
            way = f"has moved by {most[body]:.3g} along {along}"
            found.append(f"{names[body]}, which springs alone hold, {way}")
    others = f", and so have {len(found) - 1} more" * (len(found) > 1)
    return [found[0] + others] if found else []


def loose_bodies(problem: CoupledProblem, led: Array | None = None) -> list[str]:
    """Name bodies that can move or turn as a whole without any force. Collective.

    The residual has been evaluated. A controlled displacement, given by the weights of
    the owned dofs of u, counts as prescribed.
    """
    modes = _rigid_motions(_places(problem.contact))
    grip = _grip_of(problem, modes, problem.constrained)
    if problem.contact.system.axisymmetric:  # hoops hold all but the way along the axis
        grip += np.diag([1.0, 0.0, 1.0])[:, :, None]
    if led is not None:
        lead = problem.comm.allreduce(sums_by_body(problem, led * modes))
        size = np.abs(lead).max(initial=0.0) or 1.0
        grip += lead[:, None] * lead[None] / size**2
    motions = [_free_motions(one) for one in np.moveaxis(grip, 2, 0)]
    return _sentences(problem, motions, has_no_springs)


def _sentences(
    problem: CoupledProblem,
    motions: Sequence[tuple[Mask, bool]],
    counts: Callable[[CoupledProblem], Mask],
) -> list[str]:
    """Name bodies that count and that neither springs nor contact hold, of those that
    may move along some axes, or turn, each."""
    if not any(axes.any() or turns for axes, turns in motions):
        return []
    free = counts(problem) & ~touched(problem.contact, len(motions))
    if not free.any():
        return []
    springs, names, found = on_springs(problem), problem.convergence.groups.names(), []
    for body in np.flatnonzero(free):
        axes, turns = motions[body]
        along = [AXES[i] for i in np.flatnonzero(axes & ~springs[:, body])]
        texts = [f"is held by nothing along {', '.join(along)}"] * bool(along)
        if texts or turns:
            text = " and ".join(texts + ["may turn"] * turns)
            found.append(f"{names[body]} {text}")
    return found


def _free_motions(grip: Array) -> tuple[Mask, bool]:
    """Find the axes along which a body can move, and whether it can turn, from the stiffness
    against its rigid motions, (motions, motions)."""
    dim = 2 if len(grip) == 3 else 3
    values, motions = np.linalg.eigh(grip)
    none = motions[:, values <= _NO_STIFFNESS * max(values.max(), _NO_PART)]
    if not none.shape[1]:
        mixed, count = np.eye(none.shape[1]), 0
    else:
        _, turns, mixed = np.linalg.svd(none[dim:])
        count = int(np.count_nonzero(turns > _NO_PART))
    straight = np.linalg.norm(none[:dim] @ mixed[count:].T, axis=1)
    return straight > _NO_PART, count > 0


def _moved(problem: CoupledProblem) -> Mask:
    """Whether each body has moved since the accepted step. Collective."""
    sizes = problem.convergence.groups.size[: problem.contact.system.bodies.count]
    most = largest_motions(problem.contact, problem.contact.states.u_old)
    return np.asarray(most > _AT_REST * sizes)


# Ways of slave facets from the points opposite to them at the accepted step


@dataclass(frozen=True)
class Path:
    """Places of the slave points relative to those opposite to them. Lengths."""

    x: Array  # present positions of the slave points, (n, d)
    n: Array  # their normals, (n, d)
    gap: Array  # of the master's point along the slave's normal, (n,)
    slide: Array  # across the normal, (n,)
    thickness: Array  # of the master behind its facet, (n,)


def path(zone: ZoneData, opposite: OppositePoints, u: Array) -> Path:
    """Present positions of slave points and of those opposite to them. Collective.

    The ranks that own the masters' facets give where their points are, and the
    thickness behind them.
    """
    comm, (surface, master) = zone.comm, zone.sides
    x = positions(surface, opposite.facet, opposite.xi, u)
    n = unit_normals(surface, opposite.facet, opposite.xi, u)
    ids, eta = of_all(comm, opposite.master, opposite.eta)
    answers = np.zeros((len(ids), master.gdim + 1))
    local = index_among(master.facet_ids, ids)
    here = local >= 0
    answers[here, :-1] = positions(master, local[here], eta[here], u)
    thickness = np.minimum(zone.thickness[1][local[here]], np.finfo(float).max)
    answers[here, -1] = thickness
    comm.Allreduce(MPI.IN_PLACE, answers)
    start = sum(comm.allgather(len(x))[: comm.rank])
    mine = answers[start : start + len(x)]
    way = mine[:, :-1] - x
    gap = np.einsum("nd,nd->n", way, n)
    slide = np.linalg.norm(way - gap[:, None] * n, axis=1)
    return Path(x, n, gap, slide, mine[:, -1])


def passed_points(zone: ZoneData, comm: MPI.Comm) -> Indices:
    """Find this rank's points that are too deep in the master for contact, or that a
    rigid body has passed, by number. Collective."""
    found = zone.cpp.penetrating_points()
    if not zone.facets.bodies or not comm.allreduce(len(found)):
        return found
    # Some may be beside a body that is at the back of theirs
    surface = zone.facets.slave_surface
    x = zone.cpp.slave_positions()[surface.facet_nodes]
    return zone.cpp.penetrating_points(_as_solid(surface, x, comm))


def _as_solid(surface: Surface, x: Array, comm: MPI.Comm) -> _cpp.Tool:
    """Make a solid of a surface's facets on all ranks. `x` has the nodes of this rank's,
    (facets, nodes, d). Collective."""
    (every,) = of_all(comm, x)
    nodes = np.arange(every.shape[0] * every.shape[1], dtype=np.int32)
    shape = getattr(_cpp.Shape, surface.shape)
    return _cpp.facet_tool(shape, surface.node_degree, every.ravel(), nodes)

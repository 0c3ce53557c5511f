"""Forces, energies and counts summed over integration points and ranks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from ..core.compat import Array, Indices, Mask
from ..core.discretization.facets import dot
from ..core.discretization.layout import CoupledRows
from ..core.interface.point_results import CLOSED, OPEN, OfPoints, pressures
from ..core.interface.zone_data import ZoneData
from ..core.target import Target
from .communication import Communication, communication
from .tractions import (
    along_normal,
    arms,
    between_nodes,
    have_feet,
    largest_pressure,
    levers,
    seen_points,
    traction_part,
    tractions,
)


@dataclass(frozen=True)
class Resultant:
    """Force and moment of contact on a slave surface.

    For solids of revolution all values are sums over a full turn. The force is along
    the axis, (0, F_z), and the moment is 0, as radial tractions cancel.

    Attributes
    ----------
    force
        (d,). In 2D per unit thickness.
    moment
        About the origin: (3,) in 3D, in 2D a number per unit thickness. Force times
        length.
    normal, tangential
        Parts of the force, (d,), that come from tractions along the normal of
        `Contact`'s frame and from those across it, point by point: friction is
        ``tangential``, and on a curved surface both may have any direction. Their sum
        is ``force``.
    radial
        For solids of revolution the integral of radial tractions over the surface,
        2 pi r times their line load; None for other bodies.
    """

    force: Array
    moment: Array | float
    normal: Array
    tangential: Array
    radial: float | None = None


@dataclass
class Statistics:
    """Counts over all ranks, and CPU seconds of the slowest rank.

    Zones add up. If nothing else is said, a count belongs to the last `Contact.update`,
    and seconds to the last time that a stage ran.

    Attributes
    ----------
    slave_facets, master_facets
        Facets with the tags of slaves and masters.
    candidates, culled, clipped
        Pairs of facets that the search found; those that were out of reach; pairs of
        their patches that were clipped.
    pairs, segments
        Pairs of facets that overlap, and the segments that they are cut into.
    points, hits, active_points, slip_points
        Integration points; those whose ray meets a master within the search distances
        (with none, bodies are too far apart, or do not face each other); those in
        contact; those whose slip was computed, with friction all hits: of
        `points()["status"]` count `Status.SLIP` for those that slip.
    degenerate
        Slave facets without a usable normal.
    min_gap, max_gap
        Over the points that are hit, with the offset. Length.
    max_pressure
        Over the points that are hit, of dual multipliers over the nodes of their facets.
        Traction, positive in compression.
    candidate_builds, halo_builds, pairings, pairings_skipped, preallocations
        Sums since the start: searches, exchanges of facets between ranks, pairings,
        calls in which nothing had moved, and preallocations of matrices.
    residual_blocks, tangent_blocks, lifted_blocks, skipped_blocks, lookups
        Sums since the start: blocks that were computed, tangent blocks for Dirichlet
        increments, blocks left out because they are zero, and blocks whose place in the
        matrix had to be found.
    bytes_sent
        Sum since the start.
    seconds_halo, seconds_candidates, seconds_segments, seconds_rays
        Time of the stages of a pairing. CPU seconds.
    seconds_residual, seconds_tangent
        Time of the last residual and of the last tangent. CPU seconds.
    communication
        Messages and bytes between ranks: in all (`total`), and of the rank that sends
        most (`largest`).
    """

    slave_facets: int = 0
    master_facets: int = 0
    candidates: int = 0
    clipped: int = 0
    culled: int = 0
    pairs: int = 0
    segments: int = 0
    points: int = 0
    hits: int = 0
    slip_points: int = 0
    active_points: int = 0
    degenerate: int = 0
    candidate_builds: int = 0
    halo_builds: int = 0
    pairings: int = 0
    pairings_skipped: int = 0
    preallocations: int = 0
    residual_blocks: int = 0
    tangent_blocks: int = 0
    lifted_blocks: int = 0
    skipped_blocks: int = 0
    lookups: int = 0
    bytes_sent: int = 0
    min_gap: float = np.inf
    max_gap: float = -np.inf
    max_pressure: float = 0.0
    seconds_halo: float = 0.0
    seconds_candidates: float = 0.0
    seconds_segments: float = 0.0
    seconds_rays: float = 0.0
    seconds_residual: float = 0.0
    seconds_tangent: float = 0.0
    communication: Communication = field(default_factory=Communication)

    def __str__(self) -> str:
        if not self.hits:
            return f"none of {self.points} slave points meets a master within reach"
        return (
            f"{self.pairs} pairs, {self.segments} segments, {self.hits} of "
            f"{self.points} points hit, {self.active_points} active, gap "
            f"{self.min_gap:.3e} to {self.max_gap:.3e}"
        )


def statistics(zones: Sequence[ZoneData], layout: CoupledRows) -> Statistics:
    """Count over all zones and ranks. Collective."""
    found = [_counts(zone) for zone in zones]
    traffic = [zone.cpp.traffic(layout.ranges, layout.comm.rank) for zone in zones]
    total = Statistics(communication=communication(traffic, layout.comm))
    names = [one.name for one in fields(Statistics) if one.name != "communication"]
    most = [n for n in names if n.startswith(("max_", "seconds_"))]
    counts = [n for n in names if n not in ("min_gap", *most)]
    reductions: list[tuple[MPI.Op, Any, list[str]]] = [
        (MPI.MIN, np.min, ["min_gap"]),
        (MPI.MAX, np.max, most),
        (MPI.SUM, np.sum, counts),
    ]
    for op, reduce, chosen in reductions:
        values = reduce([[getattr(one, n) for n in chosen] for one in found], axis=0)
        layout.comm.Allreduce(MPI.IN_PLACE, values, op=op)
        vars(total).update(zip(chosen, values.tolist()))
    return total


def _counts(zone: ZoneData) -> Statistics:
    """Count over the points of one zone on this rank."""
    found, points = Statistics(**zone.statistics()), zone.points()
    hit = points["status"] >= OPEN
    # Boxes overlap, but the facets do not face each other within reach
    found.culled = max(found.candidates - found.clipped, 0)
    found.active_points = int(np.count_nonzero(points["status"] >= CLOSED))
    found.slip_points = found.hits if "slip" in points else 0
    found.min_gap = points["gap"][hit].min(initial=np.inf)
    found.max_gap = points["gap"][hit].max(initial=-np.inf)
    found.max_pressure = largest_pressure(zone, points, hit)
    return found


def _moments(x: Array, forces: Array) -> Array:
    """Multiply x cross force, (..., 3), or (..., 1) in 2D, which NumPy 2 lacks."""
    if x.shape[-1] == 3:
        return np.cross(x, forces)
    return x[..., :1] * forces[..., 1:] - x[..., 1:] * forces[..., :1]


def _plain(moment: Array) -> Array | float:
    """Give a moment as a number in 2D."""
    return moment if len(moment) == 3 else float(moment[0])


def resultant(
    zone: ZoneData, master: int | None = None, at_hits: bool = False
) -> Resultant:
    """Sum up force and moment on the slave side of a zone. Collective.

    Of the master with an index alone, or of all and points without a hit. Tractions have
    the arms of the slave, with the couple of friction over the gap, theory (3); or, if
    asked, those of the master where the two are not the same, theory (4.22).
    """
    if zone.facets.meets_itself:
        return mutual(zone)
    points = seen_points(zone)
    if master is not None:
        points = _chosen(points, zone.masters_of(points) == master)
    return _sum_up(zone, points, at_hits)


def _chosen(points: dict[str, Array], mine: Mask) -> dict[str, Array]:
    """Some of the points."""
    return {name: values[mine] for name, values in points.items()}


def mutual(
    zone: ZoneData, one: Sequence[int] | None = None, other: Sequence[int] | None = None
) -> Resultant:
    """Sum up force and moment on some parts of a surface from others. Collective.

    Both are integrated over: what acts on a part is the traction at its own points, and
    minus that of points that hit it, theory (3.15). None: all parts; of a surface that
    meets others, all of these.
    """
    points = seen_points(zone)
    own, met = zone.parts_of(points)

    def among(part: Indices, chosen: Sequence[int] | None) -> Mask:
        return part >= 0 if chosen is None else np.isin(part, chosen)

    if not zone.facets.meets_itself:
        return _sum_up(zone, _chosen(points, among(own, one)))
    acts = _sum_up(zone, _chosen(points, among(own, one) & among(met, other)))
    hits = _chosen(points, among(own, other) & among(met, one))
    return added([acts, _opposite(_sum_up(zone, hits, True))])


def _opposite(of: Resultant) -> Resultant:
    """Reverse a resultant: force and moment on the other side."""
    radial = None if of.radial is None else -of.radial
    return Resultant(-of.force, -of.moment, -of.normal, -of.tangential, radial)


def _sum_up(
    zone: ZoneData, points: dict[str, Array], at_hits: bool = False
) -> Resultant:
    """Sum up forces and moments at points of all ranks. Collective."""
    dim = zone.facets.slave_surface.gdim
    weight = points["weight"][:, None]
    forces = weight * points.get("dual", points["traction"])
    couples = forces - along_normal(points, forces)
    over = arms(zone, points)
    if at_hits:
        hits = points["x"] + points["distance"][:, None] * points["normal"]
        feet = have_feet(zone, points)[:, None]
        moments = _moments(over, couples) + _moments(points["x"], forces)
        moments = np.where(feet, moments, _moments(hits, forces))
    else:
        places, turned = levers(zone, points)
        moments = _moments(over, np.einsum("qij,qj->qi", turned, couples))
        moments += _moments(places, forces)
    normal = along_normal(points, weight * points["traction"])
    sums = np.concatenate([one.sum(axis=0) for one in (forces, normal, moments)])
    zone.comm.Allreduce(MPI.IN_PLACE, sums)
    force, normal, moment = np.split(sums, [dim, 2 * dim])
    if zone.facets.slave_surface.axisymmetric:  # radial parts cancel in a full turn
        radial, force[0], normal[0] = float(force[0]), 0.0, 0.0
        return Resultant(force, 0.0, normal, force - normal, radial)
    return Resultant(force, _plain(moment), normal, force - normal)


def resultant_on(zones: Sequence[ZoneData], body: Target) -> Resultant:
    """Sum up force and moment about its centre on a rigid body. Collective."""
    # The equations of a free body take tractions where they act on it
    on_slaves = [
        resultant(zone, zone.facets.bodies.index(body), body.is_free)
        for zone in zones
        if body in zone.facets.bodies
    ]
    found = _opposite(added(on_slaves))
    if found.radial is not None:
        return replace(found, moment=0.0)
    of_force = _plain(_moments(body.place[: len(found.force)], found.force))
    return replace(found, moment=found.moment - of_force)


def added(parts: Sequence[Resultant]) -> Resultant:
    """Add several resultants."""
    names = [f.name for f in fields(Resultant) if getattr(parts[0], f.name) is not None]
    return Resultant(
        **{name: sum(getattr(part, name) for part in parts) for name in names}
    )


def friction_work(zones: Sequence[ZoneData], multiplier: Function | None) -> float:
    """Integrate what friction takes in the step, theory (7.2): at points, or at nodes
    where the law holds there, with the weights of the means that it takes. Collective.
    """
    mine = sum(_friction_work(zone, multiplier) for zone in zones)
    return float(zones[0].comm.allreduce(mine))


def _friction_work(zone: ZoneData, multiplier: Function | None) -> float:
    """The share of a zone on this rank."""
    points = zone.points()
    has_own = multiplier is None or zone.dual_multiplier is None
    if has_own or "elastic_slip" in points:  # which stores a part
        return float(points["weight"] @ points["dissipated"])
    at = tractions(zone, multiplier)
    hit = points["status"] >= OPEN
    works = between_nodes(zone, -dot(at["traction"], at["slip"])[:, None], points, hit)
    return float(points["weight"][hit] @ works[:, 0])


def slip_work(zones: Sequence[ZoneData]) -> float:
    """Integrate what tractions take over the step's slip, with what springs store.
    Collective."""
    return _integral(zones, lambda p: -dot(p["traction"], p["slip"]))


def stored_energy(zones: Sequence[ZoneData], part: str) -> float:
    """Integrate |t|^2 / (2 gamma), or that of a part of t. Collective."""

    def density(points: dict[str, Array]) -> Array:
        t = traction_part(points, part)
        found, squared = np.zeros(len(t)), dot(t, t)
        # Points of a tie that meet no master have no coefficient
        np.divide(squared, 2.0 * points["gamma"], found, where=squared > 0.0)
        return found

    return _integral(zones, density)


def elastic_energy(zones: Sequence[ZoneData]) -> float:
    """Integrate what elastic slip stores, theory (4.55). Collective."""
    return _integral(zones, lambda p: p["elastic_energy"])


def work_on_gaps(zones: Sequence[ZoneData]) -> float:
    """Integrate |t_n g|, which a law at each point leaves zero. Collective."""

    def density(points: dict[str, Array]) -> Array:
        hit = points["status"] >= OPEN
        return np.abs(pressures(points) * np.where(hit, points["gap"], 0.0))

    return _integral(zones, density)


def _integral(zones: Sequence[ZoneData], density: OfPoints) -> float:
    """Integrate over the slave surfaces of all ranks. Collective."""
    all_points = [zone.points() for zone in zones]
    mine = sum(float(points["weight"] @ density(points)) for points in all_points)
    return float(zones[0].comm.allreduce(mine))

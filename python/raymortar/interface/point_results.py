"""Fields, resultants and counts from the integration points."""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from enum import IntEnum
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from .. import compat
from ..compat import Array
from ..host.communication import Communication, communication
from ..host.layout import CoupledRows
from ..host.reference_facets import shape_functions

if TYPE_CHECKING:
    from ..rigid.body import Body
    from .zone_data import ZoneData


class PointStatus(IntEnum):
    """Status of an integration point: ``Contact.points()["status"]``.

    >>> slips = points["status"] == PointStatus.SLIP
    """

    NO_HIT = 0
    """Its ray meets no master, or it stands for an uncovered part of a facet."""
    OPEN = 1
    """Its ray meets a master that it does not touch."""
    STICK = 2
    """In contact, without slip in this step."""
    SLIP = 3
    """In contact, and slips; without friction every point in contact."""


class NodeStatus(IntEnum):
    """Status of a slave node: values of the Function ``Contact.status()``."""

    OPEN = 0
    """Not in contact, or without a master in reach: see ``Contact.coverage()``."""
    STICK = 1
    """In contact, without slip in this step."""
    SLIP = 2
    """In contact, and slips; without friction every node in contact."""


# As plain numbers; from CLOSED on a point is in contact
OPEN, CLOSED = int(PointStatus.OPEN), int(PointStatus.STICK)


@dataclass(frozen=True)
class Resultant:
    """Force and moment about the origin of contact on a slave surface, (d,) and (3,)
    in 3D; in 2D per unit thickness, the moment a number.

    ``normal`` and ``tangential`` (d,) are the parts of the force that come from
    tractions along the normal of `Contact`'s frame and from those across it, point by
    point: friction is ``tangential``, and on a curved surface both may have any
    direction. Their sum is ``force``.

    For solids of revolution all values are those of a full turn. The force is along the
    axis, (0, F_z), and the moment is 0, as radial tractions cancel. ``radial`` is the
    integral of radial tractions over the surface, 2 pi r times their line load. For
    other bodies it is None.
    """

    force: Array
    moment: Array | float
    normal: Array
    tangential: Array
    radial: float | None = None


@dataclass
class Statistics:
    """Counts over all ranks, CPU seconds of the slowest rank.

    Of the last `Contact.update`, but for these sums since the start:
    ``candidate_builds``, ``halo_builds``, ``pairings``, ``pairings_skipped`` (nothing
    had moved), ``preallocations`` of matrices, ``residual_blocks``, ``tangent_blocks``,
    ``lifted_blocks`` (tangent blocks for Dirichlet increments), ``skipped_blocks`` (left
    out of tangents because they are zero), ``lookups`` (blocks whose place in the
    matrix had to be found) and ``bytes_sent``. Zones add up.

    ``hits`` of ``points`` met the master within the search distances; with none, the
    bodies are out of reach of each other. ``slip_points`` of them needed their slip.
    Seconds are CPU seconds of the last time each stage ran.
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
        gap = f"gap {self.min_gap:.3e} to {self.max_gap:.3e}"
        return (
            f"{self.pairs} pairs, {self.segments} segments, {self.hits} of "
            f"{self.points} points hit, {self.active_points} active, "
            + (gap if self.hits else "bodies out of reach of each other")
        )


def _reductions() -> list[tuple[MPI.Op, Callable[[Any, Any], Any], list[str]]]:
    """MPI operation, Python function and names, for each way to combine counts."""
    names = [f.name for f in fields(Statistics) if f.name != "communication"]
    largest = [n for n in names if n in ("max_gap", "max_pressure") or "seconds" in n]
    sums = [n for n in names if n not in largest and n != "min_gap"]
    return [
        (MPI.MIN, min, ["min_gap"]),
        (MPI.MAX, max, largest),
        (MPI.SUM, operator.add, sums),
    ]


def statistics(zones: Sequence[ZoneData], layout: CoupledRows) -> Statistics:
    """Counts of all zones and ranks. Collective."""
    reductions = _reductions()
    total = Statistics(communication=communication(zones, layout))
    for zone in zones:
        local = Statistics(**zone.statistics())
        points = zone.points()
        hit = points["status"] >= OPEN
        # Boxes overlap, but the facets do not face each other within reach
        local.culled = max(local.candidates - local.clipped, 0)
        local.active_points = int(np.count_nonzero(points["status"] >= CLOSED))
        local.slip_points = local.hits if "slip" in points else 0
        if hit.any():
            local.min_gap = float(points["gap"][hit].min())
            local.max_gap = float(points["gap"][hit].max())
            local.max_pressure = float(-points["pressure"][hit].min())
        for _, combine, names in reductions:
            for name in names:
                value = combine(getattr(total, name), getattr(local, name))
                setattr(total, name, value)
    for op, _, names in reductions:
        values = np.array([getattr(total, name) for name in names])
        layout.comm.Allreduce(MPI.IN_PLACE, values, op=op)
        for name, value in zip(names, values.tolist()):
            setattr(total, name, value)
    return total


def _moments(x: Array, forces: Array) -> Array:
    """x cross force, (n, 3) in 3D and (n,) in 2D, which NumPy 2 no longer offers."""
    if x.shape[1] == 3:
        return np.cross(x, forces)
    return x[:, 0] * forces[:, 1] - x[:, 1] * forces[:, 0]


def moments_on_slave(zone: ZoneData, points: dict[str, Array], forces: Array) -> Array:
    """Moments of contact forces (n, d) on the slave about the origin: with the couple
    of their tangential parts over the gap, as in theory (3)."""
    friction = forces - along_normal(points, forces)
    return _moments(points["x"], forces) + _moments(zone.arms(points), friction)


def resultant(zone: ZoneData, comm: MPI.Comm) -> Resultant:
    """Force and moment on the slave side of a zone. Collective."""
    points = zone.points()
    forces = points["weight"][:, None] * points["traction"]
    moment = moments_on_slave(zone, points, forces).sum(axis=0)
    normal = along_normal(points, forces).sum(axis=0)
    force = comm.allreduce(forces.sum(axis=0))
    normal = comm.allreduce(normal)
    moment = comm.allreduce(moment)
    moment = moment if np.ndim(moment) else float(moment)
    return _of_zone(zone, Resultant(force, moment, normal, force - normal))


def _of_zone(zone: ZoneData, found: Resultant) -> Resultant:
    """A resultant as it is reported: of a full turn if the zone is axisymmetric."""
    if not zone.facets.slave_surface.axisymmetric:
        return found
    along = np.array([0.0, 1.0])
    return Resultant(
        along * found.force,
        0.0,
        along * found.normal,
        along * found.tangential,
        float(found.force[0]),
    )


def resultants(zone: ZoneData, comm: MPI.Comm) -> list[Resultant]:
    """Forces and moments on the slave side of a zone, one for each of its master tags.
    Collective."""
    points = zone.points()
    master, dim = zone.masters_of(points), points["x"].shape[1]
    forces = points["weight"][:, None] * points["traction"]
    # Ranks without points know the width, too
    moments = moments_on_slave(zone, points, forces)
    moments = moments.reshape(len(forces), 3 if dim == 3 else 1)
    values = np.hstack([forces, along_normal(points, forces), moments])
    sums = np.zeros((zone.master_tags.count, values.shape[1]))
    np.add.at(sums, master[master >= 0], values[master >= 0])
    comm.Allreduce(MPI.IN_PLACE, sums)
    each = [
        Resultant(
            row[:dim],
            row[2 * dim :] if dim == 3 else float(row[-1]),
            row[dim : 2 * dim],
            row[:dim] - row[dim : 2 * dim],
        )
        for row in sums
    ]
    return [_of_zone(zone, found) for found in each]


def resultant_on(zones: Sequence[ZoneData], body: Body, comm: MPI.Comm) -> Resultant:
    """Force on a rigid body, and moment about its centre. Collective."""
    dim = zones[0].facets.slave_surface.gdim
    sums = np.zeros(2 * dim + (3 if dim == 3 else 1))
    for zone in zones:
        if body not in zone.facets.bodies:
            continue
        points = zone.points()
        mine = zone.masters_of(points) == zone.facets.bodies.index(body)
        points = {name: values[mine] for name, values in points.items()}
        forces = -points["weight"][:, None] * points["traction"]
        # Ranks without points know the width, too
        width = len(sums) - 2 * dim
        place = np.broadcast_to(body.place[:dim], forces.shape)
        if body.is_free:  # its equations take whole tractions where they hit
            at = points["x"] + points["distance"][:, None] * points["normal"]
            moments = _moments(at - place, forces)
        else:
            moments = moments_on_slave(zone, points, forces) - _moments(place, forces)
        moments = moments.reshape(len(forces), width)
        parts = forces, along_normal(points, forces), moments
        sums += np.hstack(parts).sum(axis=0)
    comm.Allreduce(MPI.IN_PLACE, sums)
    moment: Array | float = sums[2 * dim :] if dim == 3 else float(sums[-1])
    force, normal = sums[:dim], sums[dim : 2 * dim]
    return _of_zone(zones[0], Resultant(force, moment, normal, force - normal))


def added(parts: Sequence[Resultant]) -> Resultant:
    """The sum of several resultants."""
    names = [f.name for f in fields(Resultant) if getattr(parts[0], f.name) is not None]
    return Resultant(
        **{name: sum(getattr(part, name) for part in parts) for name in names}
    )


def along_normal(points: dict[str, Array], vectors: Array) -> Array:
    """Parts of vectors (n, d) at the points along the normals of the law's frame."""
    n = points["contact_normal"]
    return np.einsum("qi,qi->q", vectors, n)[:, None] * n


def pressures(points: dict[str, Array]) -> Array:
    """Normal part of the tractions at the points, positive in compression, (n,)."""
    normal = along_normal(points, points["traction"])
    return -np.einsum("qi,qi->q", normal, points["contact_normal"])


def nodal_average(
    zones: Sequence[ZoneData],
    quantity: Callable[[dict[str, Array]], Array],
    field: Function,
    hits_only: bool = True,
) -> None:
    """Average of a point quantity around each slave node, NaN elsewhere. Collective.

    Points weigh by their area times the square of the node's shape function, which
    is positive and largest next to the node.

    Parameters
    ----------
    zones
        Zones.
    quantity
        Gives values (n,) or (n, d) from the arrays of `Contact.points`.
    field
        Scalar or vector function that is set.
    hits_only
        Leave out points whose ray meets no master.
    """
    V = field.function_space
    index_map, bs = V.dofmap.index_map, V.dofmap.index_map_bs
    sums = compat.create_la_vector(index_map, bs)
    weights = compat.create_la_vector(index_map, 1)
    degree = compat.element_info(V).degree
    for zone in zones:
        points = zone.points()
        hit = points["status"] >= (OPEN if hits_only else 0)
        values = quantity(points)[hit].astype(np.float64).reshape(-1, bs)
        shape = zone.facets.slave_surface.shape
        N, _ = shape_functions(shape, degree, points["xi"][hit])
        w = points["weight"][hit, None] * N**2
        dofs = zone.result_table[points["slave"][hit]]
        np.add.at(weights.array, dofs, w)
        table = sums.array.reshape(-1, bs)
        np.add.at(table, dofs, w[:, :, None] * values[:, None, :])
    for vector in (sums, weights):
        compat.scatter_reverse_add(vector)
        compat.scatter_forward(vector)
    with np.errstate(invalid="ignore", divide="ignore"):
        average = sums.array.reshape(-1, bs) / weights.array[:, None]
    field.x.array[:] = average.ravel()

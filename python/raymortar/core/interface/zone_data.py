"""The data of a zone: one slave surface, the masters that it meets, and its history."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from ... import _cpp
from ..compat import Array, Indices, Mask
from ..discretization.facets import (
    Global,
    facet_nodes,
    interpolate,
    normals,
    shape_functions,
    units,
)
from ..discretization.ranks import index_among, of_all
from ..discretization.surfaces import Surface, surface_sizes
from ..discretization.tagged import ZoneFacets
from ..target import Motions, Target

Masters = tuple[int | str, ...] | tuple[Target, ...]


class MasterTags:
    """Tells which master of a slave a facet belongs to, or which part. Collective.

    Points may hit facets of other ranks. So with several masters, each rank knows the
    facets of all of them by number.
    """

    def __init__(
        self, zone: ZoneFacets, comm: MPI.Comm, of_parts: bool = False
    ) -> None:
        self.count = len(zone.parts if of_parts else zone.master_tags)
        self._rigid = bool(zone.bodies)
        if self.count > 1 and not self._rigid:
            surface = zone.master_surface
            self._ids, self._master = of_all(comm, surface.facet_ids, surface.zone)

    def of_points(self, points: Mapping[str, Any], met: Global) -> Indices:
        """Number of the master that each point of a zone hits; -1 for none, (n,).

        Slave and master facets that have met are the zone's ``pairs``.
        """
        hit = points["status"] > 0  # of `Status`: its ray meets a master
        number = np.where(hit, 0, -1).astype(np.int32)
        if self._rigid:
            number[hit] = points["master"][hit]
        elif self.count > 1 and hit.any():
            ids = global_masters(points, met)[hit]
            number[hit] = self._master[index_among(self._ids, ids)]
        return number


def global_masters(points: Mapping[str, Any], met: Global) -> Global:
    """Global number of the master facet of each point that has one, else -1.

    Facets that have met are in the order of the points: by slave facet, then by the
    local number of the master facet.
    """
    slave, master = points["slave"], points["master"]
    has = master >= 0
    run = np.cumsum(np.diff(slave, prepend=slave[:1]) != 0)
    keys = np.stack([run[has], master[has]], axis=1)
    _, element = np.unique(keys, axis=0, return_inverse=True)
    found = np.full(len(slave), -1, dtype=np.int64)
    found[has] = met[element.reshape(-1), 1]
    return found


@dataclass(frozen=True)
class OppositePoints:
    """The point nearest to the master, of each slave facet with a hit."""

    facet: Indices  # local slave facets, ascending, (n,)
    # The point and what it hit, reference coordinates, (n, d - 1)
    xi: Array
    eta: Array
    master: Global  # global facet that was hit, (n,)
    gap: Array  # (n,). Length
    closed: Mask  # whether any point of the facet was closed, (n,)


def nothing(gdim: int) -> OppositePoints:
    """Make an empty record, for a state that has not been paired."""
    none, places = np.empty(0, dtype=np.int32), np.empty((0, gdim - 1))
    masters, closed = none.astype(np.int64), none.astype(bool)
    return OppositePoints(none, places, places, masters, np.empty(0), closed)


def opposite_points(zone: ZoneData) -> OppositePoints:
    """Master that each slave facet faces at the last update."""
    found = zone.cpp.faced()
    return OppositePoints(**{**found, "closed": found["closed"] > 0})


@dataclass
class ZoneData:
    """A C++ zone with what Python needs to feed and read it."""

    facets: ZoneFacets
    comm: MPI.Comm
    cpp: _cpp.Zone
    multiplier_table: Indices  # (slave facets, n), local block dofs
    multiplier_nodes: Indices  # sorted block dofs in the zone's own order
    result_table: Indices  # (slave facets, n), local block dofs of result fields
    frictional: bool
    tied: bool
    distances: dict[str, Array]  # (slave facets,) of reach, depth, skin
    depth_is_default: bool
    thickness: tuple[Array, ...]  # behind this rank's slave and master facets
    opposite: OppositePoints  # at the accepted step
    master_tags: MasterTags
    hit_parts: MasterTags  # which part of a surface that meets itself is hit
    motions: Motions  # of the rigid bodies that it meets
    multiplier_degree: int = 0
    dual_multiplier: Function | None = None  # one of dual functions
    has_law_at_nodes: bool = False
    pattern: _cpp.Pattern = field(default_factory=_cpp.Pattern)
    positions: _cpp.BlockPositions = field(default_factory=_cpp.BlockPositions)
    assembly: _cpp.AssemblyStatistics = field(default_factory=_cpp.AssemblyStatistics)
    # Of friction springs, (slave facets, n, d): their traction; with a multiplier the
    # traction of the law minus the multiplier, over gamma
    traction_old: Array | None = None
    # Their rest at the points of the accepted step, of a multiplier elastic slip there or
    # at nodes, see `_cpp.Zone.accepted_springs`: rows of facet, reference coordinates,
    # area and vector, by facet
    spring_points: Array | None = None
    # Whether friction makes couples over gaps, see `PresentState`
    couples_over_gaps: bool = False
    # Length of the slip of all accepted steps; None without friction
    slip: Function | None = None
    offset: Array | None = None  # (slave facets, n), added to gaps. Length
    adjustment: Array | None = None  # the same, of `Contact.adjust`
    augmentation: Array | None = None  # the same, of an exact penalty
    against_tension: str = ""  # remedy, once one is found, see `diagnose.findings`
    # Distance of straight facets from curved surfaces, if it is much of the first gap
    off_curve: float = 0.0
    # Force on each slave facet at the last state that `diagnose.narrow` has seen
    carried: Array | None = None
    # Numbers of the rigid bodies that it has met on a path; 0 if it has met a master with
    # facets. See `diagnose.missed`
    met: set[int] = field(default_factory=set)
    # Whether the undeformed surface goes on flat around each slave facet; None: not asked
    inside_flats: Mask | None = None
    # Points of a state that several look at, see `results.looking`; None: each finds them
    kept_points: dict[str, Array] | None = None

    @property
    def sides(self) -> tuple[Surface, Surface]:
        """Surfaces of slave and masters."""
        return self.facets.sides

    @property
    def own_offset(self) -> Array | None:
        """Sum of offset and adjustment, (slave facets, n); None: neither. Length."""
        return _sum_of(self.offset, self.adjustment)

    @property
    def whole_offset(self) -> Array | None:
        """Sum of all that is added to gaps, (slave facets, n); None: nothing. Length."""
        return _sum_of(self.own_offset, self.augmentation)

    def distance(self, name: str) -> Array:
        """Reach or depth of the slave facets. A clearance adds to the depth, an
        interference to the reach. Length."""
        own, offset = self.distances[name], self.whole_offset
        if offset is None:
            return own
        more = offset if name == "depth" else -offset
        return own + np.maximum(more, 0.0).max(axis=1)

    def statistics(self) -> dict[str, Any]:
        """Counts and seconds of this rank, by the names of `results.Statistics`."""
        return self.cpp.statistics() | self.assembly.as_dict()

    def points(self) -> dict[str, Array]:
        """Arrays over the integration points, see `Contact.points`."""
        kept = self.kept_points
        if kept is None:
            return self._find_points()
        if not kept:
            kept.update(self._find_points())
        return {name: values.copy() for name, values in kept.items()}

    def _find_points(self) -> dict[str, Array]:
        points = _pressed(self.cpp.points())
        points["gap"] -= self.at_points(self.augmentation, points)  # no gap
        if self.frictional:  # a rank without points has the same keys
            points.setdefault("slip", np.empty_like(points["x"]))
            points.setdefault("closing", np.empty_like(points["gap"]))
            points.setdefault("dissipated", np.empty_like(points["gap"]))
        return points

    def nodes(self) -> dict[str, Array]:
        """Arrays over the nodes at which the law holds."""
        return _pressed(self.cpp.nodes())

    def at_points(self, nodal: Array | None, points: dict[str, Array]) -> Array:
        """Values at points of nodal values on the slave facets; 0 for None."""
        if nodal is None:
            return np.zeros(len(points["xi"]))
        surface, values = self.facets.slave_surface, nodal[points["slave"]]
        degree = surface.displacement_degree
        return interpolate(surface.shape, degree, values, points["xi"])

    def gap_without_offset(self, points: dict[str, Array]) -> Array:
        """Gaps without the user's clearance or interference, which are wanted. Length."""
        return np.asarray(points["gap"] - self.at_points(self.offset, points))

    def send_offset(self) -> None:
        """Hand all that is added to gaps to C++."""
        if self.whole_offset is not None:
            self.cpp.set_offset(self.whole_offset)

    def masters_of(self, points: dict[str, Array]) -> Indices:
        """Index among the masters of the one that each point hits; -1 for none."""
        return self.master_tags.of_points(points, self.cpp.pairs())

    def parts_of(self, points: dict[str, Array]) -> tuple[Indices, Indices]:
        """Index among its parts of what each point is on, and of what it hits.

        What it hits is -1 for none, and for points that do not meet their own surface.
        """
        own = self.facets.slave_surface.zone[points["slave"]]
        if not self.facets.meets_itself:
            return own, np.full(len(own), -1, dtype=np.int32)
        return own, self.hit_parts.of_points(points, self.cpp.pairs())


def _sum_of(*parts: Array | None) -> Array | None:
    """Sum of the arrays that there are."""
    found = [part for part in parts if part is not None]
    return sum(found[1:], found[0]) if found else None


def on_sides(zone: ZoneData, array: Array) -> tuple[Array, Array]:
    """Values of a ghosted array of u on slave and master surface, (dofs, d) each."""
    slave, master = (array.reshape(-1, s.gdim)[s.dofs] for s in zone.sides)
    return slave, master


def positions(surface: Surface, facets: Indices, at: Array, u: Array) -> Array:
    """Deformed position of a point of each facet, (n, d). Length.

    Facets are local (n,), points reference coordinates (n, d - 1), the displacement
    that of this rank's dofs, (dofs, d).
    """
    shape, X = surface.shape, surface.X[surface.facet_nodes[facets]]
    U = u[surface.dofs[surface.facet_dofs[facets]]]
    moved = interpolate(shape, surface.displacement_degree, U, at)
    return interpolate(shape, surface.node_degree, X, at) + moved


def nodes_of_facets(surface: Surface, degree: int) -> tuple[Indices, Array]:
    """Every local facet with each of its nodes of a degree: facets (n,), and reference
    coordinates (n, d - 1). The nodes of a facet follow each other."""
    at, count = facet_nodes(surface.shape, degree), len(surface.facet_dofs)
    return np.repeat(np.arange(count), len(at)), np.tile(at, (count, 1))


def unit_normals(surface: Surface, facets: Indices, at: Array, u: Array) -> Array:
    """Deformed outward normals at the same points, (n, d)."""
    _, dN = shape_functions(surface.shape, surface.node_degree, at)
    _, dM = shape_functions(surface.shape, surface.displacement_degree, at)
    X = surface.X[surface.facet_nodes[facets]]
    U = u[surface.dofs[surface.facet_dofs[facets]]]
    tangents = np.einsum("ina,nad->ind", dN, X) + np.einsum("ina,nad->ind", dM, U)
    return units(normals(tangents))


def _pressed(found: dict[str, Any]) -> dict[str, Any]:
    """Let the law's normal tractions be pressures, positive in compression."""
    found["pressure"] = 0.0 - found["pressure"]  # zero has no sign
    return found


@dataclass(frozen=True)
class SpringPoints:
    """Marks an array as rows of `ZoneData.spring_points`, so that files can write their
    facets by number."""

    zone: ZoneData


def mean_facet_size(zones: Sequence[ZoneData]) -> float:
    """Mean size of all slave facets. Length. Collective."""
    sides = [zone.facets.slave_surface for zone in zones]
    sizes = np.concatenate([surface_sizes(side) for side in sides])
    area, facets = zones[0].comm.allreduce(np.array([sizes.sum(), len(sizes)]))
    return float((area / facets) ** (1.0 / (sides[0].gdim - 1)))

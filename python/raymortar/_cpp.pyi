"""The compiled module: plain arrays in, plain arrays out. See python/bindings."""

from collections.abc import Callable, Sequence
from enum import Enum
from typing import Any, overload

import numpy as np
import numpy.typing as npt

_Reals = npt.NDArray[np.float64]
_Indices = npt.NDArray[np.int32]
_Globals = npt.NDArray[np.int64]

class Error(RuntimeError): ...

class Shape(Enum):
    interval: int
    triangle: int
    quadrilateral: int

class Measure(Enum):
    reference: int
    current: int
    reference_of_revolution: int
    current_of_revolution: int

class LawFrame(Enum):
    automatic: int
    slave: int
    master: int

class Condition(Enum):
    points: int
    nodes: int

class Method(Enum):
    augmented_lagrangian: int
    penalty: int

class TieGap(Enum):
    keep: int
    close: int

class Strategy(Enum):
    brute_force: int
    bvh: int
    pang: int

class Coulomb:
    elastic_slip: float
    def __init__(self, mu: float) -> None: ...

class Tresca:
    def __init__(self, bound: float) -> None: ...

class Stick:
    def __init__(self) -> None: ...

class PointBound:
    def __init__(self) -> None: ...

class Surface:
    def __init__(
        self,
        *,
        shape: Shape,
        degree: int,
        node_degree: int,
        gdim: int,
        X: _Reals,
        facet_nodes: _Indices,
        facet_dofs: _Indices,
        rows: _Globals,
        facet_id: _Globals,
    ) -> None: ...
    def diameters(self) -> _Reals: ...
    def set_thickness(self, thickness: _Reals) -> None: ...
    def set_bodies(self, body: _Indices) -> None: ...

class QuadratureRule:
    def __init__(self, points: _Reals, weights: _Reals) -> None: ...

class SegmentRules:
    def __init__(
        self,
        simplex: QuadratureRule,
        quadrilateral: QuadratureRule = ...,
        fan: QuadratureRule = ...,
    ) -> None: ...

class Multipliers:
    def __init__(
        self,
        *,
        degree: int = ...,
        components: int = ...,
        facet: _Indices = ...,
        rows: _Globals = ...,
    ) -> None: ...

class PairFactors:
    def __init__(
        self, *, slaves: _Indices = ..., masters: _Indices = ..., factors: _Reals = ...
    ) -> None: ...

class SearchDistances:
    @overload
    def __init__(self, reach: float, depth: float, skin: float) -> None: ...
    @overload
    def __init__(
        self, *, reach: _Reals, depth: _Reals, skin: _Reals, depth_is_default: bool
    ) -> None: ...

class Tool:
    def distances_along(self, x: _Reals, n: _Reals) -> _Reals: ...

def facet_tool(shape: Shape, degree: int, x: _Reals, nodes: _Indices) -> Tool: ...
def plane(point: _Reals, normal: _Reals) -> Tool: ...
def sphere(centre: _Reals, radius: float, hollow: bool) -> Tool: ...
def cylinder(point: _Reals, axis: _Reals, radius: float, hollow: bool) -> Tool: ...
def cone(tip: _Reals, axis: _Reals, half_angle: float, hollow: bool) -> Tool: ...
def torus(
    centre: _Reals, axis: _Reals, major: float, minor: float, hollow: bool
) -> Tool: ...
def called_tool(
    cast: Callable[
        [_Reals, _Reals], tuple[npt.NDArray[np.int8], _Reals, _Reals, _Reals]
    ],
    distance: Callable[[_Reals], float],
) -> Tool: ...

class ZoneInput:
    def __init__(
        self,
        *,
        slave: Surface,
        master: Surface,
        tools: Sequence[Tool],
        master_node_ids: _Globals,
        master_dof_ids: _Globals,
        multipliers: Multipliers,
        dual_multiplier: bool,
        method: Method,
        condition: Condition,
        friction: Coulomb | Tresca | Stick | PointBound | None,
        measure: Measure,
        frame: LawFrame,
        keeps_springs: bool,
        moving_segments: bool,
        tie: TieGap | None,
        distances: SearchDistances,
        strategy: Strategy,
        subdivide: bool,
        segment_rules: SegmentRules,
        facet_rule: QuadratureRule,
        filter: PairFilter | None,
    ) -> None: ...

class PairFilter:
    def __init__(self, *, offsets: _Globals, neighbours: _Globals) -> None: ...

class Freedom:
    @overload
    def __init__(self) -> None: ...
    @overload
    def __init__(
        self,
        *,
        centre: _Reals,
        drift: _Reals,
        spin: _Reals,
        bend: _Reals,
        rows: _Globals,
    ) -> None: ...

class Zone:
    def __init__(self, comm: int, input: ZoneInput) -> None: ...
    def set_displacement(self, slave: _Reals, master: _Reals) -> None: ...
    def set_old_displacement(self, slave: _Reals, master: _Reals) -> None: ...
    def set_fixed(self, slave: _Reals, master: _Reals) -> None: ...
    def set_rows(
        self, slave: _Globals, master: _Globals, multiplier: _Globals
    ) -> None: ...
    def set_modulus(self, modulus: float) -> None: ...
    def set_crossing(self, dofs: npt.NDArray[np.int8]) -> None: ...
    def set_multiplier(self, values: _Reals) -> None: ...
    def set_law(self, condition: Condition, dual: bool) -> None: ...
    def set_gamma(
        self, gamma: _Reals, scale: float, factors: PairFactors = ...
    ) -> None: ...
    def set_offset(self, offset: _Reals) -> None: ...
    def set_field(self, name: str, values: _Reals) -> None: ...
    def set_friction_bounds(
        self,
        s: _Reals,
        s_p: _Reals,
        s_slip: _Reals,
        s_xi: _Reals,
        at_nodes: bool,
    ) -> None: ...
    def set_node_changes(self, values: _Reals, measures: bool = ...) -> None: ...
    def slips_without_friction(self) -> _Reals: ...
    def accepted_springs(self) -> tuple[_Reals, _Reals]: ...
    def set_couples_over_gaps(self, set: bool) -> None: ...
    def set_spring_points(self, rows: _Reals) -> None: ...
    def set_shear_modulus(self, modulus: float) -> None: ...
    def set_corner_nodes(self, corners: npt.NDArray[np.int8]) -> None: ...
    def set_covered_nodes(self, covered: npt.NDArray[np.int8]) -> None: ...
    def covered_nodes(self) -> npt.NDArray[np.int8]: ...
    def set_poses(self, rotation: _Reals, shift: _Reals) -> None: ...
    def set_old_poses(self, rotation: _Reals, shift: _Reals) -> None: ...
    def set_freedoms(self, freedoms: Sequence[Freedom]) -> None: ...
    def slave_positions(self) -> _Reals: ...
    def pair(self) -> None: ...
    def cast(self) -> None: ...
    def points(self) -> dict[str, npt.NDArray[Any]]: ...
    def nodes(self) -> dict[str, npt.NDArray[Any]]: ...
    def faced(self) -> dict[str, Any]: ...
    def master_bodies(self) -> _Indices: ...
    def penetrating_points(self, body: Tool | None = None) -> _Indices: ...
    def segments(self) -> dict[str, npt.NDArray[Any]]: ...
    def pairs(self) -> _Globals: ...
    def free_points(self) -> npt.NDArray[np.int8]: ...
    def held_facets(self) -> _Indices: ...
    def unfelt(self) -> npt.NDArray[np.int8]: ...
    def set_unfelt(
        self, parts: _Reals, accepted: _Reals, kept: npt.NDArray[np.int8]
    ) -> None: ...
    def traffic(self, ranges: _Globals, rank: int) -> dict[str, int]: ...
    def statistics(self) -> dict[str, Any]: ...

class Pattern:
    def __init__(self) -> None: ...
    def __len__(self) -> int: ...
    def covers(self, zone: Zone) -> bool: ...
    def extend(self, zone: Zone) -> None: ...

class BlockPositions:
    def __init__(self) -> None: ...
    def lookups(self) -> int: ...
    def forget(self) -> None: ...

class AssemblyStatistics:
    def __init__(self) -> None: ...
    def as_dict(self) -> dict[str, float]: ...

class RigidBody:
    moved: _Reals
    turned: _Reals
    force: _Reals
    moment: _Reals
    stiffness: _Reals
    damping: _Reals
    values: _Reals
    accepted: _Reals
    accepted_turn: _Reals
    lever: float
    dt: float
    @property
    def seen(self) -> _Reals: ...
    def __init__(
        self,
        centre: _Reals,
        axis: Sequence[int],
        turns: Sequence[bool],
        stiffness: Sequence[float],
        damping: Sequence[float],
    ) -> None: ...
    def see(self) -> None: ...
    def theta(self) -> _Reals: ...
    def translation(self) -> _Reals: ...
    def turn(self) -> _Reals: ...
    def motion(self) -> _Reals: ...
    def pose_of(self, motion: _Reals) -> tuple[_Reals, _Reals]: ...
    def rates(self) -> tuple[_Reals, _Reals, _Reals]: ...
    def forces(self) -> tuple[_Reals, _Reals]: ...
    def accept(self) -> None: ...
    def set_spin(
        self,
        *,
        J: _Reals,
        whole: float,
        factor: float,
        rate: float,
        start: _Reals,
        kept: _Reals,
    ) -> None: ...
    def clear_spin(self) -> None: ...

def rotation_matrix(rotation: _Reals) -> _Reals: ...
def turning(rotation: _Reals) -> tuple[_Reals, _Reals, _Reals]: ...

class MultiplierValues:
    @overload
    def __init__(self) -> None: ...
    @overload
    def __init__(
        self, local: _Reals, owned: _Indices, rows: _Globals, components: int
    ) -> None: ...

class BodyValues:
    def __init__(self, body: RigidBody, rows: _Globals) -> None: ...

class CoupledValues:
    def __init__(
        self,
        comm: int,
        functions: Sequence[_Reals],
        owned: Sequence[int],
        rows: _Globals,
        multipliers: Sequence[MultiplierValues],
        bodies: Sequence[BodyValues],
    ) -> None: ...
    def to_vector(self, x: int, scales: Sequence[float]) -> None: ...
    def from_vector(self, x: int, scales: Sequence[float]) -> None: ...

class SystemZone:
    def __init__(
        self,
        *,
        zone: Zone,
        positions: BlockPositions,
        statistics: AssemblyStatistics,
        contact: int,
        slave: _Indices,
        master: _Indices,
        nodes: _Indices,
        bodies: Sequence[RigidBody],
    ) -> None: ...

class ContactSystem:
    def __init__(
        self, zones: Sequence[SystemZone], u: _Reals, values: CoupledValues
    ) -> None: ...
    def set_unknowns(self, x: int, scales: Sequence[float], anew: bool) -> bool: ...
    def is_finite(self) -> bool: ...
    def has_moved(self) -> bool: ...
    def is_at(self, u: _Reals) -> bool: ...
    def loads_changed(self) -> bool: ...
    def pair(self, rays_only: bool) -> None: ...
    def add_residual(self, b: int) -> None: ...
    def residual(
        self,
        b: int,
        volume: _Reals,
        fixed: npt.NDArray[Any],
        owned: _Reals,
        increment: _Reals,
        of_u: _Reals,
        values: _Reals,
        contact: bool,
    ) -> tuple[_Reals, _Reals, _Reals, _Reals]: ...
    def lift(self, b: int, increment: _Reals, alpha: float) -> None: ...
    def add_tangent(self, A: int) -> None: ...
    def node_weights(self, contact: int) -> tuple[_Reals, _Reals]: ...
    def set_groups(
        self,
        of_row: _Indices,
        count: int,
        mass: _Reals,
        fields: Sequence[npt.NDArray[np.integer[Any]]],
    ) -> None: ...

def clip_convex(slave: _Reals, master: _Reals) -> _Reals: ...
def add_residual(zone: Zone, b: int, statistics: AssemblyStatistics) -> None: ...
def add_tangent(
    zone: Zone, A: int, positions: BlockPositions, statistics: AssemblyStatistics
) -> None: ...
def add_by_parameter(
    zone: Zone, A: int, kind: str, tool: int = ..., now: _Reals = ..., old: _Reals = ...
) -> None: ...
def add_springs_by_parameter(
    zone: Zone,
    b: int,
    weights: _Reals,
    kind: str,
    tool: int = ...,
    now: _Reals = ...,
    old: _Reals = ...,
) -> None: ...
def springs_back(
    zone: Zone, slave: _Reals, master: _Reals, weights: _Reals
) -> _Reals: ...
def apply_lifting(
    zone: Zone,
    b: int,
    slave: _Reals,
    master: _Reals,
    alpha: float,
    statistics: AssemblyStatistics,
) -> None: ...
def find_candidates(
    slave: Surface, master: Surface, distances: SearchDistances, strategy: Strategy
) -> int: ...
def shape_functions(
    shape: Shape, degree: int, points: _Reals
) -> tuple[_Reals, _Reals]: ...
def is_reused(pc: int) -> bool: ...
def set_pattern(A: int, offsets: _Indices, columns: _Indices) -> None: ...
def preallocate(
    A: int,
    offsets: _Indices,
    columns: _Indices,
    zones: Sequence[Zone],
    patterns: Sequence[Pattern],
    fields: Sequence[FieldRows] = ...,
) -> None: ...

class FieldRows:
    def __init__(
        self,
        *,
        zone: int,
        slave: _Globals,
        master: _Globals,
        per_slave: int,
        per_master: int,
    ) -> None: ...

class FluxFields:
    def __init__(
        self,
        *,
        slave: _Reals,
        master: _Reals,
        slave_rows: _Globals,
        master_rows: _Globals,
        slave_degree: int,
        master_degree: int,
        tool: float,
    ) -> None: ...

def flux_points(zone: Zone, fields: FluxFields) -> dict[str, npt.NDArray[Any]]: ...
def flux_residual(
    zone: Zone, fields: FluxFields, q: _Reals, slave_heat: float, target_heat: float
) -> tuple[_Globals, _Reals]: ...
def flux_tangent(
    zone: Zone,
    fields: FluxFields,
    q: _Reals,
    slave_heat: float,
    target_heat: float,
    slopes: _Reals,
    along: _Reals,
) -> tuple[_Globals, _Globals, _Reals]: ...
def to_master_facets(zone: Zone, owned: _Reals, width: int) -> _Reals: ...
def rows_of_master_facets(zone: Zone, owned: _Globals, width: int) -> _Globals: ...

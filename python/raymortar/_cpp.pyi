"""The compiled module: plain arrays in, plain arrays out. See python/bindings."""

from collections.abc import Sequence
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

class LawKind(Enum):
    augmented_normal: int
    augmented_vector: int
    penalty: int
    augmented_friction: int
    penalty_friction: int

class Strategy(Enum):
    brute_force: int
    bvh: int
    advancing_front: int
    pang: int

class Coulomb:
    def __init__(self, mu: float) -> None: ...

class Tresca:
    def __init__(self, bound: float) -> None: ...

class Stick:
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
        degree: int = ...,
        components: int = ...,
        facet: _Indices = ...,
        rows: _Globals = ...,
    ) -> None: ...

class SearchDistances:
    @overload
    def __init__(self, reach: float, depth: float, skin: float) -> None: ...
    @overload
    def __init__(
        self, *, reach: _Reals, depth: _Reals, skin: _Reals, depth_is_default: bool
    ) -> None: ...

class Zone:
    def __init__(
        self,
        *,
        comm: int,
        slave: Surface,
        master: Surface,
        master_node_ids: _Globals,
        master_dof_ids: _Globals,
        multipliers: Multipliers,
        law: LawKind,
        friction: Coulomb | Tresca | Stick,
        current_measure: bool,
        moving_segments: bool,
        distances: SearchDistances,
        strategy: Strategy,
        subdivide: bool,
        segment_rules: SegmentRules,
        facet_rule: QuadratureRule,
    ) -> None: ...
    def set_displacement(self, slave: _Reals, master: _Reals) -> None: ...
    def set_old_displacement(self, slave: _Reals, master: _Reals) -> None: ...
    def set_fixed(self, slave: _Reals, master: _Reals) -> None: ...
    def set_modulus(self, modulus: float) -> None: ...
    def set_multiplier(self, values: _Reals) -> None: ...
    def set_gamma(
        self,
        gamma: _Reals,
        scale: float,
        slaves: _Indices = ...,
        masters: _Indices = ...,
        factors: _Reals = ...,
    ) -> None: ...
    def set_old_traction(self, traction: _Reals) -> None: ...
    def tangential_traction(self) -> _Reals: ...
    def pair(self) -> None: ...
    def cast(self) -> None: ...
    def points(self) -> dict[str, npt.NDArray[Any]]: ...
    def faced(self) -> dict[str, Any]: ...
    def master_bodies(self) -> _Indices: ...
    def sunk_points(self) -> _Indices: ...
    def segments(self) -> dict[str, npt.NDArray[Any]]: ...
    def pairs(self) -> _Globals: ...
    def free_points(self) -> npt.NDArray[np.int8]: ...
    def held_facets(self) -> _Indices: ...
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

def clip_convex(slave: _Reals, master: _Reals) -> _Reals: ...
def add_residual(zone: Zone, b: int) -> None: ...
def add_tangent(zone: Zone, A: int, positions: BlockPositions) -> None: ...
def apply_lifting(
    zone: Zone, b: int, slave: _Reals, master: _Reals, alpha: float
) -> None: ...
def find_candidates(
    slave: Surface, master: Surface, distances: SearchDistances, strategy: Strategy
) -> int: ...
def write_blocks(zone: Zone, A: int) -> int: ...
def compute_blocks(zone: Zone, tangent: bool) -> float: ...
def preallocate(
    A: int,
    offsets: _Indices,
    columns: _Indices,
    zones: Sequence[Zone],
    patterns: Sequence[Pattern],
) -> None: ...

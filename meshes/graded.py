"""Blocks of a ball or a box that are fine at one surface point, the pole.

A small uniform core of `n` cells per direction sits at the pole. Fans, one per
direction, lead from its inner faces to the far boundary, in rings whose thickness
grows geometrically. In 2D, for half a disc cut at its centre::

    C ------- E ------- Q      C, E, Q: flat cut      "far" faces
    |         |        /       left:    symmetry      "left"
    |  fan y  | fan x /        arc:     "surface", pole at P
    +------- /       /
    | core  |       /
    P ------+ - ---

Local coordinates: the pole is the origin, the body fills the quadrant (octant) of
positive coordinates, and the last coordinate is the depth below the surface.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Hashable, Iterable, Mapping
from typing import Any

import numpy as np

from .blocks import SIDES, Block, mirrored

__all__ = ["PoleGrid", "ball_blocks", "box_blocks", "cap_blocks", "completed"]

# Where the flat cut of a ball is divided, as a fraction of the radius: the corner
# that all fans share, and the points next to it on the symmetry planes
_CUT_CORNER = {2: 0.5, 3: 0.42}
_CUT_MIDDLE = 0.5


@dataclasses.dataclass(frozen=True)
class PoleGrid:
    """Sizes of a graded mesh.

    Parameters
    ----------
    half_width
        Half-width of the contact zone. Length.
    facet_size
        Size of the facets in the contact zone. Length.
    growth
        Ratio of neighbouring rings outside the core, at least 1.
    core_ratio
        Extent of the uniform core over `half_width`.
    """

    half_width: float
    facet_size: float
    growth: float = 1.2
    core_ratio: float = 1.25

    def __post_init__(self) -> None:
        if not (self.half_width > 0.0 and self.facet_size > 0.0):
            raise ValueError("the contact half-width and facet size must be positive")
        if not 1.0 < self.growth <= 3.0:
            raise ValueError(f"growth = {self.growth} is not in (1, 3]")
        if not self.core_ratio > 0.0:
            raise ValueError(f"core_ratio = {self.core_ratio} is not positive")

    @property
    def divisions(self) -> int:
        """Cells along an edge of the core."""
        extent = self.core_ratio * self.half_width / self.facet_size
        return max(2, int(np.ceil(extent - 1e-9)))

    @property
    def core(self) -> float:
        """Edge of the core. Length."""
        return self.divisions * self.facet_size

    def rings(self, distance: float) -> np.ndarray:
        """Parameters of the rings over `distance`, shape (n + 1,), from 0 to 1."""
        ratio = 1.0 + (self.growth - 1.0) * distance / self.facet_size
        n = max(2, int(np.ceil(np.log(ratio) / np.log(self.growth) - 1e-9)))
        distances = self.growth ** np.arange(n + 1) - 1.0
        return distances / distances[-1]


@dataclasses.dataclass(frozen=True)
class _Shape:
    """Geometry of a body: `core` maps the core, `project` pulls to the surface.

    `far` are the points that the corners of the core are led to, shape (2, ..., 2, d);
    the entry of the pole is not used.
    """

    core: Callable[[np.ndarray], np.ndarray]
    project: Callable[[np.ndarray], np.ndarray] | None
    far: np.ndarray


def _multilinear(values: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Interpolate corner `values` (2, ..., 2, d) at parameters `p` (n, d)."""
    result = np.zeros_like(p)
    for corner in itertools.product((0, 1), repeat=p.shape[1]):
        weight = np.where(corner, p, 1.0 - p).prod(axis=1)
        result += weight[:, None] * values[corner]
    return result


def _fan(shape: _Shape, axis: int, core: float) -> Callable[[np.ndarray], np.ndarray]:
    """Map of the unit box to the fan that leaves the core along `axis`."""

    def straight(p: np.ndarray) -> np.ndarray:
        face, outer = core * p, p.copy()
        face[:, axis], outer[:, axis] = core, 1.0
        r = p[:, axis : axis + 1]
        return (1.0 - r) * shape.core(face) + r * _multilinear(shape.far, outer)

    def fan(p: np.ndarray) -> np.ndarray:
        x = straight(p)
        if shape.project is None or axis == p.shape[1] - 1:
            return x
        # Straight rays leave the curved surface: pull them back, less with depth
        surface = p.copy()
        surface[:, -1] = 0.0
        y = straight(surface)
        return x + (1.0 - p[:, -1:]) * (shape.project(y) - y)

    return fan


def _pole_blocks(
    shape: _Shape,
    grid: PoleGrid,
    rings: np.ndarray,
    tags: Mapping[str, int],
    body: Hashable,
    split: Callable[[np.ndarray], np.ndarray] | None = None,
    **options: Any,
) -> list[Block]:
    """Core and fans.

    `tags` are by "surface", "left", "front" (symmetry planes) and "far_0", "far_1",
    ... (the far face of each fan). `split` tells from points (n, d) on the surface
    which of them still belong to the tagged one.
    """
    d, n = shape.far.shape[-1], grid.divisions
    options = {"body": body, **options}
    blocks = [
        Block(
            (n,) * d,
            (0.0,) * d,
            (grid.core,) * d,
            mapping=shape.core,
            tags=_near_tags(d, tags, range(d)),
            **options,
        )
    ]
    for axis in range(d):
        fan, cut = _fan(shape, axis, grid.core), len(rings) - 1
        if split is not None and axis < d - 1:
            line = np.zeros((len(rings), d))
            line[:, axis] = rings
            cut = max(1, int(np.sum(split(fan(line)))) - 1)
        for part in (rings[: cut + 1], rings[cut:]):
            if len(part) > 1:
                divisions = [n] * d
                divisions[axis] = len(part) - 1
                blocks.append(
                    Block(
                        tuple(divisions),
                        (0.0,) * d,
                        (1.0,) * d,
                        [part if a == axis else None for a in range(d)],
                        fan,
                        _fan_tags(d, tags, axis, part),
                        **options,
                    )
                )
    return blocks


def _near_tags(d: int, tags: Mapping[str, int], axes: Iterable[int]) -> dict[str, int]:
    """Tags of the sides through the pole that are normal to `axes`."""
    names = ("left", "front")[: d - 1] + ("surface",)
    low = {axis: side for side, (axis, end) in SIDES[d].items() if end == 0}
    return {low[a]: tags[names[a]] for a in axes if names[a] in tags}


def _fan_tags(
    d: int, tags: Mapping[str, int], axis: int, rings: np.ndarray
) -> dict[str, int]:
    """Tags of the fan along `axis`, or of its part between some `rings`."""
    inner, outer = rings[0] == 0.0, rings[-1] == 1.0
    # Beyond the split the surface carries no tag
    axes = [a for a in range(d) if a != axis and (inner or a < d - 1)]
    sides = _near_tags(d, tags, axes)
    if outer and f"far_{axis}" in tags:
        high = [side for side, where in SIDES[d].items() if where == (axis, 1)]
        sides[high[0]] = tags[f"far_{axis}"]
    return sides


def _ball_shape(dim: int, radius: float) -> _Shape:
    """Half a disc or ball on its pole."""
    centre = np.append(np.zeros(dim - 1), radius)

    def core(p: np.ndarray) -> np.ndarray:
        # Equal angles on the symmetry planes (as on a cubed sphere)
        v = np.column_stack([np.tan(p[:, :-1] / radius), -np.ones(len(p))])
        v *= ((radius - p[:, -1]) / np.linalg.norm(v, axis=1))[:, None]
        return centre + v

    def project(x: np.ndarray) -> np.ndarray:
        v = x - centre
        return centre + radius * v / np.linalg.norm(v, axis=1, keepdims=True)

    far = np.zeros((2,) * dim + (dim,))
    for corner in itertools.product((0, 1), repeat=dim):
        lateral = np.array(corner[:-1], dtype=np.float64)
        if corner[-1] == 0:
            lateral /= max(1.0, float(np.linalg.norm(lateral)))
        else:
            lateral *= _CUT_CORNER[dim] if all(corner) else _CUT_MIDDLE
        far[corner] = np.append(radius * lateral, radius)
    return _Shape(core, project, far)


def ball_blocks(
    dim: int,
    radius: float,
    grid: PoleGrid,
    tags: Mapping[str, int],
    body: Hashable,
    surface_angle: float = np.pi / 3,
    **options: Any,
) -> list[Block]:
    """A quadrant (octant) of a disc (ball) between the pole and the cut at its centre.

    Parameters
    ----------
    dim
        2 or 3.
    radius
        Length.
    grid
        Sizes of the mesh.
    tags
        By "surface" (up to about `surface_angle` from the pole), "left", "front"
        (symmetry planes x = 0, y = 0) and "cut".
    body
        Label of the body.
    surface_angle
        Radians, on the symmetry planes; the tag ends at a ring.
    options
        Passed to `Block`.
    """
    if not radius > 0.0:
        raise ValueError(f"radius = {radius} is not positive")
    if not grid.core < 0.6 * radius:
        raise ValueError(
            f"the fine core ({grid.core:g}) is too large for the radius {radius:g}: "
            "lessen the contact half-width or use more facets across it"
        )
    if not 0.0 < surface_angle <= 0.5 * np.pi:
        raise ValueError(f"surface_angle = {surface_angle} is not in (0, pi/2]")

    def within(x: np.ndarray) -> np.ndarray:
        lateral = np.linalg.norm(x[:, :-1], axis=1)
        return np.arctan2(lateral, radius - x[:, -1]) <= surface_angle * (1.0 + 1e-9)

    named = {k: tags[k] for k in ("surface", "left", "front") if k in tags}
    if "cut" in tags:
        named |= {f"far_{axis}": tags["cut"] for axis in range(dim)}
    rings = grid.rings(radius - grid.core)
    shape = _ball_shape(dim, radius)
    return _pole_blocks(shape, grid, rings, named, body, within, **options)


def box_blocks(
    size: tuple[float, ...],
    grid: PoleGrid,
    tags: Mapping[str, int],
    body: Hashable,
    **options: Any,
) -> list[Block]:
    """A box [0, size] with the pole in a corner.

    Parameters
    ----------
    size
        Edge lengths, the last one the depth.
    grid
        Sizes of the mesh.
    tags
        By "surface", "left", "front" (symmetry planes x = 0, y = 0), "side" (opposite
        to those) and "far" (opposite to the surface).
    body
        Label of the body.
    options
        Passed to `Block`.
    """
    dim = len(size)
    if not min(size) > 0.0:
        raise ValueError(f"size = {size} is not positive")
    if not grid.core < 0.8 * min(size):
        raise ValueError(
            f"the fine core ({grid.core:g}) is too large for a box of {size}: "
            "lessen the contact half-width or use more facets across it"
        )
    far = np.zeros((2,) * dim + (dim,))
    for corner in itertools.product((0, 1), repeat=dim):
        far[corner] = np.array(corner) * np.array(size)
    named = {k: tags[k] for k in ("surface", "left", "front") if k in tags}
    if "far" in tags:
        named[f"far_{dim - 1}"] = tags["far"]
    if "side" in tags:
        named |= {f"far_{axis}": tags["side"] for axis in range(dim - 1)}
    rings = grid.rings(max(size) - grid.core)
    shape = _Shape(lambda p: p, None, far)
    return _pole_blocks(shape, grid, rings, named, body, **options)


def cap_blocks(
    radius: float,
    grid: PoleGrid,
    tags: Mapping[str, int],
    body: Hashable,
    **options: Any,
) -> list[Block]:
    """The quadrant of a disc that fits on the cut of `ball_blocks` (2D).

    Parameters
    ----------
    radius, grid, body, options
        As for `ball_blocks`.
    tags
        By "left" (symmetry plane) and "far" (the arc within 45 degrees of the top).
    """
    n, e, h = grid.divisions, _CUT_CORNER[2], np.sqrt(0.5)
    centre = np.array([0.0, radius])
    # Corners of the three quadrilaterals, over the radius: see the classical O-grid
    c, f, m, q, d, top = (0, 0), (0, 0.5), (0.42, 0.44), (1, 0), (h, h), (0, 1)
    across = max(2, (n + 1) // 2)
    left = {"left": tags["left"]} if "left" in tags else {}
    far = {"top": tags["far"]} if "far" in tags else {}

    def quadrilateral(
        divisions: tuple[int, int],
        corners: tuple[Any, ...],
        arc: int | None,
        sides: Mapping[str, int],
    ) -> Block:
        values = np.reshape(np.array(corners, float), (2, 2, 2)) * radius

        def mapping(p: np.ndarray) -> np.ndarray:
            x = _multilinear(values, p)
            if arc is not None:
                edge = p.copy()
                edge[:, arc] = 1.0
                y = _multilinear(values, edge)
                on_arc = radius * y / np.linalg.norm(y, axis=1, keepdims=True)
                x = x + p[:, arc : arc + 1] * (on_arc - y)
            return centre + x

        return Block(
            divisions, (0, 0), (1, 1), None, mapping, sides, body=body, **options
        )

    return [
        quadrilateral((n, across), (c, f, (e, 0), m), None, left),
        quadrilateral((n, across), ((e, 0), m, q, d), 0, {}),
        quadrilateral((n, n), (f, top, m, d), 1, left | far),
    ]


def completed(blocks: list[Block], axes: Iterable[int]) -> list[Block]:
    """The blocks and their mirror images in the planes normal to `axes`.

    The tags of those planes, now inside the body, are dropped.
    """
    for axis in axes:
        d = blocks[0].dim
        plane = [name for name, side in SIDES[d].items() if side == (axis, 0)][0]

        def open_sides(block: Block) -> dict[str, int]:
            return {s: tag for s, tag in block.tags.items() if s != plane}

        blocks = [dataclasses.replace(b, tags=open_sides(b)) for b in blocks]
        blocks = blocks + [mirrored(b, axis) for b in blocks]
    return blocks

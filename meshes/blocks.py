"""Logically rectangular blocks and the grids of nodes in them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import Any

import numpy as np

__all__ = ["SIDES", "Block", "Grid", "mirrored", "moved", "perturbed", "rotated"]

# Logical sides by name: (axis, end), the last axis being the vertical one
SIDES = {
    2: {"left": (0, 0), "right": (0, 1), "bottom": (1, 0), "top": (1, 1)},
    3: {
        "left": (0, 0),
        "right": (0, 1),
        "front": (1, 0),
        "back": (1, 1),
        "bottom": (2, 0),
        "top": (2, 1),
    },
}
Motion = Callable[[np.ndarray], np.ndarray]

_PATTERNS = ("right", "left", "alternate", "random")


@dataclasses.dataclass(frozen=True)
class Block:
    """A logically rectangular piece of a body.

    Parameters
    ----------
    divisions
        Cells per direction, 2 or 3 numbers (x, [y,] vertical).
    lower, upper
        Corners of the box before `mapping`, as many numbers as `divisions`. Length.
    grading
        Per direction `None` (uniform), an increasing array of n + 1 parameters in
        [0, 1], or a callable that takes the uniform parameters to such an array.
        The array may cover a part of [0, 1] only; the block is then that part.
    mapping
        Takes points (n, d) of the box to the body. It must keep the orientation. It
        is applied to all nodes: with a geometry of degree 2 the cells are curved.
    tags
        Facet tag of each side: "left", "right" (x), "front", "back" (y, 3D only),
        "bottom", "top" (last direction). Sides not named carry no tag.
    pattern
        Where simplices cut a quadrilateral: "right", "left", "alternate", "random".
    body
        Label. Blocks with equal labels other than `None` are glued into one body.
    """

    divisions: tuple[int, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    grading: Sequence[Any] | None = None
    mapping: Callable[[np.ndarray], np.ndarray] | None = None
    tags: Mapping[str, int] = dataclasses.field(default_factory=dict)
    pattern: str = "right"
    body: Hashable = None

    def __post_init__(self) -> None:
        d = len(self.divisions)
        if d not in SIDES:
            raise ValueError(f"Block.divisions has {d} numbers, not 2 or 3")
        if any(int(n) != n or n < 1 for n in self.divisions):
            raise ValueError(f"Block.divisions {self.divisions} must be integers >= 1")
        if len(self.lower) != d or len(self.upper) != d:
            raise ValueError(f"Block.lower and Block.upper must have {d} numbers")
        if not np.all(np.asarray(self.lower, float) < np.asarray(self.upper, float)):
            raise ValueError(f"Block.lower {self.lower} not below upper {self.upper}")
        if self.grading is not None and len(self.grading) != d:
            raise ValueError(f"Block.grading must have {d} entries")
        for side, tag in self.tags.items():
            if side not in SIDES[d]:
                raise ValueError(f"no side '{side}' in {d}D, only {list(SIDES[d])}")
            if int(tag) != tag or not 0 < tag < 2**31:
                raise ValueError(f"tag {tag!r} of side '{side}' is no positive int32")
        if self.pattern not in _PATTERNS:
            raise ValueError(f"pattern '{self.pattern}' is not one of {_PATTERNS}")

    @property
    def dim(self) -> int:
        """Dimension of the block, 2 or 3."""
        return len(self.divisions)

    def parameters(self, axis: int) -> np.ndarray:
        """Parameters of the grid planes along `axis`, shape (n + 1,), in [0, 1]."""
        t = np.linspace(0.0, 1.0, self.divisions[axis] + 1)
        rule = None if self.grading is None else self.grading[axis]
        if rule is not None:
            t = np.asarray(rule(t) if callable(rule) else rule, dtype=np.float64)
        if t.shape != (self.divisions[axis] + 1,):
            raise ValueError(
                f"grading of axis {axis} has shape {t.shape}, "
                f"not ({self.divisions[axis] + 1},)"
            )
        inside = np.all(t >= -1e-14) and np.all(t <= 1.0 + 1e-14)
        if not (inside and np.all(np.diff(t) > 0.0)):
            raise ValueError(f"grading of axis {axis} does not increase within [0, 1]")
        return t

    def map(self, parameters: np.ndarray) -> np.ndarray:
        """Points (n, d) of the body at `parameters` (n, d) in the unit box."""
        lower, upper = np.asarray(self.lower, float), np.asarray(self.upper, float)
        x = lower + parameters * (upper - lower)
        y = x if self.mapping is None else np.asarray(self.mapping(x), np.float64)
        if y.shape != x.shape or not np.all(np.isfinite(y)):
            raise ValueError("Block.mapping must return finite points, one each")
        return y


def mirrored(block: Block, axis: int, tags: Mapping[str, int] | None = None) -> Block:
    """Mirror image of `block` in the plane through the origin normal to `axis`.

    The logical direction `axis` is reversed too, so that the cells keep their
    orientation: "left" of the block is "right" of its image, and so on.

    Parameters
    ----------
    block
        The block.
    axis
        Direction that changes sign.
    tags
        Tags of the image's sides; by default those of the sides they come from.
    """
    middle = block.lower[axis] + block.upper[axis]

    def image(x: np.ndarray) -> np.ndarray:
        y = x.copy()
        y[:, axis] = middle - y[:, axis]
        y = y if block.mapping is None else np.array(block.mapping(y), np.float64)
        y[:, axis] *= -1.0
        return y

    grading = [block.parameters(a) for a in range(block.dim)]
    grading[axis] = 1.0 - grading[axis][::-1]
    if tags is None:
        names = {side: name for name, side in SIDES[block.dim].items()}
        tags = {}
        for name, tag in block.tags.items():
            a, end = SIDES[block.dim][name]
            tags[names[a, 1 - end if a == axis else end]] = tag
    pattern = {"left": "right", "right": "left"}.get(block.pattern, block.pattern)
    return dataclasses.replace(
        block, grading=grading, mapping=image, tags=tags, pattern=pattern
    )


def moved(blocks: Sequence[Block], motion: Motion) -> list[Block]:
    """The blocks after a rigid `motion` of points (n, d)."""

    def after(first: Motion | None) -> Motion:
        return lambda x: motion(x if first is None else first(x))

    return [dataclasses.replace(b, mapping=after(b.mapping)) for b in blocks]


def _rotation_matrix(rotation: float | np.ndarray, dim: int) -> np.ndarray:
    """Matrix (dim, dim) of an angle in radians (2D), or of a matrix, checked."""
    if np.ndim(rotation) == 0 and dim == 2:
        c, s = np.cos(rotation), np.sin(rotation)
        return np.array([[c, -s], [s, c]])
    matrix = np.asarray(rotation, dtype=np.float64)
    orthogonal = matrix.shape == (dim, dim) and np.allclose(
        matrix @ matrix.T, np.eye(dim), atol=1e-12
    )
    if not orthogonal or np.linalg.det(matrix) < 0.0:
        raise ValueError(
            f"rotation must be a rotation matrix ({dim}, {dim}), or an angle in 2D"
        )
    return matrix


def rotated(blocks: list[Block], rotation: float | np.ndarray | None) -> list[Block]:
    """The blocks after a rotation about the origin; `None` leaves them."""
    if rotation is None:
        return blocks
    matrix = _rotation_matrix(rotation, blocks[0].dim)
    return moved(blocks, lambda x: x @ matrix.T)


def perturbed(
    block: Block, perturb: float, perturb_sides: float, rng: np.random.Generator
) -> np.ndarray:
    """Parameters of the vertices, shape (n_1 + 1, ..., n_d + 1, d)."""
    d = block.dim
    axes = [block.parameters(a) for a in range(d)]
    t = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    room = np.zeros_like(t)
    for a in range(d):
        h = np.diff(axes[a])
        nearest = np.concatenate([[0.0], np.minimum(h[1:], h[:-1]), [0.0]])
        room[..., a] = np.expand_dims(nearest, [b for b in range(d) if b != a])
    noise = rng.uniform(-1.0, 1.0, size=t.shape) * room
    # Zero on every side, and in all directions: `room` vanishes across a side only
    factor = np.zeros(t.shape[:-1])
    factor[(slice(1, -1),) * d] = perturb
    for side in block.tags:
        axis, end = SIDES[d][side]
        where: list[slice | int] = [slice(1, -1)] * d
        where[axis] = -end
        factor[tuple(where)] = perturb_sides
    return t + factor[..., None] * noise


class Grid:
    """Nodes, by parameters and in space, and macro cells of one block.

    Nodes count in C order.
    """

    def __init__(
        self,
        block: Block,
        position: int,
        parameters: np.ndarray,
        degree: int,
        rng: np.random.Generator,
    ) -> None:
        d = block.dim
        for a in range(d):
            parameters = _with_middles(parameters, a) if degree == 2 else parameters
        self.block, self.position = block, position
        shape = parameters.shape[:-1]
        self.parameters = parameters.reshape(-1, d)
        self.points = block.map(self.parameters)
        self.index = np.indices(block.divisions).reshape(d, -1).T
        local = np.indices((degree + 1,) * d).reshape(d, -1).T
        lattice = degree * self.index[:, None, :] + local
        strides = np.cumprod((1,) + shape[:0:-1])[::-1]
        self.macro = lattice @ strides
        self.keys = _pattern_keys(shape, degree, block.pattern, rng)


def _with_middles(t: np.ndarray, axis: int) -> np.ndarray:
    """Insert the mean of neighbours along `axis`."""
    t = np.moveaxis(t, axis, 0)
    fine = np.empty((2 * len(t) - 1,) + t.shape[1:])
    fine[::2] = t
    fine[1::2] = 0.5 * (t[1:] + t[:-1])
    return np.moveaxis(fine, 0, axis)


def _pattern_keys(
    shape: tuple[int, ...], degree: int, pattern: str, rng: np.random.Generator
) -> np.ndarray:
    """Rank of each node: quadrilaterals are cut through their lowest vertex.

    Both cells at a face read the same ranks, so the cuts always match, also
    between glued blocks that are turned against each other.
    """
    n = int(np.prod(shape))
    if pattern == "random":
        return rng.permutation(n)
    index = np.indices(shape)
    if pattern == "left":
        index[0] = shape[0] - 1 - index[0]
    order = np.ravel_multi_index(tuple(index), shape).ravel()
    if pattern == "alternate":
        order = order + n * ((index // degree).sum(axis=0).ravel() % 2)
    return order

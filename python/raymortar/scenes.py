"""Ready-made scenes of two bodies for tests and demos.

Every builder returns a `Scene`. The upper (convex) body carries the slave surface;
the master surface belongs to the lower one. The last coordinate is the vertical one.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .meshing import Block, assemble_blocks

__all__ = ["Scene", "two_blocks"]

_LATERAL = ("left", "right", "front", "back")


@dataclasses.dataclass(frozen=True)
class Scene:
    """Bodies in one mesh, ready for contact.

    Attributes
    ----------
    mesh
        DOLFINx mesh of all bodies.
    cell_tags
        Number of the body of each cell, see `bodies`.
    facet_tags
        Tags of boundary facets, see `tags`.
    tags
        Facet tag by name; "slave" and "master" are always there.
    bodies
        Cell tag by name: "lower" 1, "upper" 2.
    """

    mesh: Any
    cell_tags: Any
    facet_tags: Any
    tags: dict[str, int]
    bodies: dict[str, int] = dataclasses.field(
        default_factory=lambda: {"lower": 1, "upper": 2}
    )


def _rotation_matrix(rotation, dim) -> np.ndarray:
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


def _rotated(blocks: Sequence[Block], rotation) -> list[Block]:
    """The blocks after a rotation about the origin; `None` leaves them."""
    if rotation is None:
        return list(blocks)
    matrix = _rotation_matrix(rotation, blocks[0].dim)

    def turned(block):
        first = block.mapping if block.mapping is not None else lambda x: x
        return dataclasses.replace(block, mapping=lambda x: first(x) @ matrix.T)

    return [turned(block) for block in blocks]


def _numbers(value, count: int, name: str, default=None) -> tuple:
    """`count` numbers out of a number or a sequence of them."""
    value = default if value is None else value
    numbers = (value,) * count if np.ndim(value) == 0 else tuple(value)
    if len(numbers) != count:
        raise ValueError(f"{name} must be one number or {count}, not {value}")
    if not all(np.isfinite(numbers)):
        raise ValueError(f"{name} = {value} is not finite")
    return numbers


def _interface(interface, tilt, height: float, centre) -> Callable:
    """Height of the interface over lateral points (n, d - 1)."""
    slope = np.tan(np.asarray(tilt, dtype=np.float64))

    def at(x):
        y = height if interface is None else np.asarray(interface(x), np.float64)
        if np.ndim(y) > 0 and np.size(y) != len(x):
            raise ValueError("interface must return one height per point")
        return np.broadcast_to(np.reshape(y, -1), len(x)) + (x - centre) @ slope

    return at


def two_blocks(
    comm,
    dim: int = 2,
    cell: str | None = None,
    lower_divisions: int | Sequence[int] | None = None,
    upper_divisions: int | Sequence[int] | None = None,
    geometry_degree: int = 1,
    *,
    lower_size: float | Sequence[float] = 1.0,
    upper_size: float | Sequence[float] = 1.0,
    overhang: float | Sequence[float] = 0.0,
    gap: float = 0.0,
    interface: Callable[[np.ndarray], np.ndarray] | None = None,
    tilt: float | Sequence[float] = 0.0,
    rotation: float | np.ndarray | None = None,
    pattern: str = "right",
    perturb: float = 0.0,
    perturb_sides: float = 0.0,
    seed: int = 0,
) -> Scene:
    """One block on another, with unrelated nodes. Collective.

    Parameters
    ----------
    comm
        MPI communicator.
    dim
        2 or 3.
    cell
        Cell name; by default triangles or tetrahedra.
    lower_divisions, upper_divisions
        Cells per direction; one number for all. Default: 7 and 5 in 2D, 4 and 3 in 3D.
    geometry_degree
        1 or 2.
    lower_size, upper_size
        Edge lengths. The lower block's corner is the origin.
    overhang
        Lateral shift of the upper block from its place amid the lower one: in x, or
        in x and y. Length.
    gap
        Vertical distance between the blocks, negative for a penetration. Length.
    interface
        Height of the common interface over lateral points (n, dim - 1), shape (n,).
        By default the lower block's height. Mid nodes lie at the mean lateral place.
    tilt
        Angle of the interface's slope in x, or in x and y (3D), about the lower
        block's centre line. Radians.
    rotation
        Turns the whole scene about the origin: an angle in radians (2D) or a matrix.
    pattern, perturb, perturb_sides, seed
        See `Block` and `assemble_blocks`. Only tagged sides move, so all do here.

    Returns
    -------
    Scene
        Tags bottom 1, top 2, slave 3 (bottom of the upper block), master 4 (top of the
        lower), lower_left 5, lower_right 6, lower_front 7, lower_back 8, upper_left 9,
        upper_right 10, upper_front 11, upper_back 12 (front and back in 3D only).

    Examples
    --------
    Tilted by 20 degrees, meshed irregularly, upper block narrower:

    >>> scene = two_blocks(comm, 2, "quadrilateral", tilt=0.35, perturb=0.2,
    ...                    upper_size=(0.5, 1.0))
    """
    if dim not in (2, 3):
        raise ValueError(f"dim = {dim} is neither 2 nor 3")
    if cell is None:
        cell = "triangle" if dim == 2 else "tetrahedron"
    below = _numbers(lower_size, dim, "lower_size")
    above = _numbers(upper_size, dim, "upper_size")
    shift = _numbers(overhang, 1 if np.ndim(overhang) == 0 else dim - 1, "overhang")
    slopes = _numbers(tilt, 1 if np.ndim(tilt) == 0 else dim - 1, "tilt")
    if min(*below, *above) <= 0.0 or not np.isfinite(gap):
        raise ValueError("sizes must be positive and the gap finite")
    if np.max(np.abs(slopes)) >= 0.5 * np.pi:
        raise ValueError(f"tilt = {tilt} is not below a right angle (radians)")
    lateral, height = np.array(below[:-1]), below[-1]
    # A single number is meant along x
    shift = np.array((shift + (0.0,))[: dim - 1])
    surface = _interface(interface, (slopes + (0.0,))[: dim - 1], height, 0.5 * lateral)
    start = 0.5 * (lateral - np.array(above[:-1])) + shift

    def lower_map(x):
        share = x[:, -1] / height
        return np.column_stack([x[:, :-1], share * surface(x[:, :-1])])

    def upper_map(x):
        share = (x[:, -1] - height) / above[-1]
        roof = height + above[-1]
        y = (1.0 - share) * surface(x[:, :-1]) + share * roof + gap
        return np.column_stack([x[:, :-1], y])

    tags = {"bottom": 1, "top": 2, "slave": 3, "master": 4}
    sides = _LATERAL[: 2 * (dim - 1)]
    tags.update({f"lower_{side}": 5 + i for i, side in enumerate(sides)})
    tags.update({f"upper_{side}": 9 + i for i, side in enumerate(sides)})
    default = {2: (7, 5), 3: (4, 3)}[dim]
    lower = Block(
        _numbers(lower_divisions, dim, "lower_divisions", default[0]),
        (0.0,) * dim,
        below,
        mapping=lower_map,
        tags={"bottom": tags["bottom"], "top": tags["master"]}
        | {side: tags[f"lower_{side}"] for side in sides},
        pattern=pattern,
    )
    upper = Block(
        _numbers(upper_divisions, dim, "upper_divisions", default[1]),
        (*start, height),
        (*(start + above[:-1]), height + above[-1]),
        mapping=upper_map,
        tags={"bottom": tags["slave"], "top": tags["top"]}
        | {side: tags[f"upper_{side}"] for side in sides},
        pattern=pattern,
    )
    blocks = _rotated([lower, upper], rotation)
    mesh, cell_tags, facet_tags = assemble_blocks(
        comm, blocks, cell, geometry_degree, perturb, perturb_sides, seed
    )
    return Scene(mesh, cell_tags, facet_tags, tags)

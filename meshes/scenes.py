"""Ready-made scenes of two bodies for tests and demos.

Every builder returns a `Scene`. The upper (convex) body carries the slave surface;
the master surface belongs to the lower one. The last coordinate is the vertical one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from raymortar.io.partitions import strips

from .blocks import Block, Motion, rotated
from .hertz import cylinder_on_block, sphere_on_plane, two_cylinders, two_spheres
from .meshing import Scene, assemble_blocks

__all__ = [
    "Scene",
    "cylinder_on_block",
    "sphere_on_plane",
    "two_blocks",
    "two_cylinders",
    "two_spheres",
]

_LATERAL = ("left", "right", "front", "back")


def _numbers(value: Any, count: int, name: str, default: Any = None) -> tuple[Any, ...]:
    """`count` numbers out of a number or a sequence of them."""
    value = default if value is None else value
    numbers = (value,) * count if np.ndim(value) == 0 else tuple(value)
    if len(numbers) != count:
        raise ValueError(f"{name} must be one number or {count}, not {value}")
    if not all(np.isfinite(numbers)):
        raise ValueError(f"{name} = {value} is not finite")
    return numbers


def _interface(
    interface: Motion | None, tilt: npt.ArrayLike, height: float, centre: np.ndarray
) -> Motion:
    """Height of the interface over lateral points (n, d - 1)."""
    slope = np.tan(np.asarray(tilt, dtype=np.float64))

    def at(x: np.ndarray) -> np.ndarray:
        y: Any = height if interface is None else np.asarray(interface(x), np.float64)
        if np.ndim(y) > 0 and np.size(y) != len(x):
            raise ValueError("interface must return one height per point")
        return np.broadcast_to(np.reshape(y, -1), len(x)) + (x - centre) @ slope

    return at


def _lateral(value: Any, dim: int, name: str) -> np.ndarray:
    """Lateral vector (dim - 1,); a single number is meant along x."""
    given = _numbers(value, 1 if np.ndim(value) == 0 else dim - 1, name)
    return np.array((given + (0.0,))[: dim - 1])


def _between(
    start: float, height: float, floor: Motion, roof: Motion, lift: float = 0.0
) -> Motion:
    """Map the layer start <= z <= start + height to floor <= z <= roof, and lift it."""

    def mapping(x: np.ndarray) -> np.ndarray:
        share, lateral = (x[:, -1] - start) / height, x[:, :-1]
        z = (1.0 - share) * floor(lateral) + share * roof(lateral) + lift
        return np.column_stack([lateral, z])

    return mapping


def _block_tags(dim: int) -> dict[str, int]:
    """Tags of `two_blocks` by name."""
    tags = {"bottom": 1, "top": 2, "slave": 3, "master": 4}
    for first, body in ((5, "lower"), (9, "upper")):
        sides = _LATERAL[: 2 * (dim - 1)]
        tags |= {f"{body}_{side}": first + i for i, side in enumerate(sides)}
    return tags


def _side_tags(
    tags: dict[str, int], body: str, bottom: str, top: str
) -> dict[str, int]:
    """Tags of one block's sides."""
    sides = {side: tags.get(f"{body}_{side}") for side in _LATERAL}
    sides |= {"bottom": tags[bottom], "top": tags[top]}
    return {side: tag for side, tag in sides.items() if tag is not None}


def two_blocks(
    comm: MPI.Comm,
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
    partition: Callable[[np.ndarray, int], np.ndarray] | None = strips,
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
    pattern, perturb, perturb_sides, seed, partition
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
    if min(*below, *above) <= 0.0 or not np.isfinite(gap):
        raise ValueError("sizes must be positive and the gap finite")
    shift = _lateral(overhang, dim, "overhang")
    slopes = _lateral(tilt, dim, "tilt")
    if np.max(np.abs(slopes)) >= 0.5 * np.pi:
        raise ValueError(f"tilt = {tilt} is not below a right angle (radians)")
    centre = 0.5 * np.array(below[:-1])
    surface = _interface(interface, slopes, below[-1], centre)
    start = (*(centre - 0.5 * np.array(above[:-1]) + shift), below[-1])
    tags = _block_tags(dim)
    n_lower, n_upper = {2: (7, 5), 3: (4, 3)}[dim]
    lower = Block(
        _numbers(lower_divisions, dim, "lower_divisions", n_lower),
        (0.0,) * dim,
        below,
        mapping=_between(0.0, below[-1], lambda x: np.zeros(len(x)), surface),
        tags=_side_tags(tags, "lower", bottom="bottom", top="master"),
        pattern=pattern,
    )
    roof = below[-1] + above[-1]
    upper = Block(
        _numbers(upper_divisions, dim, "upper_divisions", n_upper),
        start,
        tuple(np.add(start, above)),
        mapping=_between(
            below[-1], above[-1], surface, lambda x: np.full(len(x), roof), gap
        ),
        tags=_side_tags(tags, "upper", bottom="slave", top="top"),
        pattern=pattern,
    )
    blocks = rotated([lower, upper], rotation)
    mesh, cell_tags, facet_tags = assemble_blocks(
        comm,
        blocks,
        cell,
        geometry_degree,
        perturb,
        perturb_sides,
        seed,
        partition,
    )
    return Scene(mesh, cell_tags, facet_tags, tags)

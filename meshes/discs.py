"""Blocks of a disc and of a ring in the plane, of quadrilaterals around their centre."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .blocks import Block

__all__ = ["disc_blocks", "ring_blocks"]

# Half a side of the square in the middle of a disc, over the radius
CORE = 0.5


def _turned(x: np.ndarray, quarter: int) -> np.ndarray:
    """Turn points by quarters."""
    for _ in range(quarter):
        x = np.column_stack([-x[:, 1], x[:, 0]])
    return x


def _fans(
    divisions: tuple[int, int],
    inner: Callable[[np.ndarray], np.ndarray],
    radius: float,
    centre: tuple[float, float],
    tags: dict[str, int],
    body: str,
) -> list[Block]:
    """Four blocks from an inner curve, given along y for x > 0, out to a circle."""

    def mapping(quarter: int) -> Callable[[np.ndarray], np.ndarray]:
        def to_place(x: np.ndarray) -> np.ndarray:
            out, angle = x[:, :1], 0.25 * np.pi * x[:, 1]
            circle = radius * np.column_stack([np.cos(angle), np.sin(angle)])
            place = (1.0 - out) * inner(x[:, 1]) + out * circle
            return _turned(place, quarter) + np.asarray(centre)

        return to_place

    box = (0.0, -1.0), (1.0, 1.0)
    return [
        Block(divisions, *box, mapping=mapping(k), tags=tags, body=body)
        for k in range(4)
    ]


def disc_blocks(
    n: int,
    radius: float,
    tag: int,
    centre: tuple[float, float] = (0.0, 0.0),
    body: str = "disc",
) -> list[Block]:
    """Five blocks of a disc, with 4 n facets of a tag around it."""
    half = CORE * radius
    x, y = centre
    core = Block((n, n), (x - half, y - half), (x + half, y + half), body=body)

    def side(t: np.ndarray) -> np.ndarray:
        return half * np.column_stack([np.ones_like(t), t])

    fans = _fans((max(n // 2, 1), n), side, radius, centre, {"right": tag}, body)
    return [core, *fans]


def ring_blocks(
    n: int,
    radii: tuple[float, float],
    across: int,
    tag: int,
    centre: tuple[float, float] = (0.0, 0.0),
    body: str = "ring",
) -> list[Block]:
    """Four blocks of a ring between two radii, with 4 n facets of a tag around it and
    cells across."""
    small, large = radii

    def arc(t: np.ndarray) -> np.ndarray:
        angle = 0.25 * np.pi * t
        return small * np.column_stack([np.cos(angle), np.sin(angle)])

    return _fans((across, n), arc, large, centre, {"right": tag}, body)

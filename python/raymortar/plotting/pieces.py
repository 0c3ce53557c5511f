"""Polygons in space as pieces of one size, which a painter sorts right by their depths."""

from __future__ import annotations

import numpy as np

from ..core.compat import Array

# Triangles of a surface, where its polygons are fewer; parts of an edge
MOST_PIECES, MOST_PARTS = 12_000, 32


def pieces_of_one_size(polygons: Array) -> tuple[Array, Array, Array]:
    """Split polygons (n, k, 3) into triangles (m, 3, 3) of about one size, no more than
    `MOST_PIECES` where there are fewer polygons; with the polygon of each, (m,), and the
    pieces of all outlines, (l, 2, 3)."""
    n, k = polygons.shape[:2]
    begin, end = polygons, np.roll(polygons, -1, axis=1)
    longest = np.linalg.norm(end - begin, axis=2).max(axis=1)
    parts = np.ones(n, dtype=int)
    for finest in range(2, MOST_PARTS + 1):
        finer = np.ceil(finest * longest / longest.max()).astype(int)
        if k * (finer**2).sum() > MOST_PIECES:
            break
        parts = finer
    middle = np.broadcast_to(polygons.mean(axis=1, keepdims=True), polygons.shape)
    fan = np.stack([middle, begin, end], axis=2)  # (n, k, 3, 3)
    pieces, of, outlines = [], [], []
    for count in np.unique(parts):
        at = np.flatnonzero(parts == count)
        some = np.einsum("tcj,nkjd->nktcd", _split_triangle(count), fan[at])
        pieces.append(some.reshape(-1, 3, 3))
        of.append(np.repeat(at, k * count**2))
        t = np.linspace(0.0, 1.0, count + 1)[:, None]
        along = begin[at, :, None] * (1.0 - t) + end[at, :, None] * t
        ends = np.stack([along[:, :, :-1], along[:, :, 1:]], axis=3)
        outlines.append(ends.reshape(-1, 2, 3))
    return np.concatenate(pieces), np.concatenate(of), np.concatenate(outlines)


def _split_triangle(count: int) -> Array:
    """Barycentric corners of the count^2 like parts of a triangle, (parts, 3, 3)."""
    found = []
    for i in range(count):
        for j in range(count - i):
            found.append([(i, j), (i + 1, j), (i, j + 1)])
            if i + j < count - 1:
                found.append([(i + 1, j + 1), (i, j + 1), (i + 1, j)])
    b = np.array(found, dtype=float) / count
    return np.concatenate([1.0 - b.sum(axis=2, keepdims=True), b], axis=2)

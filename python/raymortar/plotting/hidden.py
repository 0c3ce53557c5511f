"""Pixels in which facets in space are seen, as the nearer hides the farther.

matplotlib sorts whole polygons by the depth of their middles. Where bodies touch, it
shows parts of the one that are behind the other.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..core.compat import Array

Pixels = npt.NDArray[np.int64]

# Most samples of triangles at a time
SAMPLES = 2_000_000


def fans(polygons: Array) -> Array:
    """Split polygons (n, k, c) around their means into triangles, (n k, 3, c).

    Points that are repeated give triangles without an area.
    """
    middle = np.broadcast_to(polygons.mean(axis=1, keepdims=True), polygons.shape)
    parts = np.stack([middle, polygons, np.roll(polygons, -1, axis=1)], axis=2)
    return parts.reshape(-1, 3, polygons.shape[2])


def nearest(triangles: Array, shape: tuple[int, int]) -> tuple[Pixels, Array, Array]:
    """Find what is seen of triangles in each pixel of an image of (rows, columns).

    Triangles (n, 3, 3) are in columns, rows and depth, which is larger nearer to the eye.
    Returns the number of the triangle that is seen at the middle of each pixel, -1 for
    none; the shares of its corners, (pixels, 3); and the depth, -inf for none.
    """
    rows, columns = shape
    number = np.full(rows * columns, -1, dtype=np.int64)
    depth, shares = np.full(len(number), -np.inf), np.zeros((len(number), 3))
    corner = triangles[:, 0, :2]
    one, other = triangles[:, 1, :2] - corner, triangles[:, 2, :2] - corner
    area = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
    # Pixels whose middles are in the box of each triangle
    ends = np.array([columns, rows])
    low = np.clip(np.ceil(triangles[..., :2].min(axis=1) - 0.5), 0, ends).astype(int)
    high = np.clip(np.floor(triangles[..., :2].max(axis=1) + 0.5), 0, ends).astype(int)
    sides = np.maximum(high - low, 0)
    counts = np.where(area != 0.0, sides.prod(axis=1), 0)
    filled = np.flatnonzero(counts)
    parts = np.cumsum(counts[filled]) // SAMPLES
    for some in np.split(filled, np.flatnonzero(np.diff(parts)) + 1):
        of = np.repeat(some, counts[some])
        k = np.arange(len(of)) - np.repeat(
            np.cumsum(counts[some]) - counts[some], counts[some]
        )
        x = low[of, 0] + k % sides[of, 0]
        y = low[of, 1] + k // sides[of, 0]
        to = np.stack([x, y], axis=1) + 0.5 - corner[of]
        s = (to[:, 0] * other[of, 1] - to[:, 1] * other[of, 0]) / area[of]
        t = (one[of, 0] * to[:, 1] - one[of, 1] * to[:, 0]) / area[of]
        share = np.stack([1.0 - s - t, s, t], axis=1)
        at = y * columns + x
        own = np.einsum("ni,ni->n", share, triangles[of, :, 2])
        near = np.flatnonzero((share >= 0.0).all(axis=1) & (own > depth[at]))
        # The nearest sample of a pixel comes last, and stays
        near = near[np.argsort(own[near], kind="stable")]
        last = len(near) - 1 - np.unique(at[near][::-1], return_index=True)[1]
        near = near[last]
        number[at[near]], shares[at[near]] = of[near], share[near]
        depth[at[near]] = own[near]
    return number, shares, depth


def edges_seen(segments: Array, depth: Array, lift: float) -> Pixels:
    """Find pixels of segments (n, 2, 3) that no facet hides.

    Segments are in columns, rows and depth. Facets that they bound, depth (rows, columns),
    are behind them by up to `lift`, at the pixel or at one beside it.
    """
    rows, columns = depth.shape
    behind = np.pad(depth, 1, mode="edge")
    for axis in (0, 1):
        ahead = np.take(behind, np.arange(2, behind.shape[axis]), axis)
        here = np.take(behind, np.arange(1, behind.shape[axis] - 1), axis)
        before = np.take(behind, np.arange(behind.shape[axis] - 2), axis)
        behind = np.minimum(np.minimum(before, here), ahead)
    ways = segments[:, 1] - segments[:, 0]
    counts = np.ceil(np.abs(ways[:, :2]).max(axis=1)).astype(int) + 1
    of = np.repeat(np.arange(len(segments)), counts)
    k = np.arange(len(of)) - np.repeat(np.cumsum(counts) - counts, counts)
    x = segments[of, 0] + (k / np.maximum(counts[of] - 1, 1))[:, None] * ways[of]
    column, row = np.floor(x[:, :2]).astype(np.int64).T
    inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
    at = (row * columns + column)[inside]
    return np.unique(at[x[inside, 2] + lift >= behind.ravel()[at]])

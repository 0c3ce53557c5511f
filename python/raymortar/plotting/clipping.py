"""Polygons cut by a box."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.compat import Array

Box = tuple[Array, Array]


def within(bodies: Any, box: Box) -> list[Array]:
    """The polygons that reach into a box; in 3D what of them is in it, where polygons
    with fewer points repeat their last. Axes cut those of a plane."""
    x, u, _ = bodies
    at = x[..., : u.shape[-1]] + u
    reaches = ((at.max(axis=1) >= box[0]) & (at.min(axis=1) <= box[1])).all(axis=1)
    chosen = [values[reaches] for values in bodies]
    if u.shape[-1] == 2:
        return chosen
    rows = np.concatenate([at[reaches], *chosen], axis=2)
    parts = [part for one in rows if len(part := _clipped(one, box)) > 2]
    width = max(map(len, parts), default=3)
    order = [np.minimum(np.arange(width), len(part) - 1) for part in parts]
    cut = [part[k] for part, k in zip(parts, order)]
    found = np.array(cut).reshape(-1, width, rows.shape[2])
    return np.split(found[..., 3:], [3, 6], axis=2)


def _clipped(rows: Array, box: Box) -> Array:
    """Clip a polygon to a box: rows begin with its points, and are interpolated."""
    for sign, corner in zip((1.0, -1.0), box):
        for axis, bound in enumerate(corner):
            depth = sign * (rows[:, axis] - bound)
            if (depth >= 0.0).all():
                continue
            kept: list[Array] = []
            for k in range(len(rows)):
                if (depth[k - 1] < 0.0) != (depth[k] < 0.0):
                    share = depth[k - 1] / (depth[k - 1] - depth[k])
                    kept.append(rows[k - 1] + share * (rows[k] - rows[k - 1]))
                if depth[k] >= 0.0:
                    kept.append(rows[k])
            if not kept:
                return rows[:0]
            rows = np.array(kept)
    return rows

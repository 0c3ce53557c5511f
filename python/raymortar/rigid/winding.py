"""Side of a surface of facets on which a point is."""

from __future__ import annotations

import numpy as np

from ..compat import Array, Indices


def winding(points: Array, corners: Indices, x: Array) -> float:
    """Share of all directions from a point in which facets hide their inner side.

    Facets (m, k) are taken straight. 1 in a closed surface whose normals point outward, 0
    out of it. Of an open surface positive behind it, negative in front of it.
    """
    to = points[corners] - x
    if corners.shape[1] == 2:
        a, b = to[:, 0], to[:, 1]
        cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        angles = np.arctan2(cross, np.einsum("ni,ni->n", a, b))
        return float(angles.sum() / (2.0 * np.pi))
    fans = [to[:, [0, i, i + 1]] for i in range(1, corners.shape[1] - 1)]
    return sum(_solid_angles(fan) for fan in fans) / (4.0 * np.pi)


def _solid_angles(triangles: Array) -> float:
    """Sum of the solid angles of triangles (n, 3, 3) seen from the origin.

    Van Oosterom and Strackee's formula: tan(angle / 2) = det [a b c] / (|a| |b| |c| + ...).
    """
    a, b, c = np.moveaxis(triangles, 1, 0)
    la, lb, lc = np.linalg.norm(triangles, axis=2).T
    ab, bc, ca = (np.einsum("ni,ni->n", s, t) for s, t in ((a, b), (b, c), (c, a)))
    below = la * lb * lc + ab * lc + bc * la + ca * lb
    return float(2.0 * np.arctan2(np.linalg.det(triangles), below).sum())

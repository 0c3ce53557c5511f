"""Rotations by a vector, with their derivatives."""

from __future__ import annotations

import numpy as np

from .._cpp import rotation_matrix, turning
from ..compat import Array

__all__ = ["directions_across", "rotation_matrix", "rotation_vector", "turning"]


def rotation_vector(matrix: Array) -> Array:
    """Rotation vector of a rotation matrix, of a length up to pi, (3,)."""
    m = matrix - matrix.T
    sine = 0.5 * np.array([m[2, 1], m[0, 2], m[1, 0]])
    angle = float(np.arctan2(np.linalg.norm(sine), 0.5 * (np.trace(matrix) - 1.0)))
    if angle < 0.9 * np.pi:
        size = float(np.linalg.norm(sine))
        return sine * (angle / size if size > 0.0 else 1.0)
    # Near half a turn the skew part vanishes: the symmetric part has the axis
    both = 0.5 * (matrix + matrix.T) - np.cos(angle) * np.eye(3)
    axis = both[:, int(np.argmax(np.diag(both)))]
    axis = axis / np.linalg.norm(axis)
    return angle * (axis if axis @ sine >= 0.0 else -axis)


def directions_across(axis: Array) -> tuple[Array, Array]:
    """Two orthogonal unit vectors that are orthogonal to a given one, or to each of
    several, (..., 3)."""
    # Rounded, as components that are alike but for rounding must not decide
    least = np.eye(3)[np.round(np.abs(axis), 9).argmin(axis=-1)]
    one = np.cross(axis, least)
    one /= np.linalg.norm(one, axis=-1, keepdims=True)
    return one, np.cross(axis, one)

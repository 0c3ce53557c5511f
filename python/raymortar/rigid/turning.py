"""Rotations by a vector, with their derivatives."""

from __future__ import annotations

import numpy as np

from .._cpp import rotation_matrix, turning
from ..core.compat import Array

__all__ = [
    "LARGEST_TURN",
    "directions_across",
    "rotation_matrix",
    "rotation_vector",
    "turning",
]

# Largest rotation in one step with friction: after half a turn a slip has no direction.
# Radians
LARGEST_TURN = 0.5 * np.pi


def rotation_vector(matrix: Array) -> Array:
    """Rotation vector of a rotation matrix, of a length up to pi, (3,)."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(matrix).as_rotvec()


def directions_across(axis: Array) -> tuple[Array, Array]:
    """Two orthogonal unit vectors that are orthogonal to a given one, or to each of
    several, (..., 3)."""
    # Rounded, as components that are alike but for rounding must not decide
    least = np.eye(3)[np.round(np.abs(axis), 9).argmin(axis=-1)]
    one = np.cross(axis, least)
    one /= np.linalg.norm(one, axis=-1, keepdims=True)
    return one, np.cross(axis, one)

"""Rotations by a vector, with their derivatives."""

from __future__ import annotations

from math import factorial

import numpy as np

from ..compat import Array

# Square of the angle up to which series are used, and their number of terms
_SMALL, _TERMS = 1.0, 12


def cross_matrix(v: Array) -> Array:
    """The matrix of v x, (3, 3)."""
    a, b, c = v
    return np.array([[0.0, -c, b], [c, 0.0, -a], [-b, a, 0.0]])


def axial(matrix: Array) -> Array:
    """The vector v of the skew part of a matrix, that of v x, (..., 3)."""
    m = matrix - np.swapaxes(matrix, -1, -2)
    return 0.5 * np.stack([m[..., 2, 1], m[..., 0, 2], m[..., 1, 0]], axis=-1)


def rotation_matrix(rotation: Array) -> Array:
    """Rotation about the direction of a vector by its length in radians, (3, 3).

    Rodrigues' formula.
    """
    angle = float(np.linalg.norm(rotation))
    if angle == 0.0:
        return np.eye(3)
    cross = cross_matrix(rotation / angle)
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def rotation_vector(matrix: Array) -> Array:
    """Rotation vector of a rotation matrix, of a length up to pi, (3,)."""
    sine = axial(matrix)
    angle = float(np.arctan2(np.linalg.norm(sine), 0.5 * (np.trace(matrix) - 1.0)))
    if angle < 0.9 * np.pi:
        size = float(np.linalg.norm(sine))
        return sine * (angle / size if size > 0.0 else 1.0)
    # Near half a turn the skew part vanishes: the symmetric part has the axis
    both = 0.5 * (matrix + matrix.T) - np.cos(angle) * np.eye(3)
    axis = both[:, int(np.argmax(np.diag(both)))]
    axis = axis / np.linalg.norm(axis)
    return angle * (axis if axis @ sine >= 0.0 else -axis)


def _coefficients(s: float) -> tuple[Array, Array]:
    """a = sin t / t and b = (1 - cos t) / t^2 with two derivatives by s = t^2 each."""
    if s < _SMALL:
        a, b = np.zeros(3), np.zeros(3)
        for k in range(_TERMS):
            powers = [
                1.0 if i == 0 else float(np.prod(np.arange(k - i + 1, k + 1)))
                for i in range(3)
            ]
            terms = [p * s ** (k - i) if k >= i else 0.0 for i, p in enumerate(powers)]
            a += (-1.0) ** k / factorial(2 * k + 1) * np.array(terms)
            b += (-1.0) ** k / factorial(2 * k + 2) * np.array(terms)
        return a, b
    t = np.sqrt(s)
    sine, cosine = np.sin(t), np.cos(t)
    a = np.array(
        [
            sine / t,
            (t * cosine - sine) / (2.0 * t**3),
            (3.0 * sine - 3.0 * t * cosine - s * sine) / (4.0 * t**5),
        ]
    )
    b = np.array(
        [
            (1.0 - cosine) / s,
            (t * sine - 2.0 * (1.0 - cosine)) / (2.0 * s**2),
            (8.0 * (1.0 - cosine) - 5.0 * t * sine + s * cosine) / (4.0 * s**3),
        ]
    )
    return a, b


def turning(rotation: Array) -> tuple[Array, Array, Array]:
    """A rotation with its first and second derivatives by the vector's components,
    (3, 3), (3, 3, 3) and (3, 3, 3, 3): the last two axes are those of the matrices."""
    (a, a_s, a_ss), (b, b_s, b_ss) = _coefficients(float(rotation @ rotation))
    one = np.eye(3)
    K, E = cross_matrix(rotation), np.array([cross_matrix(e) for e in one])
    square = K @ K
    of_square = E @ K + K @ E
    a_i, b_i = 2.0 * a_s * rotation, 2.0 * b_s * rotation
    both = np.outer(rotation, rotation)
    a_ij = 4.0 * a_ss * both + 2.0 * a_s * one
    b_ij = 4.0 * b_ss * both + 2.0 * b_s * one

    def times(scalar: Array, matrix: Array) -> Array:
        return np.multiply.outer(scalar, matrix)

    R = one + a * K + b * square
    first = times(a_i, K) + a * E + times(b_i, square) + b * of_square
    products = np.einsum("iab,jbc->ijac", E, E)
    mixed = times(a_i, E) + times(b_i, of_square)
    second = (
        times(a_ij, K)
        + times(b_ij, square)
        + mixed
        + np.swapaxes(mixed, 0, 1)
        + b * (products + np.swapaxes(products, 0, 1))
    )
    return R, first, second


def directions_across(axis: Array) -> tuple[Array, Array]:
    """Two orthogonal unit vectors that are orthogonal to a given one, or to each of
    several, (..., 3)."""
    # Rounded, as components that are alike but for rounding must not decide
    least = np.eye(3)[np.round(np.abs(axis), 9).argmin(axis=-1)]
    one = np.cross(axis, least)
    one /= np.linalg.norm(one, axis=-1, keepdims=True)
    return one, np.cross(axis, one)

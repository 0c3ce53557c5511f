"""Rotations of models: fixed ones without symmetry, and random ones."""

import numpy as np

ROTATION = {
    2: np.array([[0.6, -0.8], [0.8, 0.6]]),
    3: np.array([[2, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3,
}


def rotation(dim, seed=3):
    """A random proper rotation."""
    Q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(dim, dim)))
    Q[:, 0] *= np.linalg.det(Q)
    return Q


def turn(dim, angle, rng):
    """Rotation by an angle about a random axis."""
    if dim == 2:
        c, s = np.cos(angle), np.sin(angle)
        return np.array([[c, -s], [s, c]])
    axis = rng.normal(size=3)
    x, y, z = axis / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K

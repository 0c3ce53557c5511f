"""Weights by which nodes off a contact surface stand for a node on it."""

from __future__ import annotations

import numpy as np

from ..compat import Array

# Relative difference of distances that count as the same
SAME = 1e-6

# Least singular value of the places of neighbours, over the largest: with a smaller one
# they are in a line or plane, and weights would be large
SPREAD = 0.1

# Weights up to this are rounding errors
NOTHING = 1e-14


def nearest_weights(x: Array, neighbours: Array) -> Array | None:
    """Share weight one among the nearest neighbours (n, d) of a node at x (d,).

    None without any neighbour. Values that are constant around the node are reproduced
    [theory (6.2)].
    """
    if len(neighbours) == 0:
        return None
    distance = np.linalg.norm(neighbours - x, axis=1)
    nearest = distance <= (1.0 + SAME) * distance.min()
    return np.asarray(nearest / np.count_nonzero(nearest))


def affine_weights(x: Array, neighbours: Array) -> Array | None:
    """Find the weights of neighbours (n, d) that extrapolate to a node at x (d,).

    None if the neighbours are in a line, in space in a plane. Affine functions of the
    place are reproduced; of all such weights these have the least sum of squares, each
    times the squared distance from the node [theory (6.3)].
    """
    count, d = neighbours.shape
    if count <= d:
        return None
    away = neighbours - x
    distance = np.linalg.norm(away, axis=1)
    centred = away - away.mean(axis=0)
    sizes = np.linalg.svd(centred, compute_uv=False)
    if sizes[-1] < SPREAD * sizes[0]:
        return None
    conditions = np.vstack([np.ones(count), away.T / distance.max()])
    scaled = conditions / distance
    sought = np.zeros(d + 1)
    sought[0] = 1.0
    weights = np.linalg.lstsq(scaled, sought, rcond=None)[0] / distance
    return np.where(np.abs(weights) > NOTHING, weights, 0.0)

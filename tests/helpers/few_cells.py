"""Meshes of very few cells, of which some ranks have none."""

import numpy as np
from problems import COMM

from meshes.from_arrays import create_mesh


def square(degree=1, ghosts=False):
    """Four quadrilaterals or, of degree 2, one of nine nodes, moved to the right."""
    n = 3
    x, y = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    points = np.column_stack([x.ravel() + 1.0, y.ravel()]) * 0.5
    if degree == 1:
        cells = np.array([[0, 3, 1, 4]]) + np.array([[0], [1], [3], [4]])
    else:
        cells = np.array([[0, 6, 2, 8, 3, 1, 7, 5, 4]])
    if COMM.rank > 0:
        cells, points = cells[:0], points[:0]
    return create_mesh(COMM, cells, points, "quadrilateral", degree, ghosts)

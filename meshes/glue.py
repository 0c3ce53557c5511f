"""Nodes that glued blocks of structured meshes share."""

from __future__ import annotations

import numpy as np

from raymortar.core import compat

from .blocks import Grid

# Nodes of one body closer than this fraction of its size are the same node
_GLUE_TOLERANCE = 1e-9
_GLUE_DIRECTION = (0.5377, 0.7012, 0.4683)


def glue(grids: list[Grid], body: list[int]) -> tuple[np.ndarray, list[np.ndarray]]:
    """Merge coincident nodes of each body.

    Returns
    -------
    points
        Shape (num_nodes, d).
    numbers
        Per block, number of each of its nodes in `points`.
    """
    points, start = [], 0
    numbers = [np.empty(0, dtype=np.int64)] * len(grids)
    for b in sorted(set(body)):
        members = [i for i, number in enumerate(body) if number == b]
        x = np.concatenate([grids[i].points for i in members])
        label = np.arange(len(x)) if len(members) == 1 else _coincident(x)
        first, label = np.unique(label, return_inverse=True)
        points.append(x[first])
        ends = np.cumsum([len(grids[i].points) for i in members])[:-1]
        for i, part in zip(members, np.split(start + label.reshape(-1), ends)):
            numbers[i] = part
        start += len(first)
    return np.concatenate(points), numbers


def _coincident(x: np.ndarray) -> np.ndarray:
    """For each of the points `x` (n, d) the lowest point that coincides with it."""
    tolerance = _GLUE_TOLERANCE * np.linalg.norm(np.ptp(x, axis=0))
    # Along a direction in general position only coincident points are neighbours
    direction = np.array(_GLUE_DIRECTION)[: x.shape[1]]
    s = x @ direction
    order = np.argsort(s, kind="stable")
    label = np.arange(len(x))
    step = 0
    while True:
        step += 1
        near = s[order[step:]] - s[order[:-step]] <= 2.0 * tolerance
        if not near.any():
            return label
        i, j = order[:-step][near], order[step:][near]
        same = np.linalg.norm(x[i] - x[j], axis=1) <= tolerance
        np.minimum.at(label, i[same], j[same])
        np.minimum.at(label, j[same], i[same])


def global_keys(
    grids: list[Grid], numbers: list[np.ndarray], num_points: int
) -> np.ndarray:
    """Ranks of all nodes (see `Grid`); those of the first block where glued."""
    keys = np.empty(num_points, dtype=np.int64)
    starts = np.cumsum([0] + [2 * len(grid.keys) for grid in grids])
    for grid, number, start in reversed(list(zip(grids, numbers, starts))):
        keys[number] = start + grid.keys
    return keys


def check_glue(
    cells: np.ndarray,
    facet_table: np.ndarray,
    cell: str,
    body: list[int],
    numbers: list[np.ndarray],
) -> None:
    """Raise ValueError if a tag is inside a body, or a body falls into pieces."""
    facets = compat.basix_element(cell, 1).facet_vertices
    # A random number per node makes the sum over a facet's vertices its name
    name = np.random.default_rng(0).integers(2**62, size=cells.max() + 1)
    names = np.column_stack([name[cells[:, f]].sum(axis=1) for f in np.array(facets)])
    _, inverse, count = np.unique(names, return_inverse=True, return_counts=True)
    inside = count[inverse.reshape(-1)] > 1
    if np.any(inside & (facet_table.reshape(-1) > 0)):
        tags = np.unique(facet_table.reshape(-1)[inside])
        raise ValueError(f"tags {tags[tags > 0]} are on sides glued to other blocks")
    for b in set(body):
        apart = [set(numbers[i]) for i, number in enumerate(body) if number == b]
        joined = apart.pop()
        while apart:
            near = [i for i, piece in enumerate(apart) if not joined.isdisjoint(piece)]
            if not near:
                raise ValueError(f"the blocks of body {b} do not hang together")
            joined = joined.union(*(apart[i] for i in near))
            apart = [piece for i, piece in enumerate(apart) if i not in near]

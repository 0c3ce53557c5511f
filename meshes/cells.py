"""Cells of a structured block: macro cells, or simplices that they are cut into."""

from __future__ import annotations

import numpy as np

from raymortar.core import compat

from .blocks import SIDES, Block, Grid


def cells_of(
    grid: Grid, number: np.ndarray, keys: np.ndarray, cell: str, degree: int
) -> tuple[np.ndarray, np.ndarray]:
    """Cells of one block, its macro cells cut into simplices where asked.

    Returns
    -------
    cells
        Nodes in Basix order, shape (n, nodes per cell).
    vertices
        Grid coordinates of the cells' vertices, shape (n, vertices per cell, d).
    """
    d = grid.block.dim
    macro = number[grid.macro]
    corner = _corners(d)
    at_corner = (degree * corner) @ _strides(degree, d)
    if cell in ("triangle", "tetrahedron"):
        split = _SPLIT[d](keys[macro[:, at_corner]])
    else:
        split = np.broadcast_to(np.arange(2**d), (len(macro), 1, 2**d))
    # Local coordinates of the sub-cells' vertices, then of all their nodes
    vertices = corner[split]
    element = compat.basix_element(cell, degree)
    shape = _vertex_functions(cell, element.points)
    nodes = np.rint(degree * np.einsum("nv,csvd->csnd", shape, vertices)).astype(int)
    local = nodes @ _strides(degree, d)
    cells = np.take_along_axis(macro[:, None, :], local, axis=2)
    vertices = grid.index[:, None, None, :] + vertices
    return cells.reshape(-1, local.shape[-1]), vertices.reshape(-1, split.shape[-1], d)


def centre_mid_nodes(
    points: np.ndarray,
    grid: Grid,
    number: np.ndarray,
    cells: np.ndarray,
    cell: str,
    degree: int,
) -> None:
    """Put the mid nodes of simplices at the mean parameter of their edge, in place.

    The grid has them between its own lines. On a diagonal of a shaken macro cell that
    is elsewhere, and the edge would be bent by a part of its length at any size.
    """
    if degree == 1 or cell not in ("triangle", "tetrahedron"):
        return
    place = np.empty(len(points), dtype=np.int64)
    place[number] = np.arange(len(number))
    place = place[cells]
    shape = _vertex_functions(cell, compat.basix_element(cell, degree).points)
    corners = grid.parameters[place[:, : shape.shape[1]]]
    parameters = grid.parameters.copy()
    parameters[place] = np.einsum("nv,cvd->cnd", shape, corners)
    points[number] = grid.block.map(parameters)


def _corners(d: int) -> np.ndarray:
    """Corners of the unit box in Basix order, x running fastest, shape (2^d, d)."""
    return (np.arange(2**d)[:, None] >> np.arange(d)) & 1


def _strides(degree: int, d: int) -> np.ndarray:
    """Strides of a macro cell's nodes, in C order."""
    return (degree + 1) ** np.arange(d)[::-1]


def _vertex_functions(cell: str, points: np.ndarray) -> np.ndarray:
    """(Multi-)linear functions of a cell's vertices at `points`: (points, vertices)."""
    if cell in ("triangle", "tetrahedron"):
        return np.column_stack([1.0 - points.sum(axis=1), points])
    corner = _corners(points.shape[1])[None]
    return np.where(corner, points[:, None, :], 1.0 - points[:, None, :]).prod(axis=2)


def split_quadrilaterals(keys: np.ndarray) -> np.ndarray:
    """Triangles (n, 2, 3) of quadrilaterals with the vertex ranks `keys` (n, 4)."""
    first = np.argmin(keys, axis=1)
    return _oriented(np.array([[0, 1, 3], [0, 3, 2]])[None] ^ first[:, None, None])


def split_hexahedra(keys: np.ndarray) -> np.ndarray:
    """Tetrahedra (n, 6, 4) of hexahedra with the vertex ranks `keys` (n, 8).

    The cone from the lowest vertex over the three faces opposite to it, each of them
    cut through its own lowest vertex. Vertices are numbered by the bits of their
    coordinates, so XOR with the lowest one moves it to the origin.
    """
    first = np.argmin(keys, axis=1)[:, None]
    tetrahedra = np.zeros((len(keys), 6, 4), dtype=np.int64)
    for axis in range(3):
        # The face's corners: nearest to the origin, two neighbours, and number 7
        near, b, c = 1 << axis, 1 << (axis + 1) % 3, 1 << (axis + 2) % 3
        face = np.array([near, near | b, near | c, 7])
        rank = np.take_along_axis(keys, face[None] ^ first, axis=1)
        through_7 = np.isin(np.argmin(rank, axis=1), (0, 3))[:, None]
        cut_a = face[[[0, 1, 3], [0, 3, 2]]]
        cut_b = face[[[0, 1, 2], [1, 3, 2]]]
        tetrahedra[:, 2 * axis : 2 * axis + 2, 1:] = np.where(
            through_7[:, :, None], cut_a, cut_b
        )
    return _oriented(tetrahedra ^ first[:, :, None])


_SPLIT = {2: split_quadrilaterals, 3: split_hexahedra}


def _oriented(simplices: np.ndarray) -> np.ndarray:
    """Swap two vertices of the simplices (n, m, d + 1) of negative volume."""
    x = _corners(simplices.shape[-1] - 1)[simplices]
    negative = np.linalg.det(x[:, :, 1:] - x[:, :, :1]) < 0.0
    swapped = simplices[..., [*range(simplices.shape[-1] - 2), -1, -2]]
    return np.where(negative[:, :, None], swapped, simplices)


def check_orientation(
    points: np.ndarray, cells: np.ndarray, cell: str, position: int
) -> None:
    """Raise ValueError unless the Jacobian is positive at all vertices."""
    d = points.shape[1]
    simplex = cell in ("triangle", "tetrahedron")
    for v, corner in enumerate(_corners(d)[:1] if simplex else _corners(d)):
        ends = 1 + np.arange(d) if simplex else v ^ (1 << np.arange(d))
        edges = points[cells[:, ends]] - points[cells[:, v]][:, None, :]
        jacobian = np.linalg.det(edges) * (-1.0) ** corner.sum()
        if not np.all(jacobian > 0.0):
            raise ValueError(
                f"block {position} has {np.sum(jacobian <= 0.0)} inverted or flat "
                "cells: its mapping turns it over, or the perturbation is too large"
            )


def side_tags(block: Block, vertices: np.ndarray, cell: str) -> np.ndarray:
    """Tag of each local facet of each cell, 0 for none: shape (n, facets per cell)."""
    facets = compat.basix_element(cell, 1).facet_vertices
    table = np.zeros((len(vertices), len(facets)), dtype=np.int32)
    for side, tag in block.tags.items():
        axis, end = SIDES[block.dim][side]
        on_side = vertices[:, :, axis] == end * block.divisions[axis]
        for i, facet in enumerate(facets):
            table[np.all(on_side[:, facet], axis=1), i] = tag
    return table

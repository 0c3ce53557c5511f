"""One DOLFINx mesh out of several mapped structured blocks.

Contact needs one mesh that holds bodies which share no vertex, and facet tags
on the surfaces that may touch. `Block` describes a logically rectangular piece,
`assemble_blocks` makes the mesh. Blocks with the same `Block.body` label are glued
into one conforming body; every other pair of blocks keeps nodes of its own, even
where they coincide.

The work is done on plain arrays, the same on every rank, and rank 0 alone hands
them to DOLFINx, which distributes the mesh. Tags follow the cells through that
renumbering by the *input* cell number and the local number of the facet: neither
coordinates nor tolerances are involved.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Hashable, Sequence
from typing import Any

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from raymortar import compat
from raymortar.partitions import strips

from .blocks import SIDES, Block, Grid, mirrored, perturbed

__all__ = ["Block", "Scene", "assemble_blocks", "mirrored"]

_DIMENSION = {"triangle": 2, "quadrilateral": 2, "tetrahedron": 3, "hexahedron": 3}
# Nodes of one body closer than this fraction of its size are the same node
_GLUE_TOLERANCE = 1e-9
_GLUE_DIRECTION = (0.5377, 0.7012, 0.4683)


@dataclasses.dataclass(frozen=True)
class Scene:
    """Bodies in one mesh, ready for contact.

    Attributes
    ----------
    mesh
        DOLFINx mesh of all bodies.
    cell_tags
        Number of the body of each cell, see `bodies`.
    facet_tags
        Tags of boundary facets, see `tags`.
    tags
        Facet tag by name; "slave" and "master" are always there.
    bodies
        Cell tag by name: "lower" 1, "upper" 2.
    """

    mesh: Any
    cell_tags: Any
    facet_tags: Any
    tags: dict[str, int]
    bodies: dict[str, int] = dataclasses.field(
        default_factory=lambda: {"lower": 1, "upper": 2}
    )

    def find(self, name: str) -> npt.NDArray[np.int32]:
        """Facets of this rank with a tag that is named, as of `io.GmshMesh`."""
        return self.facet_tags.find(self.tags[name])


def assemble_blocks(
    comm: MPI.Comm,
    blocks: Sequence[Block],
    cell: str = "triangle",
    geometry_degree: int = 1,
    perturb: float = 0.0,
    perturb_sides: float = 0.0,
    seed: int = 0,
    partition: Callable[[np.ndarray, int], npt.ArrayLike] | None = strips,
) -> tuple[Any, Any, Any]:
    """Make one mesh of all blocks, with cell and facet tags. Collective.

    Parameters
    ----------
    comm
        MPI communicator of the mesh. All ranks must pass equal arguments.
    blocks
        The blocks. Glued ones must match node by node.
    cell
        "triangle", "quadrilateral", "tetrahedron" or "hexahedron".
    geometry_degree
        1 or 2. Mid nodes lie at the mean *parameter*, so on the mapped surface.
    perturb
        Largest random shift of a block's interior vertices, as a fraction of the
        neighbouring cells, per direction, in [0, 0.5). Nodes on sides stay.
    perturb_sides
        The same for vertices within tagged sides, along the side: the surface and
        its edges stay what they are.
    seed
        Of the random shifts and of the "random" pattern.
    partition
        Takes midpoints of cells (n, d) and the number of ranks to the rank of each
        cell (n,). By default strips, the same in every run; `None`: up to DOLFINx's
        graph partitioner, which may cut the same mesh differently each time.

    Returns
    -------
    mesh, cell_tags, facet_tags
        `cell_tags` number the bodies from 1, in the order of `blocks`.

    Raises
    ------
    ValueError
        For bad arguments, an inverted cell, a tag on a side glued to another block,
        or a body that falls into pieces.
    """
    degree = int(geometry_degree)
    _check_arguments(blocks, cell, degree, perturb, perturb_sides)
    body, grids = _number_bodies(blocks), []
    for i, block in enumerate(blocks):
        rng = np.random.default_rng([seed, i])
        parameters = perturbed(block, perturb, perturb_sides, rng)
        grids.append(Grid(block, i, parameters, degree, rng))
    points, numbers = _glue(grids, body)
    split_cells, body_numbers, cell_tag_table = [], [], []
    keys = _global_keys(grids, numbers, len(points))
    for grid, number, b in zip(grids, numbers, body):
        split, vertices = _cells(grid, number, keys, cell, degree)
        _centre_mid_nodes(points, grid, number, split, cell, degree)
        _check_orientation(points, split, cell, grid.position)
        split_cells.append(split)
        body_numbers.append(np.full(len(split), b, dtype=np.int32))
        cell_tag_table.append(_side_tags(grid.block, vertices, cell))
    cells, cell_body = np.concatenate(split_cells), np.concatenate(body_numbers)
    facet_table = np.concatenate(cell_tag_table)
    if len(set(body)) < len(blocks):
        _check_glue(cells, facet_table, cell, body, numbers)
    ranks = None
    if partition is not None and comm.size > 1:
        ranks = partition(points[cells].mean(1), comm.size)
    tables = cell_body, facet_table
    return _distribute(comm, cells, points, cell, degree, tables, ranks)


def _check_arguments(
    blocks: Sequence[Block],
    cell: str,
    degree: int,
    perturb: float,
    perturb_sides: float,
) -> None:
    """Raise ValueError for what `assemble_blocks` cannot take."""
    if cell not in _DIMENSION:
        raise ValueError(f"cell '{cell}' is not one of {list(_DIMENSION)}")
    if not blocks:
        raise ValueError("no blocks")
    if any(block.dim != _DIMENSION[cell] for block in blocks):
        raise ValueError(f"'{cell}' needs blocks of dimension {_DIMENSION[cell]}")
    if degree not in (1, 2):
        raise ValueError(f"geometry_degree {degree} is neither 1 nor 2")
    for name, value in {"perturb": perturb, "perturb_sides": perturb_sides}.items():
        if not 0.0 <= value < 0.5:
            raise ValueError(f"{name} = {value} is not in [0, 0.5)")


def _number_bodies(blocks: Sequence[Block]) -> list[int]:
    """Body number of each block, from 1."""
    numbers: dict[Hashable, int] = {}
    labels: list[Hashable] = [
        (i,) if b.body is None else b.body for i, b in enumerate(blocks)
    ]
    return [numbers.setdefault(label, len(numbers) + 1) for label in labels]


def _glue(grids: list[Grid], body: list[int]) -> tuple[np.ndarray, list[np.ndarray]]:
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


def _global_keys(
    grids: list[Grid], numbers: list[np.ndarray], num_points: int
) -> np.ndarray:
    """Ranks of all nodes (see `Grid`); those of the first block where glued."""
    keys = np.empty(num_points, dtype=np.int64)
    starts = np.cumsum([0] + [2 * len(grid.keys) for grid in grids])
    for grid, number, start in reversed(list(zip(grids, numbers, starts))):
        keys[number] = start + grid.keys
    return keys


def _cells(
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


def _centre_mid_nodes(
    points: np.ndarray,
    grid: Any,
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


def _split_quadrilaterals(keys: np.ndarray) -> np.ndarray:
    """Triangles (n, 2, 3) of quadrilaterals with the vertex ranks `keys` (n, 4)."""
    first = np.argmin(keys, axis=1)
    return _oriented(np.array([[0, 1, 3], [0, 3, 2]])[None] ^ first[:, None, None])


def _split_hexahedra(keys: np.ndarray) -> np.ndarray:
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


_SPLIT = {2: _split_quadrilaterals, 3: _split_hexahedra}


def _oriented(simplices: np.ndarray) -> np.ndarray:
    """Swap two vertices of the simplices (n, m, d + 1) of negative volume."""
    x = _corners(simplices.shape[-1] - 1)[simplices]
    negative = np.linalg.det(x[:, :, 1:] - x[:, :, :1]) < 0.0
    swapped = simplices[..., [*range(simplices.shape[-1] - 2), -1, -2]]
    return np.where(negative[:, :, None], swapped, simplices)


def _check_orientation(
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


def _side_tags(block: Block, vertices: np.ndarray, cell: str) -> np.ndarray:
    """Tag of each local facet of each cell, 0 for none: shape (n, facets per cell)."""
    facets = compat.basix_element(cell, 1).facet_vertices
    table = np.zeros((len(vertices), len(facets)), dtype=np.int32)
    for side, tag in block.tags.items():
        axis, end = SIDES[block.dim][side]
        on_side = vertices[:, :, axis] == end * block.divisions[axis]
        for i, facet in enumerate(facets):
            table[np.all(on_side[:, facet], axis=1), i] = tag
    return table


def _check_glue(
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


def _distribute(
    comm: MPI.Comm,
    cells: np.ndarray,
    points: np.ndarray,
    cell: str,
    degree: int,
    tables: tuple[np.ndarray, np.ndarray],
    ranks: npt.ArrayLike | None,
) -> tuple[Any, Any, Any]:
    """Hand rank 0's arrays to DOLFINx and carry the tags over. Collective."""
    root = slice(None) if comm.rank == 0 else slice(0)
    cell_body, facet_table = tables
    ranks = None if ranks is None else np.asarray(ranks)[root]
    mesh = compat.create_mesh(
        comm, cells[root], points[root], cell, degree, destinations=ranks
    )
    original, tdim = mesh.topology.original_cell_index, mesh.topology.dim
    local = np.arange(len(original), dtype=np.int32)
    cell_tags = compat.meshtags(mesh, tdim, local, cell_body[original])
    facets = compat.connectivity_table(mesh, tdim, tdim - 1)
    # DOLFINx keeps the order of a cell's vertices, so also that of its facets
    tags = facet_table[original]
    facets = facets.reshape(tags.shape)  # a rank without cells does not know its width
    tagged, first = np.unique(facets[tags > 0], return_index=True)
    values = tags[tags > 0][first]
    # DOLFINx's locate_dofs_topological asks the user for it, for facets and cells
    for dim in (tdim - 1, tdim):
        compat.connectivity(mesh, dim, tdim)
    return mesh, cell_tags, compat.meshtags(mesh, tdim - 1, tagged, values)

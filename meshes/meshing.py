"""One DOLFINx mesh out of several mapped structured blocks.

Contact needs one mesh that holds bodies which share no vertex, and facet tags on the
surfaces that may touch. `Block` describes a logically rectangular piece,
`assemble_blocks` makes the mesh. Blocks with the same `Block.body` label are glued into
one conforming body; every other pair of blocks keeps separate nodes, even where they
coincide.

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

from raymortar.core import compat
from raymortar.io.partitions import strips

from .blocks import Block, Grid, mirrored, perturbed
from .cells import cells_of, centre_mid_nodes, check_orientation, side_tags
from .from_arrays import create_mesh
from .glue import check_glue, global_keys, glue

__all__ = ["Block", "Scene", "assemble_blocks", "mirrored"]

_DIMENSION = {"triangle": 2, "quadrilateral": 2, "tetrahedron": 3, "hexahedron": 3}


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
    points, numbers = glue(grids, body)
    split_cells, body_numbers, cell_tag_table = [], [], []
    keys = global_keys(grids, numbers, len(points))
    for grid, number, b in zip(grids, numbers, body):
        split, vertices = cells_of(grid, number, keys, cell, degree)
        centre_mid_nodes(points, grid, number, split, cell, degree)
        check_orientation(points, split, cell, grid.position)
        split_cells.append(split)
        body_numbers.append(np.full(len(split), b, dtype=np.int32))
        cell_tag_table.append(side_tags(grid.block, vertices, cell))
    cells, cell_body = np.concatenate(split_cells), np.concatenate(body_numbers)
    facet_table = np.concatenate(cell_tag_table)
    if len(set(body)) < len(blocks):
        check_glue(cells, facet_table, cell, body, numbers)
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
    mesh = create_mesh(
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

"""Partitions of a mesh by the place of its cells: the same in every run.

For `raymortar.io.read_gmsh`, `meshes.meshing.assemble_blocks` and the scenes. DOLFINx's
graph partitioner knows nothing of contact: it parts a slave from its master, and
the rank of the slave then sends what it assembles to that of the master. `columns`,
`sectors` and `patches` keep them together. Ranks get as many cells as others, or one less.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arguments import direction as unit_vector
from ..arguments import vector
from ..core.compat import Array, Indices
from ..core.errors import ContactError, is_whole_number
from ..rigid.turning import directions_across
from ..self_contact.all_facets import levels

__all__ = ["columns", "patches", "sectors", "strips"]

# Coordinates that differ by less, relative to the width of all, differ by rounding
ROUNDING = 1e-9


def strips(midpoints: Array, ranks: int) -> Indices:
    """Strips across the first axis, with the same number of cells each.

    DOLFINx's graph partitioner cuts the same mesh differently from one run to the next,
    so that what a rank has saved belongs to other cells.

    Parameters
    ----------
    midpoints
        Midpoints of all cells, shape (n, d). Length.
    ranks
        Number of ranks.

    Returns
    -------
    Rank of each cell, shape (n,).
    """
    return _bisected(np.asarray(midpoints)[:, :1], ranks)


def columns(direction: npt.ArrayLike) -> Callable[[Array, int], Indices]:
    """Columns along the direction of contact: cells above each other share a rank.

    For surfaces that are about flat, such as a block on a plate or a tyre on a road.

    Parameters
    ----------
    direction
        Normal to the surfaces in contact, of any length, shape (d,).

    Returns
    -------
    Partition: takes midpoints of cells (n, d) and a number of ranks to the rank of each
    cell (n,).

    Examples
    --------
    >>> read_gmsh("press.msh", comm, partition=columns((0, 0, 1)))
    """
    across = directions_across(unit_vector("direction", direction))

    def place(midpoints: Array) -> Array:
        vector("direction", direction, midpoints.shape[1])
        return _padded(midpoints) @ np.column_stack(across)

    return patches(place)


def sectors(
    centre: npt.ArrayLike, axis: npt.ArrayLike = (0.0, 0.0, 1.0)
) -> Callable[[Array, int], Indices]:
    """Sectors around an axis, cut along it too where that is long.

    For a shaft in a ring, a pin in a hole, a tube in a tube.

    Parameters
    ----------
    centre
        A point of the axis, shape (d,). Length.
    axis
        Along the axis, of any length, shape (3,); in 2D leave it out.

    Returns
    -------
    Partition, as of `columns`.
    """
    origin, along = vector("centre", centre), unit_vector("axis", axis)

    def place(midpoints: Array) -> Array:
        vector("centre", centre, midpoints.shape[1])
        away = _padded(midpoints) - origin
        height = away @ along
        radial = away - np.outer(height, along)
        radius = np.linalg.norm(radial, axis=1, keepdims=True)
        tiny = np.finfo(float).tiny
        # Arcs of the mean radius are what lengths along the axis are compared with
        arc = radius.mean() * radial / np.maximum(radius, tiny)
        return np.column_stack([arc, height])

    return patches(place)


def patches(place: Callable[[Array], Any]) -> Callable[[Array, int], Indices]:
    """Patches of cells that are near each other in coordinates of your own.

    All cells are cut in two across their widest coordinate, then each part likewise.

    Parameters
    ----------
    place
        Takes midpoints (n, d) to coordinates (n, k) that are alike for what shall be
        on one rank.

    Returns
    -------
    Partition, as of `columns`.

    Examples
    --------
    A ball in a socket, by the directions from its centre:

    >>> def direction(x):
    ...     return (x - centre) / np.linalg.norm(x - centre, axis=1, keepdims=True)
    >>> read_gmsh("hip.msh", comm, partition=patches(direction))
    """
    if not callable(place):
        raise ContactError(f"place must be a function of midpoints, not {place!r}")

    def partition(midpoints: Array, ranks: int) -> Indices:
        midpoints = np.asarray(midpoints, dtype=np.float64)
        found = np.asarray(place(midpoints.copy()), dtype=np.float64)
        if found.ndim != 2 or len(found) != len(midpoints):
            raise ContactError(
                f"place must give coordinates of shape ({len(midpoints)}, k), not "
                f"{found.shape}"
            )
        return _bisected(found, ranks)

    return partition


def _padded(points: Array) -> Array:
    """Points with three coordinates."""
    return np.pad(points, ((0, 0), (0, 3 - points.shape[1])))


def _bisected(coordinates: Array, ranks: int) -> Indices:
    """Rank of each cell, shape (n,), by cuts in two across the widest coordinate.

    Cells on a cut go by the other coordinates and, if these are alike, by their order.
    """
    if not (is_whole_number(ranks) and ranks > 0):
        raise ContactError(f"ranks = {ranks!r} must be a positive whole number")
    if coordinates.size == 0:
        return np.zeros(len(coordinates), dtype=np.int32)
    if not np.isfinite(coordinates).all():
        raise ContactError("a cell has a coordinate that is not finite")
    count = len(coordinates)
    # Rounding must not decide between cells above each other
    numbers = levels(coordinates, ROUNDING * np.ptp(coordinates, axis=0).max())
    found = np.empty(count, dtype=np.int32)
    parts = [(np.arange(count), 0, ranks)]
    while parts:
        cells, first, last = parts.pop()
        if last - first == 1 or len(cells) == 0:
            found[cells] = first
            continue
        widths = np.ptp(coordinates[cells], axis=0)
        widest = int(np.argmax(widths >= (1.0 - ROUNDING) * widths.max()))
        keys = np.delete(numbers[cells], widest, axis=1).T[::-1]
        order = np.lexsort([*keys, numbers[cells, widest]])
        middle = (first + last) // 2
        # Rank r has the cells from r / ranks to (r + 1) / ranks of them all
        start, stop = (-(-count * rank // ranks) for rank in (first, middle))
        cells_before, cells_after = np.split(cells[order], [stop - start])
        parts.append((np.sort(cells_before), first, middle))
        parts.append((np.sort(cells_after), middle, last))
    return found

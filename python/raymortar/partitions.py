"""Partitions of a mesh that are the same in every run."""

from __future__ import annotations

import numpy as np

from .compat import Array, Indices


def strips(midpoints: Array, ranks: int) -> Indices:
    """Strips across the first axis, with the same number of cells each.

    For `raymortar.meshing.assemble_blocks` and the scenes. DOLFINx's graph partitioner
    cuts the same mesh differently from one run to the next, so that what a rank has
    saved belongs to other cells.

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
    x = midpoints[:, 0]
    size = max(float(x.max() - x.min()), float(np.finfo(float).tiny))
    # Rounding must not decide between cells above each other
    order = np.argsort(np.round((x - x.min()) / size, 9), kind="stable")
    found = np.empty(len(x), dtype=np.int32)
    found[order] = np.arange(len(x)) * ranks // len(x)
    return found

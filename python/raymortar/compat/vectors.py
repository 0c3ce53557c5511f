"""Vectors of DOLFINx."""

from __future__ import annotations

from typing import Any

import dolfinx
import numpy as np


def create_la_vector(index_map: Any, bs: int = 1) -> Any:
    """Zero ``dolfinx.la`` vector of doubles over an index map with a block size."""
    if hasattr(index_map, "create_vector"):  # of several meshes
        return index_map.create_vector(bs)
    return dolfinx.la.vector(index_map, bs, dtype=np.float64)


def scatter_forward(vector: Any) -> None:
    """Send the owners' values to the ghosts. Collective."""
    vector.scatter_forward()


def scatter_reverse_add(vector: Any) -> None:
    """Add the ghosts' values to their owners'. Collective.

    Ghosts keep theirs: follow with :func:`scatter_forward` where they are read.
    """
    modes = getattr(dolfinx.la, "InsertMode", None) or dolfinx.la.ScatterMode
    vector.scatter_reverse(modes.add)

"""A soft block in a channel that narrows, after Fischer and Wriggers (2006)."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import numpy as np

from .blocks import Block
from .meshing import Scene, assemble_blocks

__all__ = ["scene_of"]

# Lengths in mm; the upper half
LENGTH, HEIGHT, START = 450.0, 200.0, 330.0
WIDE, NARROW, WALL = 199.0, 149.0, 150.0
ENTRANCE, TAPER, EXIT = 800.0, 200.0, 900.0
TAGS = {"pushed": 1, "symmetry": 2, "slave": 3, "master": 4, "outside": 5}


def scene_of(comm: MPI.Intracomm, size: int) -> Scene:
    """Block of `size` cells along its height and the wall above it. Collective."""

    def wall(x: Any) -> Any:
        share = np.clip((x[:, 0] - ENTRANCE) / TAPER, 0.0, 1.0)
        low, up = WIDE - (WIDE - NARROW) * share, x[:, 1] / WALL
        return np.column_stack([x[:, 0], (1.0 - up) * low + up * (WIDE + WALL)])

    sides = {"left": TAGS["pushed"], "bottom": TAGS["symmetry"], "top": TAGS["slave"]}
    ends = (START, 0.0), (START + LENGTH, HEIGHT)
    block = Block((9 * size // 4, size), *ends, tags=sides)
    # Nodes of the wall where it bends: 19 cells to 1900 mm, times a whole number
    cells = 19 * max(size // 3, 1), max(size // 2, 1)
    ends = (0.0, 0.0), (ENTRANCE + TAPER + EXIT, WALL)
    sides = {"bottom": TAGS["master"], "top": TAGS["outside"]}
    channel = Block(cells, *ends, mapping=wall, tags=sides)
    made = assemble_blocks(comm, [block, channel], "quadrilateral")
    return Scene(*made, TAGS, {"block": 1, "channel": 2})

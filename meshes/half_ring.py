"""An elastic half ring above a block, after Yastrebov."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import numpy as np

from .blocks import Block
from .meshing import Scene, assemble_blocks

__all__ = ["scene_of"]

# Lengths in mm; radii of the ring
INNER, MIDDLE, OUTER = 90.0, 95.0, 100.0
WIDTH, HEIGHT, GAP = 260.0, 50.0, 20.0
TAGS = {"bottom": 1, "master": 2, "slave": 3, "ends": 4}


def scene_of(comm: MPI.Intracomm, size: int) -> Scene:
    """Ring of `size` cells along its arc on a block. Collective."""
    centre = OUTER + GAP

    def bent(x: Any) -> Any:
        angle, r = x[:, 0], OUTER - x[:, 1]
        return np.column_stack([r * np.sin(angle), centre - r * np.cos(angle)])

    ring = Block(
        (size, 2),
        (-0.5 * np.pi, 0.0),
        (0.5 * np.pi, OUTER - INNER),
        mapping=bent,
        tags={"bottom": TAGS["slave"], "left": TAGS["ends"], "right": TAGS["ends"]},
    )
    block = Block(
        (13 * size // 16, max(5 * size // 32, 2)),
        (-0.5 * WIDTH, -HEIGHT),
        (0.5 * WIDTH, 0.0),
        tags={"bottom": TAGS["bottom"], "top": TAGS["master"]},
    )
    mesh, cells, facets = assemble_blocks(comm, [block, ring], "quadrilateral", 2)
    return Scene(mesh, cells, facets, TAGS)

"""A rubber stopper with a bore: its section in (r, z), and a slice in space."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import numpy as np

from .blocks import Block
from .meshing import Scene, assemble_blocks

__all__ = ["section", "slice_of"]

# Lengths in cm
BORE, FOOT, HEIGHT, SLOPE = 0.4, 1.0, 2.0, np.tan(np.radians(8.0))
ROUND = 0.6  # height of the rounded foot
ANGLE = np.radians(30.0)  # of the slice
TAGS = {"slave": 1, "top": 2, "cut": 3, "far_cut": 4}


def shaped(x: Any) -> Any:
    """(r, z) of the stopper from the unit square."""
    z = HEIGHT * x[:, 1]
    outside = FOOT + SLOPE * z - 0.4 * np.maximum(ROUND - z, 0.0) ** 2
    return np.column_stack([BORE + x[:, 0] * (outside - BORE), z])


def section(comm: MPI.Intracomm, size: int) -> Scene:
    """The stopper in the half plane. Collective."""
    tags = {"right": TAGS["slave"], "top": TAGS["top"]}
    block = Block(
        (size, 2 * size), (0.0, 0.0), (1.0, 1.0), mapping=shaped, tags=tags, body="plug"
    )
    made = assemble_blocks(comm, [block], "quadrilateral", geometry_degree=2)
    return Scene(*made, TAGS, {"plug": 1})


def slice_of(comm: MPI.Intracomm, size: int) -> Scene:
    """A slice of the stopper around the z axis. Collective."""

    def turned(x: Any) -> Any:
        r, z = shaped(x[:, [0, 2]]).T
        angle = ANGLE * x[:, 1]
        return np.column_stack([r * np.cos(angle), r * np.sin(angle), z])

    tags = {"right": TAGS["slave"], "top": TAGS["top"]}
    block = Block(
        (size, max(size // 2, 1), 2 * size),
        (0.0, 0.0, 0.0),
        (1.0, 1.0, 1.0),
        mapping=turned,
        tags={**tags, "front": TAGS["cut"], "back": TAGS["far_cut"]},
        body="plug",
    )
    made = assemble_blocks(comm, [block], "hexahedron", geometry_degree=2)
    return Scene(*made, TAGS, {"plug": 1})

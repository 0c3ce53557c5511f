"""A half pipe above a slab, after Puso and Laursen (2004): half of the scene."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import numpy as np

from .blocks import Block
from .meshing import Scene, assemble_blocks

__all__ = ["scene_of"]

SLAB = (9.0, 2.0, 3.0)  # half of it in y
RADIUS, THICKNESS, REACH, START = 3.0, 0.2, 2.6, 2.5  # START: the die's axis in x
TAGS = {"bottom": 1, "slave": 2, "master": 3, "symmetry": 4, "grips": 5}


def scene_of(comm: MPI.Intracomm, size: int) -> Scene:
    """Slab of `size` cells across its half width, die above it. Collective."""

    def bent(x: Any) -> Any:
        angle = x[:, 0]
        r = RADIUS - x[:, 2]
        along, up = START + r * np.sin(angle), RADIUS - r * np.cos(angle)
        return np.column_stack([along, x[:, 1], SLAB[2] + up])

    slab = Block(
        (9 * size // 2, size, 3 * size // 2),
        (0.0, 0.0, 0.0),
        SLAB,
        # Finer where the die presses
        grading=(None, None, lambda t: 1.0 - (1.0 - t) ** 1.3),
        tags={
            "bottom": TAGS["bottom"],
            "top": TAGS["slave"],
            "front": TAGS["symmetry"],
        },
    )
    die = Block(
        (6 * size, size + 1, 1),
        (-0.5 * np.pi, 0.0, 0.0),
        (0.5 * np.pi, REACH, THICKNESS),
        mapping=bent,
        tags={
            "bottom": TAGS["master"],
            "front": TAGS["symmetry"],
            "left": TAGS["grips"],
            "right": TAGS["grips"],
        },
    )
    mesh, cells, facets = assemble_blocks(comm, [slab, die], "hexahedron")
    return Scene(mesh, cells, facets, TAGS, {"slab": 1, "die": 2})

"""Half of a shallow arch, clamped at its ends, and a punch above its middle."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import numpy as np

from .blocks import Block
from .meshing import Scene, assemble_blocks

__all__ = ["NODE", "scene_of"]

# Lengths in mm
SPAN, RISE, THICKNESS = 10.0, 0.75, 0.4
WIDTH, HEIGHT, RADIUS, GAP = 1.2, 1.0, 4.0, 0.1
TAGS = {"clamped": 1, "master": 2, "slave": 3, "axis": 4, "top": 5}
# The loaded node of the punch
NODE = np.array([0.0, RISE + THICKNESS + GAP + HEIGHT])


def scene_of(comm: MPI.Intracomm, size: int) -> Scene:
    """Arch of `size` cells along its half, and the punch above it. Collective."""

    def arch(x: Any) -> Any:
        share, s = x[:, 0] / SPAN, np.pi * x[:, 0] / SPAN
        y = 0.5 * RISE * (1.0 + np.cos(s)) + x[:, 1]
        return np.column_stack([SPAN * share, y])

    def punch(x: Any) -> Any:
        low = RISE + THICKNESS + GAP + x[:, 0] ** 2 / (2.0 * RADIUS)
        share = x[:, 1]
        y = (1.0 - share) * low + share * (RISE + THICKNESS + GAP + HEIGHT)
        return np.column_stack([x[:, 0], y])

    below = {"left": TAGS["axis"], "right": TAGS["clamped"], "top": TAGS["slave"]}
    above = {"left": TAGS["axis"], "bottom": TAGS["master"], "top": TAGS["top"]}
    blocks = [
        Block((size, 2), (0.0, 0.0), (SPAN, THICKNESS), mapping=arch, tags=below),
        Block((4, 4), (0.0, 0.0), (WIDTH, 1.0), mapping=punch, tags=above),
    ]
    mesh, cells, facets = assemble_blocks(comm, blocks, "triangle", 2)
    return Scene(mesh, cells, facets, TAGS, {"arch": 1, "punch": 2})

"""An indenter with a round foot above a block, after Fischer and Wriggers (2006)."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import numpy as np

from .blocks import Block
from .meshing import Scene, assemble_blocks

__all__ = ["scene_of"]

# Lengths in mm
TAGS = {"bottom": 1, "top": 2, "slave": 3, "master": 4}


def on_arc(x: Any) -> Any:
    """Bend the bottom of the box [0.2, 1.4] x [0.5, 1.4] to an arc of radius 0.75."""
    angle = np.arcsin(0.6 / 0.75) * (x[:, 0] - 0.8) / 0.6
    arc = np.column_stack([0.8 + 0.75 * np.sin(angle), 0.95 - 0.75 * np.cos(angle)])
    share = ((x[:, 1] - 0.5) / 0.9)[:, None]
    top = np.column_stack([x[:, 0], np.full(len(x), 1.4)])
    return (1.0 - share) * arc + share * top


def scene_of(comm: MPI.Intracomm, size: int, across: int | None = None) -> Scene:
    """Foundation of size x size/4 quadrilaterals, indenter 0.2 mm above it.

    `across`: facets of the indenter's foot; None: a tenth of the size, at least 12.
    """
    across = max(12, size // 10) if across is None else across
    foundation = Block(
        (size, size // 4),
        (0.0, -4.0),
        (12.0, 0.0),
        tags={"bottom": TAGS["bottom"], "top": TAGS["master"]},
    )
    indenter = Block(
        (across, across // 2),
        (0.2, 0.5),
        (1.4, 1.4),
        mapping=on_arc,
        tags={"bottom": TAGS["slave"], "top": TAGS["top"]},
    )
    parts = assemble_blocks(comm, [foundation, indenter], "quadrilateral")
    return Scene(*parts, TAGS)

"""A shaft in a hub, meshed to touch: quarters in the plane, sections in (r, z)."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import numpy as np

from .blocks import Block
from .meshing import Scene, assemble_blocks

__all__ = ["quarters", "sections"]

# Lengths in mm
SHAFT, HUB, LENGTH = 50.0, 100.0, 40.0
TAGS = {"slave": 1, "master": 2, "bottom": 3, "left": 4, "top": 5}
NUMBERS = {"shaft": 1, "hub": 2}


def _arc(radius: Any, angle: Any) -> Any:
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def _core(x: Any) -> Any:
    """From the unit square to the middle of a quarter disc of radius 1."""
    s, t = x[:, :1], x[:, 1:]
    right, up, corner = [0.5, 0.0], [0.0, 0.5], [0.4, 0.4]
    return s * (1 - t) * right + (1 - s) * t * up + s * t * corner


def _rim(first: bool) -> Any:
    """From the unit square, outwards and around, to an eighth of the rim."""

    def mapping(x: Any) -> Any:
        around = x[:, 1]
        inner = _core(
            np.column_stack([np.ones_like(around), around])
            if first
            else np.column_stack([1.0 - around, np.ones_like(around)])
        )
        outer = _arc(1.0, np.pi / 4 * (around if first else 1.0 + around))
        return (1.0 - x[:, :1]) * inner + x[:, :1] * outer

    return mapping


def quarters(
    comm: MPI.Intracomm,
    around: int = 8,
    hub_around: int = 10,
    cell: str = "quadrilateral",
    geometry_degree: int = 2,
) -> Scene:
    """Quarters of shaft and hub with so many facets on their arcs. Collective."""
    n, unit = around // 2, ((0.0, 0.0), (1.0, 1.0))

    def scaled(mapping: Any) -> Any:
        return lambda x: SHAFT * mapping(x)

    def ring(x: Any) -> Any:
        radius = SHAFT + (HUB - SHAFT) * x[:, :1]
        return radius * _arc(1.0, np.pi / 2 * x[:, 1])

    slave, master, bottom, left = (
        TAGS[k] for k in ("slave", "master", "bottom", "left")
    )
    parts = [
        ((n, n), scaled(_core), {"bottom": bottom, "left": left}, "shaft"),
        ((3, n), scaled(_rim(True)), {"right": slave, "bottom": bottom}, "shaft"),
        ((3, n), scaled(_rim(False)), {"right": slave, "top": left}, "shaft"),
        ((6, hub_around), ring, {"left": master, "bottom": bottom, "top": left}, "hub"),
    ]
    blocks = [
        Block(divisions, *unit, mapping=mapping, tags=tags, body=body)
        for divisions, mapping, tags, body in parts
    ]
    return Scene(*assemble_blocks(comm, blocks, cell, geometry_degree), TAGS, NUMBERS)


def sections(comm: MPI.Intracomm, size: int = 4) -> Scene:
    """Shaft and hub in (r, z), with other numbers of cells along z. Collective."""
    ends = {"bottom": TAGS["bottom"], "top": TAGS["top"]}
    blocks = [
        Block(
            (size, size),
            (0.0, 0.0),
            (SHAFT, LENGTH),
            tags={**ends, "left": TAGS["left"], "right": TAGS["slave"]},
            body="shaft",
        ),
        Block(
            (6, size + 1),
            (SHAFT, 0.0),
            (HUB, LENGTH),
            tags={**ends, "left": TAGS["master"]},
            body="hub",
        ),
    ]
    return Scene(*assemble_blocks(comm, blocks, "quadrilateral"), TAGS, NUMBERS)

"""Two concentric shells and a plate: an eighth in space, and a meridian's plane."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import numpy as np

from .blocks import Block
from .meshing import Scene, assemble_blocks

__all__ = ["meridian_of", "scene_of"]

INNER, MIDDLE, OUTER = 10.0, 12.0, 14.0
SHELLS = ((INNER, MIDDLE), (MIDDLE, OUTER))
BODIES = {"inner": 1, "outer": 2, "plate": 3}
TAGS = {
    "x": 1, "y": 2, "z": 3, "inner": 4, "outer": 5, "roof": 6, "plate": 7, "moved": 8
}  # fmt: skip


def shell(
    n: int,
    layers: int,
    radii: tuple[float, float],
    body: str,
    tags: dict[str, int],
) -> list[Block]:
    """An eighth of a shell: three patches of n x n cells around the diagonal."""

    def patch(axis: int) -> Block:
        def on_sphere(p: Any) -> Any:
            direction = np.ones((len(p), 3))
            # Equal angles, as on a cubed sphere
            direction[:, (axis + 1) % 3] = np.tan(p[:, 0])
            direction[:, (axis + 2) % 3] = np.tan(p[:, 1])
            length = np.linalg.norm(direction, axis=1)
            return direction * (p[:, 2] / length)[:, None]

        planes = {"left": "xyz"[(axis + 1) % 3], "front": "xyz"[(axis + 2) % 3]}
        return Block(
            (n, n, layers),
            (0.0, 0.0, radii[0]),
            (0.25 * np.pi, 0.25 * np.pi, radii[1]),
            mapping=on_sphere,
            tags={side: TAGS[name] for side, name in planes.items()} | tags,
            body=body,
        )

    return [patch(axis) for axis in range(3)]


def scene_of(comm: MPI.Intracomm, size: int, layers: int) -> Scene:
    """Both shells, quadratic, and the plate over them. Collective."""
    blocks = shell(size, layers, (INNER, MIDDLE), "inner", {"top": TAGS["inner"]})
    blocks += shell(
        size + 1,
        layers,
        (MIDDLE, OUTER),
        "outer",
        {"bottom": TAGS["outer"], "top": TAGS["roof"]},
    )
    width = 1.5 * OUTER
    blocks.append(
        Block(
            (6, 6, 1),
            (0.0, 0.0, OUTER),
            (width, width, OUTER + 1.0),
            tags={"bottom": TAGS["plate"], "top": TAGS["moved"]},
        )
    )
    mesh, cells, facets = assemble_blocks(comm, blocks, "hexahedron", 2)
    return Scene(mesh, cells, facets, TAGS, BODIES)


def meridian_of(
    comm: MPI.Intracomm,
    size: int,
    layers: int,
    shells: Any = SHELLS,
    plate: float = OUTER,
) -> Scene:
    """The same in the plane of a meridian: x is the distance from the axis.

    `shells` are the radii of both shells, `plate` is the height of the plate.
    """

    def in_plane(p: Any) -> Any:
        return p[:, 1:] * np.stack([np.sin(p[:, 0]), np.cos(p[:, 0])], axis=1)

    def half(n: int, radii: Any, body: str, tags: dict[str, int]) -> Block:
        tags = {"left": TAGS["x"], "right": TAGS["z"]} | tags
        low, high = (0.0, radii[0]), (0.5 * np.pi, radii[1])
        return Block((n, layers), low, high, mapping=in_plane, tags=tags, body=body)

    blocks = [
        half(size, shells[0], "inner", {"top": TAGS["inner"]}),
        half(
            size + 1,
            shells[1],
            "outer",
            {"bottom": TAGS["outer"], "top": TAGS["roof"]},
        ),
        Block(
            (8, 1),
            (0.0, plate),
            (1.5 * OUTER, plate + 1.0),
            tags={"left": TAGS["x"], "bottom": TAGS["plate"], "top": TAGS["moved"]},
        ),
    ]
    mesh, cells, facets = assemble_blocks(comm, blocks, "quadrilateral", 2)
    return Scene(mesh, cells, facets, TAGS, BODIES)

"""Scenes with a round contact zone: cylinders and spheres.

Bodies are in local coordinates of `graded` first: pole at the origin, body above.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

from mpi4py import MPI

import numpy as np

from .blocks import Block, mirrored, moved, rotated
from .graded import PoleGrid, ball_blocks, box_blocks, cap_blocks, completed
from .meshing import Scene, assemble_blocks

__all__ = ["cylinder_on_block", "sphere_on_plane", "two_cylinders", "two_spheres"]

_HERTZ_TAGS = {
    "bottom": 1,
    "top": 2,
    "slave": 3,
    "master": 4,
    "symmetry_x": 5,
    "symmetry_y": 6,
    "side": 7,
}
# Directions to mirror the modelled part in
_SECTORS = {
    2: {"half": (), "full": (0,)},
    3: {"quarter": (), "half": (1,), "full": (0, 1)},
}


def _hertz_grids(
    contact_half_width: float, facets_across: int, master_ratio: float, growth: float
) -> tuple[PoleGrid, PoleGrid]:
    """Grids of the slave's and of the master's body."""
    if int(facets_across) != facets_across or facets_across < 2:
        raise ValueError(f"facets_across = {facets_across} is no integer >= 2")
    if not master_ratio > 0.0:
        raise ValueError(f"master_ratio = {master_ratio} is not positive")
    size = 2.0 * contact_half_width / facets_across
    grid = PoleGrid(contact_half_width, size, growth)
    return grid, dataclasses.replace(grid, facet_size=master_ratio * size)


def _hertz_tags(
    surface: str, far: str, dim: int, far_names: Sequence[str] = ("far",)
) -> dict[str, int]:
    """Tags of one body by the names of `graded`."""
    tags = {"surface": _HERTZ_TAGS[surface], "left": _HERTZ_TAGS["symmetry_x"]}
    tags |= {"side": _HERTZ_TAGS["side"]}
    if dim == 3:
        tags["front"] = _HERTZ_TAGS["symmetry_y"]
    return tags | {name: _HERTZ_TAGS[far] for name in far_names}


def _hertz_scene(
    comm: MPI.Comm,
    upper: list[Block],
    lower: list[Block],
    sector: str,
    cell: str,
    geometry_degree: int,
    gap: float,
    rotation: float | np.ndarray | None,
    **mesh_options: Any,
) -> Scene:
    """Scene of two bodies in local coordinates, poles at the origin."""
    dim = upper[0].dim
    sectors = _SECTORS[dim]
    if sector not in sectors:
        raise ValueError(f"sector '{sector}' is not one of {list(sectors)}")
    lift = np.append(np.zeros(dim - 1), float(gap))
    upper = moved(completed(upper, sectors[sector]), lambda x: x + lift)
    lower = [mirrored(b, dim - 1) for b in completed(lower, sectors[sector])]
    blocks = rotated(lower + upper, rotation)
    mesh, cell_tags, facet_tags = assemble_blocks(
        comm, blocks, cell, geometry_degree, **mesh_options
    )
    used = {tag for block in blocks for tag in block.tags.values()}
    tags = {name: tag for name, tag in _HERTZ_TAGS.items() if tag in used}
    return Scene(mesh, cell_tags, facet_tags, tags)


def cylinder_on_block(
    comm: MPI.Comm,
    cell: str = "quadrilateral",
    geometry_degree: int = 1,
    *,
    radius: float = 50.0,
    block_size: tuple[float, float] = (200.0, 200.0),
    contact_half_width: float = 6.2146,
    facets_across: int = 20,
    master_ratio: float = 1.25,
    growth: float = 1.2,
    disc: str = "half",
    sector: str = "half",
    slave_angle: float = np.pi / 3,
    gap: float = 0.0,
    rotation: float | np.ndarray | None = None,
    pattern: str = "right",
    **mesh_options: Any,
) -> Scene:
    """A cylinder (2D) on a rectangular block, fine around the contact. Collective.

    They touch at the origin. The defaults are NAFEMS benchmark 1 in mm.

    Parameters
    ----------
    comm
        MPI communicator.
    cell
        "triangle" or "quadrilateral".
    geometry_degree
        1 or 2.
    radius
        Of the cylinder. Length.
    block_size
        Width (of the whole block, whatever the sector) and height. Length.
    contact_half_width
        Expected half-width of the contact, such as Hertz's. Length.
    facets_across
        Slave facets across the whole contact. The zone of uniform facets is a quarter
        wider and as deep as half of it is wide.
    master_ratio
        Size of the master's facets over the slave's.
    growth
        Ratio of neighbouring rings of cells away from the contact.
    disc
        "half", cut at its centre, or "whole".
    sector
        "half" of the model, x >= 0, or "full".
    slave_angle
        The slave surface ends about this angle from the pole. Radians.
    gap
        Lifts the cylinder. Length.
    rotation
        Turns the whole scene about the origin: an angle in radians or a matrix.
    pattern
        See `Block`.
    mesh_options
        perturb, perturb_sides, seed: see `assemble_blocks`.

    Returns
    -------
    Scene
        Tags bottom 1, top 2 (the cut, or the arc within 45 degrees of the top), slave
        3, master 4 (top of the block), symmetry_x 5 (both bodies, half model), side 7
        (of the block).
    """
    fine, coarse = _hertz_grids(contact_half_width, facets_across, master_ratio, growth)
    if disc not in ("half", "whole"):
        raise ValueError(f"disc '{disc}' is neither 'half' nor 'whole'")
    if len(block_size) != 2:
        raise ValueError(f"block_size must be width and height, not {block_size}")
    options = {"pattern": pattern}
    far = ("cut",) if disc == "half" else ("far",)
    tags = _hertz_tags("slave", "top", 2, far)
    upper = ball_blocks(2, radius, fine, tags, "upper", slave_angle, **options)
    if disc == "whole":
        upper += cap_blocks(radius, fine, tags, "upper", **options)
    size = (0.5 * block_size[0], block_size[1])
    tags = _hertz_tags("master", "bottom", 2)
    lower = box_blocks(size, coarse, tags, "lower", **options)
    return _hertz_scene(
        comm, upper, lower, sector, cell, geometry_degree, gap, rotation, **mesh_options
    )


def two_cylinders(
    comm: MPI.Comm,
    cell: str = "quadrilateral",
    geometry_degree: int = 1,
    *,
    radius: float = 8.0,
    lower_radius: float | None = None,
    contact_half_width: float = 0.680778,
    facets_across: int = 20,
    master_ratio: float = 1.25,
    growth: float = 1.2,
    sector: str = "full",
    slave_angle: float = np.pi / 3,
    gap: float = 0.0,
    rotation: float | np.ndarray | None = None,
    pattern: str = "right",
    **mesh_options: Any,
) -> Scene:
    """Two half cylinders (2D), cut at their centres. Collective.

    They touch at the origin. The defaults are Gitterle's benchmark.

    Parameters
    ----------
    radius, lower_radius
        Of the upper and of the lower cylinder, equal by default. Length.
    comm, cell, geometry_degree, contact_half_width, facets_across, master_ratio, \
growth, sector, slave_angle, gap, rotation, pattern, mesh_options
        See `cylinder_on_block`; `slave_angle` is the master's too.

    Returns
    -------
    Scene
        Tags bottom 1 and top 2 (the cuts), slave 3, master 4, symmetry_x 5 (half
        model).
    """
    upper, lower = _two_balls(
        2,
        (radius, lower_radius),
        _hertz_grids(contact_half_width, facets_across, master_ratio, growth),
        slave_angle,
        pattern,
    )
    return _hertz_scene(
        comm, upper, lower, sector, cell, geometry_degree, gap, rotation, **mesh_options
    )


def _two_balls(
    dim: int,
    radii: tuple[float, float | None],
    grids: tuple[PoleGrid, PoleGrid],
    angle: float,
    pattern: str,
) -> tuple[list[Block], list[Block]]:
    """Blocks of the upper and of the lower half disc (quarter of a half ball)."""
    lower_radius = radii[0] if radii[1] is None else radii[1]
    upper_tags = _hertz_tags("slave", "top", dim, ("cut",))
    lower_tags = _hertz_tags("master", "bottom", dim, ("cut",))
    options: dict[str, Any] = {"surface_angle": angle, "pattern": pattern}
    return (
        ball_blocks(dim, radii[0], grids[0], upper_tags, "upper", **options),
        ball_blocks(dim, lower_radius, grids[1], lower_tags, "lower", **options),
    )


def sphere_on_plane(
    comm: MPI.Comm,
    cell: str = "hexahedron",
    geometry_degree: int = 1,
    *,
    radius: float = 50.0,
    block_size: tuple[float, float, float] = (100.0, 100.0, 50.0),
    contact_half_width: float = 10.0,
    facets_across: int = 10,
    master_ratio: float = 1.25,
    growth: float = 1.3,
    sector: str = "quarter",
    slave_angle: float = np.pi / 3,
    gap: float = 0.0,
    rotation: np.ndarray | None = None,
    pattern: str = "right",
    **mesh_options: Any,
) -> Scene:
    """Half a ball on a block (3D), fine around the contact. Collective.

    Parameters
    ----------
    cell
        "tetrahedron" or "hexahedron".
    block_size
        Widths in x and y (of the whole block, whatever the sector) and height. Length.
    contact_half_width
        Expected radius of the contact. Length.
    sector
        "quarter" of the model (x >= 0, y >= 0), "half" (x >= 0) or "full".
    comm, geometry_degree, radius, facets_across, master_ratio, growth, \
slave_angle, gap, rotation, pattern, mesh_options
        See `cylinder_on_block`; a rotation in 3D is a matrix.

    Returns
    -------
    Scene
        Tags bottom 1, top 2 (the cut), slave 3, master 4, symmetry_x 5 and symmetry_y
        6 (both bodies, unless the model is complete there), side 7 (of the block).
    """
    fine, coarse = _hertz_grids(contact_half_width, facets_across, master_ratio, growth)
    if len(block_size) != 3:
        raise ValueError(f"block_size must be three lengths, not {block_size}")
    tags = _hertz_tags("slave", "top", 3, ("cut",))
    upper = ball_blocks(3, radius, fine, tags, "upper", slave_angle, pattern=pattern)
    size = (0.5 * block_size[0], 0.5 * block_size[1], block_size[2])
    tags = _hertz_tags("master", "bottom", 3)
    lower = box_blocks(size, coarse, tags, "lower", pattern=pattern)
    return _hertz_scene(
        comm, upper, lower, sector, cell, geometry_degree, gap, rotation, **mesh_options
    )


def two_spheres(
    comm: MPI.Comm,
    cell: str = "hexahedron",
    geometry_degree: int = 1,
    *,
    radius: float = 50.0,
    lower_radius: float | None = None,
    contact_half_width: float = 10.0,
    facets_across: int = 10,
    master_ratio: float = 1.25,
    growth: float = 1.3,
    sector: str = "quarter",
    slave_angle: float = np.pi / 3,
    gap: float = 0.0,
    rotation: np.ndarray | None = None,
    pattern: str = "right",
    **mesh_options: Any,
) -> Scene:
    """Two half balls (3D), cut at their centres. Collective.

    Parameters
    ----------
    radius, lower_radius
        Of the upper and of the lower ball, equal by default. Length.
    comm, cell, geometry_degree, contact_half_width, facets_across, master_ratio, \
growth, sector, slave_angle, gap, rotation, pattern, mesh_options
        See `sphere_on_plane`; `slave_angle` is the master's too.

    Returns
    -------
    Scene
        Tags as for `sphere_on_plane`, without the side.
    """
    upper, lower = _two_balls(
        3,
        (radius, lower_radius),
        _hertz_grids(contact_half_width, facets_across, master_ratio, growth),
        slave_angle,
        pattern,
    )
    return _hertz_scene(
        comm, upper, lower, sector, cell, geometry_degree, gap, rotation, **mesh_options
    )

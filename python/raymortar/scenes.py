"""Ready-made scenes of two bodies for tests and demos.

Every builder returns a `Scene`. The upper (convex) body carries the slave surface;
the master surface belongs to the lower one. The last coordinate is the vertical one.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .graded import PoleGrid, ball_blocks, box_blocks, cap_blocks, completed, moved
from .meshing import Block, assemble_blocks, mirrored

__all__ = [
    "Scene",
    "cylinder_on_block",
    "sphere_on_plane",
    "two_blocks",
    "two_cylinders",
    "two_spheres",
]

_LATERAL = ("left", "right", "front", "back")


@dataclasses.dataclass(frozen=True)
class Scene:
    """Bodies in one mesh, ready for contact.

    Attributes
    ----------
    mesh
        DOLFINx mesh of all bodies.
    cell_tags
        Number of the body of each cell, see `bodies`.
    facet_tags
        Tags of boundary facets, see `tags`.
    tags
        Facet tag by name; "slave" and "master" are always there.
    bodies
        Cell tag by name: "lower" 1, "upper" 2.
    """

    mesh: Any
    cell_tags: Any
    facet_tags: Any
    tags: dict[str, int]
    bodies: dict[str, int] = dataclasses.field(
        default_factory=lambda: {"lower": 1, "upper": 2}
    )


def _rotation_matrix(rotation, dim) -> np.ndarray:
    """Matrix (dim, dim) of an angle in radians (2D), or of a matrix, checked."""
    if np.ndim(rotation) == 0 and dim == 2:
        c, s = np.cos(rotation), np.sin(rotation)
        return np.array([[c, -s], [s, c]])
    matrix = np.asarray(rotation, dtype=np.float64)
    orthogonal = matrix.shape == (dim, dim) and np.allclose(
        matrix @ matrix.T, np.eye(dim), atol=1e-12
    )
    if not orthogonal or np.linalg.det(matrix) < 0.0:
        raise ValueError(
            f"rotation must be a rotation matrix ({dim}, {dim}), or an angle in 2D"
        )
    return matrix


def _rotated(blocks: list[Block], rotation) -> list[Block]:
    """The blocks after a rotation about the origin; `None` leaves them."""
    if rotation is None:
        return blocks
    matrix = _rotation_matrix(rotation, blocks[0].dim)
    return moved(blocks, lambda x: x @ matrix.T)


def _numbers(value, count: int, name: str, default=None) -> tuple:
    """`count` numbers out of a number or a sequence of them."""
    value = default if value is None else value
    numbers = (value,) * count if np.ndim(value) == 0 else tuple(value)
    if len(numbers) != count:
        raise ValueError(f"{name} must be one number or {count}, not {value}")
    if not all(np.isfinite(numbers)):
        raise ValueError(f"{name} = {value} is not finite")
    return numbers


def _interface(interface, tilt, height: float, centre) -> Callable:
    """Height of the interface over lateral points (n, d - 1)."""
    slope = np.tan(np.asarray(tilt, dtype=np.float64))

    def at(x):
        y = height if interface is None else np.asarray(interface(x), np.float64)
        if np.ndim(y) > 0 and np.size(y) != len(x):
            raise ValueError("interface must return one height per point")
        return np.broadcast_to(np.reshape(y, -1), len(x)) + (x - centre) @ slope

    return at


def two_blocks(
    comm,
    dim: int = 2,
    cell: str | None = None,
    lower_divisions: int | Sequence[int] | None = None,
    upper_divisions: int | Sequence[int] | None = None,
    geometry_degree: int = 1,
    *,
    lower_size: float | Sequence[float] = 1.0,
    upper_size: float | Sequence[float] = 1.0,
    overhang: float | Sequence[float] = 0.0,
    gap: float = 0.0,
    interface: Callable[[np.ndarray], np.ndarray] | None = None,
    tilt: float | Sequence[float] = 0.0,
    rotation: float | np.ndarray | None = None,
    pattern: str = "right",
    perturb: float = 0.0,
    perturb_sides: float = 0.0,
    seed: int = 0,
) -> Scene:
    """One block on another, with unrelated nodes. Collective.

    Parameters
    ----------
    comm
        MPI communicator.
    dim
        2 or 3.
    cell
        Cell name; by default triangles or tetrahedra.
    lower_divisions, upper_divisions
        Cells per direction; one number for all. Default: 7 and 5 in 2D, 4 and 3 in 3D.
    geometry_degree
        1 or 2.
    lower_size, upper_size
        Edge lengths. The lower block's corner is the origin.
    overhang
        Lateral shift of the upper block from its place amid the lower one: in x, or
        in x and y. Length.
    gap
        Vertical distance between the blocks, negative for a penetration. Length.
    interface
        Height of the common interface over lateral points (n, dim - 1), shape (n,).
        By default the lower block's height. Mid nodes lie at the mean lateral place.
    tilt
        Angle of the interface's slope in x, or in x and y (3D), about the lower
        block's centre line. Radians.
    rotation
        Turns the whole scene about the origin: an angle in radians (2D) or a matrix.
    pattern, perturb, perturb_sides, seed
        See `Block` and `assemble_blocks`. Only tagged sides move, so all do here.

    Returns
    -------
    Scene
        Tags bottom 1, top 2, slave 3 (bottom of the upper block), master 4 (top of the
        lower), lower_left 5, lower_right 6, lower_front 7, lower_back 8, upper_left 9,
        upper_right 10, upper_front 11, upper_back 12 (front and back in 3D only).

    Examples
    --------
    Tilted by 20 degrees, meshed irregularly, upper block narrower:

    >>> scene = two_blocks(comm, 2, "quadrilateral", tilt=0.35, perturb=0.2,
    ...                    upper_size=(0.5, 1.0))
    """
    if dim not in (2, 3):
        raise ValueError(f"dim = {dim} is neither 2 nor 3")
    if cell is None:
        cell = "triangle" if dim == 2 else "tetrahedron"
    below = _numbers(lower_size, dim, "lower_size")
    above = _numbers(upper_size, dim, "upper_size")
    shift = _numbers(overhang, 1 if np.ndim(overhang) == 0 else dim - 1, "overhang")
    slopes = _numbers(tilt, 1 if np.ndim(tilt) == 0 else dim - 1, "tilt")
    if min(*below, *above) <= 0.0 or not np.isfinite(gap):
        raise ValueError("sizes must be positive and the gap finite")
    if np.max(np.abs(slopes)) >= 0.5 * np.pi:
        raise ValueError(f"tilt = {tilt} is not below a right angle (radians)")
    lateral, height = np.array(below[:-1]), below[-1]
    # A single number is meant along x
    shift = np.array((shift + (0.0,))[: dim - 1])
    surface = _interface(interface, (slopes + (0.0,))[: dim - 1], height, 0.5 * lateral)
    start = 0.5 * (lateral - np.array(above[:-1])) + shift

    def lower_map(x):
        share = x[:, -1] / height
        return np.column_stack([x[:, :-1], share * surface(x[:, :-1])])

    def upper_map(x):
        share = (x[:, -1] - height) / above[-1]
        roof = height + above[-1]
        y = (1.0 - share) * surface(x[:, :-1]) + share * roof + gap
        return np.column_stack([x[:, :-1], y])

    tags = {"bottom": 1, "top": 2, "slave": 3, "master": 4}
    sides = _LATERAL[: 2 * (dim - 1)]
    tags.update({f"lower_{side}": 5 + i for i, side in enumerate(sides)})
    tags.update({f"upper_{side}": 9 + i for i, side in enumerate(sides)})
    default = {2: (7, 5), 3: (4, 3)}[dim]
    lower = Block(
        _numbers(lower_divisions, dim, "lower_divisions", default[0]),
        (0.0,) * dim,
        below,
        mapping=lower_map,
        tags={"bottom": tags["bottom"], "top": tags["master"]}
        | {side: tags[f"lower_{side}"] for side in sides},
        pattern=pattern,
    )
    upper = Block(
        _numbers(upper_divisions, dim, "upper_divisions", default[1]),
        (*start, height),
        (*(start + above[:-1]), height + above[-1]),
        mapping=upper_map,
        tags={"bottom": tags["slave"], "top": tags["top"]}
        | {side: tags[f"upper_{side}"] for side in sides},
        pattern=pattern,
    )
    blocks = _rotated([lower, upper], rotation)
    mesh, cell_tags, facet_tags = assemble_blocks(
        comm, blocks, cell, geometry_degree, perturb, perturb_sides, seed
    )
    return Scene(mesh, cell_tags, facet_tags, tags)


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


def _hertz_grids(contact_half_width, facets_across, master_ratio, growth):
    """Grids of the slave's and of the master's body."""
    if int(facets_across) != facets_across or facets_across < 2:
        raise ValueError(f"facets_across = {facets_across} is no integer >= 2")
    if not master_ratio > 0.0:
        raise ValueError(f"master_ratio = {master_ratio} is not positive")
    size = 2.0 * contact_half_width / facets_across
    grid = PoleGrid(contact_half_width, size, growth)
    return grid, dataclasses.replace(grid, facet_size=master_ratio * size)


def _hertz_tags(surface: str, far: str, dim: int, far_names=("far",)) -> dict[str, int]:
    """Tags of one body by the names of `graded`."""
    tags = {"surface": _HERTZ_TAGS[surface], "left": _HERTZ_TAGS["symmetry_x"]}
    tags |= {"side": _HERTZ_TAGS["side"]}
    if dim == 3:
        tags["front"] = _HERTZ_TAGS["symmetry_y"]
    return tags | {name: _HERTZ_TAGS[far] for name in far_names}


def _hertz_scene(
    comm, upper, lower, sector, cell, geometry_degree, gap, rotation, **mesh_options
) -> Scene:
    """Scene of two bodies in local coordinates, poles at the origin."""
    dim = upper[0].dim
    sectors = _SECTORS[dim]
    if sector not in sectors:
        raise ValueError(f"sector '{sector}' is not one of {list(sectors)}")
    lift = np.append(np.zeros(dim - 1), float(gap))
    upper = moved(completed(upper, sectors[sector]), lambda x: x + lift)
    lower = [mirrored(b, dim - 1) for b in completed(lower, sectors[sector])]
    blocks = _rotated(lower + upper, rotation)
    mesh, cell_tags, facet_tags = assemble_blocks(
        comm, blocks, cell, geometry_degree, **mesh_options
    )
    used = {tag for block in blocks for tag in block.tags.values()}
    tags = {name: tag for name, tag in _HERTZ_TAGS.items() if tag in used}
    return Scene(mesh, cell_tags, facet_tags, tags)


def cylinder_on_block(
    comm,
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
    **mesh_options,
) -> Scene:
    """A cylinder (2D) on a rectangular block, fine around the contact. Collective.

    They touch at the origin. The defaults are those of NAFEMS benchmark 1 in mm.

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
    comm,
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
    **mesh_options,
) -> Scene:
    """Two half cylinders (2D), cut at their centres. Collective.

    They touch at the origin. The defaults are those of Gitterle's benchmark.

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
    blocks = _two_balls(
        2,
        (radius, lower_radius),
        _hertz_grids(contact_half_width, facets_across, master_ratio, growth),
        slave_angle,
        pattern,
    )
    return _hertz_scene(
        comm, *blocks, sector, cell, geometry_degree, gap, rotation, **mesh_options
    )


def _two_balls(dim, radii, grids, angle, pattern):
    """Blocks of the upper and of the lower half disc (quarter of a half ball)."""
    lower_radius = radii[0] if radii[1] is None else radii[1]
    upper_tags = _hertz_tags("slave", "top", dim, ("cut",))
    lower_tags = _hertz_tags("master", "bottom", dim, ("cut",))
    options = {"surface_angle": angle, "pattern": pattern}
    return (
        ball_blocks(dim, radii[0], grids[0], upper_tags, "upper", **options),
        ball_blocks(dim, lower_radius, grids[1], lower_tags, "lower", **options),
    )


def sphere_on_plane(
    comm,
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
    **mesh_options,
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
    comm,
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
    **mesh_options,
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
    blocks = _two_balls(
        3,
        (radius, lower_radius),
        _hertz_grids(contact_half_width, facets_across, master_ratio, growth),
        slave_angle,
        pattern,
    )
    return _hertz_scene(
        comm, *blocks, sector, cell, geometry_degree, gap, rotation, **mesh_options
    )

"""Fields on polygons in the plane and on surfaces in space, with matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ..compat import Array

STRESS_MAP, PRESSURE_MAP = "viridis", "magma_r"
# Number of quadrilaterals, roughly, into which the polygons of a picture are split
SHADED = 20_000
LOOK = {
    "figure.dpi": 160,
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10,
    "legend.frameon": False,
    "savefig.bbox": "tight",
}


def split(polygons: Array, parts: int) -> Array:
    """Split triangles (n, 3, ...) or quadrilaterals (n, 4, ...): points (n, points,
    ...). The points form a grid with `parts` intervals along each side. Values are
    interpolated linearly or bilinearly.
    """
    t = np.linspace(0.0, 1.0, parts + 1)
    r, s = (array.ravel() for array in np.meshgrid(t, t, indexing="ij"))
    if polygons.shape[1] == 3:
        inside = r + s < 1.0 + 0.5 / parts
        r, s = r[inside], s[inside]
        weights = np.stack([1.0 - r - s, r, s])
    else:
        weights = np.stack([(1 - r) * (1 - s), r * (1 - s), r * s, (1 - r) * s])
    return np.einsum("kp,nk...->np...", weights, polygons)


def split_triangles(corners: int, parts: int) -> npt.NDArray[np.int64]:
    """Triangles (t, 3) between the points that `split` makes of one polygon."""
    number, count = {}, 0
    for i in range(parts + 1):
        for j in range(parts + 1 - (i if corners == 3 else 0)):
            number[i, j], count = count, count + 1
    made = []
    for i, j in number:
        for three in (
            [(i, j), (i + 1, j), (i, j + 1)],
            [(i + 1, j), (i + 1, j + 1), (i, j + 1)],
        ):
            if all(point in number for point in three):
                made.append([number[point] for point in three])
    return np.array(made)


def draw_edges(
    axes: Any,
    polygons: Array,
    colour: str = "k",
    width: float = 0.15,
    alpha: float = 0.5,
) -> None:
    """Outlines of polygons (n, k, 2)."""
    from matplotlib.collections import PolyCollection

    axes.add_collection(
        PolyCollection(
            polygons, facecolor="none", edgecolor=colour, lw=width, alpha=alpha
        )
    )


def draw_field(
    axes: Any,
    at: Array,
    values: Array,
    images: Sequence[tuple[float, float]] = ((1, 1),),
    top: float | None = None,
    norm: Any = None,
    cmap: str = STRESS_MAP,
) -> Any:
    """A field on polygons in the plane, with their edges.

    Parameters
    ----------
    axes
        Axes of matplotlib.
    at, values
        Vertices (n, k, 2), deformed, and the field there (n, k, 1).
    images
        Factors on x and y of each copy that is drawn. Mirror images complete a
        symmetric body of which only a part is meshed.
    top, norm
        Colours go from 0 to `top`, or follow a norm of matplotlib.
    cmap
        Colour map.

    Returns
    -------
    What a colour bar needs.
    """
    scale = {"vmin": 0.0, "vmax": top} if norm is None else {"norm": norm}
    # matplotlib blends colours between vertices. Where these are far apart, blends are
    # no colours of the scale: large polygons are split
    n, k = at.shape[:2]
    parts = int(np.clip(np.sqrt(SHADED / max(n, 1)), 1, 16))
    of_one = split_triangles(k, parts)
    fine = split(values, parts)
    triangles = fine.shape[1] * np.arange(n)[:, None, None] + of_one
    for signs in images:
        polygons = at * np.array(signs)
        colours = axes.tripcolor(
            *split(polygons, parts).reshape(-1, 2).T,
            triangles.reshape(-1, 3),
            fine.ravel(),
            shading="gouraud",
            cmap=cmap,
            **scale,
        )
        draw_edges(axes, polygons)
    axes.set(aspect="equal")
    return colours


def draw_surface(
    axes: Any, polygons: Array, values: Array, azimuth: float, elevation: float = 20
) -> Any:
    """Facets in 3D, each in the colour of its value, shaded by a light.

    Parameters
    ----------
    axes
        Axes of matplotlib, with ``projection="3d"``.
    polygons, values
        Facets (n, k, 3) and their values (n,).
    azimuth, elevation
        Direction of the eye. Degrees.

    Returns
    -------
    What a colour bar needs.
    """
    import matplotlib as mpl
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    scale = mpl.colors.Normalize(min(0.0, values.min()), values.max())
    colours = mpl.colormaps[STRESS_MAP](scale(values))
    normals = np.cross(
        polygons[:, 1] - polygons[:, 0], polygons[:, -1] - polygons[:, 0]
    )
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # The normal may point either way: light the side that the eye sees
    light = np.abs(normals @ direction(azimuth + 25, elevation + 25))
    colours[:, :3] *= (0.65 + 0.35 * light)[:, None]
    axes.add_collection3d(
        Poly3DCollection(polygons, facecolors=colours, edgecolors="k", lw=0.12)
    )
    lower, upper = polygons.min(axis=(0, 1)), polygons.max(axis=(0, 1))
    axes.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1]))
    axes.set_zlim(lower[2], upper[2])
    axes.set_box_aspect(upper - lower)
    axes.view_init(elevation, azimuth)
    axes.set_proj_type("persp", focal_length=0.4)
    axes.set_axis_off()
    return mpl.cm.ScalarMappable(scale, STRESS_MAP)


def direction(azimuth: float, elevation: float) -> Array:
    """Unit vector towards the eye. Degrees."""
    a, e = np.radians([azimuth, elevation])
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])

"""Fields on polygons in the plane and on surfaces in space, by matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..compat import Array
from .tools import COLOUR

STRESS_MAP, PRESSURE_MAP = "viridis", "magma_r"
# Fewest parts into which the polygons of a picture are split
SHADED = 8_000
LOOK = {
    "figure.dpi": 160,
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10,
    "legend.frameon": False,
    "savefig.bbox": "tight",
}


def shaded(polygons: Array) -> Array:
    """Split triangles or quadrilaterals (n, k, c) into small triangles (m, 3, c).

    Values are interpolated linearly or bilinearly.
    """
    found, count = polygons, polygons.shape[1]
    while 0 < len(found) < SHADED:
        middle = 0.5 * (found + np.roll(found, -1, axis=1))
        inner = [] if count == 3 else [found.mean(axis=1)]
        parts = [
            np.stack([found[:, k], middle[:, k], *inner, middle[:, k - 1]], axis=1)
            for k in range(count)
        ]
        found = np.concatenate([*parts, middle] if count == 3 else parts)
    halves = [[0, 1, 2]] if count == 3 else [[0, 1, 2], [0, 2, 3]]
    return found[:, halves].reshape(-1, 3, found.shape[2])


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
    from matplotlib.collections import PolyCollection

    # matplotlib blends colours between vertices. Where these are far apart, blends are
    # no colours of the scale: polygons are split
    for signs in images:
        polygons = at * np.array(signs)
        x, y, z = shaded(np.concatenate([polygons, values], axis=2)).reshape(-1, 3).T
        triangles = np.arange(len(x)).reshape(-1, 3)
        colours = axes.tripcolor(
            x, y, triangles, z, shading="gouraud", cmap=cmap, **scale
        )
        lines = {"edgecolor": "k", "lw": 0.15, "alpha": 0.5}
        axes.add_collection(PolyCollection(polygons, facecolor="none", **lines))
    axes.set(aspect="equal")
    return colours


def draw_surface(
    axes: Any,
    polygons: Array,
    values: Array,
    azimuth: float,
    elevation: float = 20,
    curves: Sequence[Array] = (),
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
    curves
        Curves (n, 3) on rigid tools.

    Returns
    -------
    What a colour bar needs.
    """
    import matplotlib as mpl
    from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

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
    if len(curves):
        # matplotlib draws one collection wholly before another, which would hide half
        # of a tool around a body
        axes.computed_zorder = False
        style = {"colors": COLOUR, "lw": 0.6, "alpha": 0.7, "zorder": 3}
        axes.add_collection3d(Line3DCollection(curves, **style))
    drawn = np.concatenate([polygons.reshape(-1, 3), *curves])
    limits = np.column_stack([drawn.min(axis=0), drawn.max(axis=0)])
    axes.set(xlim=limits[0], ylim=limits[1])
    axes.set_zlim(limits[2])
    axes.set_box_aspect(np.ptp(limits, axis=1))
    axes.view_init(elevation, azimuth)
    axes.set_proj_type("persp", focal_length=0.4)
    axes.set_axis_off()
    return mpl.cm.ScalarMappable(scale, STRESS_MAP)


def direction(azimuth: float, elevation: float) -> Array:
    """Unit vector towards the eye. Degrees."""
    a, e = np.radians([azimuth, elevation])
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])

"""Fields in the plane, surfaces in space and the pressure on them, by matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..compat import Array
from ..interface.point_results import CLOSED
from ..rigid.turning import directions_across
from .slave_points import gather_points, gather_slave_facets
from .tools import COLOUR
from .traction_curves import AxisOptions, say_no_contact

if TYPE_CHECKING:
    from ..contact import Contact

STRESS_MAP, PRESSURE_MAP = "viridis", "magma_r"
# Fewest parts into which the polygons of a picture are split
SHADED = 8_000
# Margin around the points in contact, as a share of the larger side
MARGIN = 0.15
# Mean normals shorter than this have no direction: normals cancel
NOTHING = 1e-3
# Directions that are off an axis by less than a degree have its name
NEAR = np.cos(np.radians(1.0))
LOOK = {
    "axes.formatter.limits": (-3, 4),
    "axes.formatter.use_mathtext": True,
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
    axes.locator_params(nbins=6)
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
        # Newer matplotlib takes lines of one length only
        pieces = [np.stack([curve[:-1], curve[1:]], axis=1) for curve in curves]
        axes.add_collection3d(Line3DCollection(np.concatenate(pieces), **style))
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


@dataclass(frozen=True)
class PressureMap:
    """Slave facets, and the points in contact. On rank 0.

    Attributes
    ----------
    surface
        Vertices (n, k, 3), displacement and normal traction there.
    active
        Deformed positions of the points in contact, (m, 3).
    normal
        Their mean normal, (3,): unit, or zero if there is none.
    """

    surface: list[Any]
    active: Array
    normal: Array


def gather_pressure(contact: Contact) -> PressureMap | None:
    """What is drawn, on rank 0; None elsewhere. Collective."""
    surface = gather_slave_facets(contact, contact.traction("normal"))

    def quantities(points: dict[str, Array], _: int) -> list[Array]:
        return [points["x"], points["normal"] * points["weight"][:, None]]

    gathered = gather_points(contact, CLOSED, quantities)
    if gathered is None:
        return None
    x, normals = gathered
    mean = normals.sum(axis=0)
    size, most = np.linalg.norm(mean), np.linalg.norm(normals, axis=1).sum()
    normal = mean / size if size > NOTHING * most else np.zeros(3)
    return PressureMap(surface, x, normal)


def draw_pressure(axes: Any, pressures: PressureMap, options: AxisOptions) -> Any:
    """The pressure, seen along the mean normal and as near as contact is; what a colour
    bar needs."""
    X, displacement, traction = pressures.surface
    at = X + displacement
    across = pressures.normal if pressures.normal.any() else _most_normal(at)
    frame = plane_of(across)
    # Facets that are nearer to the eye hide others
    order = np.argsort(at.mean(axis=1) @ across)
    pressure = np.linalg.norm(traction, axis=2, keepdims=True)
    colours = draw_field(axes, at[order] @ frame.T, pressure[order], cmap=PRESSURE_MAP)
    axes.set(xlabel=options.length(name_of(frame[0])))
    axes.set(ylabel=options.length(name_of(frame[1])))
    if len(pressures.active):
        _zoom(axes, pressures.active @ frame.T)
    else:
        say_no_contact(axes)
    return colours


def _most_normal(at: Array) -> Array:
    """The axis that is most normal to facets (n, k, 3)."""
    areas = np.cross(at[:, 1] - at[:, 0], at[:, -1] - at[:, 0])
    return np.eye(3)[int(np.argmax(np.abs(areas).sum(axis=0)))]


def plane_of(normal: Array) -> Array:
    """Two unit vectors in the plane across a unit normal, (2, 3), as near to axes as can
    be, and along rather than against these."""
    # "xy", not "yx"
    pair = sorted(directions_across(normal), key=lambda t: int(np.argmax(np.abs(t))))
    return np.array([t * np.sign(t[np.argmax(np.abs(t))]) for t in pair])


def name_of(direction: Array) -> str:
    """Name of a direction for an axis of a picture."""
    largest = int(np.argmax(np.abs(direction)))
    if abs(direction[largest]) > NEAR:
        return "xyz"[largest]
    return "along ({:.2f}, {:.2f}, {:.2f})".format(*(np.round(direction, 2) + 0.0))


def _zoom(axes: Any, at: Array) -> None:
    """Limits around points (n, 2), but not wider than what is drawn."""
    margin = MARGIN * np.ptp(at, axis=0).max()
    lower, upper = at.min(axis=0) - margin, at.max(axis=0) + margin
    left, right = axes.get_xlim()
    axes.set_xlim(max(left, lower[0]), min(right, upper[0]))
    below, above = axes.get_ylim()
    axes.set_ylim(max(below, lower[1]), min(above, upper[1]))

"""Pictures by matplotlib: fields, surfaces in space, pressures and tractions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core.compat import Array
from ..core.interface.point_results import CLOSED, Status, pressures
from ..results.tractions import along_normal
from .labels import AxisOptions
from .tools import COLOUR
from .views import direction

MAPS = STRESS_MAP, PRESSURE_MAP = "viridis", "magma_r"
NORMAL, TANGENTIAL = "#c0392b", "#2c3e50"
PRESSURE, TRACTIONS = "contact pressure", "pressure and friction"
# Colour and name of each status
STATUSES = {
    Status.OPEN: ("#c8c8c8", "open"),
    Status.STICK: ("#2c5f9e", "sticks"),
    Status.SLIP: ("#e08214", "slips"),
}
# Fewest parts into which the polygons of a picture are split
SHADED = 8_000
# Margin along curves of tractions, as such a share
ZOOM = 0.25
# Size of the axes of a picture, and room of a tick with its label along each. Inches
AXES, TICK_ROOM = (3.5, 3.2), (0.62, 0.35)
LOOK = {
    "axes.formatter.limits": (-2, 4),
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
    """Split polygons (n, k, c) into small triangles (m, 3, c).

    Values are interpolated linearly or bilinearly, and polygons keep their order. Those
    of five points or more, whose edges are curved, are split around their means first.
    """
    if polygons.shape[1] > 4:
        mean = np.broadcast_to(polygons.mean(axis=1, keepdims=True), polygons.shape)
        fans = np.stack([mean, polygons, np.roll(polygons, -1, axis=1)], axis=2)
        polygons = fans.reshape(-1, 3, polygons.shape[2])
    found, count = polygons, polygons.shape[1]
    while 0 < len(found) < SHADED:
        middle = 0.5 * (found + np.roll(found, -1, axis=1))
        inner = [] if count == 3 else [found.mean(axis=1)]
        parts = [
            np.stack([found[:, k], middle[:, k], *inner, middle[:, k - 1]], axis=1)
            for k in range(count)
        ]
        parts += [middle] * (count == 3)
        found = np.stack(parts, axis=1).reshape(-1, *found.shape[1:])
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
    outlines: Array | None = None,
) -> Any:
    """Draw a field on polygons in the plane, with their edges; give a colour bar's source.

    The field (n, k, 1) is at deformed points (n, k, 2) around polygons. Images are
    factors on x and y of each copy that is drawn: mirrored ones complete a symmetric
    body of which only a part is meshed. Colours go from 0 to `top`, with an arrow on the
    bar where values exceed it, or follow a norm of matplotlib. Other polygons' edges,
    `outlines`, may stand for their own.
    """
    from matplotlib import colormaps
    from matplotlib.collections import PolyCollection, TriMesh
    from matplotlib.colors import Normalize
    from matplotlib.tri import Triangulation

    scale = Normalize(0.0, top) if norm is None else norm
    colours_of = colormaps[cmap].copy()
    if top is not None and values.max(initial=0.0) > top:
        colours_of.colorbar_extend = "max"
    # matplotlib blends colours between vertices. Where these are far apart, blends are
    # no colours of the scale: polygons are split
    for signs in images:
        polygons = at * np.array(signs)
        x, y, z = shaded(np.concatenate([polygons, values], axis=2)).reshape(-1, 3).T
        corners = Triangulation(x, y, np.arange(len(x)).reshape(-1, 3))
        colours = TriMesh(corners, array=z, cmap=colours_of, norm=scale)
        lines = {"edgecolor": "k", "lw": 0.15, "alpha": 0.5}
        around = polygons if outlines is None else outlines * np.array(signs)
        edges = PolyCollection(around, facecolor="none", **lines)
        # Limits by points alone: for others matplotlib would make each triangle a path
        axes.update_datalim(polygons.reshape(-1, 2))
        for one in (colours, edges):
            axes.add_collection(one, autolim=False)
    axes.autoscale_view()
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
    norm: Any = None,
) -> Any:
    """Draw facets in 3D in the colours of values; give a colour bar's source.

    A light shades facets (n, k, 3) with values (n, k), beside curves (n, 3) on rigid tools.
    Azimuth and elevation of the eye are in degrees. Colours follow a norm of matplotlib,
    or go from 0, or the least value below it, to the largest.
    """
    import matplotlib as mpl
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    from .artist import Facets

    scale = norm or mpl.colors.Normalize(min(0.0, values.min()), values.max())
    spokes = polygons - polygons[:, :1]
    normals = np.cross(spokes, np.roll(spokes, -1, axis=1)).sum(axis=1)
    sizes = np.linalg.norm(normals, axis=1, keepdims=True)
    normals /= np.where(sizes > 0.0, sizes, 1.0)
    # The normal may point either way: light the side that the eye sees
    light = np.abs(normals @ direction(azimuth + 25, elevation + 25))
    shown = mpl.cm.ScalarMappable(scale, STRESS_MAP)
    axes.add_artist(Facets(polygons, values, 0.65 + 0.35 * light, shown))
    if len(curves):
        style = {"colors": COLOUR, "lw": 0.6, "alpha": 0.7, "zorder": 3}
        # Newer matplotlib takes lines of one length only
        axes.add_collection3d(Line3DCollection(pieces_of(curves), **style))
    drawn = np.concatenate([polygons.reshape(-1, 3), *curves])
    limits = np.column_stack([drawn.min(axis=0), drawn.max(axis=0)])
    axes.set(xlim=limits[0], ylim=limits[1])
    axes.set_zlim(limits[2])
    axes.set_box_aspect(np.ptp(limits, axis=1))
    axes.view_init(elevation, azimuth)
    # Depths are lengths along one direction
    axes.set_proj_type("ortho")
    axes.set_axis_off()
    return shown


def pieces_of(curves: Sequence[Array]) -> Array:
    """Split curves (n, 3) into their straight pieces, (m, 2, 3)."""
    return np.concatenate([np.stack([x[:-1], x[1:]], axis=1) for x in curves])


def arc_lengths(ends: Array, deformed_ends: Array) -> Array:
    """Lengths along chains of deformed facets up to both ends of each facet, (m, 2).

    A chain begins at its end with the smaller x, a closed one at its point with the
    smallest x. Where one ends the next begins.
    """
    _, vertices = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    of_facet = vertices.reshape(-1, 2)
    sizes = np.linalg.norm(deformed_ends[:, 1] - deformed_ends[:, 0], axis=1)
    found, length = np.full(of_facet.shape, np.nan), 0.0
    # `unique` has sorted vertices by x and then by y; ends of chains come first
    for vertex in np.argsort(np.bincount(vertices.ravel()) != 1, kind="stable"):
        while (touches := (of_facet == vertex) & np.isnan(found[:, :1])).any():
            facet, first = np.argwhere(touches)[0]
            found[facet, first] = length
            length += sizes[facet]
            found[facet, 1 - first] = length
            vertex = of_facet[facet, 1 - first]
    return found


def over_angle(x: Array, centre: Sequence[float] | Array | None) -> Array:
    """Angle of points (n, 2) around a centre, (n,). Degrees, without a jump in the
    largest gap between points. Without a centre, around that of the circle that fits
    the points best, |x|^2 = 2 c x + k."""
    if not len(x):
        return np.zeros(0)
    near = x - (x.mean(axis=0) if centre is None else np.asarray(centre, dtype=float))
    if centre is None:
        table = np.column_stack([2.0 * near, np.ones(len(x))])
        near -= np.linalg.lstsq(table, (near**2).sum(axis=1), rcond=None)[0][:2]
    angles = np.degrees(np.arctan2(near[:, 1], near[:, 0]))
    ordered = np.sort(angles)
    gaps = np.diff(ordered)
    if len(gaps) and gaps.max() > ordered[0] + 360.0 - ordered[-1]:
        angles[angles > ordered[gaps.argmax()]] -= 360.0
    return angles - 360.0 * np.round(angles.mean() / 360.0)


def draw_tractions(
    axes: Any,
    slaves: Sequence[Array],
    points: dict[str, Array],
    options: AxisOptions,
    names: Sequence[str],
    frictional: bool,
) -> None:
    """Draw pressure and friction: in one colour a pair where there are several, or
    friction in that of each status."""
    values, label = _abscissa(slaves, points, options)
    of_status = options.quantity == "status"
    name = TRACTIONS if of_status else PRESSURE
    axes.set(xlabel=label, ylabel=options.stress(name))
    across = points["traction"] - along_normal(points, points["traction"])
    curves = {"pressure": pressures(points)}
    if frictional or of_status:
        curves["friction"] = np.linalg.norm(across, axis=1)
    if of_status:
        _draw_by_status(axes, values, curves, points["status"])
    else:
        _draw_by_pair(axes, values, curves, points["pair"], names)
    if len(axes.lines) > 1:  # above the dots
        place = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.04)}
        columns = len(axes.lines) if of_status else 2
        axes.legend(**place, ncol=columns, markerscale=2.0)
    closed = points["status"] >= CLOSED
    if options.zoom and closed.any():
        shown = values[closed]
        room = ZOOM * np.ptp(shown) or 0.5 * np.ptp(values)
        if room > 0.0:
            axes.set_xlim(shown.min() - room, shown.max() + room)
    # Limits that have zero, and cut no dot
    drawn = np.concatenate([[0.0], *curves.values()])
    if np.ptp(drawn) > 0.0:
        room = 0.04 * np.ptp(drawn)
        axes.set_ylim(drawn.min() - room, drawn.max() + room)
    if not np.any(curves["pressure"]):
        say_no_contact(axes)


def _draw_by_status(
    axes: Any, values: Array, curves: dict[str, Array], status: Array
) -> None:
    """Draw the pressure in grey, and friction in the colour of each status."""
    axes.plot(values, curves["pressure"], ".", ms=3, color="0.6", label="pressure")
    for one, (colour, name) in STATUSES.items():
        if (on := status == one).any():
            style = {"ms": 4, "color": colour, "label": f"friction, {name}"}
            axes.plot(values[on], curves["friction"][on], ".", **style)


def _draw_by_pair(
    axes: Any,
    values: Array,
    curves: dict[str, Array],
    pairs: Array,
    names: Sequence[str],
) -> None:
    """Draw curves in one colour for each pair."""
    for pair in np.unique(pairs):
        colours, markers, name = (f"C{pair % 10}",) * 2, ".x", f"{names[pair]} "
        if len(names) == 1:
            colours, markers, name = (NORMAL, TANGENTIAL), "..", ""
        on = pairs == pair
        for (kind, y), colour, marker in zip(curves.items(), colours, markers):
            style = {"ms": 3, "color": colour, "label": name + kind}
            axes.plot(values[on], y[on], marker, **style)


def _abscissa(
    slaves: Sequence[Array], points: dict[str, Array], options: AxisOptions
) -> tuple[Array, str]:
    """Find what tractions are drawn over, and its label."""
    x, over = points["x"], options.x
    if over == "arc":
        ends, facet = slaves[0][..., :2], points["facet"]
        lengths = arc_lengths(ends, ends + slaves[1])[facet]
        begin, end = np.moveaxis((ends + slaves[1])[facet], 1, 0)
        along = end - begin
        share = np.einsum("qi,qi->q", x - begin, along) / (along**2).sum(axis=1)
        length = lengths[:, 0] + np.clip(share, 0.0, 1.0) * np.diff(lengths)[:, 0]
        return length, options.length("length along the surface")
    if over == "angle":
        centre, factor = options.centre, options.factor("length")
        given = None if centre is None else factor * np.asarray(centre, dtype=float)
        return over_angle(x, given), "angle (degrees)"
    widest = int(np.argmax(np.ptp(x, axis=0))) if len(x) else 0
    k = widest if over is None else "xy".index(over)
    return x[:, k], options.length(options.axes[k])


def contents(axes: Any) -> list[Any]:
    """Find what axes show, their own labels and ticks aside."""
    legend = axes.get_legend()
    found = [*axes.artists, *axes.collections, *axes.lines, *axes.texts]
    return found if legend is None else [*found, legend]


def clear(axes: Any) -> None:
    """Take away what axes show, and keep their labels and ticks."""
    for artist in contents(axes):
        artist.remove()
    axes.relim()
    axes.autoscale(True)


def fit_ticks(figure: Any) -> None:
    """Leave as many ticks as the axes have room for labels."""
    for axes in figure.axes:
        if axes.get_label() == "<colorbar>" or hasattr(axes, "zaxis"):
            continue
        width, height = AXES
        if axes.get_aspect() != "auto":
            ratio = np.ptp(axes.get_xlim()) / np.ptp(axes.get_ylim())
            width, height = min(width, height * ratio), min(height, width / ratio)
        for axis, size, room in zip("xy", (width, height), TICK_ROOM):
            bins = int(np.clip(size / room, 2, 7))
            axes.locator_params(axis, nbins=bins, steps=[1, 2, 2.5, 5, 10])


def say_no_contact(axes: Any) -> None:
    axes.text(
        0.5, 0.5, "no contact", ha="center", va="center", transform=axes.transAxes
    )

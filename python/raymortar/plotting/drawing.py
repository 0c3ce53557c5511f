"""Pictures by matplotlib: fields, surfaces in space, pressures and tractions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core.compat import Array
from ..core.interface.point_results import CLOSED, along_normal, pressures
from ..rigid.turning import directions_across
from .labels import AxisOptions
from .pieces import pieces_of_one_size
from .tools import COLOUR

MAPS = STRESS_MAP, PRESSURE_MAP = "viridis", "magma_r"
NORMAL, TANGENTIAL = "#c0392b", "#2c3e50"
PRESSURE = "contact pressure"
# Fewest parts into which the polygons of a picture are split
SHADED = 8_000
# Margin around the points in contact, as a share of the larger side
MARGIN = 0.15
# Margin along curves of tractions, as such a share
ZOOM = 0.25
# Mean normals shorter than this have no direction: normals cancel
NOTHING = 1e-3
# Directions that are off an axis by less than this have its name
NEAR = np.cos(np.radians(5.0))
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
    """Draw facets in 3D, each in the colour of its value; give a colour bar's source.

    A light shades facets (n, k, 3) with values (n,), beside curves (n, 3) on rigid tools.
    Azimuth and elevation of the eye are in degrees. Colours follow a norm of matplotlib,
    or go from 0, or the least value below it, to the largest.
    """
    import matplotlib as mpl
    from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

    scale = norm or mpl.colors.Normalize(min(0.0, values.min()), values.max())
    colours = mpl.colormaps[STRESS_MAP](scale(values))
    spokes = polygons - polygons[:, :1]
    normals = np.cross(spokes, np.roll(spokes, -1, axis=1)).sum(axis=1)
    sizes = np.linalg.norm(normals, axis=1, keepdims=True)
    normals /= np.where(sizes > 0.0, sizes, 1.0)
    # The normal may point either way: light the side that the eye sees
    light = np.abs(normals @ direction(azimuth + 25, elevation + 25))
    colours[:, :3] *= (0.65 + 0.35 * light)[:, None]
    # matplotlib sorts polygons by the depth of their middles, which hides parts of large
    # ones behind others: pieces of one size are sorted right
    pieces, of, outlines = pieces_of_one_size(polygons)
    nearer = 0.5 * np.linalg.norm(np.diff(outlines, axis=1), axis=2)[..., None]
    outlines = outlines + nearer * direction(azimuth, elevation)
    both = [*pieces, *outlines[:, [0, 1, 1]]]
    shown = np.concatenate([colours[of], np.zeros((len(outlines), 4))])
    # Pieces have edges of their own colour, as gaps would show between them
    strokes = np.concatenate(
        [colours[of], np.tile((0.0, 0.0, 0.0, 1.0), (len(outlines), 1))]
    )
    style = {"facecolors": shown, "edgecolors": strokes, "lw": 0.15, "clip_on": False}
    axes.add_collection3d(Poly3DCollection(both, **style))
    if len(curves):
        # matplotlib draws one collection wholly before another, which would hide half
        # of a tool around a body
        axes.computed_zorder = False
        style = {"colors": COLOUR, "lw": 0.6, "alpha": 0.7, "zorder": 3}
        # Newer matplotlib takes lines of one length only
        axes.add_collection3d(Line3DCollection(pieces_of(curves), **style))
    drawn = np.concatenate([polygons.reshape(-1, 3), *curves])
    limits = np.column_stack([drawn.min(axis=0), drawn.max(axis=0)])
    axes.set(xlim=limits[0], ylim=limits[1])
    axes.set_zlim(limits[2])
    axes.set_box_aspect(np.ptp(limits, axis=1))
    axes.view_init(elevation, azimuth)
    # Outlines that are moved to the eye stay where they are in the picture
    axes.set_proj_type("ortho")
    axes.set_axis_off()
    return mpl.cm.ScalarMappable(scale, STRESS_MAP)


def pieces_of(curves: Sequence[Array]) -> Array:
    """Split curves (n, 3) into their straight pieces, (m, 2, 3)."""
    return np.concatenate([np.stack([x[:-1], x[1:]], axis=1) for x in curves])


def direction(azimuth: float, elevation: float) -> Array:
    """Unit vector towards the eye. Degrees."""
    a, e = np.radians([azimuth, elevation])
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def draw_pressure(
    axes: Any,
    slaves: Sequence[Array],
    points: dict[str, Array],
    options: AxisOptions,
    top: float | None = None,
) -> Any:
    """Draw the pressure on slave facets, seen along the mean normal of the contact."""
    X, displacement, traction, covered, traction_there, facet = slaves
    at, closed = X + displacement, points["status"] >= CLOSED
    normals = (points["normal"] * points["weight"][:, None])[closed]
    across, most = normals.sum(axis=0), np.linalg.norm(normals, axis=1).sum()
    if np.linalg.norm(across) <= NOTHING * most:
        # Normals cancel: the axis that is most normal to the facets
        areas = np.cross(at[:, 1] - at[:, 0], at[:, -1] - at[:, 0])
        across = np.eye(3)[np.argmax(np.abs(areas).sum(axis=0))]
    across = across / np.linalg.norm(across)
    frame = plane_of(across)
    if (np.abs(frame).max(axis=1) > NEAR).all():
        frame = np.round(frame)  # axes have the coordinates of their names
    # Facets nearer to the eye hide others; covered parts are on their facets
    depth = at.mean(axis=1) @ across
    order = np.argsort(np.append(depth, depth[facet]), kind="stable")
    polygons = joined((at, covered))
    tractions = joined((traction, traction_there))[order]
    pressure = np.linalg.norm(tractions, axis=2, keepdims=True)
    drawn, outlines = polygons[order] @ frame.T, at @ frame.T
    colours = draw_field(
        axes, drawn, pressure, top=top, cmap=PRESSURE_MAP, outlines=outlines
    )
    xlabel, ylabel = (options.length(name_of(one)) for one in frame)
    axes.set(xlabel=xlabel, ylabel=ylabel)
    if not closed.any():
        _say_no_contact(axes)
        return colours
    # Zoom to the points in contact, but not wider than what is drawn
    active = points["x"][closed] @ frame.T
    margin = MARGIN * np.ptp(active, axis=0).max()
    lower, upper = np.transpose([axes.get_xlim(), axes.get_ylim()])
    lower = np.maximum(lower, active.min(axis=0) - margin)
    upper = np.minimum(upper, active.max(axis=0) + margin)
    axes.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1]))
    return colours


def joined(parts: Sequence[Array]) -> Array:
    """Join polygons (n, k, 3) of some and of more points: those with fewer repeat their
    last."""
    order = np.arange(max(part.shape[1] for part in parts))
    return np.concatenate(
        [part[:, np.minimum(order, part.shape[1] - 1)] for part in parts]
    )


def plane_of(normal: Array) -> Array:
    """Two unit vectors in the plane across a unit normal, (2, 3), as near to axes as can
    be, and along rather than against these."""
    # "xy", not "yx"
    pair = sorted(directions_across(normal), key=lambda t: int(np.argmax(np.abs(t))))
    return np.array([t * np.sign(t[np.argmax(np.abs(t))]) for t in pair])


def name_of(direction: Array) -> str:
    """Name of a direction for an axis of a picture."""
    if np.abs(direction).max() > NEAR:
        return "xyz"[int(np.argmax(np.abs(direction)))]
    return "along ({:.2f}, {:.2f}, {:.2f})".format(*(np.round(direction, 2) + 0.0))


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
    """Draw pressure and friction, in one colour a pair where there are several."""
    values, label = _abscissa(slaves, points, options)
    axes.set(xlabel=label, ylabel=options.stress(PRESSURE))
    across = points["traction"] - along_normal(points, points["traction"])
    curves = {"pressure": pressures(points)}
    if frictional:
        curves["friction"] = np.linalg.norm(across, axis=1)
    for pair in np.unique(points["pair"]):
        colours, markers, name = (f"C{pair % 10}",) * 2, ".x", f"{names[pair]} "
        if len(names) == 1:
            colours, markers, name = (NORMAL, TANGENTIAL), "..", ""
        on = points["pair"] == pair
        for (kind, y), colour, marker in zip(curves.items(), colours, markers):
            style = {"ms": 3, "color": colour, "label": name + kind}
            axes.plot(values[on], y[on], marker, **style)
    if len(axes.lines) > 1:  # above the dots
        place = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.04), "ncol": 2}
        axes.legend(**place, markerscale=2.0)
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
        _say_no_contact(axes)


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
    found = [*axes.collections, *axes.lines, *axes.texts]
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


def _say_no_contact(axes: Any) -> None:
    axes.text(
        0.5, 0.5, "no contact", ha="center", va="center", transform=axes.transAxes
    )

"""Maps of slave surfaces in space: their pressure, and which points stick or slip."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ..core.compat import Array
from ..core.interface.point_results import CLOSED
from .drawing import PRESSURE_MAP, STATUSES, draw_field, say_no_contact
from .gathering import joined
from .hidden import fans, nearest
from .labels import AxisOptions
from .views import NEAR, name_of, plane_of

# Margin around the points in contact, as a share of the larger side
MARGIN = 0.15
# Pixels along the longer side of a map of statuses
STATUS_PIXELS = 800
# Mean normals shorter than this have no direction: normals cancel
NOTHING = 1e-3


def draw_pressure(
    axes: Any,
    slaves: Sequence[Array],
    points: dict[str, Array],
    options: AxisOptions,
    top: float | None = None,
) -> Any:
    """Draw the pressure on slave facets, seen along the mean normal of the contact."""
    X, displacement, traction, covered, traction_there, facet = slaves
    at = X + displacement
    across, frame = _plane(at, points)
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
    _frame_contact(axes, points, frame, options)
    return colours


def draw_status(
    axes: Any, slaves: Sequence[Array], points: dict[str, Array], options: AxisOptions
) -> None:
    """Draw slave facets, each place in the colour of the status of the facet's nearest
    integration point, seen along the mean normal of the contact."""
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgba
    from matplotlib.lines import Line2D

    X, displacement, _, covered, _, facet = slaves
    at = X + displacement
    across, frame = _plane(at, points)
    view = np.vstack([frame, across])
    # Facets that are not covered in part are wholly covered if they have points
    whole = np.setdiff1d(points["facet"], facet).astype(int)
    shown = joined((at[whole], covered)) @ view.T
    of, outlines = np.append(whole, facet).astype(int), at @ frame.T
    low, high = (end(outlines.reshape(-1, 2), axis=0) for end in (np.min, np.max))
    pixel = float((high - low).max()) / STATUS_PIXELS
    columns, rows = np.ceil((high - low) / pixel).astype(int)
    shown[..., :2] = (shown[..., :2] - low) / pixel
    number = nearest(fans(shown), (rows, columns))[0]
    seen = np.flatnonzero(number >= 0)
    facets = of[number[seen] // shown.shape[1]]
    places = (np.column_stack([seen % columns, seen // columns]) + 0.5) * pixel
    # Facets are so far apart along one more axis that the nearest point is on its own
    apart = 4.0 * float((high - low).max())
    own = np.column_stack([points["x"] @ frame.T - low, apart * points["facet"]])
    _, point = cKDTree(own).query(np.column_stack([places, apart * facets]))
    image = np.zeros((rows * columns, 4))
    table = np.zeros((max(STATUSES) + 1, 4))
    for one, (colour, _) in STATUSES.items():
        table[one] = to_rgba(colour)
    image[seen] = table[points["status"][point].astype(int)]
    extent = (low[0], low[0] + columns * pixel, low[1], low[1] + rows * pixel)
    axes.imshow(
        image.reshape(rows, columns, 4),
        origin="lower",
        extent=extent,
        interpolation="nearest",
    )
    style: dict[str, Any] = {"facecolor": "none", "edgecolor": "k", "lw": 0.15}
    axes.add_collection(PolyCollection(outlines, **style), autolim=False)
    room = MARGIN * (high - low).max()
    axes.set(xlim=(low[0] - room, high[0] + room), ylim=(low[1] - room, high[1] + room))
    present = [s for s in STATUSES if (points["status"] == s).any()]
    dots = {"ls": "", "marker": "s"}
    marks = [Line2D([], [], color=STATUSES[s][0], **dots) for s in present]
    place = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "ncol": 3}
    axes.legend(marks, [STATUSES[s][1] for s in present], **place)
    _frame_contact(axes, points, frame, options)


def _plane(at: Array, points: dict[str, Array]) -> tuple[Array, Array]:
    """Direction to the eye, along the mean normal of the contact, and the two axes of
    the map, (2, 3)."""
    closed = points["status"] >= CLOSED
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
    return across, frame


def _frame_contact(
    axes: Any, points: dict[str, Array], frame: Array, options: AxisOptions
) -> None:
    """Name the axes of a map, and zoom it to the points in contact, but not wider than
    what is drawn."""
    xlabel, ylabel = (options.length(name_of(one)) for one in frame)
    axes.set(xlabel=xlabel, ylabel=ylabel)
    closed = points["status"] >= CLOSED
    if not closed.any():
        say_no_contact(axes)
        return
    active = points["x"][closed] @ frame.T
    margin = MARGIN * np.ptp(active, axis=0).max()
    lower, upper = np.transpose([axes.get_xlim(), axes.get_ylim()])
    lower = np.maximum(lower, active.min(axis=0) - margin)
    upper = np.minimum(upper, active.max(axis=0) + margin)
    axes.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1]))

"""Tractions along slave surfaces in 2D, and what they are drawn over."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..compat import Array, Indices
from ..errors import ContactError
from ..interface.point_results import OPEN, along_normal
from .slave_points import gather_points, gather_slave_facets

if TYPE_CHECKING:
    from ..contact import Contact

NORMAL, TANGENTIAL = "#c0392b", "#2c3e50"
PRESSURE = "contact pressure"
# What tractions may be drawn over
ABSCISSAS = ("x", "y", "arc", "angle")


@dataclass(frozen=True)
class AxisOptions:
    """What the axes show, as `plot` documents it. Checked."""

    x: str | None = None
    centre: Sequence[float] | None = None
    units: tuple[str, str] | None = None

    def __post_init__(self) -> None:
        if self.x is not None and self.x not in ABSCISSAS:
            raise ContactError(f"x must be one of {ABSCISSAS} or None, not {self.x!r}")
        if self.centre is not None:
            if self.x != "angle":
                raise ContactError('centre is that of angles: give x="angle" too')
            if np.shape(self.centre) != (2,) or not np.isfinite(self.centre).all():
                raise ContactError(f"centre must be (x, y), not {self.centre!r}")
        units = self.units
        if units is not None and not (
            isinstance(units, (tuple, list))
            and len(units) == 2
            and all(isinstance(unit, str) for unit in units)
        ):
            raise ContactError(f"units must be (length, stress), not {units!r}")

    def length(self, name: str) -> str:
        """Label of a length."""
        return name if self.units is None else f"{name} ({self.units[0]})"

    def stress(self, name: str) -> str:
        """Label of a stress."""
        return name if self.units is None else f"{name} ({self.units[1]})"


@dataclass(frozen=True)
class Tractions:
    """Integration points that meet a master, of all ranks. On rank 0.

    Attributes
    ----------
    x
        Deformed positions, (n, 2).
    pressure, friction
        (n,); the latter None without friction.
    pair, facet
        Number of the pair and of the slave facet, (n,).
    ends, deformed_ends
        Ends of all slave facets, (m, 2, 2).
    """

    x: Array
    pressure: Array
    friction: Array | None
    pair: Indices
    facet: Indices
    ends: Array
    deformed_ends: Array


def gather_tractions(contact: Contact) -> Tractions | None:
    """Tractions at the points of all ranks, on rank 0; None elsewhere. Collective."""
    facets = gather_slave_facets(contact)

    def quantities(points: dict[str, Array], first: int) -> list[Array]:
        normal = along_normal(points, points["traction"])
        return [
            points["x"],
            -np.einsum("qi,qi->q", normal, points["contact_normal"]),
            np.linalg.norm(points["traction"] - normal, axis=1),
            points["pair"],
            first + points["slave"],
        ]

    gathered = gather_points(contact, OPEN, quantities)
    if gathered is None:
        return None
    x, pressure, tangential, pair, facet = gathered
    friction = None if contact.friction is None else tangential
    ends = facets[0][..., :2]
    return Tractions(x, pressure, friction, pair, facet, ends, ends + facets[1])


def arc_lengths(ends: Array, deformed_ends: Array) -> Array:
    """Lengths along chains of deformed facets up to both ends of each facet, (m, 2).

    A chain begins at its end with the smaller x, a closed one at its point with the
    smallest x. Where one ends the next begins.
    """
    points, vertices = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    of_facet = vertices.reshape(-1, 2)
    at_vertex: list[list[int]] = [[] for _ in points]
    for facet, pair in enumerate(of_facet):
        for vertex in pair:
            at_vertex[vertex].append(facet)
    sizes = np.linalg.norm(deformed_ends[:, 1] - deformed_ends[:, 0], axis=1)
    found, length = np.full(of_facet.shape, np.nan), 0.0
    # `unique` has sorted them by x and then by y
    begins = sorted(range(len(points)), key=lambda v: len(at_vertex[v]) != 1)
    for vertex in begins:
        while True:
            left = [f for f in at_vertex[vertex] if np.isnan(found[f, 0])]
            if not left:
                break
            facet = left[0]
            first = int(of_facet[facet, 0] != vertex)
            found[facet, first] = length
            length += sizes[facet]
            found[facet, 1 - first] = length
            vertex = of_facet[facet, 1 - first]
    return found


def over_arc(tractions: Tractions) -> Array:
    """Length along the deformed slave surfaces up to each point, (n,)."""
    lengths = arc_lengths(tractions.ends, tractions.deformed_ends)[tractions.facet]
    begin, end = np.moveaxis(tractions.deformed_ends[tractions.facet], 1, 0)
    along = end - begin
    share = np.einsum("qi,qi->q", tractions.x - begin, along)
    share = np.clip(share / np.einsum("qi,qi->q", along, along), 0.0, 1.0)
    return (1.0 - share) * lengths[:, 0] + share * lengths[:, 1]


def over_angle(x: Array, centre: Sequence[float] | None) -> Array:
    """Angle of points (n, 2) around a centre, (n,). Degrees, without a jump in the
    largest gap between points. Without a centre, around that of the circle that fits
    the points best."""
    if not len(x):
        return np.zeros(0)
    around = x - (_centre_of(x) if centre is None else np.asarray(centre, dtype=float))
    angles = np.degrees(np.arctan2(around[:, 1], around[:, 0]))
    ordered = np.sort(angles)
    gaps = np.diff(ordered)
    if len(gaps) and gaps.max() > ordered[0] + 360.0 - ordered[-1]:
        angles[angles > ordered[gaps.argmax()]] -= 360.0
    return angles


def _centre_of(x: Array) -> Array:
    """Centre c of the circle |x|^2 = 2 c x + k that fits points best."""
    middle = x.mean(axis=0)
    near = x - middle
    table = np.column_stack([2.0 * near, np.ones(len(x))])
    (cx, cy, _), *_ = np.linalg.lstsq(table, (near**2).sum(axis=1), rcond=None)
    return middle + np.array([cx, cy])


def draw_tractions(
    axes: Any, tractions: Tractions, options: AxisOptions, names: Sequence[str]
) -> None:
    """Pressure and friction, in one colour a pair where there are several."""
    values, label = _abscissa(tractions, options)
    axes.set(xlabel=label, ylabel=options.stress(PRESSURE))
    met = np.unique(tractions.pair)
    for k, pair in enumerate(met):
        if len(met) == 1:
            colours, markers, name = (NORMAL, TANGENTIAL), "..", ""
        else:
            colours, markers, name = (f"C{k % 10}",) * 2, ".x", f"{names[pair]} "
        on = tractions.pair == pair
        curves = {"pressure": tractions.pressure, "friction": tractions.friction}
        for (kind, y), colour, marker in zip(curves.items(), colours, markers):
            if y is not None:
                style = {"ms": 3, "color": colour, "label": name + kind}
                axes.plot(values[on], y[on], marker, **style)
    if len(axes.lines) > 1:
        axes.legend()
    _leave_room(axes, [line.get_ydata() for line in axes.lines])
    if not np.any(tractions.pressure):
        say_no_contact(axes)


def _abscissa(tractions: Tractions, options: AxisOptions) -> tuple[Array, str]:
    """What tractions are drawn over, and its label."""
    over, at = options.x, tractions.x
    if over == "arc":
        return over_arc(tractions), options.length("length along the surface")
    if over == "angle":
        return over_angle(at, options.centre), "angle (degrees)"
    if over is None:
        over = "xy"[int(np.argmax(np.ptp(at, axis=0)))] if len(at) else "x"
    return at[:, "xy".index(over)], options.length(over)


def _leave_room(axes: Any, curves: Sequence[Array]) -> None:
    """Limits that have zero, and cut no dot."""
    values = np.concatenate([[0.0], *curves])
    lower, upper = values.min(), values.max()
    if upper > lower:
        room = 0.04 * (upper - lower)
        axes.set_ylim(lower - room, upper + room)


def say_no_contact(axes: Any) -> None:
    """Say why there is nothing to see."""
    axes.text(
        0.5, 0.5, "no contact", ha="center", va="center", transform=axes.transAxes
    )

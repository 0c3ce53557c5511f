"""Slave surfaces in 3D, laid flat, with the pressure on them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..compat import Array
from ..interface.point_results import CLOSED
from ..rigid.turning import directions_across
from .drawing import PRESSURE_MAP, draw_field
from .slave_points import gather_points, gather_slave_facets
from .traction_curves import AxisOptions, say_no_contact

if TYPE_CHECKING:
    from ..contact import Contact

# Margin around the points in contact, as a share of the larger side
MARGIN = 0.15
# Mean normals shorter than this have no direction: normals cancel
NOTHING = 1e-3
# Directions that are off an axis by less than a degree have its name
NEAR = np.cos(np.radians(1.0))


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

"""Directions of the eye, and the axes of maps across them."""

from __future__ import annotations

import numpy as np

from ..core.compat import Array
from ..rigid.turning import directions_across

# Directions that are off an axis by less than this have its name
NEAR = np.cos(np.radians(5.0))


def direction(azimuth: float, elevation: float) -> Array:
    """Unit vector towards the eye. Degrees."""
    a, e = np.radians([azimuth, elevation])
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


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

"""Rigid tools: shapes as masters, in place of tags.

``Contact(u, facets, pairs=[(SLAVE, rigid.Sphere(centre, radius))])``. A shape stays
where it was made. A `Body` moves it, or lets forces move it.
"""

from .body import Body
from .polyline import Polyline
from .shapes import (
    Circle,
    Cone,
    Cylinder,
    Frame,
    Implicit,
    Line,
    Plane,
    Sphere,
    Torus,
    Wedge,
)
from .surface import Surface

__all__ = [
    "Body",
    "Circle",
    "Cone",
    "Cylinder",
    "Frame",
    "Implicit",
    "Line",
    "Plane",
    "Polyline",
    "Sphere",
    "Surface",
    "Torus",
    "Wedge",
]

"""Rigid tools: shapes as masters, in place of tags.

``Contact(u, facets, pairs=[(SLAVE, rigid.Sphere(centre, radius))])``. A shape stays
where it was made. A `Body` moves it, or lets forces move it.
"""

from typing import TYPE_CHECKING

from ..core import on_demand

if TYPE_CHECKING:
    from .body import Body
    from .implicit import Implicit
    from .polyline import Polyline
    from .shapes import Circle, Cone, Cylinder, Frame, Line, Plane, Sphere, Torus, Wedge
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

_PLACES = {
    **{name: ".shapes" for name in __all__},
    "Body": ".body",
    "Implicit": ".implicit",
    "Polyline": ".polyline",
    "Surface": ".surface",
}

__getattr__ = on_demand.lookup(__name__, _PLACES, {})

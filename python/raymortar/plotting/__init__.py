"""Pictures of deformed bodies and of the contact pressure.

- picture: `plot`
- movie: `Movie`
- labels: units, axes and names
- frames: data of a picture, gathered on rank 0
- gathering: polygons of meshes and values around them; clipping: what of them is in a box
- drawing: by matplotlib, fields, surfaces, and tractions along slaves in 2D
- maps: pressure or status on slaves in space
- artist: surfaces in space as an image; hidden: pixels in which each facet is seen
- views: directions of the eye
- tools: curves on rigid tools
- rendering: pictures in 3D by pyvista
"""

from typing import TYPE_CHECKING

from ..core import on_demand

if TYPE_CHECKING:
    from .movie import Movie

__all__ = ["Movie"]

__getattr__ = on_demand.lookup(__name__, {"Movie": ".movie"}, {})

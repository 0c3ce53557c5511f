"""Bodies in 3D and the pressure between them, drawn by pyvista."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core.compat import Array
from .drawing import PRESSURE_MAP, STRESS_MAP, direction, joined, pieces_of
from .tools import COLOUR

SIZE = (1600, 670)  # size of the picture, in pixels
# Way of covered parts towards the eye, in front of their facets, over the surface's size
LIFT = 1e-3
LIGHT = {"ambient": 0.4, "diffuse": 0.6, "specular": 0.0}
BAR = {
    "vertical": True,
    "position_x": 0.82,
    "position_y": 0.2,
    "height": 0.6,
    "width": 0.07,
    "color": "black",
    "fmt": "%.3g",
    "title_font_size": 20,
    "label_font_size": 18,
}


def lacking() -> str | None:
    """Why pyvista cannot draw here; None if it can."""
    try:
        import pyvista  # noqa: F401
        import vtkmodules.vtkRenderingOpenGL2  # noqa: F401
        from vtkmodules.vtkRenderingCore import vtkRenderWindow
    except ImportError as error:
        return (
            f"raymortar.plot needs pyvista ({error}): apt install python3-pyvista "
            "(from Debian 13 on), or pip install pyvista"
        )
    # Without a display such a window of VTK aborts the program
    through_x = vtkRenderWindow().GetClassName() == "vtkXOpenGLRenderWindow"
    if through_x and not os.environ.get("DISPLAY"):
        return (
            "pyvista has no display to draw on (DISPLAY is not set): "
            "run the program by xvfb-run -a, of Debian's packages xvfb and xauth"
        )
    return None


def render(
    bodies: list[Array],
    surface: list[Array],
    curves: Sequence[Array],
    labels: tuple[str, str],
    view: tuple[float, float],
    interactive: bool,
) -> Any:
    """Draw bodies in the colours of a field, and slaves in those of their pressure.

    Bodies are vertices (n, k, 3) of outer facets, displacement and field (n, k, 1);
    slaves the same with the normal traction (n, k, 3), and covered parts of some of them,
    deformed, with theirs. Curves (n, 3) are on rigid tools, labels those of the colour
    bars, the view azimuth and elevation in degrees. The plotter, which can open a window
    if it is interactive, has the bodies on the left, the pressure on the right.
    """
    import pyvista

    plotter = pyvista.Plotter(
        shape=(1, 2), off_screen=not interactive, window_size=SIZE, border=False
    )
    plotter.set_background("white")
    plotter.enable_anti_aliasing("fxaa")
    if curves:
        pieces = pieces_of(curves)
        wires = pyvista.PolyData(pieces.reshape(-1, 3), lines=_cells(pieces))
        plotter.subplot(0, 0)
        plotter.add_mesh(wires, color=COLOUR, line_width=1.5)
    (x, u, field), eye = bodies, direction(*view)
    at, covered = surface[0] + surface[1], surface[3]
    lift = LIFT * np.ptp(at.reshape(-1, 3), axis=0).max(initial=0.0) * eye
    facets = joined((at, covered + lift))
    pressure = np.linalg.norm(joined(surface[2:5:2]), axis=2)
    drawn = (x + u, field, STRESS_MAP), (facets, pressure, PRESSURE_MAP)
    for k, ((polygons, values, colours), label) in enumerate(zip(drawn, labels)):
        plotter.subplot(0, k)
        mesh = pyvista.PolyData(polygons.reshape(-1, 3), _cells(polygons))
        mesh.point_data[label] = values.ravel()
        lower = values.min(initial=0.0)
        plotter.add_mesh(
            mesh,
            scalars=label,
            cmap=colours,
            clim=(lower, values.max(initial=lower)),
            show_edges=True,
            edge_color="#555555",
            scalar_bar_args=BAR,
            **LIGHT,
        )
        plotter.scalar_bars[label].SetVerticalTitleSeparation(12)
        plotter.view_vector(eye, viewup=(0, 0, 1))
        plotter.add_axes(color="black")
        # Moved away from the colour bar
        plotter.camera.SetWindowCenter(0.16, 0.0)
        plotter.camera.zoom(0.9)
    return plotter


def _cells(polygons: Array) -> Array:
    """Number the points of polygons (n, k, 3) as VTK does, each after its k; points that
    repeat the one before are left out."""
    n, k = polygons.shape[:2]
    has = (np.diff(polygons, axis=1, prepend=np.inf) != 0.0).any(axis=2)
    numbers = np.arange(n * k).reshape(n, k)
    rows = np.column_stack([has.sum(axis=1), numbers])
    return rows[np.column_stack([np.ones(n, dtype=bool), has])]

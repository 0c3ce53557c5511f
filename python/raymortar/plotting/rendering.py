"""Bodies in 3D and the pressure between them, drawn by pyvista."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..compat import Array
from .drawing import PRESSURE_MAP, STRESS_MAP, direction
from .tools import COLOUR

SIZE = (1600, 670)  # size of the picture, in pixels
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
    """Bodies in the colours of a field, and slave surfaces in those of their pressure.

    Parameters
    ----------
    bodies
        Outer facets' vertices (n, k, 3), displacement (n, k, 3) and field (n, k, 1).
    surface
        Slave facets' vertices, displacement and normal traction (n, k, 3).
    curves
        Curves (n, 3) on rigid tools, drawn with the bodies.
    labels
        Labels of the colour bars of the bodies and of the pressure.
    view
        Azimuth and elevation of the eye. Degrees.
    interactive
        Whether the plotter is to open a window with ``show``.

    Returns
    -------
    The ``pyvista.Plotter``, bodies on the left, pressure on the right.
    """
    import pyvista

    plotter = pyvista.Plotter(
        shape=(1, 2), off_screen=not interactive, window_size=SIZE, border=False
    )
    plotter.set_background("white")
    plotter.enable_anti_aliasing("fxaa")
    plotter.subplot(0, 0)
    if curves:
        ends = np.cumsum([len(curve) for curve in curves])
        lines = [
            np.append(len(curve), np.arange(end - len(curve), end))
            for curve, end in zip(curves, ends)
        ]
        wires = pyvista.PolyData(np.concatenate(curves), lines=np.concatenate(lines))
        plotter.add_mesh(wires, color=COLOUR, line_width=1.5)
    x, u, values = bodies
    _add(plotter, x, u, values, labels[0], STRESS_MAP, view)
    plotter.subplot(0, 1)
    x, u, traction = surface
    pressure = np.linalg.norm(traction, axis=2, keepdims=True)
    _add(plotter, x, u, pressure, labels[1], PRESSURE_MAP, view)
    return plotter


def _add(
    plotter: Any, x: Array, u: Array, values: Array, label: str, colours: str, view: Any
) -> None:
    """Add deformed facets (n, k, 3) with a value (n, k, 1) at each vertex."""
    import pyvista

    n, k = x.shape[:2]
    faces = np.column_stack([np.full(n, k), np.arange(n * k).reshape(n, k)])
    mesh = pyvista.PolyData((x + u).reshape(-1, 3), faces.ravel())
    mesh.point_data[label] = values.ravel()
    lower = min(0.0, values.min(initial=0.0))
    plotter.add_mesh(
        mesh,
        scalars=label,
        cmap=colours,
        clim=(lower, values.max(initial=lower)),
        show_edges=True,
        edge_color="#555555",
        **LIGHT,
        scalar_bar_args=BAR,
    )
    plotter.scalar_bars[label].SetVerticalTitleSeparation(12)
    plotter.view_vector(direction(*view), viewup=(0, 0, 1))
    plotter.add_axes(color="black")
    # Moved away from the colour bar
    plotter.camera.SetWindowCenter(0.16, 0.0)
    plotter.camera.zoom(0.9)

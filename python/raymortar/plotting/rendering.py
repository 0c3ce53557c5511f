"""Bodies in 3D and the pressure between them, drawn by pyvista."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..compat import Array
from .drawing import PRESSURE_MAP, STRESS_MAP, direction
from .outlines import COLOUR

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
    wires: Sequence[Array],
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
    wires
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
    x, u, values = bodies
    lower = min(0.0, values.min(initial=0.0))
    _add_wires(plotter, wires)
    _add(plotter, 0, x + u, values, labels[0], STRESS_MAP, lower, view)
    x, u, traction = surface
    pressure = np.linalg.norm(traction, axis=2, keepdims=True)
    _add(plotter, 1, x + u, pressure, labels[1], PRESSURE_MAP, 0.0, view)
    return plotter


def _add_wires(plotter: Any, wires: Sequence[Array]) -> None:
    """Add curves (n, 3) to the left half."""
    import pyvista

    if not wires:
        return
    counts = np.array([len(curve) for curve in wires])
    starts = np.cumsum(counts) - counts
    lines = [np.append(n, begin + np.arange(n)) for n, begin in zip(counts, starts)]
    mesh = pyvista.PolyData(np.concatenate(wires), lines=np.concatenate(lines))
    plotter.subplot(0, 0)
    plotter.add_mesh(mesh, color=COLOUR, line_width=1.5)


def _add(
    plotter: Any,
    column: int,
    at: Array,
    values: Array,
    label: str,
    colours: str,
    lower: float,
    view: tuple[float, float],
) -> None:
    """Add facets (n, k, 3) with a value (n, k, 1) at each vertex."""
    import pyvista

    n, k = at.shape[:2]
    corners = np.arange(n * k).reshape(n, k)
    faces = np.column_stack([np.full(n, k), corners])
    mesh = pyvista.PolyData(at.reshape(-1, 3), faces.ravel())
    mesh.point_data[label] = values.ravel()
    plotter.subplot(0, column)
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

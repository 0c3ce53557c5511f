"""One picture of deformed bodies and of the contact pressure."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl
from dolfinx.fem import Function

from .. import compat
from ..compat import Array
from ..errors import (
    ContactError,
    as_path,
    raise_everywhere,
    require_agreement,
    together,
    writing,
)
from ..host.gathering import gather_boundary, gather_cells, nodal_field
from ..rigid.body import Body
from . import rendering
from .drawing import LOOK, draw_field, draw_surface
from .outlines import draw_tools
from .pressure_maps import draw_pressure, gather_pressure
from .traction_curves import PRESSURE, AxisOptions, draw_tractions, gather_tractions
from .wires import draw_wires, wires

if TYPE_CHECKING:
    from ..contact import Contact

BACKENDS = ("matplotlib", "pyvista")
# Margin around bodies in which tools are drawn, as a share of the larger side, in 2D
# and in 3D. Wires need a larger one to show the tool's shape
MARGIN = {2: 0.15, 3: 0.4}


def plot(
    contact: Contact,
    file: str | Path | None = None,
    field: Any = None,
    label: str | None = None,
    view: tuple[float, float] = (-60.0, 20.0),
    backend: str = "matplotlib",
    x: str | None = None,
    centre: Sequence[float] | None = None,
    units: tuple[str, str] | None = None,
) -> Any:
    """Draw the deformed bodies and the contact pressure, at the last update. Collective.

    In 2D: cells coloured by a field, outlines of the rigid tools next to them, and
    normal and tangential traction at the integration points along the slave surfaces,
    in one colour a pair. In 3D: the bodies' surfaces, wires of the rigid tools next to
    them, and the pressure on the slave surfaces, seen along the mean normal of the
    points in contact and zoomed to these. Rank 0 gathers all that is drawn, so large
    meshes may not fit; write those by `io.write_xdmf`. Edges of degree 2 are drawn
    straight.

    Parameters
    ----------
    contact
        Contact.
    file
        Picture to write, ``.png``, ``.pdf``, ...; None: only the figure is made.
    field
        Colours of the bodies: a ``Function`` or a UFL expression such as the von Mises
        stress, a vector by its length. Default: the displacement.
    label
        Label of the colour bar. Default: the name of the field, or "displacement" if it
        has none.
    view
        Azimuth and elevation of the eye in 3D. Degrees.
    backend
        What draws: ``"matplotlib"``, or in 3D ``"pyvista"``, which hides what is behind
        exactly and puts the pressure on the deformed surface.
    x
        What tractions are drawn over in 2D: ``"x"``, ``"y"``, ``"arc"`` (the length
        along the deformed slave surfaces) or ``"angle"`` (degrees around `centre`).
        Default: x or y, along which the surfaces extend more.
    centre
        Of the angles, (x, y). Default: that of the circle that fits the slave surfaces
        best.
    units
        Units of length and stress for the labels, such as ``("mm", "MPa")``. Default:
        labels have none.

    Returns
    -------
    The matplotlib figure or the pyvista plotter on rank 0, None elsewhere. Without a
    file, its ``show`` opens a window.

    Raises
    ------
    ContactError
        Without the backend, if the file cannot be written, or if an argument is no such
        thing.

    Examples
    --------
    >>> raymortar.plot(contact, "contact.png", field=von_mises, label="MPa")
    >>> raymortar.plot(contact, "contact.png", x="arc", units=("mm", "MPa"))
    >>> raymortar.plot(contact, "contact.png", backend="pyvista")
    """
    if not hasattr(contact, "zones"):
        raise ContactError(f"plot needs a Contact, not {type(contact).__name__}")
    with together(contact.layout.comm):
        u = contact.host.only.u
    mesh = u.function_space.mesh
    with together(mesh.comm):
        _check_input(contact, file, field)
        axes = "rz" if contact.axisymmetric else "xy"
        options = AxisOptions(x, centre, units, axes)
    require_agreement(mesh.comm, backend=backend)
    dim, draws = mesh.geometry.dim, mesh.comm.rank == 0
    raise_everywhere(mesh.comm, _lacking(backend, dim) if draws else None)
    shown = _nodal(u if field is None else field, u)
    if label is None:
        label = "displacement" if field is None and _is_unnamed(u) else shown.name
        label = options.length(label) if field is None else label
    if dim == 2:
        parts = gather_cells(mesh, u, shown)
        pressure: Any = gather_tractions(contact)
    else:
        parts, pressure = gather_boundary(mesh, u, shown), gather_pressure(contact)
    tools = list(dict.fromkeys(b for zone in contact.zones for b in zone.facets.bodies))
    figure = None
    if draws:
        if backend == "pyvista":
            labels, curves = (label, options.stress(PRESSURE)), _wires(tools, parts)
            figure = rendering.render(
                parts, pressure.surface, curves, labels, view, file is None
            )
        else:
            names = [str(pair) for pair in contact.pairs]
            picture = Picture(parts, pressure, tools, label, view, options, names)
            figure = picture.draw(file is None)
    with writing(mesh.comm, file, OSError, ValueError):
        if draws and file is not None:
            _save(figure, Path(file), backend)
    return figure


def _check_input(contact: Contact, file: Any, field: Any) -> None:
    """Raise if there are no results yet, or if file or field cannot be used."""
    contact.points()  # raises before the first update
    if file is not None:
        as_path(file)
    if field is None:
        return
    if not hasattr(field, "ufl_shape"):
        raise ContactError(f"field must be a Function or UFL expression, not {field!r}")
    if isinstance(field, Function) and not compat.on_mesh(
        field, contact.u.function_space.mesh
    ):
        raise ContactError("field is a Function on another mesh than the displacement")


def _is_unnamed(function: Function) -> bool:
    """Whether a function still has the name that DOLFINx gave it."""
    return re.fullmatch(r"f(_\d+)?", function.name) is not None


def _lacking(backend: str, dim: int) -> str | None:
    """Why a backend cannot draw; None if it can."""
    if backend not in BACKENDS:
        return f"backend {backend!r} is not one of {', '.join(BACKENDS)}"
    if backend == "pyvista":
        if dim == 2:
            return "backend 'pyvista' draws bodies in 3D: use 'matplotlib' in 2D"
        return rendering.lacking()
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        return (
            f"raymortar.plot needs matplotlib ({error}): apt install "
            "python3-matplotlib, or pip install matplotlib"
        )
    return None


def _figure(interactive: bool) -> Any:
    """An empty figure. pyplot knows it only if it is interactive, for ``show``."""
    from matplotlib import pyplot
    from matplotlib.figure import Figure

    make = pyplot.figure if interactive else Figure
    return make(figsize=(10, 4.2), layout="constrained")


@dataclass(frozen=True)
class Picture:
    """All that matplotlib draws. On rank 0."""

    bodies: Any
    pressure: Any
    tools: Sequence[Body]
    label: str
    view: tuple[float, float]
    options: AxisOptions
    pairs: Sequence[str]

    def draw(self, interactive: bool) -> Any:
        """The figure."""
        from matplotlib import rc_context

        with rc_context(LOOK):
            figure = _figure(interactive)
            if self.bodies[1].shape[-1] == 2:
                self._draw_plane(figure)
            else:
                self._draw_space(figure)
        return figure

    def _draw_plane(self, figure: Any) -> None:
        """Bodies and tools on the left, tractions on the right."""
        x, u, values = self.bodies
        left, right = figure.subplots(1, 2)
        span = None if values.min() >= 0.0 else _span(values)
        colours = draw_field(left, x[..., :2] + u, values, norm=span)
        figure.colorbar(colours, ax=left, label=self.label, shrink=0.85)
        if self.tools:
            draw_tools(left, self.tools, *_box(self.bodies))
        across, up = map(self.options.length, self.options.axes)
        left.set(xlabel=across, ylabel=up)
        draw_tractions(right, self.pressure, self.options, self.pairs)

    def _draw_space(self, figure: Any) -> None:
        """Bodies and tools on the left, pressure on the slave surfaces on the right."""
        x, u, values = self.bodies
        left = figure.add_subplot(1, 2, 1, projection="3d")
        colours = draw_surface(left, x + u, values.mean(axis=(1, 2)), *self.view)
        draw_wires(left, _wires(self.tools, self.bodies))
        figure.colorbar(colours, ax=left, label=self.label, shrink=0.7)
        right = figure.add_subplot(1, 2, 2)
        colours = draw_pressure(right, self.pressure, self.options)
        label = self.options.stress(PRESSURE)
        figure.colorbar(colours, ax=right, label=label, shrink=0.85)


def _save(figure: Any, path: Path, backend: str) -> None:
    """Write the picture to a file."""
    if backend == "pyvista":
        figure.screenshot(path)
        return
    from matplotlib import rc_context

    with rc_context(LOOK):
        figure.savefig(path)


def _nodal(field: Any, u: Function) -> Function:
    """A continuous scalar function, for the colours at the vertices."""
    mesh = u.function_space.mesh
    if isinstance(field, Function):
        info = compat.element_info(field.function_space)
        if info.is_lagrange and not info.is_discontinuous and info.block_size == 1:
            return field
    name = getattr(field, "name", "field")
    length = ufl.sqrt(ufl.inner(field, field)) if field.ufl_shape else field
    # Degree 2 resolves the variation within a cell
    return nodal_field(length, mesh, name, quadrature_degree=2)


def _span(values: Array) -> Any:
    """Scale of colours from the smallest to the largest value."""
    from matplotlib.colors import Normalize

    return Normalize(values.min(), values.max())


def _wires(tools: Sequence[Body], bodies: Any) -> list[Array]:
    """Wires of the tools, in a box around the bodies."""
    if not tools:
        return []
    lower, upper = _box(bodies)
    return [curve for tool in tools for curve in wires(tool, lower, upper)]


def _box(bodies: Any) -> tuple[Array, Array]:
    """Corners of a box around the deformed bodies, with a margin."""
    x, u, _ = bodies
    at = (x[..., : u.shape[-1]] + u).reshape(-1, u.shape[-1])
    margin = MARGIN[u.shape[-1]] * np.ptp(at, axis=0).max()
    return at.min(axis=0) - margin, at.max(axis=0) + margin

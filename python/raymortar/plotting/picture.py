"""One picture of deformed bodies and of the contact pressure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dolfinx.fem import Function

from ..arguments import as_path, writing
from ..core import compat
from ..core.discretization.joined import parts_of
from ..core.errors import (
    ContactError,
    described,
    raise_everywhere,
    require_agreement,
    together,
    truth,
)
from . import drawing, maps, rendering
from .frames import Frame, Ranges, gather_frame, label_of
from .labels import AxisOptions, Units, pair_label
from .tools import COLOUR

if TYPE_CHECKING:
    from ..core.contact import Contact

BACKENDS = ("matplotlib", "pyvista")


def plot(
    contact: Contact,
    file: str | Path | None = None,
    field: Any = None,
    label: str | None = None,
    view: tuple[float, float] = (-60.0, 20.0),
    backend: str = "matplotlib",
    x: str | None = None,
    centre: Sequence[float] | None = None,
    units: Units | None = None,
    zoom: bool = False,
    quantity: str = "pressure",
) -> Any:
    """Draw the deformed bodies and the contact pressure, at the last update. Collective.

    In 2D: cells coloured by a field, outlines of the rigid tools next to them, and
    normal and tangential traction at the integration points along the slave surfaces,
    in one colour for each pair. In 3D: the bodies' surfaces, sections of the rigid
    tools next to them, and the pressure on what is covered of the slave surfaces, seen
    along the mean normal of the points in contact and zoomed to these. Edges of degree
    2 are arcs. Rank 0 gathers all that is drawn, so large meshes may not fit; write
    those by `io.write_xdmf`.

    Parameters
    ----------
    contact
        Contact.
    file
        Picture to write, ``.png``, ``.pdf``, ...; None: only the figure is made.
    field
        Colours of the bodies: a ``Function`` or a UFL expression such as the von Mises
        stress; of a vector its length, of a tensor the root of the sum of its squared
        components. Of bodies on meshes of their own a list, one for each mesh. Default:
        the displacement.
    label
        Label of the colour bar; the unit is added unless it ends with it. Default: the
        name of the field; "displacement", with the name of its Function if it has one.
    view
        Azimuth and elevation of the eye in 3D. Degrees.
    backend
        Drawing library: ``"matplotlib"``, or in 3D ``"pyvista"``, which hides surfaces
        exactly and puts the pressure on the deformed surface.
    x
        Horizontal axis of tractions in 2D: ``"x"``, ``"y"``, ``"arc"`` (the length
        along the deformed slave surfaces) or ``"angle"`` (degrees around `centre`).
        Default: x or y, along which the surfaces extend more.
    centre
        Centre of the angles, (x, y). Default: that of the circle that fits the slave
        surfaces best.
    units
        Units of length and stress for the labels, such as ``("mm", "MPa")``; or, to
        convert, units and factors of ``"length"``, ``"stress"`` and the given
        ``"field"``: ``{"length": ("mm", 1e3), "stress": ("MPa", 1e-6)}`` of a model in
        SI. Default: labels have none.
    zoom
        Whether only the bodies next to the points in contact are drawn, and tractions
        there.
    quantity
        Shown of the slave surfaces: ``"pressure"``, or ``"status"``, which tells points
        that are open, stick and slip: in 2D by the colours of friction, in 3D on a map
        of the points. By matplotlib.

    Returns
    -------
    The matplotlib figure or the pyvista plotter on rank 0, None elsewhere. Without a
    file, its ``show`` opens a window.

    Raises
    ------
    ContactError
        Without the backend, if the file cannot be written, or if an argument cannot be
        used.

    Examples
    --------
    >>> raymortar.plot(contact, "contact.png", field=von_mises, label="stress (MPa)")
    >>> raymortar.plot(contact, "contact.png", x="arc", units=("mm", "MPa"))
    >>> si = {"length": ("mm", 1e3), "stress": ("MPa", 1e-6), "field": ("MPa", 1e-6)}
    >>> raymortar.plot(contact, "contact.png", von_mises, units=si, zoom=True)
    >>> raymortar.plot(contact, "slip.png", quantity="status")
    >>> raymortar.plot(contact, "contact.png", backend="pyvista")
    """
    options = checked(contact, field, x, centre, units, zoom, quantity)
    comm = contact.layout.comm
    with together(comm):
        contact.points()  # raises before the first update
        if file is not None:
            as_path(file)
    require_agreement(comm, backend=backend)
    draws = comm.rank == 0
    if backend == "pyvista" and quantity != "pressure":
        raise ContactError(
            f"backend 'pyvista' shows pressures: draw quantity={quantity!r} by "
            "'matplotlib'"
        )
    dim = contact.u.function_space.mesh.geometry.dim
    raise_everywhere(comm, lacking(backend, dim) if draws else None)
    title = label_of(contact.u, field, label, options)
    frame, figure = gather_frame(contact, field, options), None
    if frame is not None and backend == "pyvista":
        labels = title, options.stress(drawing.PRESSURE)
        shown = frame.bodies, frame.slaves, frame.lines
        figure = rendering.render(*shown, labels, view, file is None)
    elif frame is not None:
        ranges = Ranges.of([frame])
        figure = new_figure(file is None)
        draw(figure, contact, frame, ranges, title, view, options)
        drawing.fit_ticks(figure)
    with writing(comm, file, OSError, ValueError):
        if draws and file is not None:
            _save(figure, Path(file), backend)
    return figure


def checked(
    contact: Any,
    field: Any,
    x: Any,
    centre: Any,
    units: Any,
    zoom: Any,
    quantity: Any,
) -> AxisOptions:
    """Check what is drawn, and return the options of its axes. Collective."""
    if not hasattr(contact, "zones"):
        raise ContactError(f"plot needs a Contact, not {type(contact).__name__}")
    with together(contact.layout.comm):
        if field is not None:
            _check_fields(field, [u.function_space.mesh for u in parts_of(contact.u)])
        axes = "rz" if contact.system.axisymmetric else "xy"
        shown = truth("zoom", zoom), quantity
        options = AxisOptions(x, centre, units, axes, *shown)
    require_agreement(contact.layout.comm, zoom=zoom, quantity=quantity)
    return options


def _check_fields(field: Any, meshes: Sequence[Any]) -> None:
    """Raise unless there is a field for each mesh."""
    fields = field if isinstance(field, (list, tuple)) else [field]
    if len(fields) != len(meshes):
        raise ContactError(
            f"bodies are on {len(meshes)} meshes: field must be a list of one for each "
            f"mesh, not {described(field)}"
        )
    for one, mesh in zip(fields, meshes):
        if not hasattr(one, "ufl_shape"):
            raise ContactError(
                f"field must be a Function or UFL expression, not {described(one)}"
            )
        if isinstance(one, Function) and not compat.on_mesh(one, mesh):
            raise ContactError(
                "field is a Function on another mesh than the displacement"
            )


def lacking(backend: str, dim: int) -> str | None:
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


def new_figure(interactive: bool) -> Any:
    """Make an empty figure. pyplot knows it only if it is interactive, for ``show``."""
    from matplotlib import pyplot, rc_context
    from matplotlib.figure import Figure

    with rc_context(drawing.LOOK):
        make = pyplot.figure if interactive else Figure
        figure: Any = make(figsize=(10, 4.2), layout="constrained")
        figure.get_layout_engine().set(w_pad=0.1)
        return figure


def draw(
    figure: Any,
    contact: Contact,
    frame: Frame,
    ranges: Ranges,
    label: str,
    view: tuple[float, float],
    options: AxisOptions,
) -> None:
    """Draw bodies and tools on the left, tractions on the right, by matplotlib.

    A figure that has its axes keeps them, with their colour bars: what they show goes.
    """
    from matplotlib import rc_context
    from matplotlib.colors import Normalize

    x, u, values = frame.bodies
    in_plane = u.shape[-1] == 2
    is_first = not figure.axes
    with rc_context(drawing.LOOK):
        if is_first:
            figure.add_subplot(1, 2, 1, projection=None if in_plane else "3d")
            figure.add_subplot(1, 2, 2)
        left, right = figure.axes[:2]
        for axes in (left, right):
            drawing.clear(axes)
        norm = Normalize(*ranges.field)
        if in_plane:
            colours = drawing.draw_field(left, x[..., :2] + u, values, norm=norm)
            for curve in frame.lines:
                left.plot(*curve.T, color=COLOUR, lw=1.2, zorder=3)
            if frame.box is not None:
                (before, below), (after, above) = frame.box
                left.set(xlim=(before, after), ylim=(below, above))
                # Sides that cut bodies have a line
                left.spines[["top", "right"]].set_visible(options.zoom)
            across, up = map(options.length, options.axes)
            left.set(xlabel=across, ylabel=up)
            names = [pair_label(pair) for pair in contact.pairs]
            frictional = contact.friction is not None
            along = frame.slaves, frame.points, options, names, frictional
            drawing.draw_tractions(right, *along)
        else:
            shown = x + u, values[..., 0], *view, frame.lines, norm
            colours = drawing.draw_surface(left, *shown)
            on_slaves = frame.slaves, frame.points, options
            if options.quantity == "status":
                maps.draw_status(right, *on_slaves)
            else:
                bar = maps.draw_pressure(right, *on_slaves, ranges.pressure)
                pressure = options.stress(drawing.PRESSURE)
                if is_first:
                    figure.colorbar(bar, ax=right, label=pressure, shrink=0.85)
        if is_first:
            shrink = 0.85 if in_plane else 0.7
            figure.colorbar(colours, ax=left, label=label, shrink=shrink)


def _save(figure: Any, path: Path, backend: str) -> None:
    """Write the picture to a file."""
    if backend == "pyvista":
        figure.screenshot(path)
        return
    from matplotlib import rc_context

    with rc_context(drawing.LOOK):
        figure.savefig(path)

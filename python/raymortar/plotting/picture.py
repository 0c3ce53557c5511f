"""One picture of deformed bodies and of the contact pressure."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx.fem import Function
from dolfinx.mesh import Mesh

from .. import compat
from ..compat import Array
from ..discretization.gathering import (
    gather,
    gather_boundary,
    gather_cells,
    nodal_field,
)
from ..errors import (
    ContactError,
    as_path,
    raise_everywhere,
    require_agreement,
    together,
    writing,
)
from ..interface.point_results import OPEN
from ..paths.body_columns import rigid_bodies
from . import drawing, rendering
from .tools import COLOUR, curves

if TYPE_CHECKING:
    from ..contact import Contact

BACKENDS = ("matplotlib", "pyvista")
# Margin around bodies in which tools are drawn, as a share of the larger side, in 2D
# and in 3D. Wires need a larger one to show the tool's shape
MARGIN = {2: 0.15, 3: 0.4}
# Arrays of points that pictures need; `facet` is a place among all slave facets
_NAMES = "x normal contact_normal traction weight status pair facet".split()


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
    in one colour a pair. In 3D: the bodies' surfaces, sections of the rigid tools next
    to them, and the pressure on the slave surfaces, seen along the mean normal of the
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
        u = contact.unknowns.only.u
    mesh = u.function_space.mesh
    comm, dim = mesh.comm, mesh.geometry.dim
    with together(comm):
        contact.points()  # raises before the first update
        _check_input(mesh, file, field)
        axes = "rz" if contact.axisymmetric else "xy"
        options = drawing.AxisOptions(x, centre, units, axes)
    require_agreement(comm, backend=backend)
    draws = comm.rank == 0
    raise_everywhere(comm, _lacking(backend, dim) if draws else None)
    shown = _nodal(u if field is None else field, mesh)
    if label is None:
        is_unnamed = field is None and re.fullmatch(r"f(_\d+)?", u.name)
        label = "displacement" if is_unnamed else shown.name
        label = options.length(label) if field is None else label
    gather_bodies: Any = gather_cells if dim == 2 else gather_boundary
    bodies = gather_bodies(mesh, u, shown)
    facets = np.concatenate([zone.facets.slave.facets for zone in contact.zones])
    functions = [u] if dim == 2 else [u, contact.traction("normal")]
    slaves = gather_boundary(mesh, *functions, facets=facets)
    points = _gather_points(contact, comm)
    figure = None
    if draws:
        tools = rigid_bodies(contact.zones)
        lines = [curve for tool in tools for curve in curves(tool, *_box(bodies))]
        if backend == "pyvista":
            labels = label, options.stress(drawing.PRESSURE)
            figure = rendering.render(bodies, slaves, lines, labels, view, file is None)
        else:
            parts = bodies, slaves, points, lines
            figure = _draw(contact, parts, label, view, options, file is None)
    with writing(comm, file, OSError, ValueError):
        if draws and file is not None:
            _save(figure, Path(file), backend)
    return figure


def _check_input(mesh: Mesh, file: Any, field: Any) -> None:
    """Raise if file or field cannot be used."""
    if file is not None:
        as_path(file)
    if field is not None and not hasattr(field, "ufl_shape"):
        raise ContactError(f"field must be a Function or UFL expression, not {field!r}")
    if isinstance(field, Function) and not compat.on_mesh(field, mesh):
        raise ContactError("field is a Function on another mesh than the displacement")


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


def _gather_points(contact: Contact, comm: MPI.Intracomm) -> dict[str, Any]:
    """Gather the points that meet a master, rank by rank and zone by zone. Collective.

    On rank 0; None in place of arrays elsewhere.
    """
    counts = [len(zone.facets.slave.facets) for zone in contact.zones]
    first, parts = comm.exscan(sum(counts)) or 0, []
    for i, count in enumerate(counts):
        points = contact.points(i)
        points["facet"] = first + points["slave"]
        parts.append({name: points[name][points["status"] >= OPEN] for name in _NAMES})
        first += count
    return {
        name: gather(comm, np.concatenate([part[name] for part in parts]))
        for name in _NAMES
    }


def _draw(
    contact: Contact,
    parts: tuple[Any, ...],
    label: str,
    view: tuple[float, float],
    options: drawing.AxisOptions,
    interactive: bool,
) -> Any:
    """Draw bodies and tools on the left, tractions on the right, by matplotlib.

    pyplot knows the figure only if it is interactive, for ``show``.
    """
    from matplotlib import pyplot, rc_context
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    (x, u, values), slaves, points, lines = parts
    in_plane = u.shape[-1] == 2
    with rc_context(drawing.LOOK):
        make = pyplot.figure if interactive else Figure
        figure = make(figsize=(10, 4.2), layout="constrained")
        left = figure.add_subplot(1, 2, 1, projection=None if in_plane else "3d")
        right = figure.add_subplot(1, 2, 2)
        if in_plane:
            low, high = values.min(), values.max()
            norm = None if low >= 0.0 else Normalize(low, high)
            colours = drawing.draw_field(left, x[..., :2] + u, values, norm=norm)
            for curve in lines:
                left.plot(*curve.T, color=COLOUR, lw=1.2, zorder=3)
            if lines:
                (before, below), (after, above) = _box(parts[0])
                left.set(xlim=(before, after), ylim=(below, above))
            across, up = map(options.length, options.axes)
            left.set(xlabel=across, ylabel=up)
            names = [str(pair) for pair in contact.pairs]
            frictional = contact.friction is not None
            drawing.draw_tractions(right, slaves, points, options, names, frictional)
        else:
            mean = values.mean(axis=(1, 2))
            colours = drawing.draw_surface(left, x + u, mean, *view, lines)
            bar = drawing.draw_pressure(right, slaves, points, options)
            pressure = options.stress(drawing.PRESSURE)
            figure.colorbar(bar, ax=right, label=pressure, shrink=0.85)
        shrink = 0.85 if in_plane else 0.7
        figure.colorbar(colours, ax=left, label=label, shrink=shrink)
    return figure


def _save(figure: Any, path: Path, backend: str) -> None:
    """Write the picture to a file."""
    if backend == "pyvista":
        figure.screenshot(path)
        return
    from matplotlib import rc_context

    with rc_context(drawing.LOOK):
        figure.savefig(path)


def _nodal(field: Any, mesh: Mesh) -> Function:
    """A continuous scalar function, for the colours at the vertices."""
    if isinstance(field, Function):
        info = compat.element_info(field.function_space)
        if info.is_lagrange and not info.is_discontinuous and info.block_size == 1:
            return field
    name = getattr(field, "name", "field")
    length = ufl.sqrt(ufl.inner(field, field)) if field.ufl_shape else field
    # Degree 2 resolves the variation within a cell
    return nodal_field(length, mesh, name, quadrature_degree=2)


def _box(bodies: Any) -> tuple[Array, Array]:
    """Corners of a box around the deformed bodies, with a margin."""
    x, u, _ = bodies
    at = (x[..., : u.shape[-1]] + u).reshape(-1, u.shape[-1])
    margin = MARGIN[u.shape[-1]] * np.ptp(at, axis=0).max()
    return at.min(axis=0) - margin, at.max(axis=0) + margin

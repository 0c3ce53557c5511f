"""One picture of deformed bodies and of the contact pressure."""

from __future__ import annotations

import re
from collections.abc import Sequence
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
from ..host.gathering import gather, gather_boundary, gather_cells, nodal_field
from ..interface.point_results import OPEN, along_normal
from ..rigid.body import Body
from . import rendering
from .drawing import LOOK, PRESSURE_MAP, draw_field, draw_surface
from .outlines import draw_tools
from .wires import draw_wires, wires

if TYPE_CHECKING:
    from ..contact import Contact

BACKENDS = ("matplotlib", "pyvista")
# Margin around bodies in which tools are drawn, as a share of the larger side, in 2D
# and in 3D. Wires need a larger one to show the tool's shape
MARGIN = {2: 0.15, 3: 0.4}
NORMAL, TANGENTIAL = "#c0392b", "#2c3e50"


def plot(
    contact: Contact,
    file: str | Path | None = None,
    field: Any = None,
    label: str | None = None,
    view: tuple[float, float] = (-60.0, 20.0),
    backend: str = "matplotlib",
) -> Any:
    """Draw the deformed bodies and the contact pressure, at the last update. Collective.

    In 2D: cells coloured by a field, outlines of the rigid tools next to them, and
    normal and tangential traction at the integration points along the slave surfaces.
    In 3D: the bodies' surfaces, wires of the rigid tools next to them, and the pressure on
    the slave surfaces, laid flat. Rank 0 gathers all that is drawn, so large meshes may
    not fit; write those by `io.write_xdmf`. Edges of degree 2 are drawn straight.

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

    Returns
    -------
    The matplotlib figure or the pyvista plotter on rank 0, None elsewhere. Without a
    file, its ``show`` opens a window.

    Raises
    ------
    ContactError
        Without the backend, or if the file cannot be written.

    Examples
    --------
    >>> raymortar.plot(contact, "contact.png", field=von_mises, label="MPa")
    >>> raymortar.plot(contact, "contact.png", backend="pyvista")
    """
    if not hasattr(contact, "zones"):
        raise ContactError(f"plot needs a Contact, not {type(contact).__name__}")
    with together(contact.layout.comm):
        u = contact.host.only.u
    mesh = u.function_space.mesh
    with together(mesh.comm):
        _check_input(contact, file, field)
    require_agreement(mesh.comm, backend=backend)
    dim, draws = mesh.geometry.dim, mesh.comm.rank == 0
    raise_everywhere(mesh.comm, _lacking(backend, dim) if draws else None)
    shown = _nodal(u if field is None else field, u)
    if label is None:
        label = "displacement" if field is None and _is_unnamed(u) else shown.name
    if dim == 2:
        parts, pressure = gather_cells(mesh, u, shown), _pressure_line(contact)
    else:
        parts, pressure = gather_boundary(mesh, u, shown), _pressure_map(contact)
    tools = list(dict.fromkeys(b for zone in contact.zones for b in zone.facets.bodies))
    figure = None
    if draws:
        if backend == "pyvista":
            figure = rendering.render(
                parts, pressure, _wires(tools, parts), label, view, file is None
            )
        else:
            figure = _draw(parts, pressure, tools, label, view, file is None)
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


def _draw(
    bodies: Any,
    pressure: Any,
    tools: Sequence[Body],
    label: str,
    view: tuple[float, float],
    interactive: bool,
) -> Any:
    """The figure of matplotlib."""
    from matplotlib import rc_context

    with rc_context(LOOK):
        figure = _figure(interactive)
        if bodies[1].shape[-1] == 2:
            _draw_plane(figure, bodies, pressure, tools, label)
        else:
            _draw_space(figure, bodies, pressure, tools, label, view)
    return figure


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


def _pressure_line(contact: Contact) -> list[Array]:
    """On rank 0: positions (n, 2), pressure and, if any, friction (n,) at the points."""
    arrays: list[list[Array]] = [[], [], []]
    for zone in contact.zones:
        points = zone.points()
        hit = points["status"] >= OPEN
        normal = along_normal(points, points["traction"])
        pressure = -np.einsum("qi,qi->q", normal, points["normal"])
        friction = np.linalg.norm(points["traction"] - normal, axis=1)
        for array, values in zip(arrays, (points["x"], pressure, friction)):
            array.append(values[hit])
    if contact.friction is None:
        arrays.pop()
    comm = contact.u.function_space.mesh.comm
    return [gather(comm, np.concatenate(parts)) for parts in arrays]  # type: ignore


def _pressure_map(contact: Contact) -> list[Any]:
    """On rank 0: slave facets, displacement and normal traction at their vertices."""
    mesh = contact.u.function_space.mesh
    facets = np.concatenate([zone.facets.slave.facets for zone in contact.zones])
    normal = contact.traction("normal")
    return gather_boundary(mesh, contact.u, normal, facets=facets)


def _draw_plane(
    figure: Any, bodies: Any, line: Any, tools: Sequence[Body], label: str
) -> None:
    """Bodies and tools on the left; on the right tractions over the axis along which
    the surface extends most."""
    x, u, values = bodies
    left, right = figure.subplots(1, 2)
    span = None if values.min() >= 0.0 else _span(values)
    colours = draw_field(left, x[..., :2] + u, values, norm=span)
    figure.colorbar(colours, ax=left, label=label, shrink=0.85)
    if tools:
        draw_tools(left, tools, *_box(bodies))
    left.set(xlabel="x", ylabel="y")
    at, pressure, *friction = line
    axis = int(np.argmax(np.ptp(at, axis=0))) if len(at) else 0
    right.plot(at[:, axis], pressure, ".", ms=3, color=NORMAL, label="pressure")
    for along in friction:
        right.plot(at[:, axis], along, ".", ms=3, color=TANGENTIAL, label="friction")
        right.legend()
    right.set(xlabel="xy"[axis], ylabel="contact pressure")
    right.set_ylim(bottom=min(0.0, pressure.min(initial=0.0)))


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


def _draw_space(
    figure: Any,
    bodies: Any,
    surface: Any,
    tools: Sequence[Body],
    label: str,
    view: tuple[float, float],
) -> None:
    """Bodies and tools on the left, pressure on the slave surfaces on the right."""
    x, u, values = bodies
    left = figure.add_subplot(1, 2, 1, projection="3d")
    colours = draw_surface(left, x + u, values.mean(axis=(1, 2)), *view)
    draw_wires(left, _wires(tools, bodies))
    figure.colorbar(colours, ax=left, label=label, shrink=0.7)
    X, displacement, traction = surface
    at, axes = _flat(X + displacement)
    right = figure.add_subplot(1, 2, 2)
    pressure = np.linalg.norm(traction, axis=2, keepdims=True)
    colours = draw_field(right, at, pressure, cmap=PRESSURE_MAP)
    figure.colorbar(colours, ax=right, label="contact pressure", shrink=0.85)
    right.set(xlabel=axes[0], ylabel=axes[1])


def _flat(at: Array) -> tuple[Array, str]:
    """Facets (n, k, 3) seen along the axis that is most normal to them: (n, k, 2)."""
    areas = np.cross(at[:, 1] - at[:, 0], at[:, -1] - at[:, 0])
    across = int(np.argmax(np.abs(areas).sum(axis=0)))
    kept = [axis for axis in range(3) if axis != across]
    return at[..., kept], "".join("xyz"[axis] for axis in kept)

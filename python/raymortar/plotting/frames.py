"""Data of a picture, gathered on rank 0 in the units that are shown."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx.fem import Function
from dolfinx.mesh import Mesh

from ..core import compat
from ..core.compat import Array
from ..core.discretization.facets import interpolate
from ..core.discretization.joined import parts_of
from ..core.interface.point_results import CLOSED, OPEN
from ..core.interface.zone_data import positions
from ..records.patch_columns import rigid_bodies
from ..tools import nodal_field
from .clipping import Box, within
from .gathering import gather, gather_bodies, gather_boundary, gather_cells
from .labels import AxisOptions
from .tools import curves

if TYPE_CHECKING:
    from ..core.contact import Contact

# Margin around bodies in which tools are drawn, as a share of the larger side, in 2D
# and in 3D. Wires need a larger one to show the tool's shape
MARGIN = {2: 0.15, 3: 0.4}
# Margin around the points in contact of a picture that is zoomed to them
ZOOM = 0.4
# Covered share from which a slave facet has its pressure all over
WHOLE = 1.0 - 1e-9
# Arrays of points that pictures need; `facet` is a place among all slave facets
_NAMES = "x normal contact_normal traction weight status pair facet".split()
# Names that DOLFINx gives Functions without one, and parts of Functions
_UNNAMED = r"f(_\d+)?|.*_\d+"


@dataclass
class Frame:
    """Bodies, tools and points of a picture, in the units that are shown.

    Attributes
    ----------
    bodies
        Points (n, k, 3) around polygons, displacement, and field (n, k, 1).
    slaves
        The same of slave facets; in 3D with the normal traction (n, k, 3), which is 0
        on facets that are not wholly covered, and of the covered parts of these deformed
        points (m, l, 3) around polygons, normal traction, and the facet's number.
    points
        Arrays at the integration points that meet a master.
    lines
        Curves on rigid tools, (n, d).
    box
        Corners (d,) of what is shown, if tools or a zoom cut it; else None.
    """

    bodies: list[Array]
    slaves: list[Array]
    points: dict[str, Array]
    lines: list[Array]
    box: Box | None


@dataclass(frozen=True)
class Ranges:
    """Ranges of colours that pictures have in common."""

    field: tuple[float, float]
    pressure: float

    @classmethod
    def of(cls, frames: Sequence[Frame]) -> Ranges:
        """Find the ranges of some pictures. A field begins at 0 where that is not below
        its values by more than they differ, as 300 K would be."""
        values = [frame.bodies[2] for frame in frames if frame.bodies[2].size]
        low = min((float(one.min()) for one in values), default=0.0)
        high = max((float(one.max()) for one in values), default=0.0)
        if 0.0 <= low <= 0.5 * high or low == high:
            low = min(low, 0.0)
        tractions = [traction for one in frames for traction in one.slaves[2:5:2]]
        sizes = [np.linalg.norm(t, axis=2).max(initial=0.0) for t in tractions]
        return cls((low, high), float(max(sizes, default=0.0)))


def label_of(u: Any, field: Any, label: str | None, options: AxisOptions) -> str:
    """Label of the colours of bodies, with their unit; a name that all meshes have."""
    several = field if isinstance(field, (list, tuple)) else [field]
    shown = "field" if field is not None else "displacement"
    given = parts_of(u) if field is None else several
    names = {getattr(one, "name", shown) for one in given}
    name = names.pop() if len(names) == 1 else shown
    if field is not None:
        return options.label("field", name if label is None else label)
    if shown in name:
        shown = name
    elif re.fullmatch(_UNNAMED, name) is None:
        shown = f"displacement {name}"
    return options.length(shown if label is None else label)


def gather_frame(contact: Contact, field: Any, options: AxisOptions) -> Frame | None:
    """Gather what a picture shows on rank 0; None elsewhere. Collective."""
    parts = parts_of(contact.u)
    comm: Any = contact.layout.comm
    dim = contact.u.function_space.mesh.geometry.dim
    given = list(field) if isinstance(field, (list, tuple)) else [field]
    shown = [
        _nodal(u if one is None else one, u.function_space.mesh)
        for u, one in zip(
            parts, given if len(given) == len(parts) else given * len(parts)
        )
    ]
    slave = contact.surfaces.slave_u
    facets = np.concatenate([zone.facets.slave.facets for zone in contact.zones])
    if dim == 2:
        bodies = gather_bodies(gather_cells, parts, shown)
        slaves = gather_boundary(slave.function_space.mesh, slave, facets=facets)
    else:
        traction = contact.traction("normal")
        curved = partial(gather_boundary, parts=None)
        bodies = gather_bodies(curved, parts, shown)
        mesh = slave.function_space.mesh
        slaves = curved(mesh, slave, traction, facets=facets)
        share, covered = _gather_covered(contact, traction, comm)
    points = _gather_points(contact, comm)
    if comm.rank > 0:
        return None
    if dim == 3:
        slaves[2][share < WHOLE] = 0.0
        slaves += covered
    zoomed = _contact_box(slaves, points) if options.zoom else None
    if zoomed is not None:
        bodies = within(bodies, zoomed)
    around = zoomed
    if around is None:  # a box around the deformed bodies
        at = (bodies[0][..., :dim] + bodies[1]).reshape(-1, dim)
        margin = MARGIN[dim] * np.ptp(at, axis=0).max()
        around = at.min(axis=0) - margin, at.max(axis=0) + margin
    tools = rigid_bodies(contact.zones)
    lines = [curve for tool in tools for curve in curves(tool, *around)]
    frame = Frame(bodies, slaves, points, lines, around if lines else zoomed)
    return _scaled(frame, options, "length" if field is None else "field")


def _scaled(frame: Frame, options: AxisOptions, coloured_by: str) -> Frame:
    """The frame in the units that are shown."""
    length, stress = options.factor("length"), options.factor("stress")
    for values, factor in zip(
        (*frame.bodies, *frame.slaves),
        (length, length, options.factor(coloured_by), length, length)
        + (stress, length, stress),
    ):
        values *= factor
    frame.points["x"] = frame.points["x"] * length
    frame.points["traction"] = frame.points["traction"] * stress
    frame.lines = [line * length for line in frame.lines]
    if frame.box is not None:
        frame.box = frame.box[0] * length, frame.box[1] * length
    return frame


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


def _gather_covered(
    contact: Contact, traction: Function, comm: MPI.Intracomm
) -> tuple[Any, list[Any]]:
    """Gather the covered share of slave facets, (n,), and what is covered of those that
    are so in part: deformed points (m, k, 3) around polygons, traction, and the number of
    the facet, (m,). Collective.

    In the order of the facets of all zones. Polygons with fewer points repeat their last.
    """
    segments = [zone.cpp.segments() for zone in contact.zones]
    largest = max((np.diff(s["offsets"]).max(initial=1) for s in segments), default=1)
    order = np.arange(comm.allreduce(largest, op=MPI.MAX))
    values = [f.x.array.reshape(-1, 3) for f in (contact.u, traction)]
    degree, parts = compat.element_info(traction.function_space).degree, []
    first = comm.exscan(sum(len(s["covered"]) for s in segments)) or 0
    for zone, found in zip(contact.zones, segments):
        surface, begin = zone.facets.slave_surface, found["offsets"]
        partly = np.flatnonzero(found["covered"][found["slave"]] < WHOLE)
        last = np.diff(begin)[partly, None] - 1
        xi = found["xi"][(begin[partly, None] + np.minimum(order, last)).ravel()]
        slave = np.repeat(found["slave"][partly], len(order))
        x = positions(surface, slave, xi, values[0])
        nodal = values[1][zone.result_table[slave]]
        t = interpolate(surface.shape, degree, nodal, xi)
        around = (one.reshape(-1, len(order), 3) for one in (x, t))
        parts.append([*around, first + found["slave"][partly]])
        first += len(found["covered"])
    share = gather(comm, np.concatenate([s["covered"] for s in segments]))
    return share, [gather(comm, np.concatenate(one)) for one in zip(*parts)]


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


def _contact_box(slaves: Any, points: dict[str, Array]) -> Box | None:
    """Corners of a box around the points in contact, with a margin; None without any."""
    at = points["x"][points["status"] >= CLOSED]
    if not len(at):
        return None
    ends = slaves[0][..., : at.shape[1]] + slaves[1]
    # A single point has no size, but its facet
    facet = float(np.ptp(ends, axis=1).max())
    margin = max(ZOOM * float(np.ptp(at, axis=0).max()), facet)
    return at.min(axis=0) - margin, at.max(axis=0) + margin

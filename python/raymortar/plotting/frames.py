"""Data of a picture, gathered on rank 0 in the units that are shown."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx.fem import Function
from dolfinx.mesh import Mesh

from ..core import compat
from ..core.compat import Array, Indices
from ..core.discretization.facets import (
    FACET_SHAPE,
    cell_facet_nodes,
    facets_of_mesh,
    interpolate,
    shape_functions,
)
from ..core.interface.point_results import CLOSED, OPEN
from ..core.interface.zone_data import positions
from ..paths.patch_columns import rigid_bodies
from ..tools import nodal_field
from .labels import AxisOptions
from .tools import curves

if TYPE_CHECKING:
    from ..core.contact import Contact

# Margin around bodies in which tools are drawn, as a share of the larger side, in 2D
# and in 3D. Wires need a larger one to show the tool's shape
MARGIN = {2: 0.15, 3: 0.4}
# Margin around the points in contact of a picture that is zoomed to them
ZOOM = 0.4
# Most parts of an edge of degree 2, and edges of a picture that have two parts or more
PARTS, EDGES = 8, 12_000
# Covered share from which a slave facet has its pressure all over
WHOLE = 1.0 - 1e-9
# Arrays of points that pictures need; `facet` is a place among all slave facets
_NAMES = "x normal contact_normal traction weight status pair facet".split()
# Names that DOLFINx gives Functions without one, and parts of Functions
_UNNAMED = r"f(_\d+)?|.*_\d+"

Box = tuple[Array, Array]


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


def label_of(u: Function, field: Any, label: str | None, options: AxisOptions) -> str:
    """Label of the colours of bodies, with their unit."""
    if field is None:
        shown = "displacement"
        if shown in u.name:
            shown = u.name
        elif re.fullmatch(_UNNAMED, u.name) is None:
            shown = f"displacement {u.name}"
        return options.length(shown if label is None else label)
    shown = getattr(field, "name", "field") if label is None else label
    return options.label("field", shown)


def gather_frame(contact: Contact, field: Any, options: AxisOptions) -> Frame | None:
    """Gather what a picture shows on rank 0; None elsewhere. Collective."""
    u = contact.unknowns.only.u
    mesh = u.function_space.mesh
    comm, dim = mesh.comm, mesh.geometry.dim
    shown = _nodal(u if field is None else field, mesh)
    facets = np.concatenate([zone.facets.slave.facets for zone in contact.zones])
    if dim == 2:
        bodies = gather_cells(mesh, u, shown)
        slaves = gather_boundary(mesh, u, facets=facets)
    else:
        parts, traction = _parts(mesh, u), contact.traction("normal")
        bodies = gather_boundary(mesh, u, shown, parts=parts)
        slaves = gather_boundary(mesh, u, traction, facets=facets, parts=parts)
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
    values = [f.x.array.reshape(-1, 3) for f in (contact.unknowns.only.u, traction)]
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


def within(bodies: Any, box: Box) -> list[Array]:
    """The polygons that reach into a box; in 3D what of them is in it, where polygons
    with fewer points repeat their last. Axes cut those of a plane."""
    x, u, _ = bodies
    at = x[..., : u.shape[-1]] + u
    reaches = ((at.max(axis=1) >= box[0]) & (at.min(axis=1) <= box[1])).all(axis=1)
    chosen = [values[reaches] for values in bodies]
    if u.shape[-1] == 2:
        return chosen
    rows = np.concatenate([at[reaches], *chosen], axis=2)
    parts = [part for one in rows if len(part := _clipped(one, box)) > 2]
    width = max(map(len, parts), default=3)
    order = [np.minimum(np.arange(width), len(part) - 1) for part in parts]
    cut = [part[k] for part, k in zip(parts, order)]
    found = np.array(cut).reshape(-1, width, rows.shape[2])
    return np.split(found[..., 3:], [3, 6], axis=2)


def _clipped(rows: Array, box: Box) -> Array:
    """Clip a polygon to a box: rows begin with its points, and are interpolated."""
    for sign, corner in zip((1.0, -1.0), box):
        for axis, bound in enumerate(corner):
            depth = sign * (rows[:, axis] - bound)
            if (depth >= 0.0).all():
                continue
            kept: list[Array] = []
            for k in range(len(rows)):
                if (depth[k - 1] < 0.0) != (depth[k] < 0.0):
                    share = depth[k - 1] / (depth[k - 1] - depth[k])
                    kept.append(rows[k - 1] + share * (rows[k] - rows[k - 1]))
                if depth[k] >= 0.0:
                    kept.append(rows[k])
            if not kept:
                return rows[:0]
            rows = np.array(kept)
    return rows


# Meshes and fields on rank 0

# Nodes of a polygon of degree 2 in the order around it; every other one is a corner
_AROUND = {
    "interval": [0, 2, 1],
    "triangle": [0, 5, 1, 3, 2, 4],
    "quadrilateral": [0, 4, 1, 6, 3, 7, 2, 5],
}


def gather(comm: MPI.Comm, array: Array) -> Array | None:
    """Join the rows of all ranks on rank 0; None on other ranks. Collective."""
    parts = comm.gather(array, root=0)
    return None if parts is None else np.concatenate(parts)


def _degree(V: Any) -> int:
    """Degree to which pictures show functions of a space, 1 or 2."""
    return 2 if compat.element_info(V).degree == 2 else 1


def _parts(mesh: Mesh, *functions: Function) -> int:
    """Find into how many parts edges are split, so that those of degree 2 look curved."""
    degrees = [_degree(f.function_space) for f in functions]
    if max(compat.geometry_degree(mesh), *degrees) == 1:
        return 1
    cells = mesh.topology.index_map(mesh.topology.dim).size_global
    return int(np.clip(EDGES // (4 * cells), 2, PARTS))


def _outline(corners: int, degree: int, parts: int) -> Array:
    """Shape functions at the points around a polygon, (points, nodes around it)."""
    if corners == 2:
        return np.eye(2)
    t = np.arange(parts)[:, None] / parts
    begin, end, *middle = shape_functions("interval", degree, t)[0].T
    table = np.zeros((corners, parts, corners * degree))
    for k in range(corners):
        for j, values in enumerate([begin, *middle, end]):
            table[k, :, (degree * k + j) % (corners * degree)] = values
    return table.reshape(corners * parts, -1)


def _gather_around(
    mesh: Mesh,
    shape: str,
    cells: Indices,
    nodes_of: Callable[[int], Indices],
    functions: tuple[Any, ...],
    parts: int,
) -> list[Any]:
    """Points (n, k, 3) around polygons of a shape and values of functions, on rank 0.

    The nodes of cells around each polygon are those of a degree.
    """
    x, degree = mesh.geometry.x, compat.geometry_degree(mesh)
    sources = [(x, compat.geometry_dofmap(mesh), degree)]
    for f in functions:
        V = f.function_space
        values = f.x.array.reshape(-1, V.dofmap.index_map_bs)
        sources.append((values, compat.dofmap_array(V), _degree(V)))
    found, around = [], _AROUND[shape]
    for values, dofs, degree in sources:
        degree = 1 if parts == 1 or shape == "interval" else degree
        order = around[:: 3 - degree]
        at = values[dofs[cells[:, None], nodes_of(degree)[:, order]]]
        table = _outline(len(around[::2]), degree, parts)
        found.append(gather(mesh.comm, np.einsum("pa,nac->npc", table, at)))
    return found


def gather_cells(
    mesh: Mesh, *functions: Function, parts: int | None = None
) -> list[Any]:
    """Cells of a 2D mesh as polygons, with functions around them. Collective.

    The first function, if any, is the displacement: edges have several parts if it or
    the mesh is of degree 2, unless a number is given. On rank 0 points (n, k, 3) in
    order around the cell, and an array (n, k, components) for each continuous Lagrange
    function; None elsewhere.
    """
    parts = _parts(mesh, *functions[:1]) if parts is None else parts
    cells = np.arange(compat.owned_cells(mesh), dtype=np.int32)
    shape = compat.cell_name(mesh)
    nodes = np.arange(len(_AROUND[shape]))[None]
    return _gather_around(mesh, shape, cells, lambda degree: nodes, functions, parts)


def gather_boundary(
    mesh: Mesh,
    *functions: Function,
    facets: Indices | None = None,
    parts: int = 1,
) -> list[Any]:
    """Exterior facets of a mesh, or given ones of this rank, as `gather_cells`.

    Collective. Edges have a number of parts. In 2D polygons are ends.
    """
    chosen = compat.exterior_facets(mesh) if facets is None else facets
    found = facets_of_mesh(mesh, -1, chosen)
    # The owner of a facet's cell sends the facet: each facet comes once
    own = found.some(found.cells < compat.owned_cells(mesh))
    cell = compat.cell_name(mesh)

    def nodes_of(degree: int) -> Indices:
        return cell_facet_nodes(cell, degree)[own.local_facets]

    shape = FACET_SHAPE[cell]
    return _gather_around(mesh, shape, own.cells, nodes_of, functions, parts)

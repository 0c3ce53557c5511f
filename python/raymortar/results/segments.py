"""Segments and integration points as VTK files, one piece per rank.

Segments are polygons of no mesh, which DOLFINx cannot write. docs/developers.md says why
neither meshio nor VTK does it here. The format is ascii XML:
https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ElementTree, SubElement

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from ..arguments import writing
from ..core.compat import Array
from ..core.errors import ContactError
from ..core.interface.point_results import OPEN
from ..core.interface.zone_data import ZoneData, positions
from .tractions import seen_points

POINT_DATA = ("gap", "pressure", "traction", "status", "weight", "slip")
# VTK's numbers of cell types
VERTEX, LINE, POLYGON = 1, 3, 7


# Points of the cells one after the other, how many each cell has, arrays over cells
Cells = tuple[Array, Any, dict[str, Any]]


def write_segments(
    zones: Sequence[ZoneData], u: Function, comm: MPI.Comm, path: Path
) -> None:
    """Write the segments to a file and the points beside it. Collective."""
    if path.suffix != ".vtu":
        raise ContactError(f"{path} must end in .vtu")
    kind = LINE if zones[0].facets.slave_surface.gdim == 2 else POLYGON
    _write(path, kind, [_segments(zone, u) for zone in zones], comm)
    beside = path.with_name(f"{path.stem}_points{path.suffix}")
    _write(beside, VERTEX, [_points(zone) for zone in zones], comm)


def _segments(zone: ZoneData, u: Function) -> Cells:
    """Make polygons of a zone's segments, in 2D lines."""
    segments, surface = zone.cpp.segments(), zone.facets.slave_surface
    sizes, slave, xi = np.diff(segments["offsets"]), segments["slave"], segments["xi"]
    x = positions(
        surface, np.repeat(slave, sizes), xi, u.x.array.reshape(-1, surface.gdim)
    )
    ids = np.asarray(surface.facet_ids[slave], dtype=np.int64)
    data: dict[str, Any] = {"slave_facet": ids} | _averages(seen_points(zone), segments)
    return x, sizes, data


def _averages(points: dict[str, Array], segments: dict[str, Array]) -> dict[str, Array]:
    """Average over the points of each segment's pair of facets; NaN without a hit."""
    hit, n = points["status"] >= OPEN, len(segments["slave"])
    sides = ("slave", "master")
    keys = [np.concatenate([segments[side], points[side][hit]]) for side in sides]
    _, pair = np.unique(np.stack(keys, axis=1), axis=0, return_inverse=True)
    segment, pair = np.split(pair.reshape(-1), [n])
    weight = points["weight"][hit]
    total = np.bincount(pair, weight, minlength=n + len(pair))
    found = {}
    for name in ("gap", "pressure", "traction"):
        values = points[name][hit]
        sums = np.zeros((len(total), *values.shape[1:]))
        np.add.at(sums.T, (..., pair), weight * values.T)
        with np.errstate(invalid="ignore"):
            found[name] = (sums.T / total).T[segment]
    return found


def _points(zone: ZoneData) -> Cells:
    """Make vertices of a zone's integration points."""
    points = seen_points(zone)
    data = {name: points[name] for name in POINT_DATA if name in points}
    data["status"] = data["status"].astype(np.int64)
    return points["x"], np.ones(len(points["x"]), dtype=int), data


def _joined(parts: Sequence[Cells], name: str) -> Any:
    """Join the data of one name; a zone that lacks it, as slip, has NaN."""
    width = next(data[name].shape[1:] for *_, data in parts if name in data)
    lacking = (
        (data, np.full((len(sizes), *width), np.nan)) for _, sizes, data in parts
    )
    return np.concatenate([data.get(name, nothing) for data, nothing in lacking])


def _write(path: Path, kind: int, parts: Sequence[Cells], comm: MPI.Comm) -> None:
    """Write this rank's cells and, with several ranks, what joins them. Collective."""
    points, sizes = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    names = dict.fromkeys(name for *_, data in parts for name in data)
    topology = {
        "connectivity": np.arange(len(points)),
        "offsets": np.cumsum(sizes),
        "types": np.full(len(sizes), kind),
    }
    groups = {
        "Points": {"Points": points},
        "Cells": topology,
        "CellData": {name: _joined(parts, name) for name in names},
    }
    files = [f"{path.stem}_{rank}.vtu" for rank in range(comm.size)]
    own = path if comm.size == 1 else path.with_name(files[comm.rank])
    with writing(comm, path, OSError):
        root, grid = _document("UnstructuredGrid")
        counts = {"NumberOfPoints": len(points), "NumberOfCells": len(sizes)}
        texts = {name: str(count) for name, count in counts.items()}
        _add(SubElement(grid, "Piece", texts), groups)
        ElementTree(root).write(own, encoding="utf-8", xml_declaration=True)
        if comm.size > 1 and comm.rank == 0:
            root, grid = _document("PUnstructuredGrid", GhostLevel="0")
            del groups["Cells"]
            _add(grid, groups, "P")
            for file in files:
                SubElement(grid, "Piece", Source=file)
            joining = path.with_suffix(".pvtu")
            ElementTree(root).write(joining, encoding="utf-8", xml_declaration=True)


def _document(kind: str, **attributes: str) -> tuple[Element, Element]:
    """Begin a document: its root, and the grid in it."""
    root = Element("VTKFile", type=kind, version="1.0", byte_order="LittleEndian")
    return root, SubElement(root, kind, attributes)


def _add(
    parent: Element, groups: Mapping[str, Mapping[str, Any]], prefix: str = ""
) -> None:
    """Add arrays by group and name; with the prefix of joining files no values."""
    for group, arrays in groups.items():
        inside = SubElement(parent, prefix + group)
        for name, values in arrays.items():
            kind = "Int64" if values.dtype.kind in "iu" else "Float64"
            # VTK wants vectors of three components
            width = "1" if values.ndim == 1 else "3"
            attributes = {"type": kind, "Name": name, "NumberOfComponents": width}
            array = SubElement(inside, f"{prefix}DataArray", attributes)
            if not prefix:
                rows = values if values.ndim == 2 else values[:, None]
                rows = np.pad(rows, ((0, 0), (0, int(width) - rows.shape[1])))
                array.set("format", "ascii")
                array.text = "\n".join(
                    " ".join(map(repr, row)) for row in rows.tolist()
                )

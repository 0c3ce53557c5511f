"""Segments and integration points as VTK files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from ..compat import Array
from ..host.reference_facets import shape_functions
from ..interface.point_results import OPEN
from ..interface.zone_data import ZoneData
from . import vtu

POINT_DATA = ("gap", "pressure", "traction", "status", "weight", "slip")


def deformed(zone: ZoneData, u: Function, slave: Array, xi: Array) -> Array:
    """Deformed positions of points on slave facets.

    Parameters
    ----------
    zone
        Zone.
    u
        Displacement.
    slave
        Facet of each point, (n,).
    xi
        Reference coordinates on it, (n, d - 1).

    Returns
    -------
    Positions (n, d). Length.
    """
    s = zone.facets.slave_surface
    values = u.x.array.reshape(-1, s.gdim)[s.dofs]
    N, _ = shape_functions(s.shape, s.node_degree, xi)
    M, _ = shape_functions(s.shape, s.displacement_degree, xi)
    X = np.einsum("qa,qad->qd", N, s.X[s.facet_nodes[slave]])
    return X + np.einsum("qa,qad->qd", M, values[s.facet_dofs[slave]])


def _averages(points: dict[str, Array], segments: dict[str, Array]) -> dict[str, Array]:
    """Gap, pressure and traction of each segment: means over the points of its pair."""
    hit = points["status"] >= OPEN
    keys = np.stack([points["slave"][hit], points["master"][hit]], axis=1)
    pairs, pair = np.unique(keys, axis=0, return_inverse=True)
    pair = pair.ravel()
    total = np.zeros(len(pairs))
    np.add.at(total, pair, points["weight"][hit])
    own = {tuple(p): k for k, p in enumerate(pairs.tolist())}
    index = [
        own.get(key, -1)
        for key in zip(segments["slave"].tolist(), segments["master"].tolist())
    ]
    found = {}
    for name in ("gap", "pressure", "traction"):
        values = points[name][hit]
        shape = (len(pairs) + 1, *values.shape[1:])
        mean = np.full(shape, np.nan)  # the last for segments without a hit
        mean[:-1] = 0.0
        weight = points["weight"][hit].reshape(-1, *[1] * (values.ndim - 1))
        np.add.at(mean, pair, weight * values)
        mean[:-1] /= total.reshape(-1, *[1] * (values.ndim - 1))
        found[name] = mean[index]
    return found


def _polygons(zone: ZoneData, u: Function) -> vtu.Piece:
    s = zone.cpp.segments()
    sizes = np.diff(s["offsets"])
    facet = np.repeat(s["slave"], sizes)
    ids = zone.facets.slave_surface.facet_ids
    data: dict[str, Any] = {
        "slave_facet": np.asarray(ids[s["slave"]], dtype=np.int64),
        **_averages(zone.points(), s),
    }
    kind = vtu.LINE if zone.facets.slave_surface.gdim == 2 else vtu.POLYGON
    return vtu.Piece(deformed(zone, u, facet, s["xi"]), s["offsets"], kind, data)


def _points(zone: ZoneData) -> vtu.Piece:
    points = zone.points()
    data = {name: points[name] for name in POINT_DATA if name in points}
    data["status"] = data["status"].astype(np.int64)
    offsets = np.arange(len(points["x"]) + 1)
    return vtu.Piece(points["x"], offsets, vtu.VERTEX, data)


def _joined(pieces: list[vtu.Piece]) -> vtu.Piece:
    """Join several zones' pieces; data that a zone lacks is NaN there."""
    sizes = np.concatenate([np.diff(p.offsets) for p in pieces])
    names = dict.fromkeys(name for p in pieces for name in p.cell_data)
    return vtu.Piece(
        np.concatenate([p.points for p in pieces]),
        np.concatenate([[0], np.cumsum(sizes)]),
        pieces[0].cell_type,
        {name: _values(pieces, name) for name in names},
    )


def _values(pieces: list[vtu.Piece], name: str) -> Array:
    """Concatenate the data of one name. Slip, say, is known with friction only."""
    shape = next(p.cell_data[name].shape[1:] for p in pieces if name in p.cell_data)
    missing = [np.full((len(p.offsets) - 1, *shape), np.nan) for p in pieces]
    return np.concatenate([p.cell_data.get(name, m) for p, m in zip(pieces, missing)])


def write_segments(
    zones: list[ZoneData], u: Function, comm: MPI.Comm, path: Path
) -> None:
    """Write the segments to a file and the points beside it. Collective.

    Parameters
    ----------
    zones
        Zones.
    u
        Displacement.
    comm
        Communicator of the mesh.
    path
        Of the segments, ending in ``.vtu``.
    """
    vtu.write(path, _joined([_polygons(zone, u) for zone in zones]), comm)
    points = path.with_name(f"{path.stem}_points{path.suffix}")
    vtu.write(points, _joined([_points(zone) for zone in zones]), comm)

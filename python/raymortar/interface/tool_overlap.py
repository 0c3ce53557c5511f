"""Rigid tools that slaves start in, and what that has in common with meshes."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

from mpi4py import MPI

import numpy as np

from ..compat import Array
from ..discretization.facets import format_point
from ..discretization.ranks import largest
from ..discretization.reference_facets import interpolate
from ..discretization.surfaces import facet_lengths
from ..errors import ContactWarning
from ..rigid.body import Body
from ..rigid.surface import Surface
from .pairs import Pair, spoken
from .point_results import OPEN
from .straight_facets import largest_sagitta
from .zone_data import ZoneData

# Depths that differ by less than this share are the same, but for rounding
ALIKE = 1e-9
# Motion of a body that nobody has moved
_UNMOVED = np.concatenate([np.zeros(6), np.eye(3).ravel()])
_REMEDY = (
    "before anything has moved: make the tool where it touches and let it move in steps, "
    "or give an interference that is wanted as the argument offset"
)


def warn_of_tools(
    zone: ZoneData, pairs: Sequence[Pair], noise: float, comm: MPI.Comm
) -> None:
    """Warn of rigid tools in which a slave starts, with depth and place. Collective.

    Parameters
    ----------
    zone
        Undeformed slave surface, which has been paired.
    pairs
        Its pairs. Tools that `move` has moved are where the user wants them.
    noise
        Share of a facet's size, and of the thickness behind it, that counts as none.
    """
    points, side = zone.points(), zone.sides[0]
    x, n = (
        np.ascontiguousarray(np.pad(points[name], ((0, 0), (0, 3 - side.gdim))))
        for name in ("x", "normal")
    )
    chords = largest_sagitta(side, comm) if side.is_straight else 0.0
    allowed = noise * np.minimum(facet_lengths(side), zone.thickness[0]) + chords
    # An overlap that a clearance undoes is none, nor is an interference that is wanted
    added = at_points(zone, zone.adjustment, points)
    added = added + np.maximum(at_points(zone, zone.offset, points), 0.0)
    for pair in pairs:
        body = pair.master
        if not isinstance(body, Body) or not np.array_equal(body.motion(), _UNMOVED):
            continue
        depth = -(body.tool.distances_along(x, n) + added)
        depth[depth <= allowed[points["slave"]]] = 0.0
        if isinstance(body.shape, Surface):  # has no inside
            depth[points["status"] < OPEN] = 0.0
        most = largest(comm, depth)
        if most > 0.0:
            place = deepest(points["x"], depth, most, comm)
            slave = spoken(pair.slave_name, pair.slave)
            warnings.warn(
                f"slave {slave} starts {most:.3g} deep in the rigid {body.name} at "
                f"{place}, {_REMEDY}",
                ContactWarning,
                stacklevel=5,
            )


def deepest(x: Array, depth: Array, most: float, comm: MPI.Comm) -> str:
    """Place of the deepest point, chosen alike on any number of ranks. Collective."""
    at = x[depth >= (1.0 - ALIKE) * most].tolist()
    return format_point(np.array(max(sum(comm.allgather(at), []))))


def at_points(zone: ZoneData, nodal: Array | None, points: dict[str, Array]) -> Array:
    """Values at points of what has nodal values on the slave facets; 0 for None."""
    if nodal is None:
        return np.zeros(len(points["xi"]))
    surface = zone.facets.slave_surface
    degree = surface.displacement_degree
    values = nodal[points["slave"]]
    return np.asarray(interpolate(surface.shape, degree, values, points["xi"]))

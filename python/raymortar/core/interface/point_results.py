"""Statuses and pressures at points, and averages of values there at nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import IntEnum
from typing import Any

import numpy as np
from dolfinx.fem import Function

from .. import compat
from ..compat import Array, Indices
from ..discretization.facets import facet_nodes, interpolate, shape_functions
from ..discretization.ranks import sums_at
from ..discretization.surfaces import Surface
from .zone_data import ZoneData


class Status(IntEnum):
    """Status of an integration point or of a slave node, in results and in files.

    >>> slips = points["status"] == Status.SLIP
    """

    NO_HIT = 0
    """No master is in reach: see ``contact.results.coverage()`` too. Of a point also where it
    stands for an uncovered part of a facet; of a node also off the slave."""
    OPEN = 1
    """A master is in reach, and not touched."""
    STICK = 2
    """In contact, without slip in this step."""
    SLIP = 3
    """In contact, and slips; without friction all that is in contact."""


# Takes the arrays over the points of a zone
OfPoints = Callable[[dict[str, Array]], Any]
# Plain numbers; from CLOSED on a point is in contact
OPEN, CLOSED = int(Status.OPEN), int(Status.STICK)


def pressures(points: dict[str, Array]) -> Array:
    """Find the normal tractions at the points, positive in compression, (n,)."""
    return -np.einsum("qi,qi->q", points["traction"], points["contact_normal"])


# From nodes of a slave surface to its points, and back


def undeformed(surface: Surface, facet: Any, xi: Array) -> Array:
    """Find undeformed positions of points on facets, (n, d). Length."""
    X = surface.X[surface.facet_nodes[facet]]
    return interpolate(surface.shape, surface.node_degree, X, xi)


def accumulated_slip(zone: ZoneData, facet: Any, xi: Array) -> Array:
    """Interpolate the slip of all accepted steps at points, (n,). Length."""
    assert zone.slip is not None
    degree = compat.element_info(zone.slip.function_space).degree
    nodal = zone.slip.x.array[zone.result_table[facet]]
    # Polynomials of degree 2 may fall below zero between their nodes
    shape = zone.facets.slave_surface.shape
    return np.maximum(interpolate(shape, degree, nodal, xi), 0.0)


def nodal_average(
    zones: Sequence[ZoneData],
    quantity: OfPoints,
    field: Function,
    hits_only: bool = True,
) -> None:
    """Average a point quantity around each slave node; NaN elsewhere. Collective.

    Points weigh by their area times the square of the node's shape function, which
    is positive and largest next to the node. `quantity` gives values (n,) or (n, d)
    from the points of a zone; those without a hit are left out, if asked.
    """
    V, shares = field.function_space, []
    bs, degree = V.dofmap.index_map_bs, compat.element_info(V).degree
    for zone in zones:
        points = zone.points()
        hit = points["status"] >= (OPEN if hits_only else 0)
        values = quantity(points)[hit].astype(np.float64).reshape(-1, 1, bs)
        shape = zone.facets.slave_surface.shape
        N, _ = shape_functions(shape, degree, points["xi"][hit])
        w = (points["weight"][hit, None] * N**2)[..., None]
        dofs = zone.result_table[points["slave"][hit]]
        shares.append((dofs, np.concatenate([w, w * values], axis=2)))
    sums = sums_at(V.dofmap.index_map, bs + 1, *shares)
    with np.errstate(invalid="ignore", divide="ignore"):
        field.x.array[:] = (sums[:, 1:] / sums[:, :1]).ravel()


def one_of_each(zone: ZoneData) -> tuple[Indices, Indices]:
    """Find a facet of each node, and the number that the node has there, (nodes,)."""
    table = zone.multiplier_table
    _, first = np.unique(table, return_index=True)
    facet, number = np.divmod(first, max(table.shape[1], 1))
    return facet.astype(np.int32), number.astype(np.int32)


def nodes(zone: ZoneData) -> dict[str, Any]:
    """Arrays over the nodes of a zone: the law's results, a facet and place of each."""
    found: dict[str, Any] = zone.nodes()
    facet, number = one_of_each(zone)
    places = facet_nodes(zone.facets.slave_surface.shape, zone.multiplier_degree)
    return found | {"slave": facet, "xi": places[number]}


def set_at_nodes(
    zones: Sequence[ZoneData],
    quantity: Callable[[ZoneData], Any],
    field: Function,
) -> None:
    """Set a field of the multiplier's degree at all nodes; zero elsewhere. Collective.

    `quantity` gives values (nodes,) or (nodes, d) of a zone. Zones and ranks that share
    a node have the same value there.
    """
    dofmap, shares = field.function_space.dofmap, []
    for zone in zones:
        values = np.asarray(quantity(zone), dtype=np.float64)
        values = values.reshape(-1, dofmap.index_map_bs)
        dofs = zone.result_table[one_of_each(zone)]
        shares.append((dofs, np.hstack([np.ones((len(values), 1)), values])))
    sums = sums_at(dofmap.index_map, dofmap.index_map_bs + 1, *shares)
    field.x.array[:] = (sums[:, 1:] / np.maximum(sums[:, :1], 1.0)).ravel()

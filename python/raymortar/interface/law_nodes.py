"""Results of a law at nodes: a row for each multiplier node of a zone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from dolfinx.fem import Function

from ..compat import Array, Indices
from ..discretization.ranks import sums_at
from ..discretization.reference_facets import facet_nodes
from .zone_data import ZoneData


def one_of_each(zone: ZoneData) -> tuple[Indices, Indices]:
    """Find a facet of each node, and the number that the node has there, (nodes,)."""
    table = zone.multiplier_table
    _, first = np.unique(table, return_index=True)
    facet, number = np.divmod(first, max(table.shape[1], 1))
    return facet.astype(np.int32), number.astype(np.int32)


def nodes(zone: ZoneData) -> dict[str, Any]:
    """Arrays over the nodes of a zone: the law's results, a facet and place of each."""
    found: dict[str, Any] = zone.cpp.nodes()
    facet, number = one_of_each(zone)
    places = facet_nodes(zone.facets.slave_surface.shape, zone.multiplier_degree)
    return found | {"slave": facet, "xi": places[number]}


def set_at_nodes(
    zones: Sequence[ZoneData],
    quantity: Callable[[dict[str, Array]], Any],
    field: Function,
) -> None:
    """Set a scalar field of the multiplier's degree at all nodes; NaN elsewhere.
    Collective.

    Zones and ranks that share a node have the same value there.
    """
    shares = []
    for zone in zones:
        values = np.asarray(quantity(nodes(zone)), dtype=np.float64)
        dofs = zone.result_table[one_of_each(zone)]
        shares.append((dofs, np.stack([np.ones_like(values), values], axis=1)))
    sums = sums_at(field.function_space.dofmap.index_map, 2, *shares)
    with np.errstate(invalid="ignore", divide="ignore"):
        field.x.array[:] = sums[:, 1] / sums[:, 0]

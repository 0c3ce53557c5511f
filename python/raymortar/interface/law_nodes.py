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


def tractions(zone: ZoneData, multiplier: Function) -> dict[str, Any]:
    """Add each node's traction and the normal of its law's frame, (nodes, d), to `nodes`."""
    found = nodes(zone)
    normal, components = found["normal"], multiplier.function_space.dofmap.index_map_bs
    lam = multiplier.x.array.reshape(-1, components)[zone.multiplier_nodes]
    traction = lam if components > 1 else lam * normal
    return found | {"traction": traction, "contact_normal": normal}


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

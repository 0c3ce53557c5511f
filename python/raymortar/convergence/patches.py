"""Connected patches of a contact's slave surfaces: groups of rows in `balance`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .. import compat
from ..compat import Array
from ..host.bodies import find_parts
from ..host.facet_areas import surface_normals
from ..host.marks import marked_everywhere
from ..host.reference_facets import shape_functions

if TYPE_CHECKING:
    from ..contact import Contact


class Patches:
    """Patches of a contact's multiplier; a penalty has none. Collective.

    Parameters
    ----------
    contact
        A lone contact.
    first
        Number of the first patch among the groups of `balance.Groups`.

    Attributes
    ----------
    count
        Number of patches.
    of_row
        Group of each owned row of the multiplier, (rows,).
    of_node
        Group of each local block dof of the multiplier, -1 where there is none.
    mass
        int N_a dG of each owned row, (rows,). Area.
    """

    def __init__(self, contact: Contact, first: int) -> None:
        self.contact, self._first = contact, first
        self.of_row = self.of_node = np.empty(0, dtype=np.int32)
        self.count, self.mass = 0, np.empty(0)
        if contact.multiplier is None:
            return
        layout, W = contact.layout, contact.multiplier.function_space
        table = np.concatenate([zone.multiplier_table for zone in contact.zones])
        used = marked_everywhere(W, np.unique(table))
        index_map = W.dofmap.index_map
        found, self.count = find_parts(layout.comm, index_map, table, used)
        self.of_node = np.where(found < 0, found, found + first).astype(np.int32)
        c = layout.components
        self.of_row = np.repeat(self.of_node[layout.owned_multipliers], c)
        self.mass = np.repeat(lumped_area(contact), c)

    @property
    def groups(self) -> slice:
        """The patches among all groups."""
        return slice(self._first, self._first + self.count)

    def places(self) -> Array:
        """Position of each owned row, (rows, 3)."""
        if self.contact.multiplier is None:
            return np.empty((0, 3))
        layout, W = self.contact.layout, self.contact.multiplier.function_space
        X = W.tabulate_dof_coordinates()[layout.owned_multipliers]
        return np.repeat(X, layout.components, axis=0)


def lumped_area(contact: Contact) -> Array:
    """int N_a dG at the multiplier's owned dofs, over the undeformed facets, whether or
    not rays hit. Collective."""
    assert contact.multiplier is not None
    W = contact.multiplier.function_space
    degree = compat.element_info(W).degree
    lumped = compat.create_la_vector(W.dofmap.index_map, 1)
    for zone in contact.zones:
        surface = zone.facets.slave_surface
        points, weights, m = surface_normals(surface)
        areas = np.linalg.norm(m, axis=-1) * weights
        N, _ = shape_functions(surface.shape, degree, points)
        np.add.at(lumped.array, zone.multiplier_table, areas @ N)
    compat.scatter_reverse_add(lumped)
    return lumped.array[contact.layout.owned_multipliers]

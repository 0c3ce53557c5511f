"""Lengths that are added to gaps: clearances, interferences, adjustments that make
surfaces touch which their meshes hold apart, and tractions of an exact penalty."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from dolfinx.fem import Function

from .. import compat
from ..compat import Array
from ..discretization.facets import facet_nodes, shape_functions
from ..discretization.ranks import largest
from ..discretization.slave_fields import OFFSET, FieldValue, check_field, on_facets
from ..errors import require_agreement, together, warn
from ..hooks import hooks
from .contact_surfaces import ContactSurfaces
from .point_results import nodal_average
from .zone_data import ZoneData, mean_facet_size

# Change of a gap, over the mean size of facets, from which on gaps are closed
CLOSED_WITHIN = 1e-4
# Gaps above this tell that no solver has repeated the solves of an accepted step
OPEN_WITHIN = 1e-3
# Solves of one step after the first one
MOST_AUGMENTATIONS = 20


class Offsets:
    """Sets offset and adjustments of the zones of a contact. Collective.

    `value` is the offset as it was given, `excess` a message on an interference for
    which no body is thick enough, else None.
    """

    def __init__(self, surfaces: ContactSurfaces) -> None:
        self._surfaces, self._zones = surfaces, surfaces.zones
        self.value: FieldValue | None = None
        self.excess: str | None = None

    def set(self, offset: FieldValue) -> None:
        """Set what is added to the gap; see `Contact.set_offset`."""
        comm = self._surfaces.comm
        with together(comm):
            check_field(OFFSET, offset, self._surfaces.slave_u.function_space.mesh)
        require_agreement(comm, offset=offset)
        nodal = [on_facets(OFFSET, offset, zone.facets, comm) for zone in self._zones]
        for zone, values in zip(self._zones, nodal):
            zone.offset = values
        self.value = offset
        before, self.excess = self.excess, hooks.excess(self._surfaces)
        if self.excess is not None and before is None:
            warn(self.excess)
        for zone in self._zones:
            zone.send_offset()


# Corrections after a solve


class Correction(Protocol):
    """Lengths at nodes that are added to gaps, until a solve agrees with them."""

    def renew(self) -> float | None:
        """Change gaps by what a solve has found; None where both agree. Collective."""


class Augmentation:
    """Keeps accepted tractions of a penalty, over its coefficient [theory (4.32)].

    They are lengths at the slave nodes, which are added to gaps.
    """

    def __init__(self, zones: Sequence[ZoneData], scalar: Any) -> None:
        self._zones, self._comm = zones, zones[0].comm
        self._values = Function(scalar, name="augmentation")
        self._size, self._has_warned = mean_facet_size(zones), False

    @property
    def array(self) -> Array:
        """Lengths at this rank's nodes."""
        return self._values.x.array

    def set(self, values: Array) -> None:
        """Set the lengths, and add them to gaps."""
        self.array[:] = values
        degree = compat.element_info(self._values.function_space).degree
        for zone in self._zones:
            surface = zone.facets.slave_surface
            at = facet_nodes(surface.shape, surface.displacement_degree)
            N, _ = shape_functions(surface.shape, degree, at)
            zone.augmentation = self.array[zone.result_table] @ N.T
            zone.send_offset()

    def renew(self) -> float | None:
        """Take over the present tractions. Collective.

        Returns the largest change of a gap over the size of facets, and changes nothing
        where gaps are closed: then it returns None.
        """
        values, change = self._next()
        if change <= CLOSED_WITHIN:
            return None
        self.set(values)
        return change

    def _next(self) -> tuple[Array, float]:
        """Find the present tractions, and the change of a gap that they make."""
        found = Function(self._values.function_space)
        nodal_average(self._zones, lambda p: -p["pressure"] / p["gamma"], found)
        # No point around the node has a hit
        values = np.nan_to_num(found.x.array)
        change = largest(self._comm, np.abs(values - self.array)) / self._size
        return values, float(change)

    def warn_of_gaps(self) -> None:
        """Warn once where nobody has repeated the solves of an accepted step. Collective."""
        if self._has_warned:
            return
        change = self._next()[1]
        if change > OPEN_WITHIN:
            self._has_warned = True
            warn(
                f"an exact penalty has left gaps of {change:.1e} of a facet: solvers of "
                "raymortar alone repeat a solve until they close",
                page="use",
            )


def augmented(parts: Sequence[Any]) -> float:
    """Augment contacts with an exact penalty; 0 if all gaps are closed. Collective.

    Returns the largest change of a gap over the size of facets.
    """
    changes = [part.present.augment() for part in parts]
    return max([0.0, *(change for change in changes if change is not None)])

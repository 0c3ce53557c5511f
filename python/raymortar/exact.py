"""Tractions of an exact penalty, which close the gaps that it leaves."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from dolfinx.fem import Function

from .core import compat
from .core.compat import Array
from .core.discretization.facets import facet_nodes, shape_functions
from .core.discretization.ranks import largest
from .core.errors import warn
from .core.interface.contact_surfaces import ContactSurfaces
from .core.interface.point_results import nodal_average
from .core.interface.present import Follower
from .core.interface.zone_data import mean_facet_size
from .core.state import Quantity

# Change of a gap, over the mean size of facets, from which on gaps are closed
CLOSED_WITHIN = 1e-4
# Gaps above this tell that no solver has repeated the solves of an accepted step
OPEN_WITHIN = 1e-3


class Augmentation(Follower):
    """Keeps accepted tractions of a penalty, over its coefficient [theory (4.32)].

    They are lengths at the slave nodes, which are added to gaps.
    """

    is_added = False  # the method needs it

    def __init__(self, surfaces: ContactSurfaces) -> None:
        self._zones, self._comm = surfaces.zones, surfaces.comm
        self._values = Function(surfaces.scalar, name="augmentation")
        self._size = mean_facet_size(self._zones)
        self._is_paired = self._has_warned = False

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

    def bring(self) -> None:
        """Note that there are pairs."""
        self._is_paired = True

    def quantities(self) -> Iterator[Quantity]:
        """Yield the lengths."""
        space = self._values.function_space
        yield Quantity("augmentation", lambda: self.array, self.set, space)

    def step_accepted(self) -> None:
        """Warn once where nobody has repeated the solves of an accepted step. Collective."""
        if self._has_warned or not self._is_paired:
            return
        change = self._next()[1]
        if change > OPEN_WITHIN:
            self._has_warned = True
            warn(
                f"an exact penalty has left gaps of {change:.1e} of a facet: solvers of "
                "raymortar alone repeat a solve until they close",
                page="use",
            )

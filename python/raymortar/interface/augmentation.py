"""Tractions that an exact penalty carries from solve to solve."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from .. import compat
from ..compat import Array
from ..discretization.ranks import largest
from ..discretization.reference_facets import facet_nodes, shape_functions
from .point_results import nodal_average
from .stiffness import mean_facet_size
from .zone_data import ZoneData

# Change of a gap, over the mean size of facets, from which on gaps are closed
CLOSED_WITHIN = 1e-4
# Solves of one step after the first one
MOST_AUGMENTATIONS = 20


class Correction(Protocol):
    """Lengths at nodes that are added to gaps, until a solve agrees with them."""

    @property
    def array(self) -> Array:
        """Lengths at this rank's nodes."""

    def set(self, values: Array) -> None:
        """Set the lengths, and add them to gaps. Collective."""

    def renew(self) -> float | None:
        """Change gaps by what a solve has found; None where both agree. Collective."""


class Augmentation:
    """Keeps accepted tractions of a penalty, over its coefficient [theory (4.32)].

    They are lengths at the slave nodes, which are added to gaps.
    """

    def __init__(self, zones: Sequence[ZoneData], scalar: Any, layout: Any) -> None:
        self._zones, self._comm = zones, layout.comm
        self._values = Function(scalar, name="augmentation")
        self._size = mean_facet_size(layout, zones)

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
            whole = zone.whole_offset
            assert whole is not None
            zone.cpp.set_offset(whole)

    def renew(self) -> float | None:
        """Take over the present tractions. Collective.

        Returns the largest change of a gap over the size of facets, and changes nothing
        where gaps are closed: then it returns None.
        """
        found = Function(self._values.function_space)
        nodal_average(self._zones, _pressed, found)
        # No point around the node has a hit
        values = np.nan_to_num(found.x.array)
        change = largest(self._comm, np.abs(values - self.array)) / self._size
        if change <= CLOSED_WITHIN:
            return None
        self.set(values)
        return float(change)


def _pressed(points: dict[str, Array]) -> Array:
    """Pressure over the coefficient, at most 0, (n,). Length."""
    pressed: Array = points["pressure"] / points["gamma"]
    return pressed


def augmented(parts: Sequence[Any], comm: MPI.Comm) -> float:
    """Augment contacts with an exact penalty; 0 if all gaps are closed. Collective.

    Returns the largest change of a gap over the size of facets.
    """
    changes = [part.present.augment() for part in parts]
    return max([0.0, *(change for change in changes if change is not None)])

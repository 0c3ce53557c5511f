"""Approach of bodies under viscous forces: none may pass another in one solve."""

from __future__ import annotations

from functools import cached_property

from mpi4py import MPI

import numpy as np

from ..core.compat import Array, Mask
from ..core.discretization.ranks import ends_of
from ..core.errors import ConvergenceError
from ..core.interaction import Interaction
from ..core.interface.zone_data import ZoneData
from .rigid_moves import bodies_of


class Approach:
    """Bounds motions of held bodies towards loose ones, which may themselves move by
    `limit` in one solve. Collective."""

    def __init__(self, contact: Interaction, loose: Mask, limit: float) -> None:
        self._contact, self._loose, self._limit = contact, loose, limit

    @cached_property
    def _meets(self) -> Mask:
        """Whether slave or masters of each zone are on each body, (zones, bodies)."""
        contact = self._contact
        found = np.array([bodies_of(zone, contact) for zone in contact.zones])
        contact.layout.comm.Allreduce(MPI.IN_PLACE, found, op=MPI.LOR)
        return found

    def require(self, motions: Array) -> None:
        """Refuse motions of held bodies that may have passed loose ones. Collective.

        They move by more than the gap before the step and the limit.
        """
        for zone, meets in zip(self._contact.zones, self._meets):
            held = float(motions[meets & ~self._loose].max(initial=0.0))
            if not self._loose[meets].any() or held <= self._limit:
                continue
            reach = zone.distance("reach").min(initial=np.inf)
            gap = max(zone.opposite.gap.min(initial=reach), 0.0)
            gap = self._contact.layout.comm.allreduce(gap, op=MPI.MIN)
            gap = max(gap, self._apart(zone))
            if held > self._limit + gap:
                raise ConvergenceError(
                    f"a held body moves by {held:.3g} in this step, with a gap of "
                    f"{gap:.3g} to what nothing holds: it may have passed it"
                )

    def _apart(self, zone: ZoneData) -> float:
        """Distance between boxes around slave and masters of a zone at the accepted
        step, 0 where they overlap or with tools. Length. Collective."""
        facets, contact = zone.facets, self._contact
        if facets.bodies:
            return 0.0
        V, dim = contact.u.function_space, facets.slave_surface.gdim
        x = V.tabulate_dof_coordinates()[:, :dim] + contact.states.u_old.reshape(
            -1, dim
        )
        low, high = (
            ends_of(x[surface.dofs], contact.layout.comm)
            for surface in (facets.slave_surface, facets.master_surface)
        )
        return float(np.maximum(low[0] - high[1], high[0] - low[1]).max(initial=0.0))

"""Friction laws whose bound differs from point to point, as the zones need it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mpi4py import MPI

import numpy as np

from ..errors import together
from ..host.slave_fields import check_field, on_facets
from ..options.friction import Friction, Law
from .point_results import CLOSED, along_normal
from .zones import ZoneData


def spread_coefficient(law: Law | None, zones: Sequence[ZoneData], mesh: Any) -> None:
    """Send a friction coefficient that is a field to the zones. Collective."""
    if law is None or law.quantity is None or law.field is None:
        return
    with together(mesh.comm):
        check_field(law.quantity, law.field, mesh)
    for zone in zones:
        values = on_facets(law.quantity, law.field, zone.facets, mesh.comm)
        zone.cpp.set_field("friction_coefficient", values)


def evaluate_friction(
    law: Law | None, zones: Sequence[ZoneData], dt: float, comm: MPI.Comm
) -> None:
    """Evaluate a law of pressure and slip rate at all points, once for each zone, and
    send its bounds to the zones. Collective.

    Parameters
    ----------
    law
        Law of friction. Only `Friction` is evaluated here.
    zones
        Paired at the present state.
    dt
        Time of the step.
    """
    if not isinstance(law, Friction):
        return
    with together(comm):
        for zone in zones:
            points = zone.points()
            closed = points["status"] >= CLOSED
            along = points["slip"] - along_normal(points, points["slip"])
            p = np.maximum(-points["pressure"][closed], 0.0)
            v = np.linalg.norm(along[closed], axis=1) / dt
            values = np.zeros((3, len(closed)))
            values[:, closed] = law.at(p, v)
            s, by_p, by_v = values
            # The library's pressure is the normal traction, which is negative
            zone.cpp.set_friction_bounds(s, -by_p, by_v / dt)

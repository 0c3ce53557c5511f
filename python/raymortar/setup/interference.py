"""Interferences for which no body is thick enough."""

from __future__ import annotations

from ..core.discretization.joined import parts_of
from ..core.discretization.ranks import largest
from ..core.interface.contact_surfaces import ContactSurfaces
from ..core.interface.zone_data import ZoneData
from .thickness import behind

# Share of an interference that counts as rounding error
_ROUNDING = 1e-6


def excess(surfaces: ContactSurfaces) -> str | None:
    """Message on the offset of zones where it exceeds the bodies. Collective."""
    found = [_excess_on(zone, surfaces) for zone in surfaces.zones]
    return "; ".join(filter(None, found)) or None


def _excess_on(zone: ZoneData, surfaces: ContactSurfaces) -> str | None:
    """Message on an interference for which no body is thick enough. Collective."""
    facets, comm = zone.facets, surfaces.comm
    assert zone.offset is not None
    overlap = largest(comm, -zone.offset)
    # A rigid tool has no thickness that counts
    count, parts = 1 if facets.bodies else 2, parts_of(surfaces.u)
    there = min(largest(comm, side) for side in zone.thickness[:count])
    if there < overlap:
        on = (facets.slave_part, facets.master_part)[:count]
        there = min(
            largest(comm, behind(parts[k].function_space.mesh)(side, 2.0 * overlap))
            for k, side in zip(on, (facets.slave, facets.master))
        )
    if overlap <= there * (1.0 + _ROUNDING):
        return None
    return (
        f"the argument offset makes an interference of {overlap:.4g} on "
        f"{facets.spoken}, more than the {there:.4g} of body behind it. Give a "
        "length in the unit of the mesh"
    )

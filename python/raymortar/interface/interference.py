"""Interferences that are larger than the bodies, such as an offset in a wrong unit."""

from __future__ import annotations

from collections.abc import Sequence

from mpi4py import MPI

from ..compat import Array
from ..host.joined import parts_of
from ..host.thickness import Cells, thickness_behind
from .contact_surfaces import ContactSurfaces
from .zones import ZoneData

# Share of an interference that counts as rounding error
_ROUNDING = 1e-6


def excess_of_interference(surfaces: ContactSurfaces) -> str | None:
    """Message on present offsets for which no body is thick enough. Collective."""
    found = []
    for zone in surfaces.zones:
        mine = 0.0 if zone.offset is None else float((-zone.offset).max(initial=0.0))
        overlap = float(surfaces.comm.allreduce(mine, op=MPI.MAX))
        there = _thickness(zone, surfaces, overlap)
        if overlap > there * (1.0 + _ROUNDING):
            found.append(
                f"the argument offset makes an interference of {overlap:.4g} on slave "
                f"tag {zone.facets.slave_tag}, more than the {there:.4g} of body that "
                "lies behind the thinner side: it is a length in the unit of the mesh, "
                "negative where bodies overlap"
            )
    return "; ".join(found) or None


def _thickness(zone: ZoneData, surfaces: ContactSurfaces, length: float) -> float:
    """Thickness of the body behind the thinner side of a zone if it is below a length,
    else a larger number. Collective."""
    facets, comm = zone.facets, surfaces.comm
    # A rigid tool has no thickness that counts
    count = 1 if facets.bodies else 2

    def thinner(sides: Sequence[Array]) -> float:
        most = [comm.allreduce(s.max(initial=0.0), op=MPI.MAX) for s in sides[:count]]
        return float(min(most))

    known = thinner(zone.thickness)
    if known >= length:
        return known
    parts = parts_of(surfaces.u)
    sides = (facets.slave_part, facets.slave), (facets.master_part, facets.master)
    return thinner(
        [
            thickness_behind(Cells(parts[k].function_space.mesh), side, 2.0 * length)
            for k, side in sides
        ]
    )

"""A warning about tension that the multiplier of a frictionless contact shows."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from ..compat import Array
from ..errors import ContactWarning
from ..host.facets import format_point

if TYPE_CHECKING:
    from ..contact import Contact
    from ..interaction import Interaction
    from ..interface.zone_data import ZoneData

# Of the largest pressure
ALLOWED = 0.05
# Smaller pressures are rounding: of gamma times the size of a facet
NOTHING = 1e-10


def warn_of_tension(contact: Interaction, stacklevel: int) -> None:
    """Warn once of each slave surface that is pulled by its masters. Collective.

    Parameters
    ----------
    stacklevel
        Of `warnings.warn`, seen from the caller.
    """
    for one in contact.contacts:
        if one.friction is None and one.tied is None and one.multiplier is not None:
            for number, zone in enumerate(one.zones):
                if not zone.is_pulled:
                    _look(one, number, zone, stacklevel + 2)


def _look(contact: Contact, number: int, zone: ZoneData, stacklevel: int) -> None:
    """Compare the largest tension of a surface's nodes with its pressure. Collective."""
    nodal, nodes = _normal_tractions(contact), zone.multiplier_nodes
    comm, own = contact.layout.comm, nodal[nodes]
    ends = comm.allgather((own.max(initial=0.0), -own.min(initial=0.0)))
    tension, pressure = np.max(ends, axis=0)
    if tension <= ALLOWED * pressure or pressure <= NOTHING * _modulus(contact, zone):
        return
    zone.is_pulled = True
    rank = int(np.argmax([most for most, _ in ends]))
    place = None
    if comm.rank == rank:
        W, dim = contact.surfaces.scalar, zone.facets.slave_surface.gdim
        at = W.tabulate_dof_coordinates()[nodes[np.argmax(own)], :dim]
        place = format_point(at)
    pairs = [str(pair) for pair in contact.pairs if pair.surface == number]
    warnings.warn(
        f"converged with tension of {tension / pressure:.2g} of the largest pressure "
        f"between {', '.join(pairs)}, at the undeformed {comm.bcast(place, root=rank)}"
        ": the multiplier swings about zero beside contact that few facets carry. Forces "
        "are right to the square of the facets' size; refine the slave there if "
        "tractions count",
        ContactWarning,
        stacklevel=stacklevel,
    )


def _normal_tractions(contact: Contact) -> Array:
    """Normal tractions at the nodes of the multiplier, negative in compression."""
    assert contact.multiplier is not None
    values: Array = contact.multiplier.x.array
    return values if contact.layout.components == 1 else -contact.pressure().x.array


def _modulus(contact: Contact, zone: ZoneData) -> float:
    """About the modulus of the bodies, on any rank's facets. Stress. Collective."""
    surface = zone.facets.slave_surface
    nodes = surface.X[surface.facet_nodes]
    sizes = np.linalg.norm(np.ptp(nodes, axis=1), axis=1)
    largest = max(contact.layout.comm.allgather(sizes.max(initial=0.0)))
    return float(contact.gamma_scale * largest)

"""Lengths that are added to gaps: clearances and interferences, and corrections."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from ..discretization.slave_fields import OFFSET, FieldValue, check_field, on_facets
from ..errors import require_agreement, together, warn
from ..hooks import hooks
from .contact_surfaces import ContactSurfaces

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


def augmented(parts: Sequence[Any]) -> float:
    """Renew the corrections of contacts; 0 if all gaps agree with them. Collective.

    Returns the largest change of a gap over the size of facets.
    """
    changes = [part.present.augment() for part in parts]
    return max([0.0, *(change for change in changes if change is not None)])

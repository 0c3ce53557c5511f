"""What is added to the gaps of a contact: clearances, interferences, adjustments."""

from __future__ import annotations

import warnings

from ..errors import ContactWarning, require_agreement, together
from ..host.slave_fields import OFFSET, FieldValue, check_field, on_facets
from .adjustment import Adjustment, adjustment, require_start, summed
from .contact_surfaces import ContactSurfaces
from .overlap import excess_of_interference
from .present import PresentState


class Offsets:
    """Sets offset and adjustments of the zones of a contact. Collective.

    Parameters
    ----------
    surfaces
        Of the contact.
    present
        Its present state.

    Attributes
    ----------
    value
        The offset as it was given; None: nothing.
    excess
        A message on an interference for which no body is thick enough; else None.
    """

    def __init__(self, surfaces: ContactSurfaces, present: PresentState) -> None:
        self._surfaces, self._present = surfaces, present
        self.value: FieldValue | None = None
        self.excess: str | None = None

    def set(self, offset: FieldValue) -> None:
        """Set what is added to the gap; see `Contact.set_offset`."""
        zones, comm = self._surfaces.zones, self._surfaces.comm
        with together(comm):
            check_field(OFFSET, offset, self._surfaces.slave_u.function_space.mesh)
        require_agreement(comm, offset=offset)
        nodal = [on_facets(OFFSET, offset, zone.facets, comm) for zone in zones]
        for zone, values in zip(zones, nodal):
            zone.offset = values
        self.value = offset
        before, self.excess = self.excess, excess_of_interference(self._surfaces)
        if self.excess is not None and before is None:
            warnings.warn(self.excess, ContactWarning, stacklevel=3)
        self._send()

    def adjust(self, within: float) -> Adjustment:
        """Make near surfaces just touch; see `Contact.adjust`."""
        zones, comm = self._surfaces.zones, self._surfaces.comm
        with together(comm):
            require_start(self._surfaces.u.x.array, within)
        require_agreement(comm, within=within)
        self._present.update()
        changes = [adjustment(zone, float(within)) for zone in zones]
        for zone, change in zip(zones, changes):
            known = zone.adjustment
            zone.adjustment = change if known is None else known + change
        self._send()
        return summed(comm, changes)

    def _send(self) -> None:
        """Send offsets and adjustments to the zones."""
        for zone in self._surfaces.zones:
            offset = zone.whole_offset
            if offset is not None:
                zone.cpp.set_offset(offset)
        self._present.note_change()

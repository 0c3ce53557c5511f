"""The accepted step: old displacement, friction springs and poses of rigid bodies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from dolfinx.fem import Function

from ..compat import Array
from ..host.host import Host
from ..rigid.body import Body
from .faced import nearest_hits
from .point_places import nodal_average
from .point_results import CLOSED
from .state import ContactState
from .zone_data import ZoneData, on_sides


class AcceptedStep:
    """The state that a step starts from. Sends it to the zones in C++.

    The zones keep friction springs and faced facets; their `motions` keep old motions
    of bodies.

    Parameters
    ----------
    u
        Displacement. Its present value becomes the old one.
    zones
        Zones of the contact.
    bodies
        Free rigid bodies of the contact.
    slip
        Length of the slip of all accepted steps; None without friction.

    Attributes
    ----------
    u
        Old displacement, this rank's array.
    """

    def __init__(
        self,
        u: Function,
        zones: Sequence[ZoneData],
        bodies: Sequence[Body],
        slip: Function | None,
    ) -> None:
        self._present, self._zones, self._bodies = u, zones, bodies
        self._slip = slip
        self.u = u.x.array.copy()
        self._is_sent = False

    @property
    def is_here(self) -> bool:
        """Whether the present displacement of this rank is the old one."""
        return np.array_equal(self._present.x.array, self.u)

    def send(self) -> None:
        """Send the history to the zones in C++ if it has changed."""
        if self._is_sent:
            return
        for zone in self._zones:
            zone.motions.send_old(zone.cpp)
            zone.cpp.set_old_displacement(*on_sides(zone, self.u))
            traction = zone.traction_old
            zone.cpp.set_field(
                "traction_old", np.empty(0) if traction is None else traction
            )
        self._is_sent = True

    def keep_springs(self) -> None:
        """Keep the springs of the last update."""
        for zone in self._zones:
            zone.traction_old = zone.cpp.accepted_springs()

    def add_slip(self) -> None:
        """Add the length of the slip of closed points, averaged to nodes. Collective."""
        if self._slip is None:
            return
        step = Function(self._slip.function_space)
        nodal_average(self._zones, _slid, step)
        self._slip.x.array[:] += np.nan_to_num(step.x.array)

    def accept(self) -> None:
        """Keep the present displacement, and the poses of the last update."""
        self.u[:] = self._present.x.array
        for zone in self._zones:
            zone.motions.accept()
        for body in self._bodies:
            body.freedom.accept()
        self._is_sent = False

    def note_faced(self) -> None:
        """Note what each slave facet faces at the last update."""
        for zone in self._zones:
            zone.faced = nearest_hits(zone)

    def forget_flight(self, body: Body) -> None:
        """Take the present pose of a body as the old one: it has not slipped."""
        for zone in self._zones:
            zone.motions.begin_at_present(body)
        self._is_sent = False

    def state(self, host: Host, multiplier: Function | None) -> ContactState:
        """Copy of all unknowns and of the history."""
        return ContactState(
            self._present.x.array.copy(),
            self.u.copy(),
            None if multiplier is None else multiplier.x.array.copy(),
            [zone.traction_old for zone in self._zones],
            None if host.is_plain else host.values(),
            [zone.motions.old for zone in self._zones],
            [body.freedom.state() for body in self._bodies],
            None if self._slip is None else self._slip.x.array.copy(),
            any(
                side.arcs is not None
                for zone in self._zones
                for side in (zone.facets.slave_surface, zone.facets.master_surface)
            ),
        )

    def restore(
        self, state: ContactState, host: Host, multiplier: Function | None
    ) -> None:
        """Go back to a `state`."""
        self._present.x.array[:] = state.u
        if state.unknowns is not None:
            host.set_values(state.unknowns)
        self.u[:] = state.u_old
        if multiplier is not None:
            multiplier.x.array[:] = state.multiplier
        if self._slip is not None:
            self._slip.x.array[:] = 0.0 if state.slip is None else state.slip
        for zone, traction in zip(self._zones, state.traction_old):
            zone.traction_old = traction
        for zone, motion in zip(self._zones, state.old_motions):
            zone.motions.old = motion
        for body, known in zip(self._bodies, state.freedoms):
            body.freedom.restore(known)
        self._is_sent = False


def _slid(points: dict[str, Array]) -> Array:
    """Length of the step's slip where points are closed, (n,)."""
    length: Array = np.linalg.norm(points["slip"], axis=1)
    return length * (points["status"] >= CLOSED)

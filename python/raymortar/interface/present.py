"""The present state of a contact: what its zones in C++ know, and the accepted step."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from ..checked import is_real_number
from ..compat import Array
from ..errors import (
    ContactError,
    SetUpError,
    raise_everywhere,
    require_agreement,
    together,
)
from ..host.axisymmetry import off_axis_fault
from ..options.contact_options import ContactOptions
from ..options.friction import Friction
from ..rigid.body import Body
from .accepted import AcceptedStep
from .contact_surfaces import ContactSurfaces
from .cover import Cover, require_masters, warn_of_corners
from .friction_at_points import PointFriction
from .state import ContactState, not_finite, state_fault
from .straight_facets import warn_of_straight_facets, warn_of_turned_arcs
from .zone_data import on_sides


class PresentState:
    """Pairs the surfaces of a contact at the present displacement, accepts steps and
    goes back to them. Collective.

    Parameters
    ----------
    surfaces
        Of the contact.
    options
        Its arguments.

    Attributes
    ----------
    updates, updates_for_room
        Calls of `update` so far, and those that a new matrix has needed.
    revision
        Changes so far of what an assembled residual depends on, displacement and
        multiplier aside: pairing, history, coefficient.
    """

    def __init__(self, surfaces: ContactSurfaces, options: ContactOptions) -> None:
        self._surfaces, self._options = surfaces, options
        self._zones, self._host = surfaces.zones, surfaces.host
        self._u, self._multiplier = surfaces.u, surfaces.multiplier
        self._comm = surfaces.comm
        self._cover: Cover | None = None
        if self._multiplier is not None:
            self._cover = Cover(self._zones, self._multiplier.function_space)
        has_friction = options.friction is not None
        self._slip = Function(surfaces.scalar) if has_friction else None
        for zone in self._zones:
            zone.slip = self._slip
        self._accepted = AcceptedStep(
            self._u, self._zones, surfaces.layout.bodies, self._slip
        )
        self._point_friction: PointFriction | None = None
        if isinstance(options.friction, Friction):
            self._point_friction = PointFriction(
                options.friction, self._zones, self._comm
            )
        self._paired_at: Array = np.empty(0)
        self._dt = 1.0
        self._watches_arcs = bool(options.smooth)
        self.updates, self.updates_for_room, self.revision = 0, 0, 0

    def note_change(self) -> None:
        """Count a change of what an assembled residual depends on."""
        self.revision += 1

    def require_results(self) -> None:
        """Raise before the first `update`, of which all ranks know."""
        if self.updates == 0:
            raise ContactError("there are no results yet: call update, or solve, first")

    @property
    def u_old(self) -> Array:
        """Displacement of the accepted step, of this rank's dofs."""
        return self._accepted.u

    @property
    def dt(self) -> float:
        """Time of the present step."""
        return self._dt

    @dt.setter
    def dt(self, value: float) -> None:
        with together(self._comm):
            if not (is_real_number(value) and np.isfinite(value) and value > 0.0):
                raise ContactError(f"dt = {value!r} must be a positive number")
        require_agreement(self._comm, dt=float(value))
        self._dt = float(value)
        for body in self._surfaces.layout.bodies:
            body.freedom.dt = self._dt
        self.note_change()

    def update(self, rays_only: bool = False) -> None:
        """Pair and integrate at the present displacement. Collective."""
        self._begin_update()
        if self._slip is not None:
            self._paired_at = self._unknowns()
        self._accepted.send()
        self._send()
        for zone in self._zones:
            with together(self._comm):
                if rays_only:
                    zone.cpp.cast()
                else:
                    zone.cpp.pair()
        if self._point_friction is not None:
            self._point_friction.send(self._dt)
        if self._cover is not None:
            self._cover.share()
        # The bodies of other ranks may have moved
        if self._comm.allreduce(self._accepted.is_here, op=MPI.MIN):
            self._accepted.note_faced()
            if self.updates == 1:
                warn_of_straight_facets(self._surfaces)

    def _begin_update(self) -> None:
        self.updates += 1
        self.note_change()
        self._host.pull()

    def _send(self) -> None:
        """Displacement and multiplier to the zones. Collective."""
        layout = self._surfaces.layout
        for reference in self._surfaces.references:
            raise_everywhere(self._comm, reference.fault(), SetUpError)
        raise_everywhere(self._comm, not_finite(self._surfaces))
        has_friction = self._options.friction is not None
        for zone in self._zones:
            if self._surfaces.axisymmetric and zone.facets.bodies:
                fault = off_axis_fault(zone.facets.bodies)
                raise_everywhere(self._comm, fault, SetUpError)
            zone.cpp.set_displacement(*on_sides(zone, self._u.x.array))
            zone.motions.send(zone.cpp, self._comm, has_friction, layout.body_rows)
        if self._multiplier is not None:
            values = self._multiplier.x.array.reshape(-1, layout.components)
            for zone in self._zones:
                zone.cpp.set_multiplier(values[zone.multiplier_nodes])

    def _unknowns(self) -> Array:
        """Displacement and multiplier of this rank, as one array."""
        lam = [] if self._multiplier is None else [self._multiplier.x.array]
        values: Array = np.concatenate([self._u.x.array, *lam])
        return values

    def advance(self) -> None:
        """Accept the step: the present state becomes the old one. Collective."""
        if self._slip is not None and self.updates:
            if self._is_stale():
                self.update()
            self._accepted.add_slip()
            if self._options.has_springs:
                self._accepted.keep_springs()
        self._accepted.accept()
        if self.updates:
            self._accepted.note_faced()
        if self._watches_arcs:
            self._watches_arcs = not warn_of_turned_arcs(self._surfaces)
        self.note_change()

    def _is_stale(self) -> bool:
        """Whether the last `update` was at another state. Collective."""
        self._host.pull()
        same = np.array_equal(self._paired_at, self._unknowns())
        return not self._comm.allreduce(same, op=MPI.LAND)

    def forget_flight(self, body: Body) -> None:
        """Take the present pose of a body as the old one: a flight is no slip."""
        self._accepted.forget_flight(body)
        self.note_change()

    def copy(self) -> ContactState:
        """Copy of all unknowns and of the history, for `restore`."""
        self._host.pull()
        return self._accepted.state(self._host, self._multiplier)

    def fault_of(self, state: Any) -> str | None:
        """Why `restore` cannot go back to a state, if so."""
        zones = self._zones if self._options.has_springs else []
        return state_fault(state, self.copy(), zones)

    def restore(self, state: ContactState) -> None:
        """Go back to a state, and update results if there were any. Collective."""
        raise_everywhere(self._comm, self.fault_of(state))
        self._accepted.restore(state, self._host, self._multiplier)
        self.note_change()
        if self.updates:
            self.update()


class TiedState(PresentState):
    """The same of a tie, whose surfaces are paired once, undeformed. Collective."""

    def pair(self, partial: bool) -> None:
        """Pair the undeformed surfaces.

        Parameters
        ----------
        partial
            Whether slave nodes may have no master.
        """
        for zone in self._zones:
            with together(self._comm):
                zone.cpp.pair()
        require_masters(self._surfaces, partial)
        if self._cover is not None:
            self._cover.share()
            warn_of_corners(self._surfaces)

    def update(self, rays_only: bool = False) -> None:
        """Take the present displacement; pairs and points stay. Collective."""
        self._begin_update()
        self._send()

    def advance(self) -> None:
        """Accept the step. A tie has no history but the old displacement."""
        self._accepted.u[:] = self._u.x.array
        self.note_change()

"""The present state of a contact, its copies, and the step that starts from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol
from weakref import WeakSet

import numpy as np
from dolfinx.fem import Function

from ..compat import Array
from ..discretization.checks import off_axis_fault
from ..errors import (
    ContactError,
    SetUpError,
    positive,
    raise_everywhere,
    require_agreement,
    together,
)
from ..options.friction import Friction
from ..options.methods import ContactOptions, Penalty
from ..rigid.body import Body, require_same_loads
from .contact_surfaces import ContactSurfaces
from .friction_at_points import PointFriction
from .offsets import Augmentation, Correction
from .point_results import CLOSED, nodal_average, nodes, set_at_nodes
from .slave_nodes import Cover, require_masters, warn_of_corners
from .straight_facets import warn_of_straight_facets, warn_of_turned_arcs
from .zone_data import on_sides, opposite_points


@dataclass(frozen=True)
class ContactState:
    """State that a step starts from: this rank's arrays of displacement and history.

    ``unknowns`` are all unknowns, the displacement among them. None if it is the only
    one.
    """

    u: Array
    u_old: Array
    multiplier: Array | None
    traction_old: list[Array | None]
    unknowns: Array | None = None
    # Motions of rigid bodies at the accepted step, by zone. The present ones are loads
    old_motions: Sequence[Array] = ()
    # States of free rigid bodies, in the contact's order
    freedoms: Sequence[Array] = ()
    # Length of the slip of all accepted steps at nodes; None without friction
    slip: Array | None = None
    # Tractions of an exact penalty over gamma, at nodes; else None
    augmentation: Array | None = None
    # Whether straight facets are curved, see `Contact`
    smooth: bool = False
    # Changes of gaps in a step that is not yet accepted, such as implicit wear
    corrections: Sequence[Array] = ()
    # Numbers of slave surfaces whose sides are exchanged, see `ContactSurfaces`
    exchanged: Sequence[int] = ()

    @property
    def parts(self) -> tuple[ContactState, ...]:
        """The state alone; see `JointState`."""
        return (self,)

    def shapes(self) -> dict[str, tuple[int, ...] | None]:
        """Shape by name of the part, None where it is missing."""
        parts: dict[str, Any] = {
            "displacement": self.u,
            "old displacement": self.u_old,
            "multiplier": self.multiplier,
            "all unknowns": self.unknowns,
        }
        for i, traction in enumerate(self.traction_old):
            parts[f"tractions of springs {i}"] = traction
        parts["accumulated slip"] = self.slip
        parts["augmentation"] = self.augmentation
        shapes = {name: None if p is None else np.shape(p) for name, p in parts.items()}
        shapes["list of slave surfaces"] = (len(self.traction_old),)
        shapes["free rigid bodies"] = tuple(map(len, self.freedoms))
        return shapes


@dataclass(frozen=True)
class JointState:
    """States of several contacts of one problem, in their order."""

    parts: tuple[ContactState, ...]

    @property
    def u(self) -> Array:
        """Displacement, this rank's array."""
        return self.parts[0].u

    @property
    def unknowns(self) -> Array | None:
        """Unknowns, see `ContactState`."""
        return self.parts[0].unknowns


State = ContactState | JointState


def state_fault(
    state: Any, own: ContactState, springs: Mapping[int, tuple[int, ...]]
) -> str | None:
    """Return why a contact cannot go back to a state, if so."""
    if not isinstance(state, ContactState):
        return f"state must be a ContactState, not {type(state).__name__}"
    if state.smooth != own.smooth:
        return (
            f"the state is of a contact with smooth={state.smooth}, this one has smooth="
            f"{own.smooth}: their surfaces differ"
        )
    if tuple(state.exchanged) != tuple(own.exchanged):
        sides = [
            "with exchanged sides" if one.exchanged else "with sides as given"
            for one in (state, own)
        ]
        return (
            f"the state is of a contact {sides[0]}, this one is {sides[1]}: restore it "
            "once the problem is made, or call keep_sides() of both before"
        )
    theirs, here = state.shapes(), own.shapes()
    allowed = {name: {shape} for name, shape in here.items()}
    for i in range(len(own.traction_old)):
        # None before the first step, and where there are no springs
        allowed[f"tractions of springs {i}"] = {None, springs.get(i)}
    allowed["accumulated slip"] |= {None}  # a state may be older than it
    for name, shapes in allowed.items():
        if theirs.get(name) not in shapes:
            return (
                f"the state is of another contact, mesh or method: {name} of shape "
                f"{theirs.get(name)}, here {here[name]}"
            )
    return None


class Watcher(Protocol):
    """Follows the steps of a contact."""

    def path_ended(self) -> str | None:
        """Return what to warn of when a path has ended, alike on all ranks."""


class PresentState:
    """Keeps the accepted step of a contact, sends it to the zones, accepts steps and
    goes back to them. Collective.

    Attributes
    ----------
    u_old
        Displacement of the accepted step, of this rank's dofs.
    has_friction
        Whether the contact has friction.
    updates, updates_for_room
        Calls of `update` so far, and those that a new matrix has needed.
    revision
        Changes so far of what an assembled residual depends on, displacement and
        multiplier aside: pairing, history, coefficient.
    """

    def __init__(self, surfaces: ContactSurfaces, options: ContactOptions) -> None:
        self._surfaces, self._options = surfaces, options
        self._zones, self._unknowns = surfaces.zones, surfaces.unknowns
        self._u, self._multiplier = surfaces.u, surfaces.multiplier
        self._comm = surfaces.comm
        self._cover: Cover | None = None
        if self._multiplier is not None and not self._has_law_at_nodes:
            self._cover = Cover(self._zones, self._multiplier.function_space)
        self.has_friction = options.friction is not None
        # Length of the slip of all accepted steps
        self._slip = Function(surfaces.scalar) if self.has_friction else None
        for zone in self._zones:
            zone.slip = self._slip
        self._point_friction: PointFriction | None = None
        if isinstance(options.friction, Friction):
            self._point_friction = PointFriction(
                options.friction, self._zones, self._comm
            )
        # Corrections change gaps after a solve, which is then repeated
        self.corrections: list[Correction] = []
        # Objects that may warn at the end of a path
        self.watchers: WeakSet[Watcher] = WeakSet()
        self._augmentation: Augmentation | None = None
        if isinstance(options.method, Penalty) and options.method.exact:
            self._augmentation = Augmentation(self._zones, surfaces.scalar)
        self.u_old = self._u.x.array.copy()
        self._is_sent = False
        self._dt = 1.0
        self._watches_arcs = bool(options.smooth)
        self.updates, self.updates_for_room, self.revision = 0, 0, 0
        self.steps = 0  # accepted so far

    @property
    def _has_law_at_nodes(self) -> bool:
        return any(zone.has_law_at_nodes for zone in self._zones)

    def note_change(self) -> None:
        """Count a change of what an assembled residual depends on."""
        self.revision += 1

    def require_results(self) -> None:
        """Raise before the first `update`, of which all ranks know."""
        if self.updates == 0:
            raise ContactError("there are no results yet: call update, or solve, first")

    @property
    def dt(self) -> float:
        """Time of the present step."""
        return self._dt

    @dt.setter
    def dt(self, value: float) -> None:
        with together(self._comm):
            dt = positive("dt", value)
        require_agreement(self._comm, dt=dt)
        self._dt = dt
        for body in self._surfaces.layout.bodies:
            body.cpp.dt = self._dt
        self.note_change()

    @property
    def has_history(self) -> bool:
        """Whether steps have been accepted, or this rank has values of a restored state."""
        values = [f.x.array for f in (self._multiplier, self._slip) if f is not None]
        springs = (zone.traction_old for zone in self._zones)
        restored = any(map(np.any, values)) or any(t is not None for t in springs)
        return self.steps > 0 or restored

    # Updates

    def check_loads(self) -> None:
        """Raise for rigid bodies that differ between ranks or cannot be where they are.
        Collective."""
        for zone in self._zones:
            bodies = zone.facets.bodies
            if self._surfaces.axisymmetric and bodies:
                raise_everywhere(self._comm, off_axis_fault(bodies), SetUpError)
            require_same_loads(bodies, self._comm)
            if self.has_friction:
                raise_everywhere(self._comm, zone.motions.turned_too_far())

    def begin_update(self) -> None:
        """Send the history to the zones if it has changed."""
        self.updates += 1
        self.revision += 1
        if self._is_sent or self._surfaces.tied is not None:
            return
        for zone in self._zones:
            zone.motions.send_old(zone.cpp)
            zone.cpp.set_old_displacement(*on_sides(zone, self.u_old))
            traction = zone.traction_old
            zone.cpp.set_field(
                "traction_old", np.empty(0) if traction is None else traction
            )
        self._is_sent = True

    def end_update(self, is_accepted: bool) -> None:
        """Find what depends on the new pairs, given whether the displacement of all
        ranks is that of the accepted step. Collective."""
        if self._surfaces.tied is not None:
            return
        if self._point_friction is not None:
            self._point_friction.send(self._dt)
        if not (self._cover is None or self._cover.alone or self._has_law_at_nodes):
            self._cover.share()
        if is_accepted:
            self._note_opposite()
            if self.updates == 1:
                warn_of_straight_facets(self._surfaces)

    def pair_tie(self, partial: bool) -> None:
        """Pair the undeformed surfaces of a tie, whose slave nodes may have no master if
        `partial`."""
        for zone in self._zones:
            with together(self._comm):
                zone.cpp.pair()
        require_masters(self._surfaces, partial)
        if self._cover is not None:
            self._cover.share()
            warn_of_corners(self._surfaces)

    # Steps

    def accept(self) -> None:
        """Accept the step: the present state becomes the old one. Collective."""
        self._unknowns.pull()  # each contact has a displacement of its own
        self.u_old[:] = self._u.x.array
        self.steps += 1
        self.note_change()
        if self._surfaces.tied is not None:  # it has no other history
            return
        if self._slip is not None and self.updates:
            step = Function(self._slip.function_space)
            if self._has_law_at_nodes:
                set_at_nodes(self._zones, lambda zone: _slid(nodes(zone)), step)
            else:
                nodal_average(self._zones, _slid, step)
            self._slip.x.array[:] += np.nan_to_num(step.x.array)
            if self._options.has_springs:
                for zone in self._zones:
                    zone.traction_old = zone.cpp.accepted_springs()
        for zone in self._zones:
            zone.motions.accept()
        for body in self._surfaces.layout.bodies:
            body.cpp.accept()
        self._is_sent = False
        if self.updates:
            self._note_opposite()
        if self._watches_arcs:
            self._watches_arcs = not warn_of_turned_arcs(self._surfaces)

    def augment(self) -> float | None:
        """Change gaps by what a solve has found, for the next one. Collective.

        Returns None where nothing is to be solved again, see `Augmentation.renew`.
        """
        own = [] if self._augmentation is None else [self._augmentation]
        changes = [one.renew() for one in (*own, *self.corrections)]
        found = [change for change in changes if change is not None]
        if not found:
            return None
        self.note_change()
        return max(found)

    def _note_opposite(self) -> None:
        """Note what each slave facet faces at the last update."""
        for zone in self._zones:
            zone.opposite = opposite_points(zone)

    def begin_slip_here(self, body: Body) -> None:
        """Take the present pose of a body as the old one: a flight is no slip."""
        for zone in self._zones:
            zone.motions.begin_at_present(body)
        self._is_sent = False
        self.note_change()

    def copy(self) -> ContactState:
        """Copy all unknowns and the history, for `restore`."""
        unknowns, multiplier = self._unknowns, self._multiplier
        unknowns.pull()
        return ContactState(
            self._u.x.array.copy(),
            self.u_old.copy(),
            None if multiplier is None else multiplier.x.array.copy(),
            [zone.traction_old for zone in self._zones],
            None if unknowns.is_plain else unknowns.values(),
            [zone.motions.old for zone in self._zones],
            [body.freedom.state() for body in self._surfaces.layout.bodies],
            None if self._slip is None else self._slip.x.array.copy(),
            None if self._augmentation is None else self._augmentation.array.copy(),
            any(side.arcs is not None for zone in self._zones for side in zone.sides),
            [one.array.copy() for one in self.corrections],
            tuple(self._surfaces.exchanged),
        )

    def fault_of(self, state: Any) -> str | None:
        """Return why `restore` cannot go back to a state, if so."""
        sides = [zone.facets.slave_surface for zone in self._zones]
        springs = {
            i: (*side.facet_dofs.shape, side.gdim)
            for i, side in enumerate(sides)
            if self._options.has_springs
        }
        return state_fault(state, self.copy(), springs)

    def restore(self, state: ContactState) -> None:
        """Go back to a state that has no fault."""
        self._u.x.array[:] = state.u
        if state.unknowns is not None:
            self._unknowns.set_values(state.unknowns)
        self.u_old[:] = state.u_old
        if self._multiplier is not None:
            self._multiplier.x.array[:] = state.multiplier
        if self._slip is not None:
            self._slip.x.array[:] = 0.0 if state.slip is None else state.slip
        if self._augmentation is not None and state.augmentation is not None:
            self._augmentation.set(state.augmentation)
        for one, values in zip(self.corrections, state.corrections):
            one.set(values)
        for zone, traction in zip(self._zones, state.traction_old):
            zone.traction_old = traction
        for zone, motion in zip(self._zones, state.old_motions):
            zone.motions.old = motion
        for body, known in zip(self._surfaces.layout.bodies, state.freedoms):
            body.freedom.restore(known)
        self._is_sent = False
        self.note_change()


def _slid(points: dict[str, Array]) -> Array:
    """Length of the step's slip where points are closed, (n,)."""
    length: Array = np.linalg.norm(points["slip"], axis=1)
    return length * (points["status"] >= CLOSED)

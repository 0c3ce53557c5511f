"""The accepted step of a contact, and the step that starts from it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any
from weakref import WeakValueDictionary

import numpy as np
from dolfinx.fem import Function

from ..compat import Array
from ..errors import ContactError, positive, require_agreement, together
from ..hooks import hooks
from ..options.methods import ContactOptions, Penalty
from ..state import Owner, Quantity, common, of_array, of_function
from ..target import Target
from .contact_surfaces import ContactSurfaces
from .offsets import Correction
from .point_results import CLOSED, nodal_average, nodes, set_at_nodes
from .slave_nodes import Cover
from .unfelt import UnfeltParts
from .zone_data import SpringPoints, ZoneData, on_sides, opposite_points


class Follower(Owner):
    """Follows the steps of a contact, with arrays of the state that it has.

    Attributes
    ----------
    is_added
        Whether states may be older than it, and be without its arrays.
    """

    is_added: bool = True

    def bring(self) -> None:
        """Bring the contact up to date with these before it is paired. Collective."""

    def step_accepted(self) -> None:
        """Take the step that is accepted, whose end is the present state. Collective."""

    def path_ended(self) -> str | None:
        """Return what to warn of when a path has ended, alike on all ranks."""
        return None


class PresentState:
    """Keeps the accepted step of a contact, sends it to the zones, accepts steps and
    goes back to them. Collective.

    Attributes
    ----------
    u_old
        Displacement of the accepted step, of this rank's dofs.
    has_friction, unfelt, cover
        Whether the contact has friction, parts of the multiplier that nothing feels, and
        the nodes of a multiplier that masters cover.
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
        self.cover: Cover | None = None
        if self._multiplier is not None and not self._has_law_at_nodes:
            self.cover = Cover(self._zones, self._multiplier.function_space)
        self.has_friction = options.friction is not None
        # Length of the slip of all accepted steps
        self._slip = Function(surfaces.scalar) if self.has_friction else None
        for zone in self._zones:
            zone.slip = self._slip
        law = options.friction
        at_points = None if law is None else law.at_points(self._zones, self._comm)
        self._friction_at_points: Any = at_points
        # Corrections change gaps after a solve, which is then repeated
        self.corrections: list[Correction] = []
        self._followers: WeakValueDictionary[int, Follower] = WeakValueDictionary()
        if isinstance(options.method, Penalty) and options.method.exact:
            assert hooks.exact is not None, "penalties of the core alone are not exact"
            self.follow(correction := hooks.exact(surfaces))
            self.corrections.append(correction)
        self.u_old = self._u.x.array.copy()
        self.unfelt = UnfeltParts(surfaces)
        self._is_sent = False
        self._dt = 1.0
        self._watches_arcs = bool(options.smooth)
        self.updates, self.updates_for_room, self.revision = 0, 0, 0
        self.steps = self.returns = 0  # accepted, and gone back to, so far

    @property
    def followers(self) -> list[Follower]:
        """Objects that follow the steps, for as long as somebody keeps them, in order."""
        return list(self._followers.values())

    def follow(self, follower: Follower) -> None:
        """Let an object follow the steps."""
        self._followers[len(self._followers) and max(self._followers) + 1] = follower

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
    def couples_over_gaps(self) -> bool:
        """Whether friction makes couples over the gaps that multipliers leave open at
        single points, too, theory (3). Moments then balance, in more iterations."""
        return any(zone.couples_over_gaps for zone in self._zones)

    @couples_over_gaps.setter
    def couples_over_gaps(self, value: bool) -> None:
        if value == self.couples_over_gaps:
            return
        for zone in self._zones:
            zone.couples_over_gaps = value
        self._is_sent = False
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
        """Raise for rigid bodies that cannot be where they are. Collective."""
        for zone in self._zones:
            for check in hooks.on_tools if zone.facets.bodies else ():
                check(zone, self.has_friction)

    def begin_update(self) -> None:
        """Send the history to the zones if it has changed."""
        self.updates += 1
        self.revision += 1
        for one in list(self._followers.values()):  # each tangent asks
            one.bring()
        if self._is_sent or self._surfaces.tied is not None:
            return
        for zone in self._zones:
            zone.motions.send_old(zone.cpp)
            zone.cpp.set_old_displacement(*on_sides(zone, self.u_old))
            traction = zone.traction_old
            zone.cpp.set_field(
                "traction_old", np.empty(0) if traction is None else traction
            )
            rows = zone.spring_points
            zone.cpp.set_spring_points(np.empty(0) if rows is None else rows)
            zone.cpp.set_couples_over_gaps(zone.couples_over_gaps)
        self.unfelt.send(self.u_old)
        self._is_sent = True

    def end_update(self, is_accepted: bool) -> None:
        """Find what depends on the new pairs, given whether the displacement of all
        ranks is that of the accepted step. Collective."""
        if self._surfaces.tied is not None:
            return
        if self._friction_at_points is not None:
            self._friction_at_points.send(self._dt)
        if not (self.cover is None or self.cover.alone or self._has_law_at_nodes):
            self.cover.share()
        if is_accepted:
            self._note_opposite()
            if self.updates == 1:
                for look in hooks.on_first_pairs:
                    look(self._surfaces)

    # Steps

    def accept(self) -> None:
        """Accept the step: the present state becomes the old one. Collective."""
        self._unknowns.pull()  # each contact has a displacement of its own
        for one in self.followers:
            one.step_accepted()
        self.u_old[:] = self._u.x.array
        self.unfelt.accept()
        self.steps += 1
        self.note_change()
        if self._surfaces.tied is not None:  # it has no other history
            self._accept_bodies()
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
                    zone.traction_old, zone.spring_points = zone.cpp.accepted_springs()
        self._accept_bodies()
        self._is_sent = False
        if self.updates:
            self._note_opposite()
        if self._watches_arcs:
            told = [look(self._surfaces) for look in hooks.on_accept]
            self._watches_arcs = not any(told)

    def _accept_bodies(self) -> None:
        """Take the motions of rigid bodies as those of the accepted step."""
        for zone in self._zones:
            zone.motions.accept()
        for body in self._surfaces.layout.bodies:
            body.cpp.accept()

    def augment(self) -> float | None:
        """Change gaps by what a solve has found, for the next one. Collective.

        Returns None where nothing is to be solved again, see `Correction.renew`.
        """
        changes = [one.renew() for one in self.corrections]
        found = [change for change in changes if change is not None]
        if not found:
            return None
        self.note_change()
        return max(found)

    def _note_opposite(self) -> None:
        """Note what each slave facet faces at the last update."""
        for zone in self._zones:
            zone.opposite = opposite_points(zone)

    def begin_slip_here(self, body: Target) -> None:
        """Take the present pose of a body as the old one: a flight is no slip."""
        for zone in self._zones:
            zone.motions.begin_at_present(body)
        self._is_sent = False
        self.note_change()

    # State

    def quantities(self, number: int, first: int) -> Iterator[Quantity]:
        """Yield the arrays of the accepted step that only this contact has, in its
        numbers: of the contact and of its first zone."""
        is_curved = any(side.arcs is not None for z in self._zones for side in z.sides)
        zones = np.zeros(len(self._zones))
        yield Quantity(f"slave surfaces {number}", lambda: zones, lambda _: None)
        yield common(f"smooth {number}", [is_curved], _other_surfaces)
        if self._multiplier is not None:
            name = f"multiplier {number}"
            yield of_function(name, self._multiplier, is_unknown=True)
            if self.has_friction:
                yield of_array(
                    f"accepted multiplier {number}",
                    self.unfelt.accepted,
                    self._multiplier.function_space,
                )
        if self._slip is not None:
            yield of_function(f"slip {number}", self._slip, may_lack=True)
        for k, zone in enumerate(self._zones, first):
            yield from self._of_zone(zone, k)
        for follower in self.followers:
            for one in follower.quantities():
                name = f"{one.name} {number}"
                yield one.added(name) if follower.is_added else replace(one, name=name)

    def _of_zone(self, zone: ZoneData, k: int) -> Iterator[Quantity]:
        """Yield what springs hold and where tools were."""
        if self._options.has_springs:
            side = zone.facets.slave_surface
            yield Quantity(
                f"springs {k}",
                lambda: zone.traction_old,
                partial(setattr, zone, "traction_old"),
                zone,
                (*side.facet_dofs.shape, side.gdim),
                may_lack=True,  # before the first step
            )
            if self._multiplier is None or self._options.has_elastic_slip:
                yield Quantity(
                    f"springs {k} at points",
                    lambda: zone.spring_points,
                    partial(setattr, zone, "spring_points"),
                    SpringPoints(zone),
                    may_lack=True,
                    fault=partial(_other_points, zone),
                )
        if zone.motions.bodies:
            old = partial(setattr, zone.motions, "old")
            yield Quantity(f"tools {k}", lambda: zone.motions.old, old)

    def restored(self) -> None:
        """Take over the arrays of a state, which have been written."""
        self.returns += 1
        self._unknowns.pull()
        self._is_sent = False
        self.note_change()


def _other_surfaces(there: Array, here: Array) -> str:
    """Say that facets are curved in one of two contacts."""
    return (
        f"the state is of a contact with smooth={bool(there[0])}, this one has smooth="
        f"{bool(here[0])}: their surfaces differ"
    )


def _other_points(zone: ZoneData, there: Array) -> str | None:
    """Say that points of springs belong to another surface. Steps differ in their
    number."""
    side = zone.facets.slave_surface
    width, count = 2 * side.gdim + 1, len(side.facet_dofs)
    if there.shape[1:] == (width,) and not (there[:, 0] >= count).any():
        return None
    return (
        "the state is of another contact, mesh or method: its springs are at points of "
        f"another surface than one of {count} facets in {side.gdim}D"
    )


def _slid(points: dict[str, Array]) -> Array:
    """Length of the step's slip where points are closed, (n,)."""
    length: Array = np.linalg.norm(points["slip"], axis=1)
    return length * (points["status"] >= CLOSED)

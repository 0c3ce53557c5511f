"""Copies of the state that a step starts from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..compat import Array
from ..rigid.body import Body
from .contact_surfaces import ContactSurfaces
from .zone_data import ZoneData


@dataclass(frozen=True)
class ContactState:
    """What a step starts from: this rank's arrays of displacement and history.

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
    # Whether straight facets are curved, see `Contact`
    smooth: bool = False

    @property
    def parts(self) -> tuple[ContactState, ...]:
        """The state alone; see `JointState`."""
        return (self,)


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
        """As of `ContactState`."""
        return self.parts[0].unknowns


State = ContactState | JointState


def not_finite(surfaces: ContactSurfaces) -> str | None:
    """A message on values of this rank that are not finite; None if all are."""
    parts = [("displacement", surfaces.u), ("multiplier", surfaces.multiplier)]
    if not surfaces.host.is_plain:
        parts += [(f.name, f) for f in surfaces.host.functions]
    for name, f in parts:
        bad = 0 if f is None else np.count_nonzero(~np.isfinite(f.x.array))
        if bad:
            return f"the {name} has {bad} entries that are not finite"
    return None


def state_fault(
    state: Any, own: ContactState, springs: Sequence[ZoneData]
) -> str | None:
    """Why a contact cannot go back to a state, if so.

    Parameters
    ----------
    state
        The user's argument.
    own
        Present state of the contact.
    springs
        Zones, if friction springs carry tractions there.
    """
    if not isinstance(state, ContactState):
        return f"state must be a ContactState, not {type(state).__name__}"
    if state.smooth != own.smooth:
        return (
            f"the state is of a contact with smooth={state.smooth}, this one has smooth="
            f"{own.smooth}: their surfaces differ"
        )
    theirs, here = _shapes(state), _shapes(own)
    allowed = {name: {shape} for name, shape in here.items()}
    for i in range(len(own.traction_old)):
        # None before the first step, and where there are no springs
        found = {None, *map(_of_springs, springs[i : i + 1])}
        allowed[f"tractions of springs {i}"] = found
    allowed["accumulated slip"] |= {None}  # a state may be older than it
    for name, shapes in allowed.items():
        if theirs.get(name) not in shapes:
            return (
                f"the state is of another contact, mesh or method: {name} of shape "
                f"{theirs.get(name)}, here {here[name]}"
            )
    return None


def _of_springs(zone: ZoneData) -> tuple[int, ...]:
    """Shape of the tractions of a zone's springs."""
    surface = zone.facets.slave_surface
    return (*surface.facet_dofs.shape, surface.gdim)


def _shapes(state: ContactState) -> dict[str, tuple[int, ...] | None]:
    """Shape by name of the part, None where it is missing."""
    parts: dict[str, Any] = {
        "displacement": state.u,
        "old displacement": state.u_old,
        "multiplier": state.multiplier,
        "all unknowns": state.unknowns,
    }
    parts |= {f"tractions of springs {i}": t for i, t in enumerate(state.traction_old)}
    parts["accumulated slip"] = state.slip
    shapes = {name: None if p is None else np.shape(p) for name, p in parts.items()}
    counts = {
        "list of slave surfaces": (len(state.traction_old),),
        "free rigid bodies": tuple(map(len, state.freedoms)),
    }
    return shapes | counts


def extrapolate(system: Any, now: State, last: State, ratio: float) -> None:
    """Add a multiple of the change between two states to all unknowns."""
    values = system.host.values()
    if now.unknowns is None or last.unknowns is None:
        values += ratio * (now.u - last.u)
    else:
        values += ratio * (now.unknowns - last.unknowns)
    system.host.set_values(values)
    changes: dict[Body, Array] = {}  # several contacts may meet a body
    for contact, new, old in zip(system.contacts, now.parts, last.parts):
        f = contact.multiplier
        if f is not None and new.multiplier is not None and old.multiplier is not None:
            f.x.array[:] += ratio * (new.multiplier - old.multiplier)
        for body, end, begin in zip(contact.layout.bodies, new.freedoms, old.freedoms):
            totals = body.freedom.totals_of
            changes[body] = ratio * (totals(end) - totals(begin))
    for body, change in changes.items():
        body.freedom.values = body.freedom.values + change


def go_back(system: Any, begin: State, share: float) -> None:
    """Take back a part of the change of all unknowns since a state: keep a share of
    it."""
    u = system.u.x.array
    u[:] = begin.u + share * (u - begin.u)
    known: dict[Body, Array] = {}  # several contacts may meet a body
    for contact, old in zip(system.contacts, begin.parts):
        if contact.multiplier is not None and old.multiplier is not None:
            values = contact.multiplier.x.array
            values[:] = old.multiplier + share * (values - old.multiplier)
        known.update(zip(contact.layout.bodies, old.freedoms))
    for body, state in known.items():
        free = body.freedom
        start = state[: len(free)]
        free.values = start + share * (free.values - start)

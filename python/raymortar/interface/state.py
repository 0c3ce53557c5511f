"""Copies of the state that a step starts from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..compat import Array


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

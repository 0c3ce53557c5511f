"""How the rigid bodies that a slave meets move from step to step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from mpi4py import MPI

import numpy as np

from .. import _cpp
from ..compat import Array, Indices
from ..errors import raise_everywhere, require_agreement
from .body import Body

# In one step, with friction: a slip has no direction after half a turn. Radians
LARGEST_TURN = 0.5 * np.pi

# What `Body.motion` says of each body, (n, 15)
Motion = Array


def _told(body: Body) -> dict[str, str]:
    """What users say of a body, as they would put it."""
    motion, name = body.motion(), f"of the rigid {body.name}"
    held = np.where(np.isin(np.arange(3), _free_along(body)), 0.0, motion[:3])
    parts = {
        f"translation {name}": held,
        f"rotation {name}": motion[3:6],
        f"force {name}": body.force,
        f"moment {name}": np.atleast_1d(body.moment),
    }
    return {what: str(tuple(value.tolist())) for what, value in parts.items()}


def _free_along(body: Body) -> Indices:
    """Axes along which a body is free."""
    freedom = body.freedom
    return freedom.axis[~freedom.is_turn]


def _freedom(body: Body, rows: Mapping[Body, Any]) -> _cpp.Freedom:
    """How a body moves by its unknowns, as C++ has it."""
    if not body.is_free:
        return _cpp.Freedom()
    drift, spin, bend = body.freedom.rates()
    return _cpp.Freedom(
        centre=body.place, drift=drift, spin=spin, bend=bend, rows=rows[body]
    )


def loads_of_tools(zones: Sequence[Any]) -> bytes:
    """Where all rigid bodies are, and what pushes them: what a residual depends on."""
    parts = []
    for zone in zones:
        parts.append(zone.motions.present())
        for body in zone.motions.bodies:
            parts += [body.force, np.atleast_1d(body.moment)]
    return b"".join(part.tobytes() for part in parts)


class Motions:
    """Motions of some bodies: as they are set, as the last update saw them, and of the
    accepted step.

    Where bodies are is a load, as prescribed displacements are; where they were is
    history.

    Parameters
    ----------
    bodies
        Those that a slave surface meets; none, where it meets facets.

    Attributes
    ----------
    old
        Of the accepted step, (n, 15).
    """

    def __init__(self, bodies: Sequence[Body]) -> None:
        self.bodies = tuple(bodies)
        self.old = self._seen = self.present()

    def present(self) -> Motion:
        """As the bodies are set, (n, 15)."""
        found = [body.motion() for body in self.bodies]
        return np.array(found, dtype=np.float64).reshape(-1, 15)

    def send(
        self,
        cpp: Any,
        comm: MPI.Comm,
        frictional: bool,
        rows: Mapping[Body, Any] | None = None,
    ) -> None:
        """Hand the present poses to a C++ zone. Collective.

        Parameters
        ----------
        cpp
            The zone.
        comm
            Communicator of the mesh.
        frictional
            Whether slip counts.
        rows
            Of the unknowns of bodies that are free.

        Raises
        ------
        ContactError
            If ranks have moved bodies differently, or push them so, or if one has
            turned too far in this step for friction.
        """
        if not self.bodies:
            return
        present = self.present()
        for body in self.bodies:
            require_agreement(comm, **_told(body))
        if frictional:
            raise_everywhere(comm, self._turned_too_far(present))
        cpp.set_poses(*self._poses(present))
        if any(body.is_free for body in self.bodies):
            cpp.set_freedoms([_freedom(body, rows or {}) for body in self.bodies])
        self._seen = present

    def show(self, cpp: Any, motion: Motion) -> None:
        """Hand poses to a C++ zone, for a look at what they would meet."""
        cpp.set_poses(*self._poses(motion))

    def send_old(self, cpp: Any) -> None:
        """Hand the accepted poses to a C++ zone."""
        if self.bodies:
            cpp.set_old_poses(*self._poses(self.old))

    def accept(self) -> None:
        """What the last update saw becomes the accepted step."""
        self.old = self._seen

    def begin_at_present(self, body: Body) -> None:
        """Take where a body is for where it was at the accepted step."""
        if body in self.bodies:
            self.old = self.old.copy()
            self.old[self.bodies.index(body)] = body.motion()

    def _poses(self, motion: Motion) -> tuple[Array, Array]:
        """Rotations (n, 3, 3) and shifts (n, 3)."""
        found = [body.pose_of(one) for body, one in zip(self.bodies, motion)]
        return np.array([R for R, _ in found]), np.array([b for _, b in found])

    def _turned_too_far(self, present: Motion) -> str | None:
        """What is wrong with how far bodies turn in this step, if anything."""
        for body, now, was in zip(self.bodies, present, self.old):
            # No turn from one to the other is larger, and whole ones count
            angle = float(np.linalg.norm(now[3:6] - was[3:6]))
            if angle >= LARGEST_TURN:
                return (
                    f"{body!r} turns by {angle:.3g} rad since the accepted step: with "
                    f"friction it has to be less than {LARGEST_TURN:.3g}; take more steps"
                )
        return None

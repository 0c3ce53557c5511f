"""How the rigid bodies that a slave meets move from step to step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

import numpy as np

from .. import _cpp
from ..compat import Array, Indices
from ..errors import raise_everywhere, require_agreement
from .body import Body

if TYPE_CHECKING:
    from ..interface.zone_data import ZoneData

# Largest rotation in one step with friction: after half a turn a slip has no direction.
# Radians
LARGEST_TURN = 0.5 * np.pi

# `Body.motion` of each body, (n, 15)
Motion = Array


def _told(body: Body) -> dict[str, Array]:
    """Loads and position of a body by the names that messages use."""
    motion, name = body.motion(), f"of the rigid {body.name}"
    held = np.where(np.isin(np.arange(3), _free_along(body)), 0.0, motion[:3])
    return {
        f"translation {name}": held,
        f"rotation {name}": motion[3:6],
        f"force {name}": body.force,
        f"moment {name}": np.atleast_1d(body.moment),
    }


def _free_along(body: Body) -> Indices:
    """Axes along which a body is free."""
    freedom = body.freedom
    return freedom.axis[~freedom.is_turn]


def _freedom(body: Body, rows: Mapping[Body, Any]) -> _cpp.Freedom:
    """The C++ description of how a body moves by its unknowns."""
    if not body.is_free:
        return _cpp.Freedom()
    drift, spin, bend = body.freedom.rates()
    return _cpp.Freedom(
        centre=body.place, drift=drift, spin=spin, bend=bend, rows=rows[body]
    )


def loads_of_tools(zones: Sequence[ZoneData]) -> bytes:
    """Positions and loads of all rigid bodies, on which a residual depends."""
    parts = []
    for zone in zones:
        parts.append(zone.motions.present())
        for body in zone.motions.bodies:
            parts += [body.force, np.atleast_1d(body.moment)]
    return b"".join(part.tobytes() for part in parts)


class Motions:
    """Motions of some bodies: the present ones, those of the last update and those of
    the accepted step.

    A present position is a load, as a prescribed displacement is. An accepted position
    is history.

    Parameters
    ----------
    bodies
        Bodies that a slave surface meets; empty if it meets facets.

    Attributes
    ----------
    old
        Motions at the accepted step, (n, 15).
    """

    def __init__(self, bodies: Sequence[Body]) -> None:
        self.bodies = tuple(bodies)
        self.old = self._seen = self.present()

    def present(self) -> Motion:
        """Present motions, (n, 15)."""
        found = [body.motion() for body in self.bodies]
        return np.array(found, dtype=np.float64).reshape(-1, 15)

    def have_moved(self) -> bool:
        """Whether a body that is not free has moved since the accepted step."""
        held = [not body.is_free for body in self.bodies]
        return bool(np.any(self.present()[held] != self.old[held]))

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
            Whether there is friction.
        rows
            Rows of the unknowns of free bodies.

        Raises
        ------
        ContactError
            If positions or loads of bodies differ between ranks, or if a body has
            turned too far in this step for friction.
        """
        if not self.bodies:
            return
        present = self.present()
        if comm.size > 1:
            self._require_agreement(comm)
        if frictional:
            raise_everywhere(comm, self._turned_too_far(present))
        cpp.set_poses(*self._poses(present))
        if any(body.is_free for body in self.bodies):
            cpp.set_freedoms([_freedom(body, rows or {}) for body in self.bodies])
        self._seen = present

    def _require_agreement(self, comm: MPI.Comm) -> None:
        """Raise unless loads and positions are the same on all ranks. Collective."""
        told = [_told(body) for body in self.bodies]
        parts = [value for one in told for value in one.values()]
        values = np.concatenate(parts)
        ends = np.concatenate([values, -values])
        comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MIN)
        if np.array_equal(ends[: len(values)], -ends[len(values) :]):
            return
        for one in told:
            texts = {name: str(tuple(value.tolist())) for name, value in one.items()}
            require_agreement(comm, **texts)

    def send_old(self, cpp: Any) -> None:
        """Hand the accepted poses to a C++ zone."""
        if self.bodies:
            cpp.set_old_poses(*self._poses(self.old))

    def accept(self) -> None:
        """Take the motions of the last update as those of the accepted step."""
        self.old = self._seen

    def accepted(self, body: Body) -> Motion:
        """Motion of a body at the accepted step, (15,)."""
        motion: Motion = self.old[self.bodies.index(body)]
        return motion

    def begin_at_present(self, body: Body) -> None:
        """Take the present position of a body as that of the accepted step."""
        if body in self.bodies:
            self.old = self.old.copy()
            self.old[self.bodies.index(body)] = body.motion()

    def _poses(self, motion: Motion) -> tuple[Array, Array]:
        """Rotations (n, 3, 3) and shifts (n, 3)."""
        found = [body.pose_of(one) for body, one in zip(self.bodies, motion)]
        return np.array([R for R, _ in found]), np.array([b for _, b in found])

    def _turned_too_far(self, present: Motion) -> str | None:
        """Message if a body turns too far in this step, else None."""
        for body, now, was in zip(self.bodies, present, self.old):
            # The rotation between both is at most this; whole turns count too
            angle = float(np.linalg.norm(now[3:6] - was[3:6]))
            if angle >= LARGEST_TURN:
                return (
                    f"{body!r} turns by {angle:.3g} rad since the accepted step: with "
                    f"friction it has to be less than {LARGEST_TURN:.3g}; take more steps"
                )
        return None

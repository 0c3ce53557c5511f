"""How the rigid bodies that a slave meets move from step to step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mpi4py import MPI

import numpy as np

from ..compat import Array
from ..errors import raise_everywhere, require_agreement
from .body import Body

# In one step, with friction: a slip has no direction after half a turn. Radians
LARGEST_TURN = 0.5 * np.pi

# Translation and rotation of each body, (n, 2, 3)
Motion = Array


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
        Of the accepted step, (n, 2, 3).
    """

    def __init__(self, bodies: Sequence[Body]) -> None:
        self.bodies = tuple(bodies)
        self.old = self._seen = self.present()

    def present(self) -> Motion:
        """As the bodies are set, (n, 2, 3)."""
        found = [body.motion() for body in self.bodies]
        return np.array(found, dtype=np.float64).reshape(-1, 2, 3)

    def send(self, cpp: Any, comm: MPI.Comm, frictional: bool) -> None:
        """Hand the present poses to a C++ zone. Collective.

        Raises
        ------
        ContactError
            If ranks have moved bodies differently, or if one has turned too far in this
            step for friction.
        """
        if not self.bodies:
            return
        present = self.present()
        require_agreement(comm, rigid_motion=tuple(present.ravel().tolist()))
        if frictional:
            raise_everywhere(comm, self._turned_too_far(present))
        cpp.set_poses(*self._poses(present))
        self._seen = present

    def send_old(self, cpp: Any) -> None:
        """Hand the accepted poses to a C++ zone."""
        if self.bodies:
            cpp.set_old_poses(*self._poses(self.old))

    def accept(self) -> None:
        """What the last update saw becomes the accepted step."""
        self.old = self._seen

    def _poses(self, motion: Motion) -> tuple[Array, Array]:
        """Rotations (n, 3, 3) and shifts (n, 3)."""
        found = [body.pose_of(*one) for body, one in zip(self.bodies, motion)]
        return np.array([R for R, _ in found]), np.array([b for _, b in found])

    def _turned_too_far(self, present: Motion) -> str | None:
        """What is wrong with how far bodies turn in this step, if anything."""
        for body, now, was in zip(self.bodies, present, self.old):
            # No turn from one to the other is larger, and whole ones count
            angle = float(np.linalg.norm(now[1] - was[1]))
            if angle >= LARGEST_TURN:
                return (
                    f"{body!r} turns by {angle:.3g} rad since the accepted step: with "
                    f"friction it has to be less than {LARGEST_TURN:.3g}; take more steps"
                )
        return None

"""Masters without facets, which rays may hit in their place, and their motions by step.

`rigid.Body` is one. The core knows no more of it than is here.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np

from .compat import Array
from .hooks import hooks


class Target(ABC):
    """A master that has no facets.

    Attributes
    ----------
    name, is_named
        Name in messages and columns, and whether the user gave it.
    shape
        What rays hit: ``shape.gdim`` is its dimension, None for any, ``shape.place`` its
        centre.
    tool, follower, cpp
        The shape, what tied surfaces meet in its place, and its position, unknowns and
        loads, in C++.
    freedom
        Unknowns that follow from forces.
    force, moment
        Its loads.
    centre, place
        Its centre before any motion, and now, (3,).
    has_surface
        Whether anything can touch it.
    """

    name: str
    is_named: bool
    shape: Any
    tool: Any
    follower: Any
    cpp: Any
    freedom: Any
    force: Any
    moment: Any
    centre: Array
    place: Any
    has_surface: bool

    @property
    def is_free(self) -> bool:
        """Whether any of its motions follows from forces."""
        return len(self.freedom) > 0

    @abstractmethod
    def motion(self) -> Array:
        """Everything that determines the position, (15,)."""

    @abstractmethod
    def pushed(self) -> tuple[Array, Array]:
        """Forces along its unknowns other than contact, (n,), and minus their
        derivative, (n, n). Force, and force per length."""

    @abstractmethod
    def pose_of(self, motion: Array) -> tuple[Array, Array]:
        """Rotation R (3, 3) and shift b (3,) of its points after a motion:
        x = R X + b."""


def as_target(master: Any) -> Target | None:
    """The target that the master of a pair stands for; None for a tag."""
    is_tag = isinstance(master, (str, int, np.integer))
    found = master
    if hooks.as_target is not None and not is_tag:
        found = hooks.as_target(master)
    return found if isinstance(found, Target) else None


# `Target.motion` of each body, (n, 15)
Motion = Array


class Motions:
    """Motions of some bodies: present ones and those of the accepted step.

    A present position is a load, as a prescribed displacement is. An accepted position
    is history.

    Attributes
    ----------
    old
        Motions at the accepted step, (n, 15).
    """

    def __init__(self, bodies: Sequence[Target]) -> None:
        self.bodies = tuple(bodies)
        for body in bodies:
            body.cpp.see()
        self.old = self.present()

    def present(self) -> Motion:
        """Present motions, (n, 15)."""
        found = [body.motion() for body in self.bodies]
        return np.array(found, dtype=np.float64).reshape(-1, 15)

    def have_moved(self) -> bool:
        """Whether a body that is not free has moved since the accepted step."""
        held = [not body.is_free for body in self.bodies]
        return bool(np.any(self.present()[held] != self.old[held]))

    def send_old(self, cpp: Any) -> None:
        """Hand the accepted poses to a C++ zone."""
        if self.bodies:
            poses = [body.pose_of(one) for body, one in zip(self.bodies, self.old)]
            cpp.set_old_poses(*map(np.array, zip(*poses)))

    def accept(self) -> None:
        """Take the motions of the last update as those of the accepted step."""
        found = [body.cpp.seen for body in self.bodies]
        self.old = np.array(found, dtype=np.float64).reshape(-1, 15)

    def accepted(self, body: Target) -> Motion:
        """Motion of a body at the accepted step, (15,)."""
        return self.old[self.bodies.index(body)]

    def begin_at_present(self, body: Target) -> None:
        """Take the present position of a body as that of the accepted step."""
        if body in self.bodies:
            self.old = self.old.copy()
            self.old[self.bodies.index(body)] = body.motion()

"""Columns of a history on rigid bodies."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..compat import Array
from ..rigid.body import Body


def rigid_bodies(zones: Sequence[Any]) -> list[Body]:
    """List the rigid bodies that slaves meet, each once."""
    return list(dict.fromkeys(b for zone in zones for b in zone.facets.bodies))


class BodyColumns:
    """Record force, moment, motion and work of the rigid bodies of a contact."""

    def __init__(self, contact: Any) -> None:
        self._contact = contact
        self._bodies = rigid_bodies(contact.zones)
        self._dim = contact.u.function_space.mesh.geometry.dim
        plain = [re.sub(r"[^0-9A-Za-z]", "_", body.name) for body in self._bodies]
        labels = [
            f"{label}_{k}" if plain.count(label) > 1 else label
            for k, label in enumerate(plain)
        ]
        self._columns = [self._names(label) for label in labels]
        self._begin = [self._motion(body) for body in self._bodies]
        self.names = [name for columns in self._columns for name in columns]

    def _names(self, label: str) -> list[str]:
        """Name push, translation, moment, rotation and work of a body."""
        axes = [f"_{x}" for x in "xyz"[: self._dim]]
        turns = axes if self._dim == 3 else [""]
        names = [f"push_{label}", f"translation_{label}"]
        found = [name + x for name in names for x in axes]
        names = [f"moment_{label}", f"rotation_{label}"]
        return [*found, *(name + x for name in names for x in turns), f"work_{label}"]

    def _motion(self, body: Body) -> Array:
        """Join translation and rotation."""
        turn = body.rotation if self._dim == 3 else body.rotation[2:]
        return np.concatenate([body.translation[: self._dim], turn])

    def values(self, last: Mapping[str, float] | None) -> list[float]:
        """Find the columns at the last update, given the last record. Collective."""
        found: list[float] = []
        for body, names, begin in zip(self._bodies, self._columns, self._begin):
            on = self._contact.results.resultant_on(body)
            force, moment = on.force, np.atleast_1d(on.moment)
            if on.radial is not None:  # work is done where a ring is widened
                force = np.array([on.radial, force[1]])
            load, motion = np.concatenate([force, moment]), self._motion(body)
            before, work, d = np.zeros_like(load), 0.0, self._dim
            if last is not None:
                *row, work = (last[name] for name in names)
                push, way, twist, turn = np.split(row, [d, 2 * d, d + len(load)])
                before, begin = np.append(push, twist), np.append(way, turn)
            work -= float(0.5 * (load + before) @ (motion - begin))
            found += [*force, *motion[:d], *moment, *motion[d:], work]
        return list(map(float, found))

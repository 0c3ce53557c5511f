"""What a history records of rigid bodies."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..compat import Array
from ..rigid.body import Body

if TYPE_CHECKING:
    from ..interaction import Interaction
    from ..interface.zone_data import ZoneData


def rigid_bodies(zones: Sequence[ZoneData]) -> list[Body]:
    """The rigid bodies that slaves meet, each once."""
    return list(dict.fromkeys(b for zone in zones for b in zone.facets.bodies))


class BodyColumns:
    """Force, moment, motion and work of the rigid bodies of a contact or of several.

    Parameters
    ----------
    contact
        The contact, or `interactions.Interactions` of several.

    Attributes
    ----------
    names
        Names of the columns, in the order of `values`.
    """

    def __init__(self, contact: Interaction) -> None:
        self._contact = contact
        self._bodies = rigid_bodies(contact.zones)
        self._dim = contact.u.function_space.mesh.geometry.dim
        plain = [re.sub(r"[^0-9A-Za-z]", "_", body.name) for body in self._bodies]
        self._labels = [
            f"{label}_{k}" if plain.count(label) > 1 else label
            for k, label in enumerate(plain)
        ]
        self._begin = [self._motion(body) for body in self._bodies]
        self.names = [name for label in self._labels for name in self._columns(label)]

    def _columns(self, label: str) -> list[str]:
        axes = "xyz"[: self._dim]
        straight = [
            f"{what}_{label}_{x}" for what in ("push", "translation") for x in axes
        ]
        turns = [f"{what}_{label}" for what in ("moment", "rotation")]
        if self._dim == 3:
            turns = [f"{turn}_{x}" for turn in turns for x in axes]
        return [*straight, *turns, f"work_{label}"]

    def _motion(self, body: Body) -> Array:
        """Translation and rotation, in the order of the columns."""
        turn = body.rotation if self._dim == 3 else body.rotation[2:]
        return np.concatenate([body.translation[: self._dim], turn])

    def values(self, last: Mapping[str, float] | None) -> list[float]:
        """The columns at the last update. Collective.

        Parameters
        ----------
        last
            The last record by column. None before the first one.
        """
        found: list[float] = []
        for body, label, begin in zip(self._bodies, self._labels, self._begin):
            on = self._contact.results.resultant_on(body)
            force, moment = on.force, np.atleast_1d(on.moment)
            if on.radial is not None:  # radial tractions do work where a ring is
                # widened
                force = np.array([on.radial, force[1]])
            load, motion = np.concatenate([force, moment]), self._motion(body)
            before, work = np.zeros_like(load), 0.0
            if last is not None:
                *columns, known = self._columns(label)
                row = np.array([last[name] for name in columns])
                d, t = self._dim, len(moment)
                before = np.concatenate([row[:d], row[2 * d : 2 * d + t]])
                begin = np.concatenate([row[d : 2 * d], row[2 * d + t :]])
                work = last[known]
            work -= float(0.5 * (load + before) @ (motion - begin))
            parts = force, motion[: self._dim], moment, motion[self._dim :]
            found += [*np.concatenate(parts).tolist(), work]
        return found

"""States at which a functional has no derivative: a status changes exactly there."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.compat import Mask
from ..core.interface.point_results import CLOSED, OPEN
from ..core.options.friction import Coulomb

# Distance from a change of status that counts as none, over the largest traction
NEAR = 1e-8


def at_kink(problem: Any) -> str | None:
    """Name a surface where a status changes exactly at the present state. Collective.

    The normal traction of the law is then zero though a point touches, or a point that
    sticks is on the bound of friction.
    """
    found = None
    for contact in problem.contact.contacts:
        for zone in contact.zones:
            if zone.has_law_at_nodes:
                changes = _at_nodes(zone)
            else:
                changes = _at_points(contact, zone) | _on_bound(contact, zone)
            if changes.any():
                found = zone.facets.spoken
    for one in problem.comm.allgather(found):
        if one is not None:
            return (
                f"adjoint: a status of {one} changes exactly at this state, where there "
                "is no derivative: that of the present status is returned"
            )
    return None


def _at_points(contact: Any, zone: Any) -> Mask:
    """Whether points touch without a traction of the law, (points,)."""
    points = zone.points()
    law = points["gamma"] * points["gap"]
    if contact.multiplier is not None:
        law = law + np.einsum("qi,qi->q", points["traction"], points["contact_normal"])
    size = np.abs(points["pressure"]).max(initial=0.0)
    touches: Mask = (
        (points["status"] >= OPEN) & (np.abs(law) <= NEAR * size) & (size > 0)
    )
    return touches


def _at_nodes(zone: Any) -> Mask:
    """Whether closed nodes have no traction, (nodes,)."""
    nodes = zone.cpp.nodes()
    p = np.abs(nodes["pressure"])
    size = p.max(initial=0.0)
    touches: Mask = (nodes["status"] >= CLOSED) & (p <= NEAR * size) & (size > 0.0)
    return touches


def _on_bound(contact: Any, zone: Any) -> Mask:
    """Whether points of a penalty that stick are on the bound of Coulomb's number,
    (points,)."""
    points: Any = zone.points()
    law = contact.friction
    if contact.multiplier is not None or not isinstance(law, Coulomb) or law.field:
        return np.zeros(len(points["status"]), dtype=bool)
    n, t = points["contact_normal"], points["traction"]
    p = np.einsum("qi,qi->q", t, n)
    mu: Any = law.mu
    size, bound = np.linalg.norm(t - p[:, None] * n, axis=1), mu * np.abs(p)
    on: Mask = (points["status"] == CLOSED) & (bound > 0.0)
    return on & (size >= (1.0 - NEAR) * bound)

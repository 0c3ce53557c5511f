"""Statuses of points and nodes, and parts of tractions at points."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from ..compat import Array


class PointStatus(IntEnum):
    """Status of an integration point: ``Contact.points()["status"]``.

    >>> slips = points["status"] == PointStatus.SLIP
    """

    NO_HIT = 0
    """Its ray meets no master, or it stands for an uncovered part of a facet."""
    OPEN = 1
    """Its ray meets a master that it does not touch."""
    STICK = 2
    """In contact, without slip in this step."""
    SLIP = 3
    """In contact, and slips; without friction every point in contact."""


class NodeStatus(IntEnum):
    """Status of a slave node: values of the Function ``Contact.status()``."""

    OPEN = 0
    """Not in contact, or without a master in reach: see ``Contact.coverage()``."""
    STICK = 1
    """In contact, without slip in this step."""
    SLIP = 2
    """In contact, and slips; without friction every node in contact."""


# As plain numbers; from CLOSED on a point is in contact
OPEN, CLOSED = int(PointStatus.OPEN), int(PointStatus.STICK)


def along_normal(points: dict[str, Array], vectors: Array) -> Array:
    """Project vectors (n, d) at the points on the normals of the law's frame."""
    n = points["contact_normal"]
    return np.einsum("qi,qi->q", vectors, n)[:, None] * n


def pressures(points: dict[str, Array]) -> Array:
    """Find the normal tractions at the points, positive in compression, (n,)."""
    return -np.einsum("qi,qi->q", points["traction"], points["contact_normal"])


def traction_part(points: dict[str, Array], part: str) -> Array:
    """Take the total, normal or tangential tractions at the points, (n, d)."""
    traction = points["traction"]
    if part == "total":
        return traction
    normal = along_normal(points, traction)
    return normal if part == "normal" else traction - normal

"""Whether friction grips bodies: its bound suffices for their loads where they touch."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.optimize import nnls

from ..core.compat import Array, Indices
from ..core.interaction import Interaction
from ..core.interface.point_results import OPEN
from ..core.options.friction import Coulomb
from ..diagnose.holding import bodies_at, met

# Share of the loads that may be left over
LEFT = 1e-2
# Digits to which normals of one pair of bodies are the same
DIGITS = 2
# Edges of the pyramid inside the cone of friction in 3D
EDGES = 8
# Coefficient of laws without a bound that is a multiple of the pressure
STICKS = 1e3


def grips(contact: Interaction, at: Indices, load: Array, faced: bool = False) -> bool:
    """Whether forces in the cones of friction, at points where bodies touch, bear
    the resultants of bodies. Turns are left out: a body may roll, but not slide.

    Non-negative least squares for the sizes of the forces along the edges of the cones.
    Contacts without friction have the normal alone. Collective.

    Parameters
    ----------
    at
        Of each body, and of tools at the end, its row of `load`; of those that do not
        move the number of rows.
    load
        Resultants, (moving, d). Force.
    faced
        Whether what is in reach counts as touched.
    """
    comm, (count, dim) = contact.layout.comm, load.shape
    touching = np.concatenate([np.empty((0, 3 + dim)), *_touching(contact, at, faced)])
    every = np.unique(np.concatenate(comm.allgather(touching)), axis=0)
    bodies, mu, n = every[:, :2].astype(int), every[:, 2], every[:, 3:]
    n = n / np.linalg.norm(n, axis=1)[:, None]
    edges = n + mu[:, None] * _around(n)
    forces = np.zeros((*edges.shape[:2], count + 1, dim))
    each = np.arange(len(n))
    forces[:, each, bodies[:, 0]] += edges
    forces[:, each, bodies[:, 1]] -= edges
    columns = forces[:, :, :-1].reshape(len(edges) * len(n), count * dim)
    try:
        _, left = nnls(columns.T, -load.ravel())
    except RuntimeError:  # too many iterations: nothing speaks against it
        return True
    return bool(left <= LEFT * np.linalg.norm(load))


def _touching(contact: Interaction, at: Indices, faced: bool) -> Iterator[Array]:
    """Yield what differs among the points of each zone on this rank that are closed, or
    all that are `faced`: rows of the slave and the master in the load, coefficient and normal, (n, 3 + d).
    """
    for one in contact.contacts:
        mu = coefficient(one.friction)
        for zone in one.zones if one.tied is None else ():
            points = zone.points()
            closed = points["status"] >= OPEN if faced else met(points, inside=True)
            rows = at[bodies_at(contact, zone, points, closed)].T
            n = np.round(points["master_normal"][closed], DIGITS)
            columns = [rows, np.full((len(n), 1), mu), n]
            yield np.unique(np.concatenate(columns, axis=1), axis=0)


def has_friction(contact: Interaction) -> bool:
    """Whether bodies stick to each other anywhere."""
    return any(coefficient(one.friction) > 0.0 for one in contact.contacts)


def coefficient(friction: Any) -> float:
    """Bound of a law of friction over the pressure; large where it is no such number."""
    if friction is None:
        return 0.0
    is_number = isinstance(friction, Coulomb) and friction.field is None
    return float(friction.coefficient) if is_number else STICKS


def _around(n: Array) -> Array:
    """Unit vectors across each normal, evenly around it, (edges, n, d)."""
    if n.shape[1] == 2:
        t = np.stack([-n[:, 1], n[:, 0]], axis=1)
        return np.array([t, -t])
    e = np.eye(3)[np.abs(n).argmin(axis=1)]
    a = np.cross(n, e)
    a = a / np.linalg.norm(a, axis=1)[:, None]
    b = np.cross(n, a)
    angle = 2.0 * np.pi / EDGES * np.arange(EDGES)[:, None, None]
    return np.asarray(np.cos(angle) * a + np.sin(angle) * b)

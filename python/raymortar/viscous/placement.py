"""Where bodies are, about what they turn, and turns of any size."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core.compat import Array, Indices
from ..core.problem import CoupledProblem
from ..diagnose.rigid_motions import rigid_motions, sums_by_body


class Placement(NamedTuple):
    """Where bodies are, and about what they turn.

    Attributes
    ----------
    u, x
        Displacements and places of this rank's nodes. Length, (nodes, d).
    centre
        Mean place of each body's nodes. Length, (bodies, d).
    radius
        Root mean square of their distances from it. Length, (bodies,).
    """

    u: Array
    x: Array
    centre: Array
    radius: Array

    def motions(self, x: Array, body: Indices) -> Array:
        """Find rigid motions at points of bodies, (motions, n, d). Turns are lengths at
        the radius."""
        place = (x - self.centre[body]) / self.radius[body][:, None]
        return _rigid_motions(place)


def placement_of(problem: CoupledProblem) -> Placement:
    """Find where bodies are. Collective."""
    contact = problem.contact
    V = contact.u.function_space
    dim, owned = V.dofmap.index_map_bs, V.dofmap.index_map.size_local
    u = contact.u.x.array.reshape(-1, dim).copy()
    x = V.tabulate_dof_coordinates()[:, :dim] + u
    ones = np.tile(np.eye(dim), owned)
    sums = sums_by_body(problem, np.array([ones[0], *(ones * x[:owned].ravel())]))
    nodes, *places = problem.comm.allreduce(sums)
    centre = np.array(places).T / nodes[:, None]
    apart = (x - centre[contact.system.bodies.dofs])[:owned].ravel()
    squares = problem.comm.allreduce(sums_by_body(problem, apart[None] ** 2)[0])
    return Placement(u, x, centre, np.sqrt(squares / nodes))


def _rigid_motions(x: Array) -> Array:
    """Find translations and turns about the origin at points (n, d), (motions, n, d)."""
    flat = rigid_motions(x)
    return flat.reshape(len(flat), *x.shape)


def turned(arm: Array, angles: Array) -> Array:
    """Turn vectors (n, d) by angles in the planes of `rigid_motions`, (n, 1 or 3)
    [Rodrigues]."""
    angle = np.linalg.norm(angles, axis=1)[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        along = np.where(angle > 0.0, np.sin(angle) / angle, 1.0)
        back = np.where(angle > 0.0, (1.0 - np.cos(angle)) / angle**2, 0.5)

    def spin(x: Array) -> Array:
        modes = _rigid_motions(x)[x.shape[1] :]
        return np.asarray(np.einsum("nm,mnd->nd", angles, modes))

    once = spin(arm)
    return np.asarray(arm + along * once + back * spin(once))

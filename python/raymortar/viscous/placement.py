"""Places of bodies, centres of their turns, and turns of any size."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core.compat import Array, Indices
from ..core.problem import CoupledProblem
from ..diagnose.holding import sums_by_body
from ..diagnose.rigid_motions import rigid_motions


class Placement(NamedTuple):
    """Places of bodies, and the centres of their turns.

    Attributes
    ----------
    u, x
        Displacements and places of this rank's nodes. Length, (nodes, d).
    centre
        Mean place of each body's nodes, weighted by the sizes of the forces on them.
        Length, (bodies, d).
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


def placement_of(problem: CoupledProblem, forces: Array | None = None) -> Placement:
    """Find where bodies are, given the forces on their owned dofs of u: a weight has no
    moment about the centre, whatever the mesh. Without forces, or where they vanish, all
    nodes weigh the same. Collective."""
    contact = problem.contact
    V = contact.u.function_space
    dim, owned = V.dofmap.index_map_bs, V.dofmap.index_map.size_local
    u = contact.u.x.array.reshape(-1, dim).copy()
    x = V.tabulate_dof_coordinates()[:, :dim] + u
    of, mine = contact.system.bodies.dofs, x[:owned]
    nodes, middle = _means(problem, mine, np.ones(owned))
    centre = middle
    if forces is not None:
        size = np.linalg.norm(forces.reshape(-1, dim), axis=1)
        weight, centre = _means(problem, mine, size)
        centre = np.where(weight[:, None] > 0.0, centre, middle)
    squares = (mine - centre[of[:owned]]) ** 2
    mean = _sums(problem, squares.sum(axis=1)[None])[0] / nodes
    return Placement(u, x, centre, np.sqrt(mean))


def _means(problem: CoupledProblem, x: Array, weight: Array) -> tuple[Array, Array]:
    """Sum up the weights of owned nodes by body, (bodies,), and find their mean places,
    (bodies, d). Collective."""
    total, *places = _sums(problem, np.vstack([weight, weight * x.T]))
    return total, np.array(places).T / np.where(total > 0.0, total, 1.0)[:, None]


def _sums(problem: CoupledProblem, values: Array) -> Array:
    """Sum values at owned nodes by body, (values, bodies). Collective."""
    return np.asarray(problem.comm.allreduce(sums_by_body(problem, values)))


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

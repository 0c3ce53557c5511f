"""Bodies that can still move as a whole: no condition, spring or contact holds them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mpi4py import MPI

import numpy as np

from ..compat import Array, Indices, Mask
from .lost_contact import AXES, has_springs, touched

if TYPE_CHECKING:
    from ..interaction import Interaction
    from ..problem import CoupledProblem

# Of the largest stiffness of conditions against rigid motions: none
_NOTHING = 1e-9
# Of a unit motion: no part of it
_NO_PART = 1e-6


def loose_bodies(problem: CoupledProblem, led: Mask | Array | None = None) -> list[str]:
    """Sentences on bodies that can move as a whole without any force. Collective.

    Bodies in contact at the last iterate, and bodies on springs, count as held.

    Parameters
    ----------
    problem
        After an evaluation of its residual.
    led
        Weights of the owned dofs of u in a controlled displacement, which counts as
        prescribed.
    """
    groups, n = problem.convergence.groups, problem.convergence.groups.bodies
    modes = _rigid_modes(problem.contact, n)
    m, dim = modes.shape[0], modes.shape[2]
    body = np.repeat(problem.contact.bodies.dofs[: modes.shape[1]], dim)
    rows = modes.reshape(m, -1)
    held = problem.constrained.astype(float)
    grip = np.array([[_by_body(body, held * a * b, n) for b in rows] for a in rows])
    lead = np.zeros((m, n))
    if led is not None:
        lead = np.array([_by_body(body, led * a, n) for a in rows])
    comm = problem.comm
    for array in (grip, lead):
        comm.Allreduce(MPI.IN_PLACE, array)
    if problem.contact.axisymmetric:  # hoops hold all but the way along the axis
        grip += np.diag([1.0, 0.0, 1.0])[:, :, None]
    size = np.abs(lead).max(initial=0.0) or 1.0
    grip += lead[:, None] * lead[None] / size**2
    free = ~(touched(problem.contact, n) | has_springs(problem))
    ways = {b: _ways(grip[:, :, b], dim) for b in np.flatnonzero(free)}
    ways = {b: way for b, way in ways.items() if way}
    names = groups.names() if ways else []
    return [f"{names[b]} {way}" for b, way in ways.items()]


def _by_body(body: Indices, values: Array, count: int) -> Array:
    return np.bincount(body, values, count).astype(float)


def _rigid_modes(contact: Interaction, count: int) -> Array:
    """Translations and rotations of each body at the owned nodes, (motions, nodes, d).
    Rotations are about the body's middle, over its size. Collective."""
    V = contact.u.function_space
    dim, owned = V.mesh.geometry.dim, V.dofmap.index_map.size_local
    body, x = contact.bodies.dofs[:owned], V.tabulate_dof_coordinates()[:owned, :dim]
    sums = np.array([_by_body(body, c, count) for c in (*x.T, np.ones(owned))])
    contact.layout.comm.Allreduce(MPI.IN_PLACE, sums)
    x = x - (sums[:-1] / sums[-1]).T[body]
    squares = _by_body(body, np.einsum("nd,nd->n", x, x), count)
    contact.layout.comm.Allreduce(MPI.IN_PLACE, squares)
    x = x / np.sqrt(squares / sums[-1])[body, None]
    modes = [np.tile(e, (owned, 1)) for e in np.eye(dim)]
    for i, j in ((0, 1), (1, 2), (2, 0))[: 1 if dim == 2 else 3]:
        turn = np.zeros((owned, dim))
        turn[:, i], turn[:, j] = -x[:, j], x[:, i]
        modes.append(turn)
    return np.array(modes)


def _ways(grip: Array, dim: int) -> str:
    """How a body can move, in words.

    `grip` is the stiffness against its rigid motions, (motions, motions).
    """
    values, motions = np.linalg.eigh(grip)
    none = motions[:, values <= _NOTHING * max(values.max(), _NO_PART)]
    if not none.shape[1]:
        return ""
    _, turns, mixed = np.linalg.svd(none[dim:])
    count = int(np.count_nonzero(turns > _NO_PART))
    straight = none[:dim] @ mixed[count:].T
    axes = [AXES[i] for i in range(dim) if np.linalg.norm(straight[i]) > _NO_PART]
    found = [f"is held by nothing along {', '.join(axes)}"] if axes else []
    return " and ".join(found + ["may turn"] * (count > 0))

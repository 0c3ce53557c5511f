"""Rigid motions of bodies: translations and turns, and the part of a motion that is one."""

from __future__ import annotations

import numpy as np

from ..core.compat import Array, Mask
from ..core.discretization.ranks import ends_of
from ..core.interaction import Interaction
from ..core.problem import CoupledProblem
from .holding import AXES, sums_by_body


def places(contact: Interaction, x: Array | None = None) -> Array:
    """Find points, or the owned nodes of u, from the middle of the meshes, over their
    size, (points, d). Collective."""
    V = contact.u.function_space
    dim, owned = V.mesh.geometry.dim, V.dofmap.index_map.size_local
    nodes = V.tabulate_dof_coordinates()[:owned, :dim]
    ends = ends_of(nodes, contact.layout.comm)
    size = np.linalg.norm(np.ptp(ends, axis=0))
    return np.asarray(((nodes if x is None else x) - ends.mean(axis=0)) / size)


def rigid_motions(x: Array) -> Array:
    """Find translations and turns about the origin at points (n, d), (motions, n d)."""
    n, dim = x.shape
    modes = np.zeros((3 if dim == 2 else 6, n, dim))
    modes[:dim] = np.eye(dim)[:, None]
    for turn, (i, j) in zip(modes[dim:], ((0, 1), (1, 2), (2, 0))):
        turn[:, i], turn[:, j] = -x[:, j], x[:, i]
    return modes.reshape(len(modes), -1)


def grip_of(problem: CoupledProblem, motions: Array, held: Mask) -> Array:
    """Find the stiffness against rigid motions of each body by holding owned dofs,
    (motions, motions, bodies). Collective."""
    mine = np.array([sums_by_body(problem, held * row * motions) for row in motions])
    return np.asarray(problem.comm.allreduce(mine))


def rigid_part(
    problem: CoupledProblem, body: int, change: Array
) -> tuple[Array, Array, Array]:
    """Find the rigid part of a body's motion, the products of its rigid motions with
    each other, and those with the change of the owned dofs of u. Collective."""
    modes = rigid_motions(places(problem.contact))
    grip = grip_of(problem, modes, np.ones(len(change), dtype=bool))[:, :, body]
    push = problem.comm.allreduce(sums_by_body(problem, modes * change))[:, body]
    return np.linalg.lstsq(grip, push, rcond=None)[0], grip, push


def motion_in_words(problem: CoupledProblem, body: int, change: Array) -> str:
    """Name the rigid part of a body's motion, from the change of the owned dofs of u.
    Collective."""
    dim = problem.contact.u.function_space.dofmap.index_map_bs
    motion, grip, push = rigid_part(problem, body, change)
    nodes, mixed, turn = grip[0, 0], grip[dim:, :dim], motion[dim:]
    # Turns about the body's own middle
    spin = turn @ (grip[dim:, dim:] - mixed @ mixed.T / nodes) @ turn
    straight, spin = np.abs(push[:dim]) / nodes, np.sqrt(max(spin, 0.0) / nodes)
    least = 0.5 * max(straight.max(), spin)
    along = ", ".join(AXES[i] for i in np.flatnonzero(straight >= least))
    words = [f"move along {along}"] * bool(along) + ["turn"] * bool(spin >= least)
    return " and ".join(words)

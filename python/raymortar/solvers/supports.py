"""Springs for bodies that the conditions alone do not hold."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..compat import Array, Indices, Mask
from ..host.bodies import find_bodies
from .rigid_motions import NOTHING, rigid_motions


def supports(contact: Any, surface: Indices, fixed: Mask) -> npt.NDArray[np.int64]:
    """Dofs of u whose springs hold all bodies, unrolled. For one rank.

    Some nodes of each body that the conditions alone do not hold, on the surfaces of
    contact and far from each other.

    Parameters
    ----------
    contact
        Contact, or several.
    surface
        Block dofs on the surfaces of contact.
    fixed
        Whether a dof of u is prescribed, (n_u,), unrolled.
    """
    V = contact.u.function_space
    dim = V.mesh.geometry.dim
    x = V.tabulate_dof_coordinates()[:, :dim]
    motions = np.column_stack(rigid_motions(V))
    of_body, found = find_bodies(V), []
    for body in range(of_body.count):
        nodes = np.flatnonzero(of_body.dofs == body)
        held = unrolled(nodes, dim)
        held = held[fixed[held]]
        if _rank(motions[held]) == motions.shape[1]:
            continue
        candidates = surface[of_body.dofs[surface] == body]
        found.append(unrolled(_far_apart(candidates, x, dim + 1), dim))
    dofs = np.concatenate([np.empty(0, dtype=np.int64), *found])
    return dofs[~fixed[dofs]]


def unrolled(nodes: Indices, dim: int) -> npt.NDArray[np.int64]:
    """Dofs of the components of some block dofs."""
    return (dim * nodes.astype(np.int64)[:, None] + np.arange(dim)).ravel()


def _rank(motions: Array) -> int:
    """Number of rigid motions that dofs prevent."""
    if not len(motions):
        return 0
    # Translations and rotations alike
    lengths = np.maximum(np.abs(motions).max(axis=0), 1e-300)
    sizes = np.linalg.svd(motions / lengths, compute_uv=False)
    return int((sizes > NOTHING * sizes.max()).sum())


def _far_apart(nodes: Indices, x: Array, count: int) -> Indices:
    """Some of the nodes, each as far as can be from those before it."""
    if len(nodes) <= count:
        return nodes
    points = x[nodes]
    distance = np.linalg.norm(points - points.mean(axis=0), axis=1)
    chosen = []
    for _ in range(count):
        chosen.append(int(distance.argmax()))
        to_last = np.linalg.norm(points - points[chosen[-1]], axis=1)
        distance = to_last if len(chosen) == 1 else np.minimum(distance, to_last)
    return nodes[chosen]

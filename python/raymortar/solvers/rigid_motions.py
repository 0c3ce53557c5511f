"""Rigid motions of the bodies, which the coarse levels of multigrid must represent."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from petsc4py import PETSc

import numpy as np

from ..compat import Array, Mask

if TYPE_CHECKING:
    from ..interaction import Interaction

# Share of a motion that is rounding error once the other motions are taken off
NOTHING = 1e-8


def rigid_motions(V: Any) -> list[Array]:
    """Translations and rotations at the owned dofs of a vector space, unrolled.

    Rotations are about the mean of all ranks' dofs. Collective.
    """
    dim, index_map = V.mesh.geometry.dim, V.dofmap.index_map
    n = index_map.size_local
    x = V.tabulate_dof_coordinates()[:n, :dim]
    x = x - V.mesh.comm.allreduce(x.sum(axis=0)) / index_map.size_global
    motions = [np.tile(e, (n, 1)) for e in np.eye(dim)]
    for i, j in ((0, 1), (1, 2), (2, 0))[: 1 if dim == 2 else 3]:
        turn = np.zeros((n, dim))
        turn[:, i], turn[:, j] = -x[:, j], x[:, i]
        motions.append(turn)
    return [motion.ravel() for motion in motions]


def near_nullspace(contact: Interaction) -> PETSc.NullSpace:
    """Rigid motions as vectors over the owned displacement dofs. Collective."""
    return nullspace_of(contact.u.function_space)


def nullspace_of(V: Any, fixed: Mask | None = None) -> PETSc.NullSpace:
    """Rigid motions of a vector space, orthonormal. Collective.

    Parameters
    ----------
    V
        Vector space.
    fixed
        Whether an owned dof cannot move, (n,), unrolled. A motion that depends on the
        others without these dofs is left out.
    """
    comm = V.mesh.comm
    vectors: list[PETSc.Vec] = []
    for motion in rigid_motions(V):
        vector = PETSc.Vec().createMPI((len(motion), None), comm=comm)
        vector.array[:] = motion if fixed is None else np.where(fixed, 0.0, motion)
        size = vector.norm()
        for other in vectors:
            vector.axpy(-other.dot(vector), other)
        if vector.norm() > NOTHING * size:
            vector.normalize()
            vectors.append(vector)
    return PETSc.NullSpace().create(vectors=vectors, comm=comm)

"""Forces at nodes, and their moments."""

import gathered
import numpy as np
import states


def nodal_forces(contact):
    """Contact forces on the displacement dofs, (dofs, gdim)."""
    dim = contact.u.function_space.mesh.geometry.dim
    return states.assembled(contact)[: gathered.size_u(contact)].reshape(-1, dim)


def nodal_positions(contact):
    """Deformed positions of the displacement dofs, (dofs, gdim)."""
    V = contact.u.function_space
    X = states.dof_positions(V)
    return gathered.owned(V, X + contact.u.x.array.reshape(X.shape))


def moments(x, f):
    """x cross f, (n, 1) in 2D and (n, 3) in 3D."""
    if x.shape[1] == 3:
        return np.cross(x, f)
    return (x[:, 0] * f[:, 1] - x[:, 1] * f[:, 0])[:, None]


def out_of_balance(contact):
    """Sums of contact forces and moments over the size of the forces."""
    f, x = nodal_forces(contact), nodal_positions(contact)
    size = np.abs(f).sum()
    assert size > 1e-3
    turning = moments(x - x.mean(axis=0), f).sum(axis=0)
    return np.abs(f.sum(axis=0)).max() / size, np.abs(turning).max() / size

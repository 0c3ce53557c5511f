"""How a stiffness matrix answers to uniform strains: shear apart from bulk."""

from __future__ import annotations

from typing import Any

import numpy as np
from dolfinx.fem import Function

from ..compat import Array

# The bulk modulus counts up to that of Poisson's ratio 0.3, where Lame's constants have
# this ratio
LARGEST_RATIO = 1.5
# It is that or less, but for rounding
_ROUNDING = 1e-6


def deviators(d: int) -> list[Array]:
    """Orthonormal symmetric strains without change of volume, (d, d) each."""
    found = []
    for i in range(d):
        for j in range(i):
            shear = np.zeros((d, d))
            shear[i, j] = shear[j, i] = np.sqrt(0.5)
            found.append(shear)
    for i in range(1, d):
        stretch = np.diag([1.0] * i + [-float(i)] + [0.0] * (d - 1 - i))
        found.append(stretch / np.linalg.norm(stretch))
    return found


def _positions(u: Function, from_axis: bool = False) -> list[Array]:
    """Of the owned nodes, from the middle of the mesh, or from there on the axis r = 0,
    (n, d) each: undeformed, and displaced where anything is. Collective."""
    V = u.function_space
    mesh, owned = V.mesh, V.dofmap.index_map.size_local
    d = mesh.geometry.dim
    X = V.tabulate_dof_coordinates()[:owned, :d]
    ends = np.stack([X.max(axis=0, initial=-np.inf), (-X).max(axis=0, initial=-np.inf)])
    moved = u.x.array[: owned * d].reshape(-1, d)
    parts = mesh.comm.allgather((ends, bool(moved.any())))
    high, low = np.max([part[0] for part in parts], axis=0)
    middle = 0.5 * (high - low)
    middle[:1] *= not from_axis
    X = X - middle
    return [X, X + moved] if any(part[1] for part in parts) else [X]


def translation_forces(K: Any, u: Function) -> Array:
    """Forces of the translation by 1 along each axis, (d, owned dofs). Collective.

    A body that is only elastic has none. Parameters are those of `strain_response`.
    """
    d = u.function_space.mesh.geometry.dim
    w, f = K.createVecs()
    forces = []
    for axis in np.eye(d):
        w.array[:] = np.tile(axis, len(w.array) // d)
        K.mult(w, f)
        forces.append(f.array.copy())
    w.destroy()
    f.destroy()
    return np.array(forces)


def strain_response(K: Any, u: Function) -> Array:
    """Forces of uniform strains at each owned node, (n, 2, 1 or 2).

    In a uniform strain E the nodal force of a homogeneous isotropic body is sigma c, with
    the node's share c of the boundary's vector area and sigma = 2 mu E for a deviator,
    (d lambda + 2 mu) I for E = I [theory (5.2)]. Only the cells around a node take part.
    Where matrices resist translation also (masses, springs), the strain is taken
    around each node. Collective.

    Parameters
    ----------
    K
        Assembled stiffness of all cells at u, without conditions.
    u
        Displacement.

    Returns
    -------
    Squares of the forces, summed over the deviators, and that of E = I; of strains of the
    undeformed bodies, and of the deformed ones if there is a displacement: only one of
    these keeps the volume, by whether the form is of small or large strains.
    """
    w, f = K.createVecs()

    def force(field: Array) -> Array:
        w.array[:] = field.ravel()
        K.mult(w, f)
        return f.array.reshape(field.shape).copy()

    def squares(x: Array, E: Array) -> Array:
        field = x @ E
        found = force(field)
        for i, forces in enumerate(pushed):
            found -= field[:, i, None] * forces
        return np.einsum("ni,ni->n", found, found)

    positions = _positions(u)
    n, d = positions[0].shape
    pushed = translation_forces(K, u).reshape(d, n, d)
    found = [
        (sum(squares(x, E) for E in deviators(d)), squares(x, np.eye(d)))
        for x in positions
    ]
    w.destroy()
    f.destroy()
    return np.moveaxis(np.array(found), 2, 0).swapaxes(1, 2)


def response_of_revolution(K: Any, u: Function) -> Array:
    """`strain_response` for solids of revolution about the axis r = 0. Collective.

    A field that grows with r strains hoops as well. Of the strains of a full turn those
    are taken that a linear field makes, as it has them exactly on any mesh: the uniform
    one, and the stretch along the axis without change of volume, u = (r, -2 z) / 2
    [theory (5.15)]. What of this would be that of the plane's strains is returned, so
    that the relations of `strain_response` hold. Springs and masses that resist a growth
    of the radius count as hoops.

    Parameters
    ----------
    K, u
        See `strain_response`.
    """
    w, f = K.createVecs()

    def force(field: Array) -> Array:
        w.array[:] = field.ravel()
        K.mult(w, f)
        return f.array.reshape(field.shape).copy()

    def squares(forces: Array) -> Array:
        return np.einsum("ni,ni->n", forces, forces)

    pushed = translation_forces(K, u)[1].reshape(-1, 2)
    found = []
    for x in _positions(u, from_axis=True):
        # 2 mu (c_r, -2 c_z) / 2 and (3 lambda + 2 mu) c
        stretched = force(x * [0.5, -1.0]) + x[:, 1:] * pushed
        swollen = force(x) - x[:, 1:] * pushed
        sheared = stretched * [2.0, -1.0]
        found.append((squares(sheared), squares((2.0 * swollen + sheared) / 3.0)))
    w.destroy()
    f.destroy()
    return np.moveaxis(np.array(found), 2, 0).swapaxes(1, 2)


def stiffness_without_bulk(sheared: Array, swollen: Array, d: int) -> Array:
    """Share of a diagonal stiffness that does not grow with the bulk modulus.

    The diagonal's sum over the directions is (lambda + (d + 1) mu) times what depends
    on the mesh only. lambda counts up to 1.5 mu [theory (5.2)].

    Parameters
    ----------
    sheared, swollen
        Sums of `strain_response` over nodes.
    d
        Dimension of space.

    Returns
    -------
    In (0, 1]. Exactly 1 up to a Poisson's ratio of 0.3, and if the response is not that
    of an elastic body.
    """
    kappa = (d + 1.0) / 2.0 - 1.0 / d  # sum of E E over the deviators
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        bulk = 2.0 / d * np.sqrt(kappa * swollen / sheared)  # over mu
        ratio = bulk - 2.0 / d  # lambda / mu
        share = (LARGEST_RATIO + d + 1.0) / (ratio + d + 1.0)
        bulky = np.isfinite(ratio) & (ratio > LARGEST_RATIO * (1.0 + _ROUNDING))
    return np.where(bulky, share, 1.0)

"""Controls of a path, which lead it in place of the load factor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem

from ..core import compat
from ..core.compat import Array, Indices
from ..core.errors import (
    ContactError,
    Options,
    described,
    is_real_number,
    is_truth_value,
    is_whole_number,
    together,
    warn,
)


@dataclass(frozen=True, eq=False)
class DisplacementControl(Options):
    """Steps of a chosen displacement; the load factor is an unknown.

    For paths on which the load falls while the displacement grows on: snap-through.

    Parameters
    ----------
    where
        The nodes that are moved: dofs of the displacement's space, as
        ``fem.locate_dofs_topological`` gives them (int32); a function of coordinates
        (3, n), as ``fem.locate_dofs_geometrical`` takes it; a point (d,), whose nearest
        node is taken; or a UFL functional of the displacement, such as ``(u[1] / area)
        * ds(3)``, or ``(u[0] * ds(4) - u[0] * ds(5)) / area`` for an opening.
    direction
        Component, or a vector (d,), whose length counts; the mean over the dofs is
        taken. None for a functional.
    by
        Growth of the displacement from the start of the path to its end. Length.

    Examples
    --------
    >>> top = fem.locate_dofs_topological(V, 1, facets.find(3))
    >>> control = DisplacementControl(top, direction=1, by=-0.4)
    >>> for step in LoadSteps(solver, apply, steps=40, control=control):
    ...     print(step.factor)
    """

    where: Any
    direction: Any = None
    by: float = 0.0

    def check(self) -> None:
        if not (is_real_number(self.by) and np.isfinite(self.by) and self.by != 0.0):
            raise ContactError(
                f"by = {self.by!r} must be a length, how much the displacement grows"
            )
        functional = isinstance(self.where, ufl.Form)
        if functional and self.where.arguments():
            raise ContactError("where must be a functional: no test function in it")
        if functional == (self.direction is not None):
            message = "direction must be a component or a vector; of a functional, None"
            raise ContactError(message)
        if not functional and not is_whole_number(self.direction):
            vector = np.asarray(self.direction)
            numbers = vector.dtype.kind in "iuf" and vector.ndim == 1
            if not (numbers and np.isfinite(vector).all() and vector.any()):
                raise ContactError(
                    f"direction must be a component or a vector, not {self.direction!r}"
                )


@dataclass(frozen=True)
class ArcLength(Options):
    """Steps along the path of equilibria; the load factor is an unknown.

    A step ends where the displacement u and the load factor t have moved by the radius:
    ``|du|^2 + (psi dt)^2 = radius^2``, with the root mean square ``|du|`` over all
    nodes. For paths on which load and displacement fall in turn. The path ends where t
    first meets the end of `LoadSteps`' ``path``.

    Parameters
    ----------
    radius
        Radius of the first step. Length. None: such that the tangent of the path takes
        the load factor as far as the first of ``steps`` equal steps.
    psi
        Length that a unit of the load factor counts as. 0: a cylinder, on which the
        displacement alone is measured.
    most
        Largest number of steps; a path that has not met its end by then fails.
    falling
        Whether the path starts away from the end of ``path``, to continue one that was
        left while its load factor fell.

    Notes
    -----
    After a step of n iterations the next radius is sqrt(easy / n) times as large where
    n is below ``easy``, sqrt(2 easy / n) times where n is above 2 ``easy``, between a
    half and twice, never above ``largest`` times the first. After a failure it is
    halved, and grows again up to the first.
    """

    radius: float | None = None
    psi: float = 0.0
    most: int = 1000
    falling: bool = False

    def check(self) -> None:
        r, psi = self.radius, self.psi
        if r is not None and not (is_real_number(r) and 0.0 < r < np.inf):
            raise ContactError(f"radius = {r!r} must be a positive length or None")
        if not (is_real_number(psi) and 0.0 <= psi < np.inf):
            raise ContactError(f"psi = {psi!r} must be a length that is not negative")
        if not (is_whole_number(self.most) and self.most >= 1):
            message = f"most = {self.most!r} must be positive and a whole number"
            raise ContactError(message)
        if not is_truth_value(self.falling):
            raise ContactError(f"falling must be True or False, not {self.falling!r}")


def mean_weights(control: DisplacementControl, u: Any) -> Array:
    """Weigh the owned dofs for a mean displacement along a direction. Collective."""
    V = u.function_space
    comm, dim, n = V.mesh.comm, V.dofmap.index_map_bs, V.dofmap.index_map.size_local
    with together(comm):
        direction = _vector(control.direction, dim)
        found = _dofs(control.where, V)
    dofs = _nearest(control.where, V) if found is None else np.unique(found[found < n])
    count = comm.allreduce(len(dofs))
    if not count:
        raise ContactError("where names no dof of the displacement")
    if isinstance(control.where, np.ndarray) and count > 1:
        _warn_of_facets(dofs, V)
    weights = np.zeros((n, dim))
    weights[dofs] = direction / count
    return weights.ravel()


def _vector(direction: Any, dim: int) -> Array:
    """Take a component or a vector as a vector (d,)."""
    if is_whole_number(direction):
        if not 0 <= direction < dim:
            raise ContactError(f"direction {direction} is none of {dim} components")
        return np.eye(dim)[direction]
    vector = np.asarray(direction, dtype=float)
    if vector.shape != (dim,):
        raise ContactError(f"direction must have {dim} entries, not {len(vector)}")
    return vector


def _dofs(where: Any, V: Any) -> Indices | None:
    """Find the block dofs of a place; return None for a point."""
    if callable(where):
        found = fem.locate_dofs_geometrical(V, where)
        return np.asarray(found, dtype=np.int32)
    array, dim = np.asarray(where), V.mesh.geometry.dim
    if isinstance(where, np.ndarray) and array.dtype.kind in "iu" and array.ndim == 1:
        index_map = V.dofmap.index_map
        count = index_map.size_local + index_map.num_ghosts
        if len(array) and not 0 <= array.min() <= array.max() < count:
            raise ContactError("where has dofs that the displacement's space has not")
        return array
    if array.dtype.kind not in "iuf" or array.shape not in ((dim,), (3,)):
        raise ContactError(
            "where must be an array of dofs, a function of coordinates, a point "
            f"({dim},) or a UFL functional, not {described(where)}"
        )
    return None


def _warn_of_facets(dofs: Indices, V: Any) -> None:
    """Warn of dofs off the boundary with the numbers of facets on it. Collective."""
    mesh = V.mesh
    facets = compat.exterior_facets(mesh)
    ends = fem.locate_dofs_topological(V, mesh.topology.dim - 1, facets)
    are_facets = mesh.comm.allreduce(bool(np.isin(dofs, facets).all()), op=MPI.LAND)
    inside = mesh.comm.allreduce(len(np.setdiff1d(dofs, ends)))
    if are_facets and inside:
        warn(
            f"where has {inside} dof(s) inside the bodies, and all its numbers are those "
            "of facets: give fem.locate_dofs_topological(V, mesh.topology.dim - 1, facets)",
        )


def _nearest(point: Any, V: Any) -> Indices:
    """Find the node nearest to a point, on the rank that owns it. Collective."""
    n, dim, comm = V.dofmap.index_map.size_local, V.mesh.geometry.dim, V.mesh.comm
    away = V.tabulate_dof_coordinates()[:n, :dim] - np.asarray(point, dtype=float)[:dim]
    distances = np.linalg.norm(away, axis=1)
    mine = float(distances.min(initial=np.inf))
    _, rank = comm.allreduce((mine, comm.rank), op=MPI.MINLOC)
    if comm.rank != rank:
        return np.empty(0, dtype=np.int32)
    return np.array([np.argmin(distances)], dtype=np.int32)

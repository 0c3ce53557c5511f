"""Equations for a load factor that is an unknown.

Newton's method goes from u to u - X and from t to t + dt. A constraint adds the
equation g X = c + e dt.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

import numpy as np
import ufl
from dolfinx import fem

from .. import compat
from ..compat import Array, Indices
from ..convergence.balance import EPS
from ..errors import ContactError, ContactWarning, ConvergenceError, together
from .control import ArcLength, DisplacementControl, is_component

if TYPE_CHECKING:
    from ..interaction import Interaction

# Tolerance of a constraint, as a share of the step
TOLERANCE = 1e-10

# Cosine between one step and the next below which a path has turned back
TURNED = -0.5


class ChosenDisplacement:
    """A mean displacement, or a functional, has a prescribed value. Collective.

    Parameters
    ----------
    control
        What was chosen.
    contact
        Whose displacement it is.
    """

    def __init__(self, control: DisplacementControl, contact: Interaction) -> None:
        self._u, self._n = contact.u, contact.layout.n_u
        self._comm: MPI.Comm = contact.layout.comm
        self._by, self._functional = float(control.by), None
        if isinstance(control.where, ufl.Form):
            test = ufl.TestFunction(self._u.function_space)
            slope = ufl.derivative(control.where, self._u, test)
            self._functional = compat.form(control.where), compat.form(slope)
        else:
            self._weights = mean_weights(control, self._u)
        self._begin = self._target = self.value
        self._step = 0.0

    @property
    def value(self) -> float:
        """The chosen displacement at present. Length. Collective."""
        if self._functional is not None:
            mine = fem.assemble_scalar(self._functional[0])
        else:
            mine = self._weights @ self._u.x.array[: self._n]
        return float(self._comm.allreduce(float(mine)))

    def _gradient(self) -> Array:
        """Derivative of the value by the owned dofs. Collective."""
        if self._functional is None:
            return self._weights
        dofmap = self._u.function_space.dofmap
        r = compat.create_la_vector(dofmap.index_map, dofmap.index_map_bs)
        compat.assemble_residual(r.array, self._functional[1])
        compat.scatter_reverse_add(r)
        return r.array[: self._n].copy()

    def begin(self, share: float, part: float) -> None:
        """Begin a step that ends at a share of the whole growth; its size is a part of
        it."""
        self._target = self._begin + share * self._by
        self._step = abs(part * self._by)

    def row(self, factor: float) -> tuple[Array, float, float]:
        """g (owned dofs), e and c. Collective."""
        return self._gradient(), 0.0, self.value - self._target

    def share(self, change: Array, step: float) -> float:
        """Share of a change, the load factor's included, that is applied."""
        return 1.0

    def is_met(self, factor: float) -> bool:
        """Whether the value is as prescribed, to rounding. Collective."""
        rounding = 256.0 * EPS * largest(self._comm, self._u.x.array)
        rounding *= float(self._comm.allreduce(np.abs(self._gradient()).sum()))
        lacks = abs(self.value - self._target)
        return lacks <= TOLERANCE * self._step + rounding

    def check(self, factor: float) -> None:
        """Nothing to check: every displacement is allowed."""


class Arc:
    """A step has a given length. Collective.

    Parameters
    ----------
    control
        How lengths are measured.
    contact
        Whose displacement moves.
    towards
        First change of the load factor. Its sign says which way the path sets out.

    Attributes
    ----------
    radius
        Of the step. Length. None until the first solve has found it.
    """

    def __init__(
        self, control: ArcLength, contact: Interaction, towards: float
    ) -> None:
        self._u, self._n = contact.u, contact.layout.n_u
        self._comm: MPI.Comm = contact.layout.comm
        V = self._u.function_space
        self._nodes = V.dofmap.index_map.size_global
        self._psi = float(control.psi)
        self._towards = -towards if control.falling else towards
        self.radius = control.radius
        self._u_0, self._factor_0 = self._u.x.array.copy(), 0.0
        self._last: tuple[Array, float] | None = None
        self._sets_out = True

    def _product(self, a: tuple[Array, float], b: tuple[Array, float]) -> float:
        """Scalar product of two changes (owned displacements, load factor). Length
        squared."""
        mine = float(a[0][: self._n] @ b[0][: self._n]) / self._nodes
        return self._comm.allreduce(mine) + self._psi**2 * a[1] * b[1]

    def _change(self, factor: float) -> tuple[Array, float]:
        """Displacement and load factor since the step began."""
        return self._u.x.array - self._u_0, factor - self._factor_0

    def length(self, u: Array, factor: float) -> float:
        """Length of a change. Collective."""
        return float(self._product((u, factor), (u, factor)) ** 0.5)

    def begin(self, factor: float, last: tuple[Array, float] | None) -> None:
        """Begin a step at the present state.

        Parameters
        ----------
        factor
            Load factor there.
        last
            Change of displacement and load factor in the step before.
        """
        self._u_0[:], self._factor_0 = self._u.x.array, factor
        self._last = last

    def row(self, factor: float) -> tuple[Array, float, float]:
        """g (owned dofs), e and c. The first iterate goes ahead along the path, later
        ones to the tangent plane of the sphere. Collective."""
        change = self._change(factor)
        here = self._product(change, change)
        self._sets_out = self.radius is None or here <= (TOLERANCE * self.radius) ** 2
        if not self._sets_out:
            assert self.radius is not None
            return self._plane(change, 0.5 * (here - self.radius**2))
        if self._last is None:
            return np.zeros(self._n), 1.0, -self._towards
        return self._plane(self._last, -self._product(self._last, self._last))

    def _plane(
        self, normal: tuple[Array, float], right: float
    ) -> tuple[Array, float, float]:
        """The plane across a normal, as g, e and c."""
        g = normal[0][: self._n] / self._nodes
        return g, self._psi**2 * normal[1], right

    def share(self, change: Array, step: float) -> float:
        """Share of a change, the load factor's included, that is applied. Collective."""
        if not self._sets_out:
            return 1.0
        length = self.length(change, step)
        if length == 0.0:
            raise ConvergenceError(
                "the loads move nothing: give ArcLength a psi, or apply what loads"
            )
        if self.radius is None:
            self.radius = length
        return self.radius / length

    def is_met(self, factor: float) -> bool:
        """Whether the step has its length. Collective."""
        if self.radius is None:
            return False
        change = self._change(factor)
        rounding = 256.0 * EPS * largest(self._comm, self._u.x.array)
        length = self.length(*change)
        return abs(length - self.radius) <= TOLERANCE * self.radius + rounding

    def check(self, factor: float) -> None:
        """Raise where the path has turned back. Collective."""
        change, last = self._change(factor), self._last
        if last is None:
            if change[1] * self._towards < 0.0:
                raise ConvergenceError(
                    "the path sets out backwards: take a smaller radius"
                )
            return
        sizes = self._product(change, change) * self._product(last, last)
        if self._product(change, last) < TURNED * sizes**0.5:
            raise ConvergenceError("the path turns back: take a smaller radius")


def mean_weights(control: DisplacementControl, u: Any) -> Array:
    """Weights of the owned dofs. Their product with u is the mean displacement of the
    nodes along a direction. Collective."""
    V = u.function_space
    comm, dim = V.mesh.comm, V.dofmap.index_map_bs
    with together(comm):
        direction = _vector(control.direction, dim)
        found = _dofs(control.where, V)
    if found is None:
        found = _nearest(np.asarray(control.where, dtype=float), V)
    dofs: Indices = found
    dofs = np.unique(dofs[dofs < V.dofmap.index_map.size_local])
    count = comm.allreduce(len(dofs))
    if not count:
        raise ContactError("where names no dof of the displacement")
    if isinstance(control.where, np.ndarray) and count > 1:
        _warn_of_facets(dofs, V)
    weights = np.zeros((V.dofmap.index_map.size_local, dim))
    weights[dofs] = direction / count
    return weights.ravel()


def _vector(direction: Any, dim: int) -> Array:
    """A direction as a vector (d,)."""
    if is_component(direction):
        if not 0 <= direction < dim:
            raise ContactError(f"direction {direction} is none of {dim} components")
        return np.eye(dim)[direction]
    vector = np.asarray(direction, dtype=float)
    if vector.shape != (dim,):
        raise ContactError(f"direction must have {dim} entries, not {len(vector)}")
    return vector


def _dofs(where: Any, V: Any) -> Indices | None:
    """Block dofs of a place; None for a point."""
    if callable(where):
        found = fem.locate_dofs_geometrical(V, where)
        return np.asarray(found, dtype=np.int32)
    array = np.asarray(where)
    if isinstance(where, np.ndarray) and array.dtype.kind in "iu" and array.ndim == 1:
        index_map = V.dofmap.index_map
        count = index_map.size_local + index_map.num_ghosts
        if len(array) and not 0 <= array.min() <= array.max() < count:
            raise ContactError("where has dofs that the displacement's space has not")
        return array
    dim = V.mesh.geometry.dim
    if array.dtype.kind not in "iuf" or array.shape not in ((dim,), (3,)):
        raise ContactError(
            "where must be an array of dofs, a function of coordinates, a point "
            f"({dim},) or a UFL functional, not {where!r}"
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
        warnings.warn(
            f"where has {inside} dof(s) inside the bodies, and all its numbers are those "
            "of facets on the boundary: for the nodes of facets give "
            "fem.locate_dofs_topological(V, mesh.topology.dim - 1, facets)",
            ContactWarning,
            stacklevel=2,
        )


def _nearest(point: Array, V: Any) -> Indices:
    """The owned node that is nearest to a point, on the rank that owns it.
    Collective."""
    n, dim = V.dofmap.index_map.size_local, V.mesh.geometry.dim
    x = V.tabulate_dof_coordinates()[:n, :dim]
    distances = np.linalg.norm(x - point[:dim], axis=1)
    mine = float(distances.min(initial=np.inf))
    _, rank = V.mesh.comm.allreduce((mine, V.mesh.comm.rank), op=MPI.MINLOC)
    if V.mesh.comm.rank != rank:
        return np.empty(0, dtype=np.int32)
    return np.array([np.argmin(distances)], dtype=np.int32)


def largest(comm: MPI.Comm, values: Array) -> float:
    """Largest magnitude on any rank. Collective."""
    return float(comm.allreduce(np.abs(values).max(initial=0.0), op=MPI.MAX))

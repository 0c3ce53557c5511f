"""Groups of rows that Newton's method judges separately: bodies and patches of contact.

Each group has a stiffness, a rounding error and a name for messages. None of them
depends on the number of ranks.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from mpi4py import MPI

import numpy as np

from ..compat import Array, Indices, Mask
from ..discretization.unknowns import Field

EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Groups:
    """Rows of the coupled system by body, patch of slave surface and field.

    - A body is a part of the mesh whose cells are connected. A free rigid body is a
      group as well.
    - Each connected patch of slave surface is a group with the equations of its
      multiplier: they are forces between two bodies, one of which may be much softer.
    - Each further field that the user solves for, such as a pressure, is a group: its
      equations are not forces.

    The order is bodies, patches, free rigid bodies, fields. Groups below `forces` are
    forces; there are `bodies` bodies and `free` free rigid bodies.
    """

    comm: MPI.Comm
    of_row: Indices  # group of each owned row
    count: int
    forces: int
    bodies: int
    free: int
    fields: Sequence[Field]  # the displacement and further ones
    mass: Array  # int N_a dG of each owned multiplier row
    size: Array  # diagonal of each group's box, or its distance from the origin
    largest: float  # the same of all groups together
    mean: Array  # mean and norm of the stiffness of each group's rows
    norm: Array
    # Norm and mean of what a unit of a field does to a group's rows, (fields, groups)
    coupling: Array
    mean_coupling: Array
    area: Array  # of each slave surface, as nodes and gammas
    nodes: Array
    met: Mask  # whether a group is at a slave surface, (surfaces, groups)
    gammas: Callable[[], Array]  # present coefficients
    springs: Callable[[], Array]  # norm of the springs' forces on each free rigid body
    names: Callable[[], list[str]]  # collective

    @property
    def is_patch(self) -> Mask:
        """Whether each group is a patch of slave surface."""
        found = np.zeros(self.count, dtype=bool)
        found[self.bodies : self.forces - self.free] = True
        return found

    def sum(self, *rows: Array) -> Array:
        """Sum one or several arrays over the rows of each group. Collective."""
        return sum_by_group(self.comm, self.of_row, self.count, *rows)

    def on_rows(self, of_u: Array) -> Array:
        """Place values of the owned displacements at their rows, 0 elsewhere."""
        rows = np.zeros(len(self.of_row))
        rows[self.fields[0].rows] = of_u
        return rows

    def largest_of_fields(self, *arrays: Array) -> Array:
        """Largest absolute values of arrays over the local unknowns, (arrays, fields).
        Collective."""
        most = np.array(
            [[np.abs(a[f.local]).max(initial=0.0) for f in self.fields] for a in arrays]
        )
        self.comm.Allreduce(MPI.IN_PLACE, most, op=MPI.MAX)
        return most

    def field_terms(self, sizes: Array) -> tuple[Array, Array]:
        """Bound the terms in each group's rows, 0 for forces, and their rounding error
        that comes from further fields [theory (5.13)]."""
        scales, floors = sizes @ self.coupling, sizes[1:] @ self.coupling[1:]
        scales[: self.forces] = 0.0
        # Displacements are as exact as positions
        floors[self.forces :] += self.largest * self.coupling[0, self.forces :]
        return scales, EPS * floors

    def inertia_floors(self, of_row: Array, sizes: Array) -> Array:
        """Rounding error of inertia in the residual of each group, from the force that
        a unit of each owned unknown of the forms takes and the largest value of each
        field [theory (5.18)]. Collective."""
        terms = np.zeros(len(self.of_row))
        for field, size in zip(self.fields, sizes):
            terms[field.rows] = of_row[field.rows] * size
        return np.asarray(EPS * np.sqrt(self.sum(terms**2)))

    def field_rows(self, sizes: Array) -> list[tuple[Any, float, float]]:
        """Find each further field's rows, the divisor that makes them lengths, and the
        length that a unit of the field counts as."""
        found = []
        for k, field in enumerate(self.fields[1:]):
            unit = self.largest / (sizes[1 + k] or 1.0)
            by_u, *by_others = self.mean_coupling[:, self.forces + k]
            own = by_others[k] / unit
            found.append((field.rows, by_u or own or 1.0, unit))
        return found

    def floors(self) -> Array:
        """Rounding error of the residual of each group [theory (5.4)]."""
        gammas, first_free = self.gammas(), self.forces - self.free
        patches, gamma = slice(self.bodies, first_free), np.ones(self.count)
        on_patches = self.met[:, patches]
        gamma[patches] = (gammas[:, None] * on_patches).max(axis=0)
        floors: Array = EPS * gamma * self.norm * self.size
        # Without a multiplier contact acts on bodies
        forces = self.largest * gammas * self.area / self.nodes**0.5
        forces[on_patches.any(axis=1)] = 0.0
        floors[: self.bodies] += EPS * (forces @ self.met[:, : self.bodies])
        floors[first_free : self.forces] = np.linalg.norm(floors[:first_free])
        floors[first_free : self.forces] += EPS * self.springs()
        return floors

    def softest(self, free: Array) -> tuple[Array, float]:
        """Find the stiffness of each body and patch, and the largest stiffness of closed
        contact at a node over that of the softest body there. Collective.

        A patch has the stiffness of the softest body at it that can move. Rows that are
        not constrained have `free` 1, others 0.
        """
        is_body = np.arange(self.count) < self.bodies
        moves = is_body & (self.sum(free) > 0.0) & (self.mean > 0.0)
        stiffness = np.where(moves, self.mean, np.inf)
        softest = np.where(self.met & is_body, stiffness, np.inf).min(axis=1)
        near = np.where(self.met & ~is_body, softest[:, None], np.inf).min(axis=0)
        springs = self.gammas() * self.area / self.nodes / softest
        return np.minimum(stiffness, near), float(springs.max(initial=0.0))


def sum_by_group(comm: MPI.Comm, of_row: Indices, count: int, *rows: Array) -> Array:
    """Sum one or several arrays over the rows of each group. Collective."""
    # Without rows, bincount gives integers
    sums = np.array(
        [np.bincount(of_row, values, count) for values in rows], dtype=float
    )
    comm.Allreduce(MPI.IN_PLACE, sums)
    return sums[0] if len(rows) == 1 else sums


def largest_by(group: Indices, values: Array, count: int) -> Array:
    """Largest values (n, k) of each group, -inf where there are none, (count, k)."""
    largest = np.full((count, values.shape[1]), -np.inf)
    np.maximum.at(largest, group, values)
    return largest

"""Groups of rows that Newton's method judges separately: bodies and surfaces of
contact.

Each group has a stiffness, a rounding error and a name for messages. None of them
depends on the number of ranks.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from ..compat import Array, Indices
from ..host.facet_areas import surface_areas
from ..options.methods import Penalty
from .patches import Patches

if TYPE_CHECKING:
    from ..interaction import Interaction

EPS = float(np.finfo(float).eps)


class Groups:
    """Rows of the coupled system by body, patch of slave surface and field. Collective.

    - A body is a part of the mesh whose cells are connected. A free rigid body is a
      group as well.
    - Each connected patch of slave surface is a group with the equations of its
      multiplier: they are forces between two bodies, one of which may be much softer.
    - Each further field that the user solves for, such as a pressure, is a group: its
      equations are not forces.

    Parameters
    ----------
    contact
        After `Contact.prepare`; or several contacts, see `interactions.Interactions`.

    Attributes
    ----------
    of_row
        Group of each owned row, (rows,).
    count, forces, bodies
        Number of groups, of those that are forces, and of bodies. The order is
        bodies, patches, free rigid bodies, fields.
    fields
        What the user solves for besides the displacement; see `host.Field`.
    size
        Diagonal of each group's box, or its distance from the origin. Length.
    mass
        int N_a dG of each owned multiplier row, (rows,). Area.
    """

    def __init__(self, contact: Interaction) -> None:
        self.contact, layout = contact, contact.layout
        self.comm: MPI.Comm = layout.comm
        V, bodies = contact.u.function_space, contact.bodies
        nodes, self.bodies = bodies.dofs, bodies.count
        of_host = np.empty(layout.n, dtype=np.int32)
        self._u_rows = contact.host.u_owned
        of_u = np.repeat(nodes, V.dofmap.index_map_bs)[: layout.n_u]
        of_host[self._u_rows] = of_u
        self._body_of_node, self.count = nodes, self.bodies
        self._patches: list[Patches] = []
        for one in contact.contacts:
            self._patches.append(Patches(one, self.count))
            self.count += self._patches[-1].count
        of_multiplier = [patches.of_row for patches in self._patches]
        self.mass = np.concatenate([patches.mass for patches in self._patches])
        self._free = contact.layout.bodies
        of_bodies = np.empty(0, dtype=np.int32)
        for body in self._free:
            if contact.layout.own_bodies:
                own = np.full(len(body.freedom), self.count, dtype=np.int32)
                of_bodies = np.concatenate([of_bodies, own])
            self.count += 1
        self.forces = self.count
        displacement, *self.fields = contact.host.fields()
        self._places: list[Any] = [field.local for field in self.fields]
        self._places.insert(0, displacement.local if self.fields else slice(None))
        for field in self.fields:
            of_host[field.rows] = self.count
            self.count += 1
        self.of_row = np.concatenate([of_host, *of_multiplier, of_bodies])
        rows = self.on_rows(contact.stiffness_diagonal, self.mass)
        self._mean = self.sum(rows) / self.sum(np.ones_like(rows))
        self._norm = np.sqrt(self.sum(rows**2))
        self.size, self._largest = self._sizes()
        self._zones = self._met()
        self._find_couplings()

    def on_rows(self, of_u: Array, of_multiplier: Array | None = None) -> Array:
        """Values at the rows of the owned displacements and multipliers; 0 at other
        rows."""
        rows = np.zeros(len(self.of_row))
        rows[: self.contact.layout.n][self._u_rows] = of_u
        if of_multiplier is not None:
            n = self.contact.layout.n
            rows[n : n + len(of_multiplier)] = of_multiplier
        return rows

    def _find_couplings(self) -> None:
        """How much a unit of each field changes the rows of each group. Collective."""
        couplings = self.contact.couplings
        self._coupling = np.zeros((1 + len(self.fields), self.count))
        self._mean_coupling = self._coupling.copy()
        if not self.fields:
            return
        tail = np.zeros((len(couplings), len(self.of_row) - couplings.shape[1]))
        rows = np.hstack([couplings, tail])
        self._coupling = np.sqrt(self.sum(*rows**2))
        self._mean_coupling = self.sum(*rows) / self.sum(np.ones(rows.shape[1]))

    def largest(self, *arrays: Array) -> Array:
        """Largest absolute values of arrays over the local unknowns, by field, the
        displacement first, (arrays, fields). Collective."""
        most = np.array(
            [[np.abs(a[p]).max(initial=0.0) for p in self._places] for a in arrays]
        )
        self.comm.Allreduce(MPI.IN_PLACE, most, op=MPI.MAX)
        return most

    def field_scales(self, sizes: Array) -> Array:
        """Upper bound of the terms in each group's rows; 0 for forces
        [theory (5.13)].

        Parameters
        ----------
        sizes
            Largest value of each field, the displacement first.
        """
        scales = sizes @ self._coupling
        scales[: self.forces] = 0.0
        return scales

    def field_floors(self, sizes: Array) -> Array:
        """Rounding error of each group that comes from further fields."""
        if not self.fields:
            return np.zeros(self.count)
        positions = np.concatenate([[0.0], sizes[1:]])
        floors = positions @ self._coupling
        # Displacements are as exact as positions
        floors[self.forces :] += self._largest * self._coupling[0, self.forces :]
        return EPS * floors

    def field_rows(self, sizes: Array) -> list[tuple[Any, float, float]]:
        """For each further field its rows, the divisor that makes them lengths, and the
        length that a unit of the field counts as."""
        found = []
        for k, field in enumerate(self.fields):
            unit = self._largest / (sizes[1 + k] or 1.0)
            by_u, *by_others = self._mean_coupling[:, self.forces + k]
            own = by_others[k] / unit
            found.append((field.rows, by_u or own or 1.0, unit))
        return found

    def sum(self, *rows: Array) -> Array:
        """Sums over the rows of each group, for one or several arrays. Collective."""
        # Without rows, bincount gives integers
        sums = np.array(
            [np.bincount(self.of_row, values, self.count) for values in rows],
            dtype=float,
        )
        self.comm.Allreduce(MPI.IN_PLACE, sums)
        return sums[0] if len(rows) == 1 else sums

    def _sizes(self) -> tuple[Array, float]:
        """Size of each group, and of all groups together: the diagonal of the box, or
        its distance from the origin if that is larger. Length. Collective."""
        V = self.contact.u.function_space
        X = V.tabulate_dof_coordinates()
        ends = np.stack(
            [largest_by(self._body_of_node, x, self.bodies) for x in (X, -X)]
        )
        self.comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MAX)

        def size(ends: Array) -> Any:
            return np.linalg.norm(np.max([ends.sum(0), *abs(ends)], axis=0), axis=-1)

        largest = float(size(ends.max(axis=1)))
        # Gaps are differences of positions of any two bodies
        patches = np.full(self.count - self.bodies, largest)
        return np.concatenate([size(ends), patches]), largest

    def floors(self) -> Array:
        """Rounding error of the residual of each group [theory (5.4)]."""
        gamma = np.ones(self.count)
        for patches in self._patches:
            gamma[patches.groups] = patches.contact.gamma_scale
        floors = EPS * gamma * self._norm * self.size
        for contact, area, nodes, met in self._zones:
            if isinstance(contact.method, Penalty):
                force = contact.gamma_scale * self._largest * area / nodes**0.5
                floors[: self.bodies][met[: self.bodies]] += EPS * force
        for group in self._groups_of_free:
            floors[group] = np.linalg.norm(floors[: self._groups_of_free[0]])
        return floors

    @property
    def _groups_of_free(self) -> range:
        """Groups of the free rigid bodies."""
        return range(self.forces - len(self._free), self.forces)

    def _met(self) -> list[tuple[Any, float, float, npt.NDArray[np.bool_]]]:
        """For each zone: its contact, the area and the number of nodes of its slave
        surface, and the bodies and patches on its two sides. Collective."""
        zones = []
        for patches in self._patches:
            for zone in patches.contact.zones:
                sides = zone.facets.slave_surface, zone.facets.master_surface
                sums = np.zeros(2 + self.count)
                sums[:2] = surface_areas(sides[0]).sum(), len(sides[0].dofs)
                for side in sides:
                    sums[2 + self._body_of_node[side.dofs]] = 1.0
                sums[2 + patches.of_node[zone.multiplier_nodes]] = 1.0
                for group, body in zip(self._groups_of_free, self._free):
                    sums[2 + group] = 1.0 * (body in zone.facets.bodies)
                self.comm.Allreduce(MPI.IN_PLACE, sums)
                area, nodes = float(sums[0]), float(sums[1])
                zones.append((patches.contact, area, nodes, sums[2:] > 0.0))
        return zones

    def softest(self, free: Array) -> tuple[Array, float]:
        """Stiffness of each body and each patch. Force per length. Collective.

        A patch has the stiffness of the softest body at it that can move.

        Parameters
        ----------
        free
            1 for each owned row that is not constrained, else 0.

        Returns
        -------
        stiffness, springs
            `springs` is the largest stiffness of closed contact at a node, over that of
            the softest body there.
        """
        stiffness, ratios = np.full(self.count, np.inf), [0.0]
        bodies = slice(self.bodies)
        moves = (self.sum(free)[bodies] > 0.0) & (self._mean[bodies] > 0.0)
        stiffness[bodies][moves] = self._mean[bodies][moves]
        for contact, area, nodes, met in self._zones:
            here = float(stiffness[bodies][met[bodies]].min())
            patches = np.flatnonzero(met[self.bodies :]) + self.bodies
            stiffness[patches] = np.minimum(stiffness[patches], here)
            ratios.append(contact.gamma_scale * area / nodes / here)
        return stiffness, max(ratios)

    def names(self) -> list[str]:
        """Name of each group for messages. Collective."""
        V, layout = self.contact.u.function_space, self.contact.layout
        dim, bs = V.mesh.geometry.dim, V.dofmap.index_map_bs
        of_u = np.repeat(V.tabulate_dof_coordinates(), bs, axis=0)[: layout.n_u]
        of_multiplier = np.concatenate([one.places() for one in self._patches])
        places = of_u, of_multiplier
        one = [self.on_rows(*(part[:, i] for part in places)) for i in range(dim)]
        *sums, counts = self.sum(*one, np.ones(len(self.of_row)))
        names = []
        for group, centre in enumerate((np.array(sums) / counts).T[: self.forces]):
            place = ", ".join(f"{value:.3g}" for value in centre)
            kind = "the body" if group < self.bodies else "the contact"
            names.append(f"{kind} around ({place})")
        for group, body in zip(self._groups_of_free, self._free):
            names[group] = f"the rigid {body.name}"
        return names + [f"the unknown {field.name}" for field in self.fields]


def largest_by(group: Indices, values: Array, count: int) -> Array:
    """Largest values (n, k) of each group, -inf where there are none, (count, k)."""
    largest = np.full((count, values.shape[1]), -np.inf)
    if len(group):
        order = np.argsort(group, kind="stable")
        found, starts = np.unique(group[order], return_index=True)
        largest[found] = np.maximum.reduceat(values[order], starts)
    return largest

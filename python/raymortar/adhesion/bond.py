"""Points that adhere to each other, as a term of a problem."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
from dolfinx.fem import Function
from scipy.spatial import cKDTree

from ..core import compat
from ..core.compat import Array
from ..core.discretization.facets import dot, shape_functions
from ..core.discretization.ranks import destroy, sums_at
from ..core.errors import raise_everywhere, require_agreement, together
from ..core.gamma.probing import product
from ..core.interface.point_results import CLOSED, OPEN
from ..core.interface.present import Follower
from ..core.interface.zone_data import SpringPoints, ZoneData
from ..core.state import Quantity
from ..core.terms import Term
from .points import BondedPoints, Opening, Side, opening_of

# An opening is a rounding error below both: this share of the one at which damage begins,
# and this share of positions. The first alone is too much, as a soft body on strong glue
# closes its springs by less
ROUNDING, OF_POSITIONS = 1e-6, 100.0 * np.finfo(float).eps


class Springs(NamedTuple):
    """Springs at points (n,), and what damage leaves of them."""

    opening: Array  # without the undeformed gap. Length
    tension: Array  # of undamaged springs, along the normal. Traction
    slopes: Array  # half the derivative of twice their energy by y, (n, m)
    shear_slopes: Array  # the part of shear
    energy: Array  # twice that of undamaged springs, per area
    response: Any


class Bond(Term, Follower):
    """Points of a contact that adhere, as `Contact.bond`. Collective.

    They are paired once, undeformed, and keep their partners until the law lets go of
    them. Jumps and tangents at all points are one product of a constant matrix with the
    displacements, on any number of ranks.

    Attributes
    ----------
    law
        The `Cohesive` law.
    area
        Undeformed area that was bonded.
    """

    spoken = "bonds of adhesion"
    is_of_contact = True

    def __init__(self, law: Any, contact: Any, *surfaces: Any) -> None:
        self.law, self._contact = law, contact
        self._comm: MPI.Comm = contact.layout.comm
        with together(self._comm):
            law.check()
        options = {name: of for name, of in vars(law).items() if name != "where"}
        require_agreement(self._comm, adhesion=str(options), where=law.where is None)
        self._at = BondedPoints(law, contact, *surfaces)
        self.area = float(self._comm.allreduce(self._at.weight.sum()))
        fault = (
            "adhesion bonds no point: the undeformed surfaces are farther apart than "
            "Cohesive(within=...), or where= leaves none"
        )
        raise_everywhere(self._comm, None if self.area > 0.0 else fault)
        # Damage, and energy per area that it has taken, at the accepted step
        self._history = np.zeros((len(self._at.weight), 2))
        self._system: Any = None
        self._C: Any = None  # from the unknowns to jumps and tangents
        self._D: Any = None  # of blocks of points
        self._K: Any = None  # of both
        contact.assembly.present.follow(self)

    def __repr__(self) -> str:
        return f"<Bond of {self._contact!r} by {self.law!r}>"

    # Equations

    def start(self, system: Any) -> None:
        """Take the rows of the displacements. Collective."""
        destroy(self._C, self._D, self._K)
        self._system, self._C = system, self._at.matrix(system)
        self._D = self._K = None

    def couple(self, pattern: Any) -> None:
        """Make room for the tangent. Collective."""
        size = self._at.start.shape[-1] ** 2
        pattern.include(self._times(np.ones((len(self._at.weight), size, size))))

    def _times(self, blocks: Array) -> PETSc.Mat:
        """Matrix between the unknowns of blocks at points, (n, m, m). Collective."""
        n, m, _ = blocks.shape
        kind, begin = PETSc.IntType, self._C.getOwnershipRange()[0]
        columns = begin + np.arange(n * m).reshape(n, 1, m)
        columns = np.broadcast_to(columns, blocks.shape).ravel().astype(kind)
        csr = (m * np.arange(n * m + 1)).astype(kind), columns, blocks.ravel()
        if self._D is None:
            sizes = ((n * m, None),) * 2
            self._D = PETSc.Mat().createAIJ(sizes, csr=csr, comm=self._comm)
        else:
            self._D.setValuesCSR(*csr)
        self._D.assemble()
        self._K = self._D.ptap(self._C, result=self._K)
        return self._K

    def _opening(self) -> Opening:
        """Openings of the present displacements. Collective."""
        fault = "adhesion is a term of a problem: give the contact to one first"
        raise_everywhere(self._comm, fault if self._system is None else None)
        moved = product(self._C, self._system.unknowns.owned_values())
        return opening_of(self._at.start + moved.reshape(self._at.start.shape))

    def _springs(self, at: Opening) -> Springs:
        """Evaluate springs and law [theory (4.46)-(4.48)]."""
        K_n, K_s = self.law.stiffness
        n, size = len(at.along), at.slopes[0].size if len(at.slopes) else 0
        opening = at.along - self._at.gap
        tension = K_n * np.maximum(opening, 0.0)
        normal = tension * np.maximum(opening, 0.0)
        shear = K_s * dot(at.across, at.across)
        by_shear = -at.along[:, None, None] * at.slopes
        by_shear[:, 0] += at.jump
        by_shear = K_s * by_shear.reshape(n, size)
        slopes = tension[:, None] * at.slopes.reshape(n, size) + by_shear
        response = self.law.respond(normal, shear, self._history[:, 0])
        return Springs(opening, tension, slopes, by_shear, normal + shear, response)

    def _forces(self) -> Array:
        """Forces of all points at the owned rows. Collective."""
        springs = self._springs(self._opening())
        left = self._at.weight * (1.0 - springs.response.damage)
        forces = left[:, None] * springs.slopes
        return product(self._C, forces.ravel(), transposed=True)

    def _blocks(self) -> Array:
        """Derivative of the forces at points, (n, m, m) [theory (4.49)]. Collective."""
        at = self._opening()
        springs, (K_n, K_s) = self._springs(at), self.law.stiffness
        (n, size), response = springs.slopes.shape, springs.response
        q = at.slopes.reshape(n, size)
        bent = springs.tension - K_s * at.along
        blocks = bent[:, None, None] * at.bends.reshape(n, size, size)
        # At an opening of zero, rounding must not choose: springs that will be stretched
        stiff = K_n * (springs.opening >= -self._rounding()) - K_s
        blocks += stiff[:, None, None] * q[:, :, None] * q[:, None]
        own = np.arange(len(at.normal[0]) if n else 0)
        blocks[:, own, own] += K_s
        blocks *= (1.0 - response.damage)[:, None, None]
        normal, shear = springs.slopes - springs.shear_slopes, springs.shear_slopes
        grows = (
            response.by_normal[:, None] * normal + response.by_shear[:, None] * shear
        )
        blocks -= 2.0 * springs.slopes[:, :, None] * grows[:, None]
        found: Array = self._at.weight[:, None, None] * blocks
        return found

    def _rounding(self) -> float:
        """Opening that may be a rounding error of positions. Collective."""
        unknowns = self._system.unknowns
        moved = unknowns.owned_values()[unknowns.u_owned]
        lengths = [side.own.facets.slave_surface.X for side in self._at.sides]
        largest = sum(np.abs(of).max(initial=0.0) for of in (moved, *lengths))
        largest = self._comm.allreduce(float(largest), op=MPI.MAX)
        first = np.atleast_1d(self.law.strength)[0] / self.law.stiffness[0]
        return float(min(ROUNDING * first, OF_POSITIONS * largest))

    def residual(self, bcs: Sequence[Any], lacking: Any) -> Array:
        """Forces at the owned unknowns of the forms, with what they lack to meet the
        conditions, (n,). Collective."""
        found, unknowns = self._forces(), self._system.unknowns
        increment = unknowns.owned_part(lacking.increment)
        if self._comm.allreduce(int(increment.any())):
            blocks = self._blocks()
            moved = product(self._C, increment).reshape(blocks.shape[:2])
            moved = np.einsum("nij,nj->ni", blocks, moved)
            found += product(self._C, moved.ravel(), transposed=True)
        return found[: self._system.layout.n]

    def forces(self, bcs: Sequence[Any]) -> Array:
        """Forces at the owned unknowns of the forms, (n,). Collective."""
        return self._forces()[: self._system.layout.n]

    def add_matrices(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        """Add the derivative between free unknowns. Collective."""
        K = self._times(self._blocks())
        free = K.createVecRight()
        free.set(1.0)
        fixed = self._system.unknowns.owned_prescribed(bcs)
        free.array[: len(fixed)][fixed] = 0.0
        K.diagonalScale(free, free)
        A.axpy(1.0, K, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        free.destroy()

    # Steps

    def step_accepted(self) -> None:
        """Keep the damage of the step that is accepted. Collective."""
        response = self._springs(self._opening()).response
        self._history[:, 0] = response.damage
        self._history[:, 1] += response.dissipated

    def quantities(self) -> Iterator[Quantity]:
        """Yield damage and dissipated energy at the points of each slave."""
        for k, (side, part) in enumerate(zip(self._at.sides, self._at.slices())):
            yield Quantity(
                f"springs of bond {k}",
                partial(self._read, side, part),
                partial(self._write, side, part),
                SpringPoints(side.own),
                may_lack=True,
                fault=partial(_other_points, side),
            )

    def _read(self, side: Side, part: slice) -> Array:
        """Facets, places, areas and history."""
        values = np.zeros((len(side.weight), side.start.shape[-1]))
        values[:, :2] = self._history[part]
        return np.column_stack([side.facet, side.xi, side.weight, values])

    def _write(self, side: Side, part: slice, rows: Array | None) -> None:
        """Take the history of the nearest points: another partition may number them in
        another order."""
        self._history[part] = 0.0
        if rows is None or not len(rows):
            return
        d = side.start.shape[-1]
        apart = np.array([4.0] + [1.0] * (d - 1))  # facets by more than their size
        own = np.column_stack([side.facet, side.xi])
        _, nearest = cKDTree(apart * rows[:, :d]).query(apart * own)
        self._history[part] = rows[nearest, d + 1 : d + 3]

    # Results

    def points(self) -> dict[str, Array]:
        """Arrays over this rank's bonded points, n rows each. Collective.

        Returns
        -------
        Arrays by name:

        - ``opening``: along the slave's normal, beyond the undeformed gap; ``slide``
          (n, d): across it. Length
        - ``traction`` (n, d): what adhesion adds to that of contact on the slave
        - ``damage``: from 0 to 1; ``dissipated``: energy per area that it has taken
        - ``normal`` (n, d): of the slave, outward; ``weight``: undeformed area
        - ``slave``, ``xi``: facets and places on them
        """
        at = self._opening()
        springs, sides = self._springs(at), self._at.sides
        response, K_s = springs.response, self.law.stiffness[1]
        t = springs.tension[:, None] * at.normal + K_s * at.across
        return {
            "opening": springs.opening,
            "slide": at.across,
            "traction": (1.0 - response.damage)[:, None] * t,
            "damage": response.damage,
            "dissipated": self._history[:, 1] + response.dissipated,
            "normal": at.normal,
            "weight": self._at.weight.copy(),
            "slave": np.concatenate([side.facet for side in sides]),
            "xi": np.concatenate([side.xi for side in sides]),
        }

    def _sum(self, values: Array) -> Any:
        return self._comm.allreduce(self._at.weight @ values)

    def dissipated(self) -> float:
        """Energy that damage has taken so far, per thickness in 2D. Collective."""
        return float(self._sum(self.points()["dissipated"]))

    def stored(self) -> float:
        """Energy that the bonded points hold, and give back. Collective."""
        springs = self._springs(self._opening())
        return float(self._sum(0.5 * (1.0 - springs.response.damage) * springs.energy))

    def force(self) -> Array:
        """Force of adhesion on the slave, (d,). Collective."""
        return np.asarray(self._sum(self.points()["traction"]))

    def damage(self) -> Function:
        """Damage around each slave node; 0 where nothing was bonded. Collective."""
        f = Function(self._contact.surfaces.scalar, name="damage")
        V, damage, shares = f.function_space, self.points()["damage"], []
        degree = compat.element_info(V).degree
        for side, part in zip(self._at.sides, self._at.slices()):
            shape = side.own.facets.slave_surface.shape
            N, _ = shape_functions(shape, degree, side.xi)
            w = side.weight[:, None] * N**2
            both = np.stack([w, w * damage[part, None]], axis=-1)
            shares.append((side.own.result_table[side.facet], both))
        weights, sums = sums_at(V.dofmap.index_map, 2, *shares).T
        f.x.array[:] = np.divide(
            sums, weights, np.zeros_like(sums), where=weights > 0.0
        )
        return f

    def holding(self) -> Iterator[tuple[ZoneData, dict[str, Any]]]:
        """Yield the zone and the points of each slave, of which those are closed that
        still hold something. Collective."""
        damage = self.points()["damage"]
        for side, part in zip(self._at.sides, self._at.slices()):
            points = side.zone.points()
            status = np.minimum(points["status"], OPEN)
            status[side.number] = np.where(damage[part] < 1.0, CLOSED, OPEN)
            yield side.zone, {**points, "status": status}


def _other_points(side: Side, there: Array) -> str | None:
    """Say that damage belongs to points of another surface."""
    d, count = side.start.shape[-1], len(side.own.facets.slave_surface.facet_ids)
    if there.shape[1:] == (2 * d + 1,) and not (there[:, 0] >= count).any():
        return None
    return (
        "the state is of another contact, mesh or method: its adhesion is at points of "
        f"another surface than one of {count} facets in {d}D"
    )

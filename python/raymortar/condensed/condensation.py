"""Static condensation of dual multipliers: systems in the user's unknowns alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from petsc4py import PETSc

import numpy as np
import numpy.typing as npt

from ..core.compat import Array, Mask
from ..core.discretization.facets import facet_nodes, shape_functions
from ..core.discretization.layout import Layout
from ..core.discretization.ranks import destroy, marked_everywhere
from ..core.errors import SetUpError, raise_everywhere
from ..core.gamma.probing import product
from ..core.interface.zone_data import ZoneData
from ..core.system.coupled import CoupledSystem
from ..entries import empty_matrix, node_blocks

_OTHER = PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN

Rows = npt.NDArray[np.int64]

# Name under which a matrix carries what was eliminated from it
ELIMINATED = "raymortar_eliminated"


def rows_of_tests(zone: ZoneData) -> Array:
    """Test functions of gaps at the displacement's nodes of a facet, (n, nodes): rows of
    the displacement combine by them to those of the nodes [theory (4.23)]."""
    surface = zone.facets.slave_surface
    places = facet_nodes(surface.shape, surface.displacement_degree)
    # They are multiples of 1/4: what is rounding would make neighbours of nodes
    values = shape_functions(surface.shape, zone.multiplier_degree, places)[0].T
    values = np.round(4.0 * values) / 4.0
    if zone.multiplier_degree == 1:
        return values
    corners, middle = values[:2], values[2:]
    return np.concatenate([corners + 0.25 * middle, 0.5 * middle])


def scale(matrix: PETSc.Mat, left: Array | None, right: Array | None) -> None:
    """Multiply rows and columns of a matrix."""
    of_columns, of_rows = matrix.createVecs()
    of_rows.array[:] = 1.0 if left is None else left
    of_columns.array[:] = 1.0 if right is None else right
    matrix.diagonalScale(of_rows, of_columns)
    destroy(of_rows, of_columns)


@dataclass
class Newton:
    """Multipliers of Newton's method between two tangents [theory (4.37)]. Collective.

    Attributes
    ----------
    lam
        Owned multipliers at the place of the last tangent.
    x
        That place: the user's owned unknowns. None: no tangent yet.
    change
        What a whole step adds to multipliers where displacements stay.
    by_x
        Derivatives of the multipliers by the user's unknowns.
    share
        Its product with a motion is the share of the step that this is.
    """

    lam: Array
    x: Array | None = None
    change: Any = None
    by_x: Any = None
    share: Any = None

    def at(self, x: Array) -> Array:
        """Owned multipliers where the user's owned unknowns are x."""
        if self.x is None:
            return self.lam
        way = x - self.x
        done = self.by_x.comm.tompi4py().allreduce(float(self.share @ way))
        return self.lam + done * self.change + product(self.by_x, way)


@dataclass
class Eliminated:
    """Holds what multipliers were in a condensed tangent. m components a node.

    Attributes
    ----------
    tests
        Matrix by which the user's rows combine to those of multipliers; by its transpose
        a value at a node gives displacements: hats.
    law
        Matrix that puts rows of multipliers into those of slave nodes.
    spread
        Forces on the user's rows by a force on the rows of a multiplier.
    shares
        Derivatives of a node's rows by the forces on it, (nodes, m, m): the identity where
        contact is open.
    active
        Where the law is evaluated, (nodes, m).
    """

    tests: PETSc.Mat
    law: PETSc.Mat
    spread: PETSc.Mat
    shares: Array
    active: Mask


class Condensation:
    """Eliminates the multipliers of a system by the rows of slave nodes [theory (4.30),
    (4.31)]. Collective.

    Attributes
    ----------
    n
        Owned rows of the user's unknowns.
    tests
        Matrix by which rows of the user's unknowns combine to those of multipliers.
    """

    def __init__(self, system: CoupledSystem) -> None:
        self._system, self._comm = system, system.unknowns.comm
        self.n: int = system.layout.n
        self._count: int = system.layout.size - self.n
        # The user's rows and multipliers are numbered each by themselves, rank by rank
        sizes = np.array(self._comm.allgather((self.n, self._count)), dtype=np.int64)
        self._sizes = sizes[:, 0]
        starts = np.cumsum(sizes, axis=0) - sizes
        self._first_u, self._first_lam = starts.T
        self._ranges = system.layout.ranges
        raise_everywhere(self._comm, self._shared_nodes(), SetUpError)
        self.tests = empty_matrix(self._comm, self._count, self.n)
        self._law = empty_matrix(self._comm, self.n, self._count)
        self._near = empty_matrix(self._comm, self._count, self._count)
        for part in system.parts:
            for zone in part.zones:
                self._add_zone(part.layout, zone)
        for matrix in (self.tests, self._law, self._near):
            matrix.assemble()
        self._fixed: Mask | None = None
        self._held = np.zeros(self._count, dtype=bool)
        self._kept = np.zeros(self._count, dtype=bool)
        self._extends: PETSc.Mat | None = None

    # Rows

    def _split(self, rows: Rows) -> Rows:
        """Numbers among the user's rows, or among the multipliers, of rows of all."""
        rank = np.searchsorted(self._ranges, rows, side="right") - 1
        local = rows - self._ranges[rank]
        behind = local - self._sizes[rank]
        return np.where(
            behind < 0, self._first_u[rank] + local, self._first_lam[rank] + behind
        )

    def _shared_nodes(self) -> str | None:
        """Name a slave node that two contacts have, or that is a master's too."""
        V = self._system.u.function_space
        slaves, masters = [], []
        for part in self._system.parts:
            own = [zone.facets.slave_surface.dofs for zone in part.zones]
            slaves.append(marked_everywhere(V, np.unique(np.concatenate(own))))
            for zone in part.zones:
                masters.append(zone.facets.master_surface.dofs)
        is_slave = np.sum(slaves, axis=0)
        is_master = marked_everywhere(V, np.unique(np.concatenate(masters)))
        what = "a slave node of a condensed contact is"
        if (is_slave > 1).any():
            return f"{what} one of another contact: give the pairs to one Contact"
        if (is_master & (is_slave > 0)).any():
            return f"{what} a node of a master too: solve by raymortar.NonlinearProblem"
        return None

    def _add_zone(self, layout: Layout, zone: ZoneData) -> None:
        """Enter test functions, law's rows and neighbours of a zone's facets."""
        surface, tests = zone.facets.slave_surface, rows_of_tests(zone)
        u_rows = self._system.layout.u_rows[surface.dofs][surface.facet_dofs]
        first = layout.multiplier_rows[zone.multiplier_table]
        for of_u, of_lam in zip(u_rows, first):
            for i in range(layout.components):
                lam = self._split(of_lam + i).astype(PETSc.IntType)
                u = self._split(of_u[:, i]).astype(PETSc.IntType)
                self._enter(self.tests, lam, u, tests)
                self._enter(self._law, u[: len(lam)], lam, np.eye(len(lam)))
                self._near.setValues(lam, lam, np.ones((len(lam),) * 2), addv=True)

    @staticmethod
    def _enter(matrix: PETSc.Mat, rows: Rows, columns: Rows, values: Array) -> None:
        """Set entries that are not zero: other facets may have set the same."""
        for row, of_row in zip(rows, values):
            found = np.flatnonzero(of_row)
            matrix.setValues([row], columns[found], of_row[found])

    # State

    def set_prescribed(self, fixed: Mask) -> None:
        """Take which owned unknowns of the user are prescribed. Collective.

        The multiplier of a node whose rows they prescribe is not determined: it extends
        those of the nodes next to it, or is kept if the master does not feel it either.
        """
        kept = self._unfelt()
        same = (
            self._fixed is not None
            and np.array_equal(fixed, self._fixed)
            and np.array_equal(kept, self._kept)
        )
        self._fixed, self._kept = fixed.copy(), kept
        if self._comm.allreduce(int(not same)) == 0:
            return
        self._held = product(self.tests, fixed.astype(float)) > 0.0
        free = product(self._near, (~self._held).astype(float)) > 0.0
        alone = self._comm.allreduce(int((self._held & ~self._kept & ~free).sum()))
        if alone:
            raise SetUpError(
                f"{alone} multipliers of a condensed contact are at slave nodes that "
                "conditions prescribe, with none beside them that is free: swap slave "
                "and master, or solve by raymortar.NonlinearProblem"
            )

    def _unfelt(self) -> Mask:
        """Tell which owned multipliers no free displacement feels [theory (5.22)]."""
        found = []
        for part in self._system.parts:
            nodes, m = part.layout.owned_multipliers, part.layout.components
            mask = part.present.unfelt.along
            if mask is None or m == 1:
                mask = np.zeros((len(part.present.unfelt.accepted), m), dtype=bool)
            found.append(mask[nodes].ravel())
        return np.concatenate(found)

    def weigh(self) -> None:
        """Take what nodes weigh at the last pairing. Collective."""
        rows: list[tuple[Array, Array, Array]] = []
        for k, part in enumerate(self._system.parts):
            nodes, m = part.layout.owned_multipliers, part.layout.components
            found = self._system.cpp.node_weights(k)
            area, gamma = (np.repeat(np.asarray(one)[nodes], m) for one in found)
            rows.append((area, gamma, np.full(len(area), part.gamma_scale)))
        weights, gammas, scales = (np.concatenate(one) for one in zip(*rows))
        self._found = (weights > 0.0) & ~self._held
        self._by_force = np.zeros(self._count)
        self._by_force[self._found] = 1.0 / (weights * scales)[self._found]
        # The law of a kept one is minus it, but for what it does not depend on
        rest = self._held & self._kept & (weights > 0.0)
        self._by_own_law = np.zeros(self._count)
        self._by_own_law[rest] = gammas[rest] / (weights * scales**2)[rest]
        # An open node then has the force that its row gives
        self._by_law = np.where(self._found, -gammas / scales, 0.0)
        self._extension(weights > 0.0)
        of_law = product(self._law, self._found.astype(float))
        self._keeps = 1.0 - of_law

    def _extension(self, covered: Mask) -> None:
        """Make what extends determined multipliers to covered nodes that are held."""
        if self._extends is not None:
            self._extends.destroy()
            self._extends = None
        extends = self._held & ~self._kept & covered
        if self._comm.allreduce(int(extends.sum())) == 0:
            return
        known = self._found.astype(float)
        sums = product(self._near, known)
        left = np.where(extends & (sums > 0.0), 1.0 / np.maximum(sums, 1.0), 0.0)
        self._extends = self._near.copy()
        scale(self._extends, left, known)
        self._extends.setOption(PETSc.Mat.Option.NEW_NONZERO_LOCATION_ERR, False)
        diagonal = self._extends.getDiagonal()
        diagonal.array[:] += known
        self._extends.setDiagonal(diagonal)
        diagonal.destroy()

    # Equations

    def change(self, b: Array, lam: Array) -> Array:
        """Find how multipliers have to change to balance slave nodes, from the residual of
        all unknowns [theory (4.30)]: those of held nodes extend the others. Kept ones
        do not change, see `changes_of_kept`. Collective.
        """
        found = self._by_force * product(self.tests, b[: self.n]) + self._found * lam
        if self._extends is not None:
            found = product(self._extends, found)
        return np.where(self._kept & self._held, 0.0, found - lam)

    def unbalance(self, b: Array) -> float:
        """Norm of the forces on slave nodes, of a residual of all unknowns. Collective."""
        forces = self._found * product(self.tests, b[: self.n])
        return float(np.sqrt(self._comm.allreduce(float(forces @ forces))))

    def changes_of_kept(self, b: Array) -> Array:
        """Find by how much kept multipliers miss their law, in a residual of all."""
        return self._by_own_law * b[self.n :]

    def residual(self, b: Array) -> Array:
        """Rows of the user's unknowns from those of all, which multipliers are eliminated
        from [theory (4.31)]. Collective."""
        by_law = self._by_law * b[self.n :]
        return self._keeps * b[: self.n] + product(self._law, by_law)

    def tangent(self, A: PETSc.Mat) -> tuple[PETSc.Mat, PETSc.Mat, Eliminated]:
        """Matrix of the user's unknowns from the tangent of all, and derivatives of
        multipliers by these unknowns, both new; and what was eliminated. Collective."""
        uu, ul, lu, ll = self._parts(A)
        change = self.tests.matMult(uu)
        scale(change, self._by_force, None)
        if self._extends is not None:
            change, inner = self._extends.matMult(change), change
            inner.destroy()
        self._add_kept(change, lu, ll)
        eliminated = self._eliminated(ul, ll)
        law = self._law.copy()
        scale(law, None, self._by_law)
        for kept, added in ((uu, lu), (ul, ll)):
            scale(kept, self._keeps, None)
            rows = law.matMult(added)
            kept.axpy(1.0, rows, _OTHER)
            rows.destroy()
        through = ul.matMult(change)
        uu.axpy(1.0, through, _OTHER)
        destroy(ul, lu, ll, law, through)
        return uu, change, eliminated

    def _add_kept(self, change: PETSc.Mat, lu: PETSc.Mat, ll: PETSc.Mat) -> None:
        """Add derivatives of kept multipliers, by their law, to those of the others."""
        if self._comm.allreduce(int(self._by_own_law.any())) == 0:
            return
        by_others = ll.matMult(change)
        for of_law in (lu, by_others):
            rows = of_law.copy()
            scale(rows, self._by_own_law, None)
            change.axpy(1.0, rows, _OTHER)
            rows.destroy()
        by_others.destroy()

    def _eliminated(self, forces: PETSc.Mat, law: PETSc.Mat) -> Eliminated:
        """Take what preconditioners need of a tangent's columns by multipliers."""
        if self._extends is None:
            spread = forces.copy()
        else:
            spread = forces.matMult(self._extends)
        scale(spread, self._keeps, self._by_force)
        m = self._system.parts[0].layout.components
        at = np.arange(self._count).reshape(-1, m)
        shares = node_blocks(law, at) * self._by_law[at][:, :, None]
        shares *= self._by_force[at][:, None, :]
        active = self._found.reshape(-1, m)
        shares[~active[:, :, None] & np.eye(m, dtype=bool)] = 1.0
        return Eliminated(self.tests, self._law, spread, shares, active)

    def _parts(self, A: PETSc.Mat) -> list[PETSc.Mat]:
        """Parts of a tangent: by u and by multipliers of u's rows, then of theirs."""
        begin, end = A.getOwnershipRange()
        middle = begin + self.n
        sets = [
            PETSc.IS().createStride(middle - begin, begin, 1, comm=self._comm),
            PETSc.IS().createStride(end - middle, middle, 1, comm=self._comm),
        ]
        found = [A.createSubMatrix(rows, columns) for rows in sets for columns in sets]
        destroy(*sets)
        return found

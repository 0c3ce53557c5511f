"""Iterations of Newton's method with the statuses of nodes where their step ends."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from petsc4py import PETSc

import numpy as np
from scipy.sparse import csr_matrix

from ..core.compat import Array, Indices, Mask
from ..core.discretization.ranks import destroy
from ..core.errors import NotFinite
from ..core.interface.zone_data import ZoneData
from ..core.system.coupled import ROOM
from .rows_of_nodes import RowsOfNodes

# Most rows that may change. Each takes a column of the compliance, and all of them as
# long as an iteration or two (docs/measured/statuses_ahead.md)
MOST_COLUMNS = 256

# Most solves for the statuses of one step: of some hundred steps the longest took 30
MOST_SOLVES = 40

# Solves in a row after which no more follow, if none leaves less of the law
IN_VAIN = 12

# Residual over that of Newton's iterate above which that one stays
WORSE = 1.1

# Difference of two rows that is rounding, over their largest entry
ROUNDING = 1e-12


@dataclass
class _Zone:
    """A zone whose law holds at nodes, and the number of its contact."""

    contact: int
    part: Any
    zone: ZoneData

    @property
    def rows(self) -> Indices:
        """Global rows of the nodes' multipliers, (nodes, components)."""
        first = self.part.layout.multiplier_rows[self.zone.multiplier_nodes]
        rows: Indices = first[:, None] + np.arange(self.part.layout.components)
        return rows

    def linearise(self, system: Any, multipliers: Array, gaps: Array) -> None:
        """Linearise the law at a change of the multipliers, as unknowns, and of the
        integrals of gaps and slips, as rows, (nodes, components) each."""
        scale, (areas, _) = self.part.gamma_scale, system.cpp.node_weights(self.contact)
        areas = np.asarray(areas)[self.zone.multiplier_nodes, None]
        means = gaps / scale / np.where(areas > 0.0, areas, 1.0)
        if means.shape[1] == 1:
            means = means * self.zone.cpp.nodes()["normal"]
        values = np.hstack([scale * multipliers, means])
        self.zone.cpp.set_node_changes(values.ravel())


class _Step:
    """The linear step from an iterate, as its rows at nodes change. Collective.

    With the tangent A and the residual r the step is d = -A^-1 r. Where rows of the
    system change by D, and those of the residual by e, it is d - Z v, with the columns Z
    of A^-1 that belong to these rows, and (1 + D Z) v = D d + e.
    """

    def __init__(self, solver: Any, rows: RowsOfNodes, d: Array) -> None:
        self._solver, self._rows = solver, rows
        self._d, self._d_met = d, rows.in_columns(d)
        # Columns so far: their rows, and their values on this rank and where rows of
        # nodes have entries
        self._known: list[int] = []
        self._Z, self._Z_met = np.empty((len(d), 0)), np.empty((len(self._d_met), 0))

    def changed(self, D: csr_matrix, e: Array, changes: Mask) -> Array | None:
        """Solve with changes of this rank's rows; `changes` tells which of all rows
        change. Return the step on this rank; None: there is none, or it takes too many
        columns."""
        of = self._rows
        changed = np.flatnonzero(changes).tolist()
        new = sorted(set(changed) - set(self._known))
        if len(self._known) + len(new) > MOST_COLUMNS:
            return None
        if new:
            self._add(new)
        used = [self._known.index(row) for row in changed]
        right = (D @ self._d_met + e)[:, None]
        table = of.joined(np.hstack([D @ self._Z_met[:, used], right]))[changed]
        try:
            v = np.linalg.solve(np.eye(len(used)) + table[:, :-1], table[:, -1])
        except np.linalg.LinAlgError:  # nothing holds a body with these statuses
            return None
        return np.asarray(self._d - self._Z[:, used] @ v)

    def _add(self, new: list[int]) -> None:
        """Solve for columns. Collective."""
        A, scale = self._solver.A, self._solver.scale
        sizes = A.getSizes()[0], (PETSc.DECIDE, len(new))
        right, Z = (PETSc.Mat().createDense(sizes, comm=A.comm) for _ in range(2))
        for matrix in (right, Z):
            matrix.setUp()
        rows = self._rows.all[new] - A.getOwnershipRange()[0]
        (own,) = np.nonzero((rows >= 0) & (rows < len(self._d)))
        one = np.ones(len(self._d)) if scale is None else scale.array_r
        right.getDenseArray()[rows[own], own] = one[rows[own]]
        for matrix in (right, Z):
            matrix.assemble()
        factors(self._solver.krylov_solver).matSolve(right, Z)
        found = Z.getDenseArray().copy()
        destroy(right, Z)
        self._known += new
        self._Z = np.hstack([self._Z, found])
        self._Z_met = np.hstack([self._Z_met, self._rows.in_columns(found)])


def factors(ksp: PETSc.KSP) -> PETSc.Mat:
    """Factors of the present tangent, of a solver that factorises. Collective."""
    if ksp.getType() == "python":
        return ksp.getPythonContext().factors(ksp)
    return ksp.getPC().getFactorMatrix()


class StatusesAhead:
    """Ends each iteration with the statuses of nodes where its linear step ends.
    Collective.

    Newton's method takes a step with the statuses that nodes have where it begins, so
    that a front of opening or of slip moves by a facet in each iteration. Here the law
    is linearised where the step leads, and the step solved again, until all nodes keep
    their statuses [theory (5.30)]. Pairs and all other rows stay, so that such a solve
    takes rows of nodes, and a column of the compliance for each row that changes. If
    statuses come again after others, or more columns are needed, the step is kept that
    leaves least of the law: of all solves, or Newton's. Newton's iterate stays, too,
    where this one has more out of balance: far from linear, the end of a linear step
    misleads.
    """

    def __init__(self, solver: Any) -> None:
        self._solver, self._problem = solver, solver.problem
        self._zones = _zones_at_nodes(solver.problem)
        # The iterate from which the step goes, its statuses, and zones that cast rays
        # alone there
        self._begin: PETSc.Vec | None = None
        self._statuses = b""
        self._cast: list[ZoneData] = []
        # A matrix for contact alone, and the rows of nodes in it and the tangent
        self._A: Any = None
        self._nodes: Any = None

    def __bool__(self) -> bool:
        return bool(self._zones)

    def __call__(self, x: PETSc.Vec, b: PETSc.Vec) -> None:
        """Change an iterate, and b, its residual."""
        problem = self._problem
        if len(problem.history) < 2 or not problem.convergence.now.is_finite:
            return
        changed = _differing(self._present(), self._statuses)
        if not 0 < changed <= MOST_COLUMNS:
            return
        begin, newton, norm = self._begin, x.copy(), problem.convergence.now.norm
        assert begin is not None
        begin.copy(x)
        problem.form(x)
        for zone in self._cast:
            zone.cpp.cast()
        step = self._step(newton.array_r - x.array_r)
        if step is not None:
            x.array[:] += step
        if step is None or not self._is_fit(x, b, norm):
            newton.copy(x)
            self._evaluate(x, b)
        destroy(newton)

    def _is_fit(self, x: PETSc.Vec, b: PETSc.Vec, norm: float) -> bool:
        """Take the residual; return whether it is finite, and not far above `norm`,
        which Newton's iterate has. Collective."""
        try:
            self._evaluate(x, b)
        except NotFinite:
            return False
        now = self._problem.convergence.now
        return bool(now.is_finite and now.norm <= WORSE * norm)

    def _evaluate(self, x: PETSc.Vec, b: PETSc.Vec) -> None:
        """Take the residual of an iterate in place of the last one. Collective."""
        problem = self._problem
        problem.F(x, b)
        if self._solver.scale is not None:
            b.pointwiseMult(b, self._solver.scale)
        # Each iterate is in the history once
        problem.history[-2:] = problem.history[-1:]

    def keep(self, x: PETSc.Vec) -> None:
        """Keep the iterate from which the next step goes. Collective."""
        if self._begin is None:
            self._begin = x.duplicate()
        x.copy(self._begin)
        self._statuses, self._cast = self._present(), []
        if len(self._problem.history) == 1:
            zones = self._problem.contact.zones
            self._cast = [zone for zone in zones if zone.motions.have_moved()]

    def destroy(self) -> None:
        """Free what belongs to PETSc. Collective."""
        destroy(self._begin, self._A)
        self._begin = self._A = None

    def _present(self) -> bytes:
        """Statuses of all nodes. Collective."""
        found = b"".join(
            one.zone.cpp.nodes()["status"].tobytes() for one in self._zones
        )
        comm = self._problem.comm
        return found if comm.size == 1 else b"".join(comm.allgather(found))

    def _rows(self) -> RowsOfNodes:
        """Rows of the nodes in a tangent with the present pattern."""
        A = self._solver.A
        room = A.getAttr(ROOM)
        if self._A is None or self._A.getAttr(ROOM) != room:
            destroy(self._A)
            self._A = A.duplicate()
            self._A.setAttr(ROOM, room)
            self._nodes = RowsOfNodes([one.rows for one in self._zones], A)
        found: RowsOfNodes = self._nodes
        return found

    def _step(self, d: Array) -> Array | None:
        """The step that ends with its own statuses, or leaves least of the law, from
        Newton's; None: that is the best."""
        rows, scale = self._rows(), self._solver.scale
        begin, of_entries = rows.entries(self._solver.A), rows.row_of_entries()
        if scale is not None:
            begin /= scale.array_r[rows.local][of_entries]
        with self._linearised_elsewhere():
            for one in self._zones:
                one.zone.cpp.set_node_changes(np.empty(0), measures=True)
            entries, lifted = self._system_of(rows, contact=False)
            measures = rows.matrix(entries)
        contact, r = self._system_of(rows)
        sizes = rows.largest(begin) + rows.largest(contact)
        softened = rows.joined(rows.largest(begin - contact) > ROUNDING * sizes)
        system, at_begin = self._problem.contact.system, self._statuses_of(rows)
        steps, found, seen = _Step(self._solver, rows, d), d, [b""]
        places = [rows.places(one.rows) for one in self._zones]
        best, least, in_vain = None, np.inf, 0
        with self._linearised_elsewhere():
            for _ in range(MOST_SOLVES):
                met = rows.in_columns(found)
                gaps = rows.joined(measures @ met + lifted)
                multipliers = rows.of_columns(met)
                for one, at in zip(self._zones, places):
                    one.linearise(system, multipliers[at], gaps[at])
                statuses = self._statuses_of(rows)
                entries, residual = self._system_of(rows)
                left = rows.joined(residual + rows.matrix(entries) @ met)
                norm, in_vain = float(np.linalg.norm(left)), in_vain + 1
                if norm < least:
                    least, in_vain = norm, 0
                    best = None if found is d else found
                if statuses.tobytes() in seen or in_vain == IN_VAIN:
                    break
                seen.append(statuses.tobytes())
                changes = softened | (statuses != at_begin)
                D = np.where(rows.own(changes)[of_entries], entries - begin, 0.0)
                e = np.where(rows.own(changes), residual - r, 0.0)
                changed = steps.changed(rows.matrix(D), e, changes)
                if changed is None:
                    break
                found = changed
        return best

    def _statuses_of(self, rows: RowsOfNodes) -> Array:
        """Statuses of the nodes of all rows. Collective."""
        known, statuses = [], []
        for one in self._zones:
            known.append(one.rows.ravel())
            status = one.zone.cpp.nodes()["status"]
            statuses.append(np.repeat(status, one.part.layout.components))
        return rows.spread(np.concatenate(known), np.concatenate(statuses))

    def _system_of(
        self, rows: RowsOfNodes, contact: bool = True
    ) -> tuple[Array, Array]:
        """Entries of this rank's rows in the tangent of contact, and the same rows of
        its residual, to which prescribed displacements are added. Without `contact`,
        the residual has these alone."""
        problem, system = self._problem, self._problem.contact.system
        A, b = self._A, problem.create_vector()
        A.zeroEntries()
        system.add_tangent(A, problem.bcs)
        A.assemble()
        b.set(0.0)
        if contact:
            system.add_residual(b, problem.bcs)
        lacking = problem.contact.unknowns.lacking(problem.bcs)
        system.cpp.lift(b.handle, lacking.of_u, -1.0)
        b.assemble()
        found = b.array_r[rows.local].copy()
        destroy(b)
        return rows.entries(A), found

    @contextmanager
    def _linearised_elsewhere(self) -> Iterator[None]:
        """Let laws be linearised at the present state again in the end."""
        try:
            yield
        finally:
            for one in self._zones:
                one.zone.cpp.set_node_changes(np.empty(0))


def _differing(one: bytes, other: bytes) -> int:
    """Number of bytes that differ."""
    return int(np.count_nonzero(np.frombuffer(one, "u1") != np.frombuffer(other, "u1")))


def _zones_at_nodes(problem: Any) -> list[_Zone]:
    """Zones of contacts with a law at nodes; none where one with a multiplier has its
    law at points, or constraints combine unknowns."""
    contacts = zip(problem.contact.contacts, problem.contact.parts)
    found = []
    for k, (one, part) in enumerate(contacts):
        if one.multiplier is None or part.surfaces.tied is not None:
            continue
        if getattr(one.method, "condition", "points") != "nodes":
            return []
        found += [_Zone(k, part, zone) for zone in one.zones]
    return found if problem.constraints is None else []

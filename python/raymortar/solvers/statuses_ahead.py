"""Iterations of Newton's method with the statuses where their step ends."""

from __future__ import annotations

from functools import partial
from typing import Any

from petsc4py import PETSc

import numpy as np
from scipy.sparse import csr_matrix

from ..core.compat import Array, Mask
from ..core.discretization.ranks import destroy
from ..core.errors import ContactError, NotFinite
from ..core.interface.zone_data import ZoneData
from ..core.system.coupled import ROOM
from .laws_ahead import LawAhead, System, laws_ahead
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

# Newton's iterate stays if the residual has fallen to this part of the last one, and no
# more than a few statuses differ: the next step has these
FELL, FEW = 0.01, 2

# Difference of two rows that is rounding, over their largest entry
ROUNDING = 1e-12


class _Step:
    """The linear step from an iterate, as rows of the law change. Collective.

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
        if not np.isfinite(v).all():
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


class _LawOfStep:
    """The law in the linear step from an iterate x, linearised where solves for the step
    lead. Collective."""

    def __init__(
        self, ahead: StatusesAhead, law: LawAhead, rows: RowsOfNodes, x: Any, d: Array
    ) -> None:
        self._law, self._rows, self._steps = law, rows, _Step(ahead.solver, rows, d)
        self._system = partial(ahead.system_of, rows)
        begin = ahead.entries_of_tangent(rows)
        contact, self._r = self._system(True)
        law.begin(rows, x, self._system)
        self._base, self._of_entries = contact, rows.row_of_entries()
        if law.casts:
            self._base, self._r = self._system(True)
        # Rays alone do not move segments
        self._shift, self._begin = contact - self._base, begin
        self._sizes = rows.largest(begin) + rows.largest(contact)
        softened = rows.joined(self._differ(begin, contact))
        self._softened = np.asarray(softened, dtype=bool)

    def _differ(self, one: Array, other: Array) -> Mask:
        """Whether two sets of entries differ in each of this rank's rows."""
        size = self._rows.largest(one - other)
        return np.asarray(size > ROUNDING * self._sizes)

    def linearise(self, step: Array) -> bytes:
        """Linearise the law where a step leads; return its statuses on this rank."""
        self._met = self._rows.in_columns(step)
        statuses = self._law.linearise(step, self._met)
        self._entries, self._residual = self._system(True)
        return statuses

    def left(self) -> float:
        """Size of what the step leaves of the law."""
        rows = self._rows.matrix(self._entries + self._shift)
        left = self._rows.joined(self._residual + rows @ self._met)
        return float(np.linalg.norm(left))

    def solved(self) -> Array | None:
        """The step by the law as it is linearised; None: see `_Step`."""
        rows, law = self._rows, self._law
        changed = law.changed(self._differ(self._entries, self._base))
        changes = self._softened | changed
        own, D = rows.own(changes), self._entries + self._shift - self._begin
        D = np.where(own[self._of_entries], D, 0.0)
        e = np.where(own, self._residual - self._r, 0.0)
        return self._steps.changed(rows.matrix(D), e, changes)


class StatusesAhead:
    """Ends each iteration with the statuses that nodes or points have where its linear
    step ends. Collective.

    Newton's method takes a step with the statuses that they have where it begins, so
    that a front of opening or of slip moves by a facet in each iteration. Here the law
    is linearised where the step leads, and the step solved again, until all keep their
    statuses [theory (5.30)]. Pairs and all other rows stay, so that such a solve takes
    the rows of the law, and a column of the compliance for each row that changes. If
    statuses come again after others, or more columns are needed, the step is kept that
    leaves least of the law: of all solves, or Newton's. Far from linear the end of a
    linear step misleads. So Newton's iterate stays, too, where this one has more out of
    balance, and under forces that let bodies move far.
    """

    def __init__(self, solver: Any) -> None:
        self.solver, self._problem = solver, solver.problem
        self._law: LawAhead | None = laws_ahead(solver.problem)
        # The iterate from which the step goes, its statuses, and zones that cast rays
        # alone there
        self._begin: PETSc.Vec | None = None
        self._statuses = b""
        self._cast: list[ZoneData] = []
        # A matrix for contact alone, and the rows of the law in it and the tangent
        self._A: Any = None
        self._of_law: Any = None

    def __bool__(self) -> bool:
        return self._law is not None

    def __call__(self, x: PETSc.Vec, b: PETSc.Vec) -> None:
        """Change an iterate, and b, its residual."""
        problem, law = self._problem, self._law
        if len(problem.history) < 2 or not problem.convergence.now.is_finite:
            return
        if any(term.leads_far for term in problem.terms):
            return
        assert law is not None
        changed = _differing(self._of_all(law.statuses()), self._statuses)
        if not 0 < changed <= MOST_COLUMNS or self._is_near(changed):
            return
        begin, newton, norm = self._begin, x.copy(), problem.convergence.now.norm
        assert begin is not None
        begin.copy(x)
        problem.form(x)
        for zone in self._cast:
            zone.cpp.cast()
        step = self._step(law, x, newton.array_r - x.array_r)
        begin.copy(x)
        if step is not None:
            x.array[:] += step
        if step is None or not self._is_fit(x, b, norm):
            newton.copy(x)
            self._evaluate(x, b)
        destroy(newton)

    def _is_near(self, changed: int) -> bool:
        """Whether the residual has fallen so far, and so few statuses differ, that
        Newton's iterate may stay."""
        last, now = self._problem.history[-2:]
        return changed <= FEW and now <= FELL * last

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
        if self.solver.scale is not None:
            b.pointwiseMult(b, self.solver.scale)
        # Each iterate is in the history once
        problem.history[-2:] = problem.history[-1:]

    def keep(self, x: PETSc.Vec) -> None:
        """Keep the iterate from which the next step goes. Collective."""
        assert self._law is not None
        if self._begin is None:
            self._begin = x.duplicate()
        x.copy(self._begin)
        self._statuses, self._cast = self._of_all(self._law.statuses()), []
        if len(self._problem.history) == 1:
            zones = self._problem.contact.zones
            self._cast = [zone for zone in zones if zone.motions.have_moved()]

    def destroy(self) -> None:
        """Free what belongs to PETSc. Collective."""
        destroy(self._begin, self._A)
        self._begin = self._A = None

    def _of_all(self, statuses: bytes) -> bytes:
        """Join what each rank has."""
        comm = self._problem.comm
        return statuses if comm.size == 1 else b"".join(comm.allgather(statuses))

    def _rows(self, law: LawAhead) -> RowsOfNodes:
        """Rows of the law in a tangent with the present pattern."""
        A = self.solver.A
        room = A.getAttr(ROOM)
        if self._A is None or self._A.getAttr(ROOM) != room:
            destroy(self._A)
            self._A = A.duplicate()
            self._A.setAttr(ROOM, room)
            self._of_law = RowsOfNodes([one.rows for one in law.zones], A)
        found: RowsOfNodes = self._of_law
        return found

    def _step(self, law: LawAhead, x: PETSc.Vec, d: Array) -> Array | None:
        """The step that ends with its own statuses, or leaves least of the law, from
        Newton's at x; None: that is the best."""
        rows = self._rows(law)
        try:
            return self._settled(_LawOfStep(self, law, rows, x, d), d)
        finally:
            law.end()

    def _settled(self, of_step: _LawOfStep, d: Array) -> Array | None:
        """Solve for the step until no status changes."""
        best, least, in_vain, found, seen = None, np.inf, 0, d, [b""]
        for _ in range(MOST_SOLVES):
            try:
                statuses = self._of_all(of_step.linearise(found))
            except ContactError:  # no rays can be cast there
                break
            norm, in_vain = of_step.left(), in_vain + 1
            if norm < least:
                least, in_vain = norm, 0
                best = None if found is d else found
            if statuses in seen or in_vain == IN_VAIN:
                break
            seen.append(statuses)
            changed = of_step.solved()
            if changed is None:
                break
            found = changed
        return best

    def system_of(self, rows: RowsOfNodes, contact: bool = True) -> System:
        """Entries of this rank's rows in the tangent of contact, and the same rows of
        its residual, to which prescribed displacements are added. Without `contact`,
        the residual has these alone. Collective."""
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

    def entries_of_tangent(self, rows: RowsOfNodes) -> Array:
        """Entries of this rank's rows in the tangent that was solved."""
        entries, scale = rows.entries(self.solver.A), self.solver.scale
        if scale is not None:
            entries /= scale.array_r[rows.local][rows.row_of_entries()]
        return entries


def _differing(one: bytes, other: bytes) -> int:
    """Number of bytes that differ; 1 where there are more or fewer points."""
    if len(one) != len(other):
        return 1
    return int(np.count_nonzero(np.frombuffer(one, "u1") != np.frombuffer(other, "u1")))

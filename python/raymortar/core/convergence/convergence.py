"""The test that ends Newton's method: are the forces of each body in balance?"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..compat import Array, Mask
from .balance import EPS, Groups

# Weight of a prescribed displacement in line searches, in stiffnesses of the softest
# body: with 1, a first touch may end the search (docs/measured/robustness_units.md)
PRESCRIBED = 10.0

# Ratio of stiffnesses up to which line searches see both bodies well enough as they are
ALIKE = 100.0

# Bodies and surfaces that a message names
MOST_NAMED = 3

# Periods of cycles that are looked for, in iterations
PERIODS = range(2, 9)

# Relative difference of residuals that count as the same where there is something else
# to try
REPEATS = 0.03

# Share of the rounding error below which a patch's residual counts though it falls
FAR = 1e-3

# Growth of the residual over all before it that no solve comes back from
GROWTH = 1e4

# Iterations without a new least residual, after which a solve wanders
WANDERS = 8

# Such iterations, after which a solve from a predicted start strays
# (docs/measured/load_steps.md)
STRAYS = 7

# Growth over the first residuals, from which a solve ends if another way has just worked
JUMP = 100.0

# Growth of the residual in the first iteration from which its start may not count
STRETCHES = 10.0


@dataclass(frozen=True)
class Imbalance:
    """Distance of one iterate from a solution, by group of rows.

    `residual` is the norm of the residual's free rows. Force; for a further field the
    unit of its equation. `forces` is the norm of the forces that are in balance:
    stresses, loads and supports of a body, tractions of a surface; for a further field
    an upper bound of the terms of its equation. `lacking` is the largest difference
    between the present and the prescribed value, by field, the displacement first, and
    `sizes` the largest value of each field, whose rounding error iterative solvers leave
    in all values. The first `count` groups are forces.
    """

    residual: Array
    forces: Array
    lacking: Array
    sizes: Array
    count: int

    @property
    def norm(self) -> float:
        """Norm of all forces of the residual. Force."""
        forces = self.residual[: self.count]
        return float(np.sqrt(forces @ forces))

    @property
    def pending(self) -> float:
        """Largest difference between a displacement and its prescribed value.
        Length."""
        return float(self.lacking[0])

    @property
    def is_finite(self) -> bool:
        """Whether the residual is finite in all rows."""
        return bool(np.isfinite(self.residual).all())


UNKNOWN = Imbalance(np.empty(0), np.empty(0), np.zeros(1), np.zeros(1), 0)


class Convergence:
    """Judges the iterates of one problem, the same way for every solver.

    Each group of rows (`balance.Groups`) is compared with its own forces: the larger of
    its first residual and its present forces. So a soft body beside a stiff one is
    solved to the same tolerance, and a step that begins near its solution need not beat
    the rounding error. Lengths are compared with lengths, and the residual of a further
    field with the terms of its own equation.

    `now` is the last residual, and `norms` are those of the iterates since `start`, force:
    rejected trial steps are left out, and iterates that had not reached a prescribed
    displacement. A solve that is `patient` goes on until it is hopeless. Otherwise it ends
    at the first trouble, as `LoadSteps` has remedies. One that `lasts` may begin with a
    residual that is less than the next ones. One that is `hasty` ends where the residual
    jumps, one that is `predicted`, whose start is not the only one, where it strays. A
    `watcher` is called at each iterate.
    """

    def __init__(self, groups: Groups) -> None:
        self.groups = groups
        self.patient, self.lasts, self.hasty, self.predicted = True, False, False, False
        self.watcher: Callable[[], None] | None = None
        self.norms: list[float] = []
        # These include residuals after softened tangents, which `norms` leaves out
        self._all_norms: list[float] = []
        self.now: Imbalance = UNKNOWN
        self._first: Imbalance = UNKNOWN
        # Residuals of the last two iterates
        self._last: tuple[Array | None, Array | None] = (None, None)
        self._floors = self.groups.floors()
        self._field_floors = np.zeros(self.groups.count)
        self._inertia_floors = np.zeros(self.groups.count)
        self._asked: tuple[float, float | None] | None = None

    @property
    def floor(self) -> float:
        """Norm of the rounding errors of all forces. Force."""
        floors = self._floors + self._inertia_floors
        return float(np.linalg.norm(floors[: self.groups.forces]))

    def start(self) -> None:
        """Begin a solve. Collective."""
        self._floors = self.groups.floors()
        self._inertia_floors[:] = 0.0
        self._last, self.now = (None, None), UNKNOWN
        self._first = UNKNOWN
        self.norms.clear()
        self._all_norms.clear()

    def measure(
        self,
        norms: tuple[Array, Array, Array, Array],
        more: tuple[Array, Array] | None = None,
        inertia: Array | None = None,
    ) -> Imbalance:
        """Note a residual. Collective.

        `norms` are those of `CoupledSystem.norms`; `more` are the sizes and rounding
        errors that terms of fluxes add to each group; `inertia` is the force of inertia
        that a unit of each owned unknown takes, None without inertia.
        """
        groups, (residual, forces, lacking, sizes) = self.groups, norms
        if inertia is not None:
            self._inertia_floors = groups.inertia_floors(inertia, sizes)
        if len(groups.fields) > 1:
            scales, self._field_floors = groups.field_terms(sizes)
            if more is not None:
                scales, self._field_floors = np.add((scales, self._field_floors), more)
            forces = np.maximum(forces, scales)
        self.now = Imbalance(residual, forces, lacking, sizes, groups.forces)
        if self._first is UNKNOWN:
            self._first = self.now
        return self.now

    def accept(self) -> None:
        """Note that the last residual belongs to an iterate, not to a trial step."""
        self._last = self._last[1], self.now.residual
        if (self.now.lacking > 256.0 * EPS * self.now.sizes).any():
            self.norms.clear()
            self._all_norms.clear()
        else:
            self.norms.append(self.now.norm)
            self._all_norms.append(self.now.norm)
        if self.watcher is not None:
            self.watcher()

    @property
    def is_stuck(self) -> bool:
        """Whether more iterations would be in vain."""
        if not self.now.is_finite:
            return True
        if self.now.norm <= self.floor:
            return False
        if self.patient:
            return is_hopeless(self.norms)
        return self.jumped or self._strays or is_in_trouble(self._way())

    @property
    def jumped(self) -> bool:
        """Whether the residual of a `hasty` solve has grown a hundredfold."""
        norms = self.norms
        return self.hasty and len(norms) > 1 and norms[-1] > JUMP * min(norms[:2])

    @property
    def _strays(self) -> bool:
        """Whether a `predicted` solve has had no new least residual for a while."""
        return self.predicted and _idle(self._all_norms) >= STRAYS

    def _way(self) -> list[float]:
        """Return the residuals that tell of trouble.

        Small loads may leave less out of balance than all iterates on the way, as a body
        that bends is stretched first.
        """
        norms = self.norms
        if not self.lasts or len(norms) < 3 or norms[1] < STRETCHES * norms[0]:
            return norms
        return norms[1:]

    def reached(self, rtol: float, atol: float | None, at_once: bool = False) -> bool:
        """Whether the last residual is small enough.

        `rtol` is the residual of each group over its forces, and the distance from
        prescribed values over the first such distance. `atol` is the norm of all forces
        of the residual that ends a solve. Force. None: the rounding error of each group,
        once iterations no longer reduce the residual, or `at_once`.
        """
        self._asked = rtol, atol
        if self._pending(rtol):
            return False
        balanced = self._balanced(rtol, atol, at_once)
        if atol is not None and self.now.norm <= atol:
            balanced = balanced[self.now.count :]
        return bool(balanced.all())

    @property
    def _forces(self) -> Array:
        """Forces that the residual of each group is compared with."""
        return np.maximum(self.now.forces, self._first.residual)

    def _pending(self, rtol: float) -> bool:
        """Whether displacements have not yet reached their prescribed values."""
        step = max(rtol, 8.0 * EPS) * self._first.lacking
        # Linear solvers round by the largest unknowns: several ranks' more than one's
        rounding = 256.0 * EPS * self.now.sizes
        return bool((self.now.lacking > np.maximum(step, rounding)).any())

    def _balanced(self, rtol: float, atol: float | None, at_once: bool) -> Mask:
        """Whether each group is in balance."""
        now = self.now
        balanced = now.residual <= rtol * self._forces
        fields = np.arange(len(balanced)) >= now.count
        if atol is not None and not fields.any():
            return balanced
        # A body of soft and stiff parts has the rounding error of the stiff ones, and
        # may have all forces of the others below: it counts where nothing improves
        settled: Any = at_once
        if not at_once and self._last[0] is not None:
            settled = now.residual >= 0.1 * self._last[0]
        floors = self._floors + self._field_floors + self._inertia_floors
        rounding = settled & (now.residual <= floors)
        # The tractions of a surface that opens vanish, and their residual with them
        rounding |= self.groups.is_patch & (now.residual <= FAR * floors)
        # A tolerance for forces says nothing about fields that are not forces
        return balanced | (rounding & (fields if atol is not None else True))

    def describe(self) -> str:
        """Name the groups that are out of balance, for messages; "" for none. Collective."""
        if self.now is UNKNOWN or self._asked is None:
            return ""
        now, (rtol, atol) = self.now, self._asked
        lacking = np.flatnonzero(~self._balanced(rtol, atol, True))
        text = ""
        if len(lacking):
            names, forces = self.groups.names(), self._forces
            listed = [
                f"{names[g]} by {now.residual[g]:.3e} of {forces[g]:.3e}"
                for g in lacking[:MOST_NAMED]
            ]
            more = [f"{len(lacking) - MOST_NAMED} more"] * (len(lacking) > MOST_NAMED)
            text = f"; out of balance: {', '.join(listed + more)}"
        if self._pending(rtol):
            text += f"; prescribed displacements lack up to {now.pending:.3e}"
            for field, value in zip(self.groups.fields[1:], now.lacking[1:]):
                text += f", prescribed values of {field.name} up to {value:.3e}"
        return text

    def row_scale(self, fixed: Mask, values: Array) -> Array:
        """Find factors of the owned rows that make them comparable in a line search.

        The rows of a body, divided by its stiffness, are lengths, as prescribed
        displacements are. Multiplied by the stiffness of the softest body that can
        move, all rows are forces again. So units do not matter, and a soft body counts
        as much as a stiff one. Owned unknowns of the user are `fixed` where they are
        constrained; `values` are those of the local unknowns.
        """
        free = np.ones(len(self.groups.of_row))
        free[: len(fixed)][fixed] = 0.0
        stiffness, springs = self.groups.softest(free)
        one = float(stiffness.min())
        one = one if np.isfinite(one) else 1.0
        scale = one / stiffness
        # A symmetric matrix stays symmetric if bodies are alike, or do not move
        scale[scale >= 1.0 / ALIKE] = 1.0
        scale[scale == 0.0] = 1.0
        rows = scale[self.groups.of_row]
        # Forces that a body meets on its way are no reason to stop it: heavier than the
        # springs of contact
        heavy = one * max(PRESCRIBED, springs)
        rows[: len(fixed)][fixed] = heavy
        (sizes,) = self.groups.largest_of_fields(values)
        for of, per_length, unit in self.groups.field_rows(sizes):
            rows[of] = np.where(fixed[of], heavy * unit, one / per_length)
        return rows


def cycle_length(history: Sequence[float], tolerance: float = 1e-2) -> int:
    """Number of residuals after which the last ones repeat, 0 if they do not.

    Three times over, to a tolerance; residuals that stay the same are no cycle.
    """
    for period in PERIODS:
        last = np.array(history[-3 * period :])
        if len(last) < 3 * period or not np.isfinite(last).all():
            continue
        change = np.abs(last[period:] - last[:-period])
        same = change <= tolerance * last[period:]
        if same.all() and np.ptp(last[:period]) > 0.03 * last.max():
            return period
    return 0


def stays(history: Sequence[float], tolerance: float, count: int) -> bool:
    """Whether the last residuals are all the same, and not zero."""
    last = np.array(history[-count:])
    if len(last) < count or not np.isfinite(last).all():
        return False
    return bool(last.max() > 0.0 and np.ptp(last) <= tolerance * last.max())


def is_hopeless(norms: Sequence[float]) -> bool:
    """Whether residuals repeat so often that a solve should end. For a solve outside of
    `LoadSteps`, which has nothing else to try."""
    return cycle_length(norms, 1e-3) > 0 or stays(norms, 1e-3, 7)


def is_in_trouble(norms: Sequence[float]) -> bool:
    """Whether `LoadSteps` should try another way: residuals repeat, grow by orders of
    magnitude, or reach no new minimum."""
    r = np.asarray(norms)
    if not np.isfinite(r).all():
        return True
    if len(r) < 2:
        return False
    grows = len(r) > 3 and r[-1] > GROWTH * r[:3].max()
    wanders = _idle(norms) >= WANDERS
    return bool(grows or wanders) or is_hopeless(norms) or _repeats(r)


def _idle(norms: Sequence[float]) -> int:
    """Number of residuals since the least one."""
    return len(norms) - 1 - int(np.argmin(norms)) if norms else 0


def _repeats(r: Array) -> bool:
    """Whether the last residuals have repeated twice, to a few percent."""
    for period in PERIODS:
        n = max(2 * period, 5)
        last = r[-n - period + 1 :]
        if len(last) == n + period - 1 and last.min() > 0.0:
            if np.abs(last[period:] / last[:-period] - 1.0).max() <= REPEATS:
                return True
    return False

"""The test that ends Newton's method: are the forces of each body in balance?"""

from __future__ import annotations

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

# Share of the rounding error below which a patch's residual counts though it falls
FAR = 1e-3


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
    displacement.
    """

    def __init__(self, groups: Groups) -> None:
        self.groups = groups
        self.norms: list[float] = []
        self.now: Imbalance = UNKNOWN
        self._first: Imbalance = UNKNOWN
        # Tolerances of the last call of `reached`
        self._asked: tuple[float, float | None] | None = None
        # Residuals of the last two iterates
        self.recent: tuple[Array | None, Array | None] = (None, None)
        self._floors = self.groups.floors()
        self._field_floors = np.zeros(self.groups.count)
        self._inertia_floors = np.zeros(self.groups.count)

    @property
    def floor(self) -> float:
        """Norm of the rounding errors of all forces. Force."""
        floors = self._floors + self._inertia_floors
        return float(np.linalg.norm(floors[: self.groups.forces]))

    def start(self) -> None:
        """Begin a solve. Collective."""
        self._floors = self.groups.floors()
        self._inertia_floors[:] = 0.0
        self.recent, self.now = (None, None), UNKNOWN
        self._first = UNKNOWN
        self.norms.clear()

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
        self.recent = self.recent[1], self.now.residual
        if (self.now.lacking > 256.0 * EPS * self.now.sizes).any():
            self.norms.clear()
        else:
            self.norms.append(self.now.norm)

    @property
    def is_stuck(self) -> bool:
        """Whether more iterations would be in vain."""
        return not self.now.is_finite

    def reached(self, rtol: float, atol: float | None, at_once: bool = False) -> bool:
        """Whether the last residual is small enough.

        `rtol` is the residual of each group over its forces, and the distance from
        prescribed values over the first such distance. `atol` is the norm of all forces
        of the residual that ends a solve. Force. None: the rounding error of each group,
        once iterations no longer reduce the residual, or `at_once`.
        """
        self._asked = rtol, atol
        if self.is_pending(rtol):
            return False
        balanced = self.balanced(rtol, atol, at_once)
        if atol is not None and self.now.norm <= atol:
            balanced = balanced[self.now.count :]
        return bool(balanced.all())

    @property
    def is_last(self) -> bool:
        """Whether the present iteration is likely to end the solve, to `rtol`: its
        residual falls by the square of what the last one fell by."""
        asked = self._asked
        if asked is None or len(self.norms) < 2 or not self.norms[-2] > 0.0:
            return False
        fell, forces = self.norms[-1] / self.norms[-2], self.forces[: self.now.count]
        most = asked[0] * float(np.linalg.norm(forces))
        return self.norms[-1] * fell**2 <= most

    @property
    def forces(self) -> Array:
        """Forces that the residual of each group is compared with."""
        return np.maximum(self.now.forces, self._first.residual)

    def is_pending(self, rtol: float) -> bool:
        """Whether displacements have not yet reached their prescribed values."""
        step = max(rtol, 8.0 * EPS) * self._first.lacking
        # Linear solvers round by the largest unknowns: several ranks' more than one's
        rounding = 256.0 * EPS * self.now.sizes
        return bool((self.now.lacking > np.maximum(step, rounding)).any())

    def balanced(self, rtol: float, atol: float | None, at_once: bool) -> Mask:
        """Whether each group is in balance."""
        now = self.now
        balanced = now.residual <= rtol * self.forces
        fields = np.arange(len(balanced)) >= now.count
        if atol is not None and not fields.any():
            return balanced
        # A body of soft and stiff parts has the rounding error of the stiff ones, and
        # may have all forces of the others below: it counts where nothing improves
        settled: Any = at_once
        if not at_once and self.recent[0] is not None:
            settled = now.residual >= 0.1 * self.recent[0]
        floors = self._floors + self._field_floors + self._inertia_floors
        rounding = settled & (now.residual <= floors)
        # The tractions of a surface that opens vanish, and their residual with them
        rounding |= self.groups.is_patch & (now.residual <= FAR * floors)
        # A tolerance for forces says nothing about fields that are not forces
        return balanced | (rounding & (fields if atol is not None else True))

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

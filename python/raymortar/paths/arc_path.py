"""Paths whose steps have a given length."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core.compat import Array
from ..core.errors import ConvergenceError
from ..core.state import State
from .controls import ArcLength
from .led_paths import TOLERANCE, Change, LedPath

# Cosine between one step and the next below which a path has turned back
TURNED = -0.5


class ArcPath(LedPath):
    """Take steps of given length until the load factor meets the end. Collective."""

    time = 0.0  # the length of the path so far

    def __init__(self, control: ArcLength, *given: Any) -> None:
        super().__init__(*given)
        self._psi, self._most = float(control.psi), control.most
        self._nodes = self._u.function_space.dofmap.index_map.size_global
        # First change of the load factor. Its sign says which way the path sets out
        towards = (self._ends[1] - self._ends[0]) * self.sizes.part
        self._towards = -towards if control.falling else towards
        self._first = control.radius  # None: the first solve finds it
        self._last: Change | None = None
        self._count, self._sets_out = 0, True

    @property
    def _radius(self) -> float | None:
        return None if self._first is None else self.sizes.size * self._first

    @property
    def ended(self) -> bool:
        """Whether the path is at its end; an error if it has taken too many steps."""
        at_end = self.factor == self._ends[1] and self._count > 0
        if not at_end and self._count >= self._most:
            raise ConvergenceError(
                f"the path is at load factor {self.factor:.6g} after {self._most} "
                f"steps, and has not met its end at {self._ends[1]:.6g}"
            )
        return at_end

    def _product(self, a: Change, b: Change) -> float:
        """Multiply two changes as vectors. Length squared. Collective."""
        mine = float(a[0][: self._n] @ b[0][: self._n]) / self._nodes
        return float(self._comm.allreduce(mine)) + self._psi**2 * a[1] * b[1]

    def _since(self) -> Change:
        """Find the change since the step began."""
        return (
            self._u.x.array - self._contact.states.u_of(self._state),
            self.trial - self.factor,
        )

    def begin(self) -> None:
        super().begin()
        self._state = self._contact.state()

    def remember(self) -> list[float]:
        return [*super().remember(), self._first or 0.0, self._count]

    def recall(self, numbers: Sequence[float], starts: Sequence[State]) -> None:
        super().recall(numbers, starts)
        if len(numbers) < 11 or not starts:
            return
        self.time, self._first, self._count = self._done, numbers[9], int(numbers[10])
        start = self._contact.states.u_of(starts[-1])
        self._last = self._u.x.array - start, self.factor - self._before

    def row(self) -> tuple[Array, float, float]:
        """Go ahead along the path at first, later to the sphere's tangent plane."""
        change, radius = self._since(), self._radius
        here = self._product(change, change)
        self._sets_out = radius is None or here <= (TOLERANCE * radius) ** 2
        if radius is not None and not self._sets_out:
            normal, right = change, 0.5 * (here - radius**2)
        elif self._last is not None:
            normal, right = self._last, -self._product(self._last, self._last)
        else:
            return np.zeros(self._n), 1.0, -self._towards
        g = normal[0][: self._n] / self._nodes
        return g, self._psi**2 * normal[1], right

    def share(self, change: Array, step: float) -> float:
        if not self._sets_out:
            return 1.0
        length = self._product((change, step), (change, step)) ** 0.5
        if length == 0.0:
            raise ConvergenceError(
                "the loads move nothing: give ArcLength a psi, or apply what loads"
            )
        if self._first is None:
            self._first = length
        return self.sizes.size * self._first / length

    def is_met(self) -> bool:
        radius, change = self._radius, self._since()
        if radius is None:
            return False
        lacks = abs(self._product(change, change) ** 0.5 - radius)
        return lacks <= TOLERANCE * radius + self._rounding()

    def check(self) -> None:
        change, last = self._since(), self._last
        if last is None:
            fault = "sets out backwards" if change[1] * self._towards < 0.0 else ""
        else:
            size = (self._product(change, change) * self._product(last, last)) ** 0.5
            turns = self._product(change, last) < TURNED * size
            fault = "turns back" if turns else ""
        if fault:
            raise ConvergenceError(f"the path {fault}: take a smaller radius")

    def solve(self) -> tuple[int, bool]:
        """Solve a step, which is cut if it passes the end of the path."""
        iterations, converged = super().solve()
        end, way = self._ends[1], self.trial - self.factor
        if (self.trial - end) * (self.factor - end) <= 0.0 and way != 0.0:
            self._contact.states.go_back(self._state, (end - self.factor) / way)
            self._load(end)
            iterations += int(self._given.solve()[0])
            self.trial = end
        return iterations, converged

    def reached(self) -> None:
        self._last = self._since()
        super().reached()
        self.time += self._product(self._last, self._last) ** 0.5
        self._count += 1

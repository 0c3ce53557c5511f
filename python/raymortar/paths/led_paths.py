"""Paths that a chosen displacement or the length of the path leads."""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from .. import compat
from ..compat import Array
from ..convergence.balance import EPS
from ..errors import ConvergenceError
from .bordered import LedPath, largest
from .control import ArcLength, DisplacementControl, mean_weights
from .load_path import StepSizes

# Tolerance of the equation that leads, as a share of the step
TOLERANCE = 1e-10

# Cosine between one step and the next below which a path has turned back
TURNED = -0.5

# Change of displacement (owned dofs and ghosts) and load factor
Change = tuple[Array, float]


class DisplacementPath(LedPath):
    """Lead steps by a mean displacement or a functional. Collective."""

    def __init__(self, control: DisplacementControl, *given: Any) -> None:
        super().__init__(*given)
        self._by, self._functional = float(control.by), None
        if isinstance(control.where, ufl.Form):
            test = ufl.TestFunction(self._u.function_space)
            slope = ufl.derivative(control.where, self._u, test)
            self._functional = compat.form(control.where), compat.form(slope)
        else:
            self._weights = mean_weights(control, self._u)
        self._begin = self._target = self.controlled

    @property
    def controlled(self) -> float:
        """Chosen displacement at present. Length. Collective."""
        if self._functional is not None:
            mine = fem.assemble_scalar(self._functional[0])
        else:
            mine = self._weights @ self._u.x.array[: self._n]
        return float(self._comm.allreduce(float(mine)))

    @property
    def led_weights(self) -> Array:
        """Derivative of the chosen displacement by the owned dofs. Collective."""
        if self._functional is None:
            return self._weights
        dofmap = self._u.function_space.dofmap
        r = compat.create_la_vector(dofmap.index_map, dofmap.index_map_bs)
        compat.assemble_residual(r.array, self._functional[1])
        compat.scatter_reverse_add(r)
        return r.array[: self._n].copy()

    @property
    def time(self) -> float:
        """Share of the whole growth of the displacement."""
        return self.sizes.share

    def begin(self) -> None:
        super().begin()
        self._target = self._begin + self.sizes.share * self._by

    def row(self) -> tuple[Array, float, float]:
        return self.led_weights, 0.0, self.controlled - self._target

    def is_met(self) -> bool:
        rounding = 256.0 * EPS * largest(self._comm, self._u.x.array)
        rounding *= float(self._comm.allreduce(np.abs(self.led_weights).sum()))
        lacks = abs(self.controlled - self._target)
        return lacks <= TOLERANCE * abs(self.sizes.part * self._by) + rounding


class ArcSizes(StepSizes):
    """Let the iterations of each step decide the next radius, in first radii."""

    def accept(self, iterations: int) -> None:
        easy = max(self._easy, 1) / max(iterations, 1)
        # However small a step is, contact needs some iterations. So steps shrink only
        # above twice the iterations of an easy step, and halved steps grow again
        if self.size >= 1.0 and easy < 1.0:
            easy = min(1.0, 2.0 * easy)
        elif self.size < 1.0:
            easy *= 2.0
        grown = self.size * min(max(easy**0.5, 0.5), 2.0)
        most = 1.0 if self.size < 1.0 else self._largest
        self._last, self.size = self.size, min(max(grown, self._least), most)


class ArcPath(LedPath):
    """Take steps of given length until the load factor meets the end. Collective."""

    def __init__(self, control: ArcLength, *given: Any) -> None:
        super().__init__(*given)
        self._psi, self._most = float(control.psi), control.most
        self._nodes = self._u.function_space.dofmap.index_map.size_global
        # First change of the load factor. Its sign says which way the path sets out
        towards = (self._ends[1] - self._ends[0]) * self.sizes.part
        self._towards = -towards if control.falling else towards
        # Radius of the first step. None: the first solve finds it
        self._first = control.radius
        self._last: Change | None = None
        self._count, self._sets_out, self._length = 0, True, 0.0

    @property
    def time(self) -> float:
        """Length of the path so far."""
        return self._length

    @property
    def _radius(self) -> float | None:
        """Length of the step, None before the first solve has found it."""
        return None if self._first is None else self.sizes.size * self._first

    @property
    def ended(self) -> bool:
        """Whether the path is at its end.

        Raises
        ------
        ConvergenceError
            If it has taken too many steps.
        """
        if self.factor == self._ends[1] and self._count:
            return True
        if self._count >= self._most:
            raise ConvergenceError(
                f"the path is at load factor {self.factor:.6g} after {self._most} "
                f"steps, and has not met its end at {self._ends[1]:.6g}"
            )
        return False

    def _product(self, a: Change, b: Change) -> float:
        """Multiply two changes as vectors. Length squared. Collective."""
        mine = float(a[0][: self._n] @ b[0][: self._n]) / self._nodes
        return self._comm.allreduce(mine) + self._psi**2 * a[1] * b[1]

    def _since(self) -> Change:
        """Find the change since the step began."""
        return self._u.x.array - self._state.u, self.trial - self.factor

    def _plane(self, normal: Change, right: float) -> tuple[Array, float, float]:
        """Find the plane across a normal, as g, e and c."""
        g = normal[0][: self._n] / self._nodes
        return g, self._psi**2 * normal[1], right

    def begin(self) -> None:
        super().begin()
        self._state = self._contact.state()

    def row(self) -> tuple[Array, float, float]:
        """Go ahead along the path at first, later to the sphere's tangent plane."""
        change, radius = self._since(), self._radius
        here = self._product(change, change)
        self._sets_out = radius is None or here <= (TOLERANCE * radius) ** 2
        if radius is not None and not self._sets_out:
            return self._plane(change, 0.5 * (here - radius**2))
        if self._last is None:
            return np.zeros(self._n), 1.0, -self._towards
        return self._plane(self._last, -self._product(self._last, self._last))

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
        if self._radius is None:
            return False
        change = self._since()
        rounding = 256.0 * EPS * largest(self._comm, self._u.x.array)
        lacks = abs(self._product(change, change) ** 0.5 - self._radius)
        return lacks <= TOLERANCE * self._radius + rounding

    def check(self) -> None:
        change, last = self._since(), self._last
        if last is None:
            if change[1] * self._towards < 0.0:
                raise ConvergenceError(
                    "the path sets out backwards: take a smaller radius"
                )
            return
        sizes = self._product(change, change) * self._product(last, last)
        if self._product(change, last) < TURNED * sizes**0.5:
            raise ConvergenceError("the path turns back: take a smaller radius")

    def solve(self) -> tuple[int, bool]:
        """Solve a step, which is cut if it passes the end of the path."""
        iterations, converged = super().solve()
        end = self._ends[1]
        if (self.trial - end) * (
            self.factor - end
        ) <= 0.0 and self.trial != self.factor:
            share = (end - self.factor) / (self.trial - self.factor)
            self._contact.go_back(self._state, share)
            self._load(end)
            iterations += int(self._given.solve()[0])
            self.trial = end
        return iterations, converged

    def reached(self) -> None:
        self._last = self._since()
        super().reached()
        self._length += self._product(self._last, self._last) ** 0.5
        self._count += 1

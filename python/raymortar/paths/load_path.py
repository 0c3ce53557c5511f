"""What leads a path from step to step: the load factor, a displacement or an arc."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..compat import Array, Mask
from ..errors import ConvergenceError
from .bordered import CHANGE, BorderedSolver
from .constraints import Arc, ChosenDisplacement
from .control import ArcLength, DisplacementControl
from .step_sizes import ArcSizes, StepSizes


class PrescribedPath:
    """A path whose load factor is prescribed: `apply` is called with it.

    Parameters
    ----------
    solver
        As of `LoadSteps`.
    apply
        Function of load factor and size of the step.
    ends
        Load factor at the start and at the end.
    sizes
        Of the steps.

    Attributes
    ----------
    solver
        Solves a step after `begin`.
    factor
        Load factor of the last accepted step.
    led
        Whether an owned dof of u leads the path. None where the load factor does.
    led_weights
        Weights of the owned dofs in a chosen displacement, which counts as prescribed.
        None where none is chosen.
    """

    led: Mask | None = None
    led_weights: Array | None = None

    def __init__(
        self,
        solver: Any,
        apply: Callable[[float, float], Any],
        ends: tuple[float, float],
        sizes: StepSizes,
    ) -> None:
        self.solver, self._apply = solver, apply
        self._ends, self._sizes = ends, sizes
        self.factor = ends[0]

    @property
    def ended(self) -> bool:
        """Whether the path is at its end."""
        return self._sizes.ended

    @property
    def next(self) -> float:
        """Load factor after the next step, the path's end met exactly."""
        begin, end = self._ends
        share = self._sizes.share
        return end if share == 1.0 else begin + share * (end - begin)

    @property
    def time(self) -> float:
        """The quantity that grows along the path."""
        return self.factor

    @property
    def ratio(self) -> float:
        """Size of the next step over that of the last accepted one."""
        return self._sizes.ratio

    def begin(self) -> None:
        """Set the loads of the next step."""
        self._apply(self.next, self.next - self.factor)

    def set_first_loads(self) -> None:
        """Set the loads of the last accepted step, in place of those of `begin`."""
        self._apply(self.factor, self.next - self.factor)

    def restart(self) -> None:
        """Note that the state of the last accepted step has been restored."""

    def extrapolate(self, ratio: float) -> None:
        """Note that the state has been extrapolated by a ratio times the last step's
        change."""

    def halve(self) -> bool:
        """Halve the next step. False if it is the smallest."""
        return self._sizes.halve()

    def reached(self) -> None:
        """Note that a step is solved, before its results are recorded."""
        self.factor = self.next

    def accept(self, iterations: int) -> None:
        """Go on to the next step."""
        self._sizes.accept(iterations)

    def describe(self) -> str:
        """Name the failed step, for a message."""
        return f"load factor {self.next:.6g} failed"


class _LedPath:
    """A path whose load factor is an unknown. `controlled` grows instead."""

    led_weights: Array | None = None

    def __init__(
        self,
        solver: Any,
        apply: Callable[[float, float], Any],
        ends: tuple[float, float],
        constraint: Any,
    ) -> None:
        self._apply, self._ends, self._constraint = apply, ends, constraint
        self._contact = solver.problem.contact
        self.factor = self._before = ends[0]
        change = CHANGE * (ends[1] - ends[0])
        self._inner = BorderedSolver(solver, self._load, constraint, ends[0], change)

    def _load(self, factor: float) -> None:
        self._apply(factor, factor - self.factor)

    @property
    def solver(self) -> Any:
        return self._inner

    @property
    def led(self) -> Mask:
        """Whether an owned dof of u leads the path. All do: an arc's length counts them
        all."""
        return np.ones(self._contact.layout.n_u, dtype=bool)

    @property
    def next(self) -> float:
        """Load factor at the begin of the step, as that at its end is not known."""
        return self.factor

    def restart(self) -> None:
        self._inner.factor = self.factor
        self._load(self.factor)

    def extrapolate(self, ratio: float) -> None:
        self._inner.factor = self.factor + ratio * (self.factor - self._before)

    def reached(self) -> None:
        self._before, self.factor = self.factor, self._inner.factor

    def describe(self) -> str:
        return f"the step after load factor {self.factor:.6g} failed"


class DisplacementPath(_LedPath):
    """A chosen displacement leads, in shares of its whole growth.

    Parameters
    ----------
    solver, apply, ends, sizes
        As of `PrescribedPath`; the first end is where the load factor starts.
    control
        What was chosen.
    """

    def __init__(
        self,
        solver: Any,
        apply: Callable[[float, float], Any],
        ends: tuple[float, float],
        sizes: StepSizes,
        control: DisplacementControl,
    ) -> None:
        self._chosen = ChosenDisplacement(control, solver.problem.contact)
        super().__init__(solver, apply, ends, self._chosen)
        self._sizes, self.time = sizes, 0.0

    @property
    def led(self) -> Mask:
        """Whether an owned dof of u leads the path. Collective."""
        return self.led_weights != 0.0

    @property
    def led_weights(self) -> Array:  # type: ignore[override]
        """Weights of the owned dofs of u in the chosen displacement. Collective."""
        return self._chosen.row(self.factor)[0]

    @property
    def ended(self) -> bool:
        return self._sizes.ended

    @property
    def ratio(self) -> float:
        return self._sizes.ratio

    def begin(self) -> None:
        self._inner.factor = self.factor
        self._chosen.begin(self._sizes.share, self._sizes.part)

    def halve(self) -> bool:
        return self._sizes.halve()

    def reached(self) -> None:
        super().reached()
        self.time = self._sizes.share

    def accept(self, iterations: int) -> None:
        self._sizes.accept(iterations)

    @property
    def controlled(self) -> float:
        """The chosen displacement. Collective."""
        return self._chosen.value


class ArcPath(_LedPath):
    """Steps of a given length, until the load factor meets the end of the path.

    Parameters
    ----------
    solver, apply, ends
        As of `PrescribedPath`.
    steps, max_halvings, largest, easy
        As of `LoadSteps`.
    control
        How lengths are measured.
    """

    def __init__(
        self,
        solver: Any,
        apply: Callable[[float, float], Any],
        ends: tuple[float, float],
        steps: int,
        max_halvings: int,
        largest: float,
        easy: float,
        control: ArcLength,
    ) -> None:
        towards = (ends[1] - ends[0]) / steps
        self._arc = Arc(control, solver.problem.contact, towards)
        super().__init__(solver, apply, ends, self._arc)
        self._sizes = ArcSizes(max_halvings, largest, easy, control.radius)
        self._most, self._count, self.time = control.most, 0, 0.0
        self._last: tuple[Array, float] | None = None
        self._given = solver

    @property
    def solver(self) -> Any:
        return self

    @property
    def problem(self) -> Any:
        """The problem that the solver solves."""
        return self._given.problem

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

    @property
    def ratio(self) -> float:
        return self._sizes.ratio

    @property
    def controlled(self) -> float:
        """Length of the path so far."""
        return self.time

    def begin(self) -> None:
        self._inner.factor = self.factor
        self._state = self._contact.state()
        self._arc.radius = self._sizes.radius
        self._arc.begin(self.factor, self._last)

    def solve(self) -> tuple[int, bool]:
        """Solve a step. It is cut where it passes the end of the path."""
        iterations, converged = self._inner.solve()
        end, factor = self._ends[1], self._inner.factor
        if (factor - end) * (self.factor - end) <= 0.0 and factor != self.factor:
            iterations += self._to_the_end((end - self.factor) / (factor - self.factor))
        return iterations, converged

    def _to_the_end(self, share: float) -> int:
        """Solve the last step, which ends at a share of the arc. Returns the
        iterations."""
        end = self._ends[1]
        self._contact.go_back(self._state, share)
        self._load(end)
        iterations = int(self._given.solve()[0])
        self._inner.factor = end
        return iterations

    def halve(self) -> bool:
        self._note_first()
        return self._sizes.halve()

    def _note_first(self) -> None:
        """Keep the radius that the first solve has found."""
        if self._sizes.first is None:
            self._sizes.first = self._arc.radius

    def reached(self) -> None:
        super().reached()
        self._note_first()
        self._last = self._contact.u.x.array - self._state.u, self.factor - self._before
        self.time += self._arc.length(*self._last)
        self._count += 1

    def accept(self, iterations: int) -> None:
        self._sizes.accept(iterations)

"""Schemes of time integration, and paths of time with the sizes of their steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from ..core.compat import Array
from ..core.errors import (
    ContactError,
    Options,
    is_real_number,
    is_whole_number,
    positive,
)
from ..paths.load_path import PrescribedPath, StepSizes


@dataclass(frozen=True)
class StepEquation:
    """Equation R + M (factor u + b) + kept S = 0 of a step, for what it solves for.

    R are the forces of the problem without inertia, S those of the last accepted step,
    and b = position u_n + velocity v_n + acceleration a_n [theory (6.6)].
    """

    factor: float
    position: float
    velocity: float
    acceleration: float
    kept: float

    def shift(self, u: Array, v: Array, a: Array) -> Array:
        """b, from displacements, velocities and accelerations of the last step."""
        return self.position * u + self.velocity * v + self.acceleration * a


@dataclass(frozen=True)
class Newmark(Options):
    """Newmark's scheme; by default the trapezoidal rule, which keeps the energy.

    All forces act at the end of the step.

    Parameters
    ----------
    beta, gamma
        Second order for gamma = 1/2, stable for 2 beta >= gamma >= 1/2.
    """

    beta: float = 0.25
    gamma: float = 0.5

    def check(self) -> None:
        for name in ("beta", "gamma"):
            if not is_real_number(getattr(self, name)):
                raise ContactError(f"{name} must be a number")
        if not 2.0 * self.beta >= self.gamma >= 0.5:
            raise ContactError(
                f"beta = {self.beta!r}, gamma = {self.gamma!r} grow without bound: a "
                "stable scheme has 2 beta >= gamma >= 1/2"
            )

    @property
    def alphas(self) -> tuple[float, float]:
        """Shares of the last step's acceleration and forces."""
        return 0.0, 0.0

    def equation(self, dt: float) -> StepEquation:
        """Equation of a step of a size [theory (6.7)]."""
        return _equation(dt, self.beta, *self.alphas)


@dataclass(frozen=True)
class GeneralizedAlpha(Options):
    """Generalised alpha of Chung and Hulbert: second order, damps high frequencies.

    Forces are weighed means of both ends of the step; contact holds at its end.

    Parameters
    ----------
    rho_inf
        Factor by which a step multiplies the highest frequencies, 0 to 1.
    """

    rho_inf: float = 0.8

    def check(self) -> None:
        if not (is_real_number(self.rho_inf) and 0.0 <= self.rho_inf <= 1.0):
            raise ContactError(f"rho_inf = {self.rho_inf!r} must be from 0 to 1")

    @property
    def alphas(self) -> tuple[float, float]:
        """Shares of the last step's acceleration and forces."""
        rho = self.rho_inf
        return (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)

    @property
    def gamma(self) -> float:
        """Newmark's gamma."""
        alpha_m, alpha_f = self.alphas
        return 0.5 - alpha_m + alpha_f

    @property
    def beta(self) -> float:
        """Newmark's beta."""
        alpha_m, alpha_f = self.alphas
        return 0.25 * (1.0 - alpha_m + alpha_f) ** 2

    def equation(self, dt: float) -> StepEquation:
        """Equation of a step of a size [theory (6.7)]."""
        return _equation(dt, self.beta, *self.alphas)


@dataclass(frozen=True)
class Midpoint(Options):
    """Midpoint rule: all forces, of contact too, act in the middle of the step.

    It keeps momentum and moment of momentum in large rotation, and of linear bodies the
    energy.
    """

    # beta is for the error estimate; gamma is the share of forces at the solved point
    beta: ClassVar[float] = 0.25
    gamma: ClassVar[float] = 1.0

    def check(self) -> None:
        """Nothing can be wrong."""

    def equation(self, dt: float) -> StepEquation:
        """Equation of a step of a size, for its middle [theory (6.9)]."""
        return StepEquation(4.0 / dt**2, -4.0 / dt**2, -2.0 / dt, 0.0, 0.0)


def velocity_in_step(
    scheme: Scheme, dt: float, v: Array, a: Array
) -> tuple[float, Array]:
    """Find factor and start of the velocity factor (q - q_n) + start of unknowns q for
    which a step is solved, from velocities v and accelerations a at its begin
    [theory (6.7), (6.9)]."""
    if isinstance(scheme, Midpoint):
        return 2.0 / dt, 0.0 * v
    ratio = scheme.gamma / scheme.beta
    return ratio / dt, (1.0 - ratio) * v + dt * (1.0 - 0.5 * ratio) * a


def end_of_step(
    scheme: Scheme, dt: float, begun: tuple[Array, Array, Array], q: Array
) -> tuple[Array, Array, Array]:
    """Find values, velocities and accelerations at the end of a step that is solved for
    q, from those at its begin [theory (6.7), (6.9)]."""
    old, v, a = begun
    if isinstance(scheme, Midpoint):
        end = 2.0 * q - old
        new_v = 2.0 * (end - old) / dt - v
        return end, new_v, (new_v - v) / dt
    beta, gamma = scheme.beta, scheme.gamma
    new_a = (q - old - dt * v) / (beta * dt**2) - (0.5 / beta - 1.0) * a
    return q, v + dt * ((1.0 - gamma) * a + gamma * new_a), new_a


SCHEMES = (Newmark, Midpoint, GeneralizedAlpha)
Scheme = Newmark | Midpoint | GeneralizedAlpha


def _equation(dt: float, beta: float, alpha_m: float, alpha_f: float) -> StepEquation:
    """Equation of the schemes whose contact holds at the end of the step."""
    factor = (1.0 - alpha_m) / ((1.0 - alpha_f) * beta * dt**2)
    by_old = alpha_m - (1.0 - alpha_m) * (0.5 / beta - 1.0)
    return StepEquation(
        factor=factor,
        position=-factor,
        velocity=-factor * dt,
        acceleration=by_old / (1.0 - alpha_f),
        kept=alpha_f / (1.0 - alpha_f),
    )


# Share of the size that the estimated error allows
SAFE = 0.9
# A step whose error is more than this many times the tolerance is refused
WORST = 2.0


@dataclass(frozen=True)
class Adaptive(Options):
    """Time steps whose sizes follow their Newton iterations and local errors.

    Parameters
    ----------
    error
        Local error of the displacement in a step, over the distance that the bodies
        would move in it at the largest velocity so far.
    easy
        Newton iterations of a step up to which the next one may be larger.
    largest
        Largest step, over `dt`.
    """

    error: float = 1e-2
    easy: int = 8
    largest: float = 1.0

    def check(self) -> None:
        positive("error", self.error)
        if positive("largest", self.largest) < 1.0:
            raise ContactError(f"largest = {self.largest!r} must be at least 1")
        if not (is_whole_number(self.easy) and self.easy > 0):
            raise ContactError(f"easy = {self.easy!r} must be a whole number above 0")


class AdaptiveSizes(StepSizes):
    """Sizes in first steps, by iterations and the local error of the last step.

    `error` is the local error of the solved step.
    """

    def __init__(self, steps: float, max_halvings: int, rule: Adaptive) -> None:
        super().__init__(1, max_halvings, rule.largest, rule.easy)
        self._all, self._rule, self.error = steps, rule, 0.0
        self._fit()

    def remember(self) -> list[float]:
        return [*super().remember(), self.error]

    def recall(self, numbers: Sequence[float], as_rest: bool) -> bool:
        self.error = numbers[-1]
        return super().recall(numbers, as_rest)

    @property
    def share(self) -> float:
        """Share of the path after the next step."""
        end = self._done + self.size
        return 1.0 if end > self._all * (1.0 - 1e-9) else end / self._all

    def is_too_far(self, error: float) -> bool:
        """Note the error of a solved step; whether it is to be halved."""
        self.error = error
        return error > WORST * self._rule.error and self.size > self._least

    def accept(self, iterations: int) -> None:
        """Accept the step and choose the size of the next one."""
        self._done = self._all if self.share == 1.0 else self._done + self.size
        self._last = self.size
        grown = (self._easy / max(iterations, 1)) ** 0.5
        if self.error > 0.0:
            grown = min(grown, SAFE * (self._rule.error / self.error) ** 0.5)
        self.size = self.size * min(max(grown, 0.5), 2.0)
        self.size = min(max(self.size, self._least), self._largest)
        self._fit()

    def _fit(self) -> None:
        """Shorten the steps that are left alike, so that they meet the end."""
        left = self._all - self._done
        if left > 0.0:
            count = -(-left * (1.0 - 1e-9) // self.size)
            self.size = min(self.size, left / max(count, 1.0))


class TimePath(PrescribedPath):
    """Lead steps by the time, with which `apply` is called.

    Attributes
    ----------
    solved_at
        Share of a step at which it is solved, with the loads there.
    """

    has_parts = False
    solved_at = 1.0

    def begin(self) -> None:
        """Set the loads of the next step."""
        dt = self.next - self.factor
        self._apply(self.factor + self.solved_at * dt, dt)

    def describe(self) -> str:
        """Name the failed step for a message."""
        return f"time {self.next:.6g} failed"

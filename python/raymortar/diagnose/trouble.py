"""Signs that a solve will not converge, and what keeps it from it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..core.compat import Array
from ..core.convergence.balance import Groups
from ..core.convergence.convergence import UNKNOWN, Convergence

# Bodies and surfaces that a message names
MOST_NAMED = 3

# Periods of cycles that are looked for, in iterations
PERIODS = range(2, 9)

# Relative difference of residuals that count as the same where there is something else
# to try
REPEATS = 0.03

# Growth of the residual over all before it that no solve comes back from
GROWTH = 1e4

# Iterations without a new least residual, after which a solve wanders
WANDERS = 8

# Growth over the first residuals, from which a solve ends if another way has just worked
JUMP = 100.0

# Growth of the residual in the first iteration from which its start may not count
STRETCHES = 10.0


class Watched(Convergence):
    """Judges iterates, and ends solves that are in trouble.

    A solve that is `patient` goes on until it is hopeless. Otherwise it ends at the first
    trouble, as `LoadSteps` has remedies. One that `lasts` may begin with a residual that
    is less than the next ones. One that is `hasty` ends where the residual jumps. A
    `watcher` is called at each iterate.
    """

    def __init__(self, groups: Groups) -> None:
        super().__init__(groups)
        self.patient, self.lasts, self.hasty = True, False, False
        self.watcher: Callable[[], None] | None = None

    def accept(self) -> None:
        super().accept()
        if self.watcher is not None:
            self.watcher()

    @property
    def is_stuck(self) -> bool:
        """Whether more iterations would be in vain."""
        if super().is_stuck:
            return True
        if self.now.norm <= self.floor:
            return False
        if self.patient:
            return is_hopeless(self.norms)
        return self.jumped or is_in_trouble(self._way())

    @property
    def jumped(self) -> bool:
        """Whether the residual of a `hasty` solve has grown a hundredfold."""
        norms = self.norms
        return self.hasty and len(norms) > 1 and norms[-1] > JUMP * min(norms[:2])

    def _way(self) -> list[float]:
        """Return the residuals that tell of trouble.

        Small loads may leave less out of balance than all iterates on the way, as a body
        that bends is stretched first.
        """
        norms = self.norms
        if not self.lasts or len(norms) < 3 or norms[1] < STRETCHES * norms[0]:
            return norms
        return norms[1:]

    def describe(self) -> str:
        """Name the groups that are out of balance, for messages; "" for none. Collective."""
        if self.now is UNKNOWN or self._asked is None:
            return ""
        now, (rtol, atol) = self.now, self._asked
        lacking = np.flatnonzero(~self.balanced(rtol, atol, True))
        text = ""
        if len(lacking):
            names, forces = self.groups.names(), self.forces
            listed = [
                f"{names[g]} by {now.residual[g]:.3e} of {forces[g]:.3e}"
                for g in lacking[:MOST_NAMED]
            ]
            more = [f"{len(lacking) - MOST_NAMED} more"] * (len(lacking) > MOST_NAMED)
            text = f"; out of balance: {', '.join(listed + more)}"
        if self.is_pending(rtol):
            text += f"; prescribed displacements lack up to {now.pending:.3e}"
            for field, value in zip(self.groups.fields[1:], now.lacking[1:]):
                text += f", prescribed values of {field.name} up to {value:.3e}"
        return text


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
    wanders = len(r) - 1 - int(np.argmin(r)) >= WANDERS
    return bool(grows or wanders) or is_hopeless(norms) or _repeats(r)


def _repeats(r: Array) -> bool:
    """Whether the last residuals have repeated twice, to a few percent."""
    for period in PERIODS:
        n = max(2 * period, 5)
        last = r[-n - period + 1 :]
        if len(last) == n + period - 1 and last.min() > 0.0:
            if np.abs(last[period:] / last[:-period] - 1.0).max() <= REPEATS:
                return True
    return False

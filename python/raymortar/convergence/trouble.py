"""Signs in a history of residuals that a solve will not converge."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..compat import Array

# Periods of cycles that are looked for, in iterations
PERIODS = range(2, 9)

# Relative difference of residuals that count as the same where there is something else
# to try
REPEATS = 0.03

# Growth of the residual over all before it that no solve comes back from
GROWTH = 1e4

# Iterations without a new least residual, after which a solve wanders
WANDERS = 8


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
    if is_hopeless(norms) or _repeats(r):
        return True
    if len(r) > 3 and r[-1] > GROWTH * r[:3].max():
        return True
    return len(r) - 1 - int(np.argmin(r)) >= WANDERS


def _repeats(r: Array) -> bool:
    """Whether the last residuals have repeated twice, to a few percent."""
    for period in PERIODS:
        n = max(2 * period, 5)
        last = r[-n - period + 1 :]
        if len(last) == n + period - 1 and last.min() > 0.0:
            change = np.abs(last[period:] / last[:-period] - 1.0)
            if change.max() <= REPEATS:
                return True
    return False

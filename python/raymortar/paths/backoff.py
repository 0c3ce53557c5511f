"""Leaving out what fails again and again on a path."""

from __future__ import annotations

# Most steps for which it is left out
LONGEST = 8


class Backoff:
    """Leaves something out for 1, 2, 4, 8 steps, longer after each failure."""

    def __init__(self) -> None:
        self._length = self._left = 0

    def rests(self) -> bool:
        """Tell whether this step leaves it out, and count the step."""
        rests = self._left > 0
        self._left -= rests
        return rests

    def failed(self) -> None:
        """Note a failure."""
        self._length = min(max(1, 2 * self._length), LONGEST)
        self._left = self._length

    def reset(self) -> None:
        """Forget all failures."""
        self._length = self._left = 0

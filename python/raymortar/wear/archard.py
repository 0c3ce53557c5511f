"""Archard's law of wear."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.compat import Array
from ..core.errors import ContactError, is_real_number


@dataclass(frozen=True)
class Archard:
    """Archard's law of wear: depth per slip is ``k`` times the pressure.

    Attributes
    ----------
    k
        Wear coefficient over hardness, >= 0. Area per force.
    """

    k: float

    def __post_init__(self) -> None:
        if not (is_real_number(self.k) and np.isfinite(self.k) and self.k >= 0.0):
            raise ContactError(f"Archard.k = {self.k!r} must be a number, not negative")

    def __call__(self, p: Array, v: Array) -> Array:
        """Depth per time, (n,), of pressures and slip rates (n,)."""
        return self.k * p * v

"""How exactly the linear systems of Newton's method are solved."""

from __future__ import annotations

# Residual of a linear system, over the one that the Newton iteration leaves in any case
SHARE = 0.1


class Forcing:
    """Relative tolerances of linear systems that add no Newton iteration.

    Let e be the residual over the one that ends the solve. Where Newton's method is
    quadratic, an iteration that took it from e_last to e is followed by one that leaves
    e (e / e_last)^2; and less than 1 is never needed. A linear system may leave a tenth
    of the larger one. Where Newton's method is not quadratic, because the active set
    changes, it leaves more, and the tolerance is on the safe side.

    Parameters
    ----------
    first
        Tolerance of the first system, before which nothing is known; the largest one.
    least
        Smallest tolerance.
    """

    def __init__(self, first: float, least: float) -> None:
        self.first, self.least = first, least
        self._last = 0.0

    def tolerance(self, iteration: int, excess: float) -> float:
        """Relative tolerance of the next linear system.

        Parameters
        ----------
        iteration
            Number of Newton iterations so far.
        excess
            Residual over the one that ends the solve.
        """
        last, self._last = self._last, excess
        if iteration == 0 or not 0.0 < excess < last:
            return self.first
        left = max((excess / last) ** 2, 1.0 / excess)
        return max(self.least, min(self.first, SHARE * left))

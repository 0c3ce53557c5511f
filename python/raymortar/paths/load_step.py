"""An accepted step of a path."""

from __future__ import annotations


class LoadStep:
    """An accepted step: load factor, Newton iterations, halvings so far, strategy.

    Attributes
    ----------
    strategy
        What solved the step: ``"full"``, the solver as it was given;
        ``"extrapolated"``, ``"small gamma"``, ``"capped"``, ``"line search"``, ``"small
        gamma, line search"`` or ``"viscous forces"``: see `LoadSteps`. With `stabilize`
        that of the step's last solve.
    released
        Energy that a snap has set free at least, which another way than ``"full"`` has
        passed; 0 where there was none.
    number
        Counts the accepted steps of the problem from 1, over all of its `LoadSteps`.
    """

    def __init__(
        self,
        factor: float,
        iterations: int,
        halvings: int,
        strategy: str = "full",
        number: int = 1,
        released: float = 0.0,
    ) -> None:
        self.factor, self.iterations, self.halvings = factor, iterations, halvings
        self.strategy, self.number, self.released = strategy, number, released

    def __repr__(self) -> str:
        return (
            f"LoadStep(factor={self.factor:.6g}, iterations={self.iterations}, "
            f"halvings={self.halvings}, strategy={self.strategy!r})"
        )

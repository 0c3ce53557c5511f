"""Cases of other codes' own tests and of public reports, each with its source.

A module `cases_*.py` registers functions by `case`. A function sets a scene up, solves
it and returns an `Outcome`, the figures in the order of the case's `Figure`s.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path


@dataclass(frozen=True)
class Figure:
    """A figure of the source and how far ours may lie from it.

    Attributes
    ----------
    quantity
        Name of the figure, with its unit where it has one.
    reference
        Value that the source prints.
    tolerance
        Deviation allowed, relative to `scale`.
    scale
        Of the deviation. None: the magnitude of the reference.
    """

    quantity: str
    reference: float
    tolerance: float
    scale: float | None = None

    def deviation(self, value: float) -> float:
        """How far a value lies from the reference, with its sign."""
        return (value - self.reference) / (self.scale or abs(self.reference))


@dataclass(frozen=True)
class Outcome:
    """Figures that were computed, and the Newton iterations of each step."""

    values: Sequence[float]
    iterations: Sequence[int]

    @property
    def effort(self) -> str:
        """Iterations of few steps; of many the number of steps, mean and most."""
        counts = list(self.iterations)
        if len(counts) <= 4:
            return ", ".join(map(str, counts))
        mean = sum(counts) / len(counts)
        return f"{len(counts)} steps, {mean:.1f} each, at most {max(counts)}"


@dataclass(frozen=True)
class Case:
    """A case of another code, or of a report about one.

    Attributes
    ----------
    name
        Of the case and of the law that it takes, unique.
    code, source
        Code, standard or forum, and the file or page that has the reference.
    scene
        Bodies, loads and law in one line.
    figures
        What is compared.
    verdict
        Reason of a deviation: where the reference is at fault, or is of another
        discretisation. Empty where the codes agree.
    solve
        Computes the figures.
    """

    name: str
    code: str
    source: str
    scene: str
    figures: Sequence[Figure]
    verdict: str
    solve: Callable[[], Outcome] = field(repr=False)


CASES: dict[str, Case] = {}


def case(
    code: str,
    source: str,
    scene: str,
    figures: Sequence[Figure],
    law: str = "",
    verdict: str = "",
) -> Callable[[Callable[..., Outcome]], Callable[..., Outcome]]:
    """Register a function as a case, once for each `law` that it is given."""

    def register(solve: Callable[..., Outcome]) -> Callable[..., Outcome]:
        name = f"{solve.__name__}-{law}" if law else solve.__name__
        if name in CASES:
            raise ValueError(f"there are two cases {name}")
        if len({figure.quantity for figure in figures}) < len(figures):
            raise ValueError(f"two figures of {name} have one name")

        def run() -> Outcome:
            return solve(law) if law else solve()

        CASES[name] = Case(name, code, source, scene, tuple(figures), verdict, run)
        return solve

    return register


def all_cases() -> list[Case]:
    """Import the modules of cases, and list what they register."""
    for module in sorted(Path(__file__).parent.glob("cases_*.py")):
        import_module(module.stem)
    return list(CASES.values())

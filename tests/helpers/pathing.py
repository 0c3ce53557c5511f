"""Paths of load steps, and what it takes to solve them."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Callable
from typing import Any

import raymortar


@dataclasses.dataclass
class Path:
    """What `LoadSteps` is given, and what is measured at the end."""

    problem: Any
    apply: Callable[[float], None]
    steps: int
    result: Callable[[], Any] = lambda: None
    options: dict[str, Any] = dataclasses.field(default_factory=dict)
    solver: Any = raymortar.SNESSolver


@dataclasses.dataclass
class Taken:
    """Steps of a path, and all its tangents, those of failed solves included."""

    steps: list[Any]
    tangents: int
    halvings: int
    arrived: bool
    failure: str = ""

    @property
    def iterations(self) -> int:
        """Of accepted steps."""
        return sum(step.iterations for step in self.steps)

    @property
    def ways(self) -> dict[str, int]:
        """Steps by the way that solved them."""
        return dict(Counter(step.strategy for step in self.steps))


def take(path, each=lambda step: None, **options):
    """Solve a path to its end, or as far as it goes."""
    before = path.problem.tangents
    solver = path.solver(path.problem)
    options = {"progress": False, **path.options, **options}
    load = raymortar.LoadSteps(solver, path.apply, path.steps, **options)
    steps, failure = [], ""
    try:
        for step in load:
            steps.append(step)
            each(step)
    except raymortar.ContactError as error:
        failure = str(error)
    tangents = path.problem.tangents - before
    return Taken(steps, tangents, load.halvings, not failure, failure)

"""What a path remembers of its last steps, from which one that is resumed goes on."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from ..core.compat import Array
from ..core.state import Quantity, State
from .load_path import PrescribedPath
from .strategies import Strategies


def memory_of(contact: Any) -> PathMemory:
    """The memory that all paths of a contact share, one after the other. Collective."""
    found = contact.states.owners.get("path")
    if not isinstance(found, PathMemory):
        found = contact.states.owners["path"] = PathMemory(contact)
    return found


class PathMemory:
    """Starts of the last two accepted steps, and what solved them, for checkpoints.

    Attributes
    ----------
    starts
        Unknowns at these starts, the last one last.
    """

    def __init__(self, contact: Any) -> None:
        self._contact = contact
        self.starts: list[State] = []
        self._of: tuple[Any, PrescribedPath, Strategies] | None = None
        # Of a file, until a path goes on from it
        self._read: dict[str, list[float]] = {}
        self._begun: dict[int, State] = {}

    def follow(self, steps: Any, path: PrescribedPath, ways: Strategies) -> None:
        """Follow the path and the ways of `LoadSteps`. They go on from what was read.
        Collective."""
        known, self._read, self._of = self._read, {}, (steps, path, ways)
        self.starts = [self._begun[k] for k in sorted(self._begun)]
        self._begun = {}
        if known:
            steps.halvings = int(known["steps"][0])
            path.recall(known["path"], self.starts)
            ways.recall(known["ways"], self.starts)

    def note(self, begin: State) -> None:
        """Note where an accepted step began."""
        self.starts = [*self.starts[-1:], begin]

    def quantities(self) -> Iterator[Quantity]:
        """Yield the starts, and numbers of the path and of its ways."""
        for k in range(2):
            for one in self._contact.states.changing():
                of = partial(self._start, k, one.name), partial(self._take, k, one.name)
                yield Quantity(f"{k} {one.name}", *of, one.by, is_of_step=False)
        for name in ("steps", "path", "ways"):
            of = partial(self._numbers, name), partial(self._set_numbers, name)
            yield Quantity(name, *of, is_of_step=False)

    def _start(self, k: int, name: str) -> Array | None:
        return self.starts[k][name] if k < len(self.starts) else None

    def _take(self, k: int, name: str, values: Array) -> None:
        self._begun.setdefault(k, State())[name] = values

    def _numbers(self, name: str) -> Array | None:
        if self._of is None:
            return None
        steps, path, ways = self._of
        if name == "steps":
            return np.array([steps.halvings], dtype=np.float64)
        numbers = path.remember() if name == "path" else ways.remember()
        return np.array(numbers, dtype=np.float64)

    def _set_numbers(self, name: str, values: Array) -> None:
        self._read[name] = values.tolist()

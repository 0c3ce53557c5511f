"""What a path remembers of its last steps, from which one that is resumed goes on."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from ..compat import Array
from ..state import Quantity, State
from .load_path import PrescribedPath
from .strategies import Strategies


def memory_of(contact: Any) -> PathMemory:
    """The memory that all paths of a contact share, one after the other. Collective."""
    found = contact.owners.get("path")
    if not isinstance(found, PathMemory):
        found = contact.owners["path"] = PathMemory(contact)
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
        self._of: tuple[PrescribedPath, Strategies] | None = None
        self._read: dict[str, list[float]] = {}

    def follow(self, path: PrescribedPath, ways: Strategies) -> None:
        """Follow a path from its beginning. It goes on from the one that was read."""
        known, self._read, self._of = self._read, {}, (path, ways)
        if not known:
            self.starts = []
            return
        path.recall(known["path"], self.starts)
        ways.recall(known["ways"], self.starts)

    def note(self, begin: State) -> None:
        """Note where an accepted step began."""
        self.starts = [*self.starts[-1:], begin]

    def quantities(self) -> Iterator[Quantity]:
        """Yield the starts, and numbers of the path and of its ways."""
        for k in range(2):
            for one in self._contact.changing():
                of = partial(self._start, k, one.name), partial(self._take, k, one.name)
                yield Quantity(f"{k} {one.name}", *of, one.by, is_of_step=False)
        for name in ("path", "ways"):
            of = partial(self._numbers, name), partial(self._set_numbers, name)
            yield Quantity(name, *of, is_of_step=False)

    def _start(self, k: int, name: str) -> Array | None:
        return self.starts[k][name] if k < len(self.starts) else None

    def _take(self, k: int, name: str, values: Array) -> None:
        if name == "unknown 0":  # the first one
            self.starts = [*self.starts[:k], State()]
        self.starts[k][name] = values

    def _numbers(self, name: str) -> Array | None:
        if self._of is None:
            return None
        path, ways = self._of
        numbers = path.remember() if name == "path" else ways.remember()
        return np.array(numbers, dtype=np.float64)

    def _set_numbers(self, name: str, values: Array) -> None:
        self._read[name] = values.tolist()

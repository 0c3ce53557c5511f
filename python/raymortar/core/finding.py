"""What is doubtful about a state of contact."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from .errors import format_point


@dataclass(frozen=True)
class Finding:
    """A doubt about a state of contact, the same on all ranks.

    Attributes
    ----------
    pair
        Surfaces or body, by the names that were given.
    place
        Where it is worst, undeformed or, for depths, deformed; empty for a doubt without
        a place. Length.
    text
        The doubt.
    remedy
        What to do against it.
    size
        How bad it is, to compare the same doubt about several states.
    is_wrong
        Whether a figure may be off by more than 10 %, or the scene is not what was
        meant. A solve warns of such a finding, and of no other.
    about
        The same for the same doubt about another state of the same problem.
    force
        Normal force that the doubt is about, where that about the largest one of a path
        is told; else None.
    """

    pair: str
    place: tuple[float, ...]
    text: str
    remedy: str
    size: float
    is_wrong: bool = True
    about: tuple[Any, ...] = field(default=(), repr=False, compare=False)
    force: float | None = field(default=None, repr=False, compare=False)

    def __str__(self) -> str:
        at = f" at {format_point(self.place)}" if self.place else ""
        about = f"{self.pair}{at}: " if self.pair or at else ""
        return f"{about}{self.text}. {self.remedy}"


def placed(point: Any, others: Any = (), digits: int = 6) -> tuple[float, ...]:
    """A point as a finding has it: coordinates that are noise beside those of others
    are 0."""
    text = format_point(point, others, digits)
    return tuple(float(x) for x in text.strip("()").split(","))

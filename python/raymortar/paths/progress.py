"""An accepted load step and its line: rewritten on a terminal, plain in a log."""

from __future__ import annotations

import shutil
import sys
from dataclasses import dataclass, field
from typing import Any, ClassVar, TextIO

from mpi4py import MPI

from ..problem import CoupledProblem
from ..results.sums import Statistics

# The last resort, as it is reported
HALVED = "half the step"


@dataclass(eq=False)
class LoadStep:
    """An accepted step of a load path.

    Attributes
    ----------
    factor
        Load factor.
    iterations
        Newton iterations of the step.
    halvings
        Halvings of steps so far on this path.
    strategy
        Way that solved the step: ``"full"``, the solver as it was given;
        ``"extrapolated"``, from where the last step led, as asked; ``"soft start"``,
        ``"small gamma, line search"`` or ``"viscous forces"``: see `LoadSteps`.
    released
        Least energy that a snap has set free in this step. 0 without a snap, and also
        where no energy balance is made: in steps by ``"full"`` or as asked, with
        ``control``, and of bodies on meshes of their own.
    tangents, solves
        Tangents assembled and nonlinear solves begun for the step, including failed
        tries and larger steps that were halved.
    number
        Counts the accepted steps of the problem from 1, over all of its `LoadSteps`.
    """

    # Name of the factor in the line of a step
    kind: ClassVar[str] = "load"

    factor: float
    iterations: int
    halvings: int
    strategy: str = "full"
    number: int = field(default=1, repr=False)
    released: float = field(default=0.0, repr=False)
    tangents: int = field(default=0, repr=False)
    solves: int = field(default=0, repr=False)


class Effort:
    """Counts tangents and nonlinear solves of a problem, failed ones too, by step."""

    def __init__(self, problem: CoupledProblem) -> None:
        self._problem, self._before = problem, (problem.tangents, problem.solves)

    def taken(self) -> tuple[int, int]:
        """Return those since the last call."""
        problem, (tangents, solves) = self._problem, self._before
        self._before = problem.tangents, problem.solves
        return problem.tangents - tangents, problem.solves - solves


def is_file(thing: Any) -> bool:
    """Whether a thing is open for writing."""
    return callable(getattr(thing, "write", None))


def line(step: LoadStep, counts: Statistics) -> str:
    """One line on an accepted step."""
    gap = f"gap {counts.min_gap:.1e}" if counts.hits else "out of reach"
    way = "" if step.strategy == "full" else f"  {step.strategy}"
    return (
        f"step {step.number:3}  {step.kind} {step.factor:<8.6g}  Newton {step.iterations:2}  "
        f"halvings {step.halvings}  active {counts.active_points}  {gap}  "
        f"pressure {counts.max_pressure:.3g}{way}"
    )


class Progress:
    """Writes the lines. Rank 0 decides where, and writes. Collective.

    Lines go on counting from `accepted`, the steps of the problem before this path.
    `shown` tells whether anything is shown, the same on all ranks.
    """

    def __init__(self, comm: MPI.Comm, to: bool | TextIO | None, accepted: int) -> None:
        stream: Any = to if is_file(to) else sys.stderr
        self._in_place = bool(getattr(stream, "isatty", bool)())
        shown = self._in_place if to is None else to is not False
        self.shown: bool = comm.bcast(shown, root=0)
        self._stream = stream if self.shown and comm.rank == 0 else None
        self._last, self._drawn = "", 0
        self._accepted, self._factor = accepted, 0.0

    def solving(self, factor: float) -> None:
        """Report that a step begins: on a terminal by the last line or the factor."""
        self._factor = factor
        if self._in_place:
            self._draw(self._last or f"load {factor:.6g} ...")

    def trying(self, what: str) -> None:
        """Report that a solve has failed and another way is tried."""
        text = f"step {self._accepted + 1:3}  load {self._factor:<8.6g}  trying {what}"
        if self._in_place:
            self._draw(text)
        else:
            self._put(f"{text}\n")

    def accepted(self, text: str) -> None:
        """Report an accepted step, and leave a terminal's line to the caller."""
        self._last = text
        self._accepted += 1
        if self._in_place:
            self.clear()
        else:
            self._put(f"{text}\n")

    def clear(self) -> None:
        """Clear the terminal's line."""
        if self._drawn:
            self._put("\r" + " " * self._drawn + "\r")
            self._drawn = 0

    def finished(self) -> None:
        """Report the end of the path: the last line stays."""
        if self._in_place and self._last:
            self._put(f"{self._last}\n")

    def _draw(self, text: str) -> None:
        """Show a text, cut to one line of the terminal: only one can be rewritten."""
        self.clear()
        text = text[: shutil.get_terminal_size().columns - 1]
        self._put(f"\r{text}")
        self._drawn = len(text)

    def _put(self, text: str) -> None:
        if self._stream is not None:
            self._stream.write(text)
            self._stream.flush()

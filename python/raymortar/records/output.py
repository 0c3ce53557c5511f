"""Outputs of a path: files of its steps, and lines of its progress."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, TextIO

from mpi4py import MPI

from dolfinx.fem import Function

from ..arguments import new_file, writing
from ..core import compat
from ..core.discretization.joined import parts_of
from ..core.errors import (
    ContactError,
    described,
    is_real_number,
    is_truth_value,
    require_agreement,
    together,
)
from ..core.finding import Finding
from ..core.problem import CoupledProblem
from ..core.solvers.solver import require_problem
from ..io.writers import (
    Entry,
    folder_of,
    read_collection,
    write_collection,
    write_vtk,
    write_xdmf,
)
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
        Newton iterations of the step, a tangent each.
    halvings
        Halvings of steps so far on this path.
    strategy
        Way that solved the step: ``"full"``, the solver as it was given;
        ``"extrapolated"``, from where the last step led, as asked; ``"soft start"``,
        ``"partial steps"``, ``"small gamma, line search"`` or ``"viscous forces"``: see
        `LoadSteps`.
    released
        Bounds (least, most) of the energy that a snap within the step has set free. The
        step does not know the load of the snap: smaller steps narrow them. With a least
        of 0 there may have been none. None where no energy balance is made: in steps by
        ``"full"`` or as asked, with ``control``, and of bodies on meshes of their own.
    tangents, solves
        Tangents assembled and nonlinear solves begun for the step, including failed
        tries and larger steps that were halved.
    number
        Counts the accepted steps of the problem from 1, over all of its `LoadSteps`.
    findings
        All that is doubtful about the step's end, as of `NonlinearProblem.check`; contact
        of few facets only where its force is the largest of the path so far.
    """

    # Name of the factor in the line of a step
    kind: ClassVar[str] = "load"

    factor: float
    iterations: int
    halvings: int
    strategy: str = "full"
    number: int = field(default=1, repr=False)
    released: tuple[float, float] | None = field(default=None, repr=False)
    tangents: int = field(default=0, repr=False)
    solves: int = field(default=0, repr=False)
    findings: list[Finding] = field(default_factory=list, repr=False)


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
        self.working(f"trying {what}")

    def working(self, on: str) -> None:
        """Report what is done in a step."""
        text = f"step {self._accepted + 1:3}  load {self._factor:<8.6g}  {on}"
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


ENDINGS = (".pvd", ".xdmf")


class Output:
    """Displacement, contact fields, segments and points of every step. Collective.

    Parameters
    ----------
    problem
        Problem that is solved.
    file
        Path that ends in ``.pvd`` (VTK files, with all nodes of degree 2) or ``.xdmf``
        (values at the nodes of the mesh). The series begins with the first step, in
        place of an older one, and is whole after each step.
    more
        Further Functions on the mesh of a displacement, each with its own name.
        `update` sets their values.
    segments
        Whether segments and integration points are written too, as series
        ``<stem>_segments.pvd`` and ``<stem>_points.pvd``. All files that the series
        name are in the folder ``<stem>_files``.
    update
        Called on every rank before a step is written, when it is solved and not yet
        accepted.

    Attributes
    ----------
    steps
        Number of steps written so far.

    Notes
    -----
    If bodies have their own meshes, a ``.pvd`` shows all of them at each time; in
    ``.xdmf`` each mesh after the first has its own file, ``<stem>_mesh1.xdmf``, ...
    With several contacts, names of fields end in the contact's number: ``gap_0``,
    ``gap_1``.

    Examples
    --------
    >>> LoadSteps(problem, apply, steps=5, output="run.pvd").run()
    >>> def update():
    ...     stress.interpolate(expression)
    >>> output = Output(problem, "run.pvd", more=[stress], update=update)
    >>> LoadSteps(problem, press, steps=5, output=output).run()
    >>> LoadSteps(problem, slide, steps=5, path=(1.0, 2.0), output=output).run()
    """

    def __init__(
        self,
        problem: CoupledProblem,
        file: str | Path,
        more: Sequence[Function] = (),
        segments: bool = True,
        update: Callable[[], object] | None = None,
    ) -> None:
        require_problem(problem)
        self.problem, self._comm = problem, problem.comm
        self._parts = parts_of(problem.contact.u)
        with together(self._comm):
            self.path = path = new_file(self._comm, file)
            if path.suffix not in ENDINGS:
                raise ContactError(f"{path} must end in .pvd or .xdmf")
            meshes = [part.function_space.mesh for part in self._parts]
            self._more = by_mesh(more, meshes)
            if not is_truth_value(segments):
                raise ContactError(f"segments must be True or False, not {segments!r}")
            if update is not None and not callable(update):
                raise ContactError(f"update must be a function, not {update!r}")
        require_agreement(self._comm, output=str(file), segments=bool(segments))
        self._update = update
        self.segments, self.steps = bool(segments), 0

    def write(self, time: float) -> None:
        """Add the present state, after a solve and before `Contact.advance`.

        Collective.

        Raises
        ------
        ContactError
            If a file cannot be written.
        """
        with together(self._comm):
            if not is_real_number(time):
                raise ContactError(f"time of a step must be a number, not {time!r}")
            if self._update is not None:
                self._update()
        for k, (part, fields) in enumerate(zip(self._parts, self._fields())):
            mesh, append = part.function_space.mesh, self.steps > 0
            if self.path.suffix == ".pvd":
                write_vtk(self.path, mesh, fields, time, append or k > 0, k)
            else:
                end = f"_mesh{k}" if k else ""
                file = self.path.with_name(f"{self.path.stem}{end}.xdmf")
                write_xdmf(file, mesh, fields, time, append)
        if self.segments:
            self._write_segments(time)
        self.steps += 1

    def _fields(self) -> list[list[Function]]:
        """All Functions of a step, by mesh. Collective."""
        found = [[part, *more] for part, more in zip(self._parts, self._more)]
        contacts = self.problem.contact.contacts
        for number, contact in enumerate(contacts):
            on = contact.zones[0].facets.slave_part
            for f in contact.fields():
                name = f.name if len(contacts) == 1 else f"{f.name}_{number}"
                found[on].append(Function(f.function_space, f.x, name=name))
        return found

    def _write_segments(self, time: float) -> None:
        """Write segments and points of this step, and add them to their series."""
        series = [f"{self.path.stem}_{what}" for what in ("segments", "points")]
        folder = folder_of(self._comm, self.path)
        file = folder / f"{series[0]}_{self.steps:04d}.vtu"
        self.problem.contact.results.write_segments(file)
        ending = ".vtu" if self._comm.size == 1 else ".pvtu"
        for stem, name in zip(series, (file.stem, f"{file.stem}_points")):
            path = self.path.with_name(f"{stem}.pvd")
            with writing(self._comm, path, OSError):
                if self._comm.rank == 0:
                    before = read_collection(path) if self.steps else []
                    place = f"{folder.name}/{name}{ending}"
                    entry = Entry(repr(float(time)), 0, place)
                    write_collection(path, [*before, entry])


def check_output(output: Any, problem: CoupledProblem) -> Output | None:
    """Return the `Output` as it was given, or make one for a path. Collective."""
    if output is None:
        return None
    if not isinstance(output, Output):
        return Output(problem, output)
    if output.problem is not problem:
        raise ContactError("output is of another problem than the solver")
    return output


def by_mesh(more: Any, meshes: Sequence[Any]) -> list[list[Function]]:
    """Sort further Functions, `more`, by the mesh of a displacement that each is on."""
    if not isinstance(more, (list, tuple)):
        raise ContactError(f"more must be a list of Functions, not {described(more)}")
    found: list[list[Function]] = [[] for _ in meshes]
    for f in more:
        here = [isinstance(f, Function) and compat.on_mesh(f, m) for m in meshes]
        if not any(here):
            raise ContactError(
                f"more has {described(f)}, which is no Function on the mesh of a "
                "displacement"
            )
        found[here.index(True)].append(f)
    return found

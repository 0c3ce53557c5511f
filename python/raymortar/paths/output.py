"""Time series of all fields of a path of load steps, for ParaView."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from dolfinx.fem import Function

from .. import compat
from ..compat.files import Entry, read_collection, write_collection
from ..discretization.joined import parts_of
from ..errors import (
    ContactError,
    described,
    is_real_number,
    is_truth_value,
    new_file,
    require_agreement,
    together,
    writing,
)
from ..problem import CoupledProblem
from ..solvers.solver import require_problem

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
        ``<stem>_segments.pvd`` and ``<stem>_points.pvd``.
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
                compat.write_vtk(self.path, mesh, fields, time, append or k > 0, k)
            else:
                end = f"_mesh{k}" if k else ""
                file = self.path.with_name(f"{self.path.stem}{end}.xdmf")
                compat.write_xdmf(file, mesh, fields, time, append)
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
        file = self.path.with_name(f"{series[0]}_{self.steps:04d}.vtu")
        self.problem.contact.write_segments(file)
        ending = ".vtu" if self._comm.size == 1 else ".pvtu"
        for stem, name in zip(series, (file.stem, f"{file.stem}_points")):
            path = self.path.with_name(f"{stem}.pvd")
            with writing(self._comm, path, OSError):
                if self._comm.rank == 0:
                    before = read_collection(path) if self.steps else []
                    entry = Entry(repr(float(time)), 0, name + ending)
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

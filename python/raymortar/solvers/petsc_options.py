"""PETSc options of a solver, and what its ranks must have alike."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from petsc4py import PETSc

from ..errors import ContactError, require_agreement, together
from ..problem import CoupledProblem


class PetscOptions:
    """Options under a prefix, which are in PETSc's table within a ``with`` alone.

    The table has room for 512, of all solvers that live, and at the end of the program
    PETSc tells of those that nothing has read. They have to be there while a solver works
    as well as when it is made: MUMPS reads its own at each factorisation, and solvers
    inside a preconditioner theirs as that is set up.

    Parameters
    ----------
    prefix
        Of the options' names.
    options
        Value by name. What the command line, or a program, has set goes before it.

    Attributes
    ----------
    given
        Value by name.
    """

    def __init__(self, prefix: str, options: Mapping[str, Any]) -> None:
        self.prefix, self.given = prefix, dict(options)
        self._added: list[list[str]] = []  # of each `with` within another

    def __enter__(self) -> PetscOptions:
        table = PETSc.Options(self.prefix)
        added = [key for key in self.given if not table.hasName(key)]
        for key in added:
            table[key] = self.given[key]
        self._added.append(added)
        return self

    def __exit__(self, *_: Any) -> None:
        table = PETSc.Options(self.prefix)
        for key in self._added.pop():
            table.delValue(key)

    def configure(self, thing: Any) -> None:
        """Have a SNES or KSP read them, PETSc's command line included."""
        thing.setOptionsPrefix(self.prefix)
        try:
            with self:
                thing.setFromOptions()
        except PETSc.Error as error:
            # Of newer petsc4py's, the text has no more than a number
            reason = getattr(error, "_traceback_", None) or [str(error)]
            raise ContactError(
                f"PETSc does not take the options {self.given}: {reason[-1]}"
            ) from None


def check_solver_input(solver: Any, problem: Any, options: Any) -> None:
    """Raise unless a solver can be made of these, the same on every rank. Collective."""
    if not isinstance(problem, CoupledProblem):
        raise ContactError(
            f"problem must be a NonlinearProblem, not {type(problem).__name__}"
        )
    with together(problem.comm):
        if options is not None and not (
            isinstance(options, Mapping) and all(isinstance(k, str) for k in options)
        ):
            raise ContactError(
                f"options must be PETSc options by name, not {options!r}"
            )
    options = None if options is None else dict(sorted(options.items()))
    require_agreement(problem.comm, solver=type(solver).__name__, options=options)

"""PETSc options of a solver, and checks that they are the same on all ranks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

from dolfinx.fem import Function

from .. import compat
from ..errors import ContactError, raise_everywhere, require_agreement, together
from ..problem import CoupledProblem


class PetscOptions:
    """Options under a prefix, which are in PETSc's table only within a ``with`` block.

    The table has room for 512 options of all solvers, and at the end of the program
    PETSc lists those that nothing has read. The options must be there when a solver is
    made and while it works: MUMPS reads its options at each factorisation, and solvers
    inside a preconditioner read theirs when it is set up.

    Parameters
    ----------
    prefix
        Prefix of the names.
    options
        Value by name. Options from the command line, or set by the program, win.

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
        """Let a SNES or KSP read the options, PETSc's command line included."""
        thing.setOptionsPrefix(self.prefix)
        try:
            with self:
                thing.setFromOptions()
        except PETSc.Error as error:
            # The text of newer petsc4py's errors has no more than a number
            reason = getattr(error, "_traceback_", None) or [str(error)]
            raise ContactError(
                f"PETSc does not take the options {self.given}: {reason[-1]}"
            ) from None


def check_solver_input(solver: Any, problem: Any, options: Any) -> None:
    """Raise unless problem and options suit a solver, alike on all ranks.
    Collective."""
    name = type(solver).__name__
    if not isinstance(problem, CoupledProblem):
        remedy = f": {name}(problem)" if isinstance(problem, MPI.Comm) else ""
        raise ContactError(
            f"problem must be a NonlinearProblem, not {type(problem).__name__}{remedy}"
        )
    with together(problem.comm):
        if options is not None and not (
            isinstance(options, Mapping) and all(isinstance(k, str) for k in options)
        ):
            raise ContactError(
                f"options must be PETSc options by name, not {options!r}"
            )
    options = None if options is None else dict(sorted(options.items()))
    require_agreement(problem.comm, solver=name, options=options)


def check_unknowns(problem: CoupledProblem, u: Any) -> None:
    """Raise unless u is None or what a problem solves for. Collective."""
    own = problem.contact.host.functions
    given = u if isinstance(u, (list, tuple)) else [u]
    fits = u is None or (
        len(given) == len(own)
        and all(isinstance(f, Function) for f in given)
        and all(compat.same_values(f, g) for f, g in zip(given, own))
    )
    named = [f.name if isinstance(f, Function) else repr(f) for f in given]
    names = [f.name for f in own]
    message = (
        f"solve takes what the problem solves for, {', '.join(names)}, or nothing, and "
        f"was given another: {', '.join(named)}"
    )
    if set(names) & set(named):
        message += ", a Function of the same name that Contact was not given: problem.u"
    raise_everywhere(problem.comm, None if fits else message)

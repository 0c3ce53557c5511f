"""Settings that a user gives a solver, misspelt ones, and a solver's reasons in words."""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from petsc4py import PETSc

from dolfinx.fem import Function

from ..core import compat
from ..core.errors import raise_everywhere, warn
from ..core.problem import CoupledProblem
from ..core.solvers.petsc_objects import DIRECT, NOT_A_NUMBER, PetscOptions
from ..core.solvers.solver import MAX_IT, CoupledSolver

# Settings of DOLFINx's Newton solver, which programs look for in others
_NAMES = ("rtol", "atol", "max_it", "relaxation_parameter", "convergence_criterion")
# Options of solvers within others and of ours, which need not have been read yet
_INNER = re.compile("_(snes|ksp|pc|mat)_|^(kept|lagged|bodies)_|^snes_inexact$")
# Ends of a nonlinear solve, by PETSc's names
_REASONS = {
    "FUNCTION_DOMAIN": "the residual has no value there",
    "FUNCTION_COUNT": "too many residuals were asked for",
    "LINEAR_SOLVE": "the linear solver failed",
    "MAX_IT": "the largest number of iterations was reached",
    "LINE_SEARCH": "the line search found no smaller residual",
    "INNER": "an inner solve failed",
    "LOCAL_MIN": "the same residuals come again and again",
    "DTOL": "the residual grew beyond the divergence tolerance",
    "JACOBIAN_DOMAIN": "the tangent has no value there",
    "TR_DELTA": "the trust region became too small",
}


class WatchedOptions(PetscOptions):
    """Options of which a solver tells those of the user's that nothing has read."""

    def __init__(
        self, prefix: str, options: Mapping[str, Any], by_user: Iterable[str]
    ) -> None:
        super().__init__(prefix, options)
        # Options of the user's that nothing has read so far
        self._unread = [
            name
            for name in sorted(by_user)
            if name not in DIRECT and not _INNER.search(name)
        ]

    def _leave(self, added: list[str]) -> None:
        # Options of the command line are not ours to judge
        self._unread = [
            key
            for key in self._unread
            if key in added and not compat.option_was_read(self.prefix + key)
        ]

    def tell_unread(self) -> None:
        """Warn once, after a solve, of the user's options that nothing has read; on every
        rank."""
        names, self._unread = ", ".join(map(repr, self._unread)), []
        if names:
            warn(
                f"nothing has read the PETSc option(s) {names}: misspelt, or of a "
                "solver not in use. Names have no dash and no prefix, as 'snes_rtol'",
                page="use",
            )


def is_limited(solver: Any) -> bool:
    """Whether the user has limited the iterations of a solver, or its limit is not known."""
    return getattr(solver, "max_it", None) != MAX_IT


def reason_in_words(reason: int) -> str:
    """Put PETSc's reason for the end of a nonlinear solve in words."""
    reasons = PETSc.SNES.ConvergedReason
    known = {getattr(reasons, f"DIVERGED_{k}", None): v for k, v in _REASONS.items()}
    known[NOT_A_NUMBER] = "the residual is no number"
    return f"SNES reason {reason}" + (f": {known[reason]}" if reason in known else "")


def check_name(solver: CoupledSolver, name: str) -> None:
    """Raise for a new attribute of a solver whose name is nearly that of a setting."""
    known = _settings(type(solver))
    is_new = name not in known and not name.startswith("_")
    if is_new and _resembles(name, [*known, *_NAMES]):
        raise AttributeError(
            f"{type(solver).__name__} has no {name}: there are {', '.join(known)}"
        )


def _resembles(name: str, known: Sequence[str]) -> bool:
    """Whether a name is nearly one of those that are known."""
    # It takes a while to import, and only unusual programs need it
    from difflib import get_close_matches

    return bool(get_close_matches(name, known, 1, 0.75))


@functools.cache
def _settings(solver: type[CoupledSolver]) -> list[str]:
    """Public attributes of a type of solver that can be set."""
    names = {name for one in solver.__mro__ for name in inspect.get_annotations(one)}
    names |= {
        name
        for name in dir(solver)
        if getattr(getattr(solver, name), "fset", None) is not None
    }
    return sorted(name for name in names if not name.startswith("_"))


@contextmanager
def temporarily(thing: Any, **values: Any) -> Iterator[None]:
    """Give attributes of an object, such as settings of a solver, other values for a
    while."""
    before = {name: getattr(thing, name) for name in values}
    for name, value in values.items():
        setattr(thing, name, value)
    try:
        yield
    finally:
        for name, value in before.items():
            setattr(thing, name, value)


def check_unknowns(problem: CoupledProblem, u: Any) -> None:
    """Raise unless u is None or the problem's unknowns. Collective."""
    own = problem.contact.unknowns.functions
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

"""PETSc options, errors in what PETSc calls, and factors, for all solvers."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from petsc4py import PETSc

from ..errors import ContactError
from ..system.coupled import ROOM

_counter = itertools.count()

# The tangent is unsymmetric and, with a multiplier, has zeros on its diagonal: a
# direct solver has to pivot. Contact fills in more than MUMPS guesses by default.
DIRECT = {
    "ksp_type": "preonly",
    "pc_type": "lu",
    "pc_factor_mat_solver_type": "mumps",
    "mat_mumps_icntl_14": 60,
}


class PetscOptions:
    """Options under a prefix, which are in PETSc's table only within a ``with`` block.

    The table has room for 512 options of all solvers, and at the end of the program
    PETSc lists those that nothing has read. The options must be there when a solver is
    made and while it works: MUMPS reads its options at each factorisation, and solvers
    inside a preconditioner read theirs when it is set up.

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
        # A question for a name counts as reading it
        wanted = () if self._added else self.given
        added = [key for key in wanted if not table.hasName(key)]
        for key in added:
            table[key] = self.given[key]
        self._added.append(added)
        return self

    def __exit__(self, *_: Any) -> None:
        table, added = PETSc.Options(self.prefix), self._added.pop()
        if not self._added:
            self._leave(added)
        for key in added:
            table.delValue(key)

    def _leave(self, added: list[str]) -> None:
        """Look at options that have been in the table, before they leave it."""

    def tell_unread(self) -> None:
        """Warn, after a solve, of options that nothing has read, where a floor does."""

    def configure(self, thing: Any) -> None:
        """Let a SNES or KSP read the options, PETSc's command line included."""
        thing.setOptionsPrefix(self.prefix)
        try:
            with self:
                thing.setFromOptions()
        except PETSc.Error as error:
            # The text of newer petsc4py's errors has no more than a number
            reason = getattr(error, "_traceback_", None) or [str(error)]
            message = f"PETSc does not take the options {self.given}: {reason[-1]}"
            raise ContactError(message) from None


def make_regular(A: PETSc.Mat) -> None:
    """Make any regular matrix of one that could not be assembled: the residual that
    follows ends the solve. Collective."""
    A.assemble()
    A.zeroEntries()
    A.shift(1.0)


@contextmanager
def raising(raised: list[Exception]) -> Iterator[None]:
    """Raise at the end of the block what code that PETSc calls raised in it, in place of
    what PETSc and DOLFINx make of that."""
    raised.clear()
    try:
        yield
    except Exception:
        if not raised:
            raise
    if raised:
        raise raised.pop(0)


def new_prefix(kind: str) -> str:
    """Make a prefix that no other solver has, or one would set the other's options."""
    return f"raymortar_{kind}_{next(_counter)}_"


def renew(ksp: PETSc.KSP, A: PETSc.Mat) -> None:
    """Drop the factors: after a failure MUMPS refuses to factorise anew, and PETSc
    takes a new pattern for the old one (`Contact.make_room`)."""
    ksp.reset()
    ksp.setOperators(A)


def take_tangent(problem: Any, x: PETSc.Vec, A: PETSc.Mat, ksp: PETSc.KSP) -> None:
    """Assemble the tangent at x, and tell the KSP where A's pattern is new. Collective.

    Another solver of the same matrix may have changed the pattern.
    """
    problem.J(x, A)
    room = A.getAttr(ROOM)
    if ksp.getAttr(ROOM) != room:
        renew(ksp, A)
        ksp.setAttr(ROOM, room)


# Its name in petsc4py has changed
NOT_A_NUMBER = -4

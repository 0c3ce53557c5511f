"""PETSc options, contexts that know the problem, and factors, for all solvers."""

from __future__ import annotations

import itertools
import re
import weakref
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from petsc4py import PETSc

from .. import compat
from ..discretization.ranks import destroy
from ..errors import ContactError, warn
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
# Options of factors whose type follows the symmetry of the matrix
SYMMETRIC_OR_NOT = {k: v for k, v in DIRECT.items() if k != "pc_type"}

# Relative tolerance of systems that paths solve with one tangent, whose solutions they
# combine
CLOSE = 1e-8

# Options of solvers within others and of ours, which need not have been read yet
_INNER = re.compile("_(snes|ksp|pc|mat)_|^(kept|lagged|bodies)_")


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

    def __init__(
        self, prefix: str, options: Mapping[str, Any], by_user: Iterable[str] = ()
    ) -> None:
        self.prefix, self.given = prefix, dict(options)
        self._added: list[list[str]] = []  # of each `with` within another
        # Options of the user's that nothing has read so far
        self._unread = [
            name for name in by_user if name not in DIRECT and not _INNER.search(name)
        ]

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
        if not self._added:  # those of the command line are not ours to judge
            self._unread = [
                key
                for key in self._unread
                if key in added and not compat.option_was_read(self.prefix + key)
            ]
        for key in added:
            table.delValue(key)

    def tell_unread(self, level: int) -> None:
        """Warn once, after a solve, of the user's options that nothing has read; on every
        rank. The level of `warnings.warn` is seen from the caller."""
        names, self._unread = ", ".join(map(repr, self._unread)), []
        if names:
            warn(
                f"nothing has read the PETSc option(s) {names}: misspelt, or of a "
                "solver not in use. Names have no dash and no prefix, as 'snes_rtol'",
                page="use",
            )

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


class KnowsProblem:
    """A Python context of PETSc's that `attach` gives the problem.

    Attributes
    ----------
    contact, row_scale
        The problem's contact, and the factors of the rows of its matrices.
    raised
        Errors that the solver raises after a solve, see `solvers.inner.kept_inside`; None:
        nobody does.
    """

    def __init__(self) -> None:
        self.contact: Any = None
        self.raised: list[Exception] | None = None
        self.row_scale: PETSc.Vec | None = None
        # Weak: C would keep the problem alive in a cycle
        self._problem: Any = None

    @property
    def problem(self) -> Any:
        """The problem that is solved."""
        return self._problem()

    def know(
        self,
        problem: Any,
        row_scale: PETSc.Vec | None,
        raised: list[Exception] | None = None,
    ) -> None:
        """Take the problem, the factors of its rows, and the list of errors."""
        self._problem, self.contact = weakref.ref(problem), problem.contact
        self.row_scale, self.raised = row_scale, raised

    def _destroy(self, *names: str) -> None:
        """Free and forget PETSc objects, those that have been made."""
        for name in names:
            destroy(getattr(self, name, None))
            setattr(self, name, None)


def attach(
    ksp: PETSc.KSP,
    problem: Any,
    row_scale: PETSc.Vec | None = None,
    raised: list[Exception] | None = None,
) -> None:
    """Give the problem, the factors of its rows, and a list of errors to raise after a
    solve, to a solver whose options have been read.

    Raises
    ------
    ContactError
        If the solver is iterative, and there are unknowns beside the displacement, or a
        free rigid body.
    """
    for thing in (ksp, ksp.getPC()):
        if thing.getType() == "python":
            context = thing.getPythonContext()
            if isinstance(context, KnowsProblem):
                context.know(problem, row_scale, raised)


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


def reason_in_words(reason: int) -> str:
    """Put PETSc's reason for the end of a nonlinear solve in words."""
    reasons = PETSc.SNES.ConvergedReason
    known = {getattr(reasons, f"DIVERGED_{k}", None): v for k, v in _REASONS.items()}
    known[NOT_A_NUMBER] = "the residual is no number"
    return f"SNES reason {reason}" + (f": {known[reason]}" if reason in known else "")

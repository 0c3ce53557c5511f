"""Checks, linear systems and failures that both Newton solvers share."""

from __future__ import annotations

import sys
import weakref
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, cast

from mpi4py import MPI
from petsc4py import PETSc

from .. import compat
from ..discretization.ranks import destroy
from ..errors import ContactError, require_agreement, together, warn
from ..hooks import hooks
from ..interface.offsets import MOST_AUGMENTATIONS, augmented
from ..problem import CoupledProblem
from .petsc_objects import PetscOptions, renew

# Iterations of a solve whose limit the user has not set
MAX_IT = 25


class CoupledSolver(ABC):
    """Newton's method on [u, multiplier], whatever object iterates. Collective.

    Attributes
    ----------
    A, b
        Tangent and residual.
    krylov_solver
        The PETSc KSP.
    options
        `PetscOptions`. To use the KSP by itself, write ``with solver.options:``, which
        puts them into PETSc's table.
    tolerances
        rtol and atol.
    on_iterate
        Function that is called with each iterate and its residual before the iterate is
        judged, and may change both. None: no function.
    """

    A: PETSc.Mat
    b: PETSc.Vec
    krylov_solver: PETSc.KSP
    options: PetscOptions
    tolerances: tuple[float, float]
    on_iterate: Callable[[PETSc.Vec, PETSc.Vec], None] | None = None

    def __init__(
        self,
        problem: CoupledProblem,
        options: Mapping[str, Any] | None,
        matrix: PETSc.Mat | None = None,
        owned: bool = False,
    ) -> None:
        _check_input(type(self).__name__, problem, options)
        # The communicator ends with the mesh, which has to outlive PETSc's objects
        self._contact = problem.contact
        self._problem: Any = weakref.ref(problem) if owned else lambda: problem
        self.A = problem.create_matrix() if matrix is None else matrix
        self.b = problem.create_vector()
        self._floor = problem.residual_floor()
        # Factors of the rows, where the solver weighs them; errors of what PETSc calls
        self.scale: PETSc.Vec | None = None
        self.raised: list[Exception] = []

    # Type checkers do not see names that have moved
    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            return hooks.moved(self, name)

    def __setattr__(self, name: str, value: Any) -> None:
        for check in hooks.on_setting:
            check(self, name)
        super().__setattr__(name, value)

    def _configure(
        self,
        thing: Any,
        prefix: str,
        options: Mapping[str, Any],
        by_user: Iterable[str],
    ) -> None:
        """Let DOLFINx's or PETSc's object read its options, of which the user has given
        some. Collective."""
        if hooks.options is None:
            self.options = PetscOptions(prefix, options)
        else:
            self.options = hooks.options(prefix, options, by_user)
        self.options.configure(thing)
        for call in hooks.on_solver:
            call(self.krylov_solver, self.problem, self.scale, self.raised)

    def __del__(self) -> None:
        if sys.is_finalizing():
            return
        contact = self.__dict__.get("_contact")
        for name in ("newton", "snes", "krylov_solver", "A", "b", "x", "scale"):
            self.__dict__.pop(name, None)
        # Several ranks may do so at different times: there the next solver on the mesh
        # frees the objects that all ranks have dropped
        if contact is not None and not PETSc.Sys.isFinalized():
            if contact.layout.comm.size == 1:
                compat.destroy_garbage(contact.layout.comm)

    @property
    def problem(self) -> CoupledProblem:
        """The problem that is solved."""
        problem = self._problem()
        if problem is None:
            raise ContactError(
                "the problem of this snes_solver is gone: keep it in a variable, or make "
                "SNESSolver(problem)"
            )
        return cast("CoupledProblem", problem)

    @property
    def force_tolerance(self) -> float | None:
        """The absolute tolerance where the user has given one. Force."""
        atol = self.tolerances[1]
        return None if atol == self._floor else atol

    @abstractmethod
    def _settings(self) -> dict[str, Any]:
        """Settings without which one rank would stop before the others."""

    @abstractmethod
    def _iterate(self, x: PETSc.Vec) -> tuple[int, str | None]:
        """Iterate from x; return the iterations and why they failed, None if they
        converged. Collective."""

    def solve(self, u: Any = None) -> tuple[int, bool]:
        """Solve from the present u and multiplier.

        Parameters
        ----------
        u
            The Function that the problem solves for, of several unknowns the list of
            them, as programs for DOLFINx name it; None is the same.

        Returns
        -------
        iterations, converged

        Raises
        ------
        ConvergenceError
            With PETSc's reason, pairs, active points, gaps and residual history.
        ContactError
            If u is something else.
        """
        for check in hooks.on_solve:
            check(self.problem, u)
        settings = {"tolerances": self.tolerances, **self._settings()}
        name = type(self).__name__
        require_agreement(self.problem.comm, solver=name, **settings)
        return self.iterate_by(self._iterate, 0), True

    def iterate_by(self, iterate: Callable[..., tuple[int, str | None]], n: int) -> int:
        """Solve from the present unknowns by a loop that is given. Collective.

        The loop takes the vector of unknowns and n others, and returns its iterations
        and why they failed, None if they converged.
        """
        iterations, change = self._iterate_once(iterate, n), 0.0
        for _ in range(MOST_AUGMENTATIONS):
            change = augmented(self.problem.contact.parts)
            if not change:
                return iterations
            iterations += self._iterate_once(iterate, n)
        warn(
            f"an exact penalty has changed gaps by {change:.1e} of a facet in the last "
            f"of {MOST_AUGMENTATIONS} solves: a larger gamma converges faster",
        )
        return iterations

    def _iterate_once(
        self, iterate: Callable[..., tuple[int, str | None]], n: int
    ) -> int:
        """Solve with the tractions that an exact penalty has carried over. Collective."""
        problem = self.problem
        problem.solves += 1
        vectors = [problem.start(), *(problem.create_vector() for _ in range(n))]
        reason: str | None = ""
        try:
            with self.options:
                iterations, reason = iterate(*vectors)
        finally:
            destroy(*vectors)
            if reason is not None:
                renew(self.krylov_solver, self.A)
        if iterations > 0:
            self.options.tell_unread()
        end = f"after {iterations} iterations{reason}"
        hooks.judge(problem, reason is None, end)
        return iterations

    def weigh_rows(self) -> None:
        """Take the present factors of the rows. Collective."""
        if self.scale is not None:
            self.scale.array[:] = self.problem.row_scale()


def forwarded(to: str, name: str, meaning: str) -> Any:
    """Make an attribute of a class that is one of the object of another attribute."""
    return property(
        lambda owner: getattr(getattr(owner, to), name),
        lambda owner, value: setattr(getattr(owner, to), name, value),
        doc=meaning,
    )


def require_problem(problem: Any, remedy: str = "") -> None:
    """Raise unless something is a problem."""
    if not isinstance(problem, CoupledProblem):
        name = type(problem).__name__
        raise ContactError(f"problem must be a NonlinearProblem, not {name}{remedy}")


def _check_input(name: str, problem: Any, options: Any) -> None:
    """Raise unless problem and options suit a solver, on all ranks. Collective."""
    remedy = f": {name}(problem)" if isinstance(problem, MPI.Comm) else ""
    if hasattr(type(problem), "attach"):  # as of a CondensedProblem
        remedy = ": problem.attach(snes) gives its equations to a solver of your own"
    require_problem(problem, remedy)
    known = options is None or isinstance(options, Mapping)
    with together(problem.comm):
        if not (known and all(isinstance(k, str) for k in options or ())):
            message = f"options must be PETSc options by name, not {options!r}"
            raise ContactError(message)
    options = None if options is None else dict(sorted(options.items()))
    require_agreement(problem.comm, solver=name, options=options)

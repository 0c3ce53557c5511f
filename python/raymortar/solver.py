"""Newton's method on the coupled unknowns: DOLFINx's solver, and PETSc SNES."""

from __future__ import annotations

import itertools
import weakref
from collections.abc import Callable, Mapping, Sequence
from typing import Any, cast

from petsc4py import PETSc

from . import compat, solvers
from .errors import ContactError, ConvergenceError, raise_everywhere
from .methods import Penalty
from .penetration import warn_of_penetration
from .problem import NonlinearProblem

# Each solver has its own prefix in the PETSc options, or one would set the other's
_counter = itertools.count()

# The tangent is unsymmetric and, with a multiplier, has zeros on its diagonal: a
# direct solver has to pivot. Contact fills in more than MUMPS guesses by default.
DIRECT = {
    "ksp_type": "preonly",
    "pc_type": "lu",
    "pc_factor_mat_solver_type": "mumps",
    "mat_mumps_icntl_14": 60,
}


def _configure(owner: Any, obj: Any, prefix: str, options: Mapping[str, Any]) -> None:
    """Put options under a prefix and read them, PETSc's command line included.

    MUMPS reads its own at the first factorisation, so they stay as long as `owner`;
    then they leave, as PETSc holds 512 options at most, and tells of those that nothing
    has read when the program ends.
    """
    database = PETSc.Options(prefix)
    new = [key for key in options if not database.hasName(key)]
    for key in new:
        database[key] = options[key]
    weakref.finalize(owner, _forget, prefix, new)
    obj.setOptionsPrefix(prefix)
    obj.setFromOptions()


def _forget(prefix: str, keys: Sequence[str]) -> None:
    """Take options out of PETSc's database."""
    if PETSc.Sys.isFinalized():
        return
    for key in keys:
        PETSc.Options(prefix).delValue(key)


class NewtonSolver:
    """DOLFINx's Newton solver on [u, multiplier]. Collective.

    Parameters
    ----------
    problem
        Problem to solve.
    options
        PETSc options of the linear solver, without prefix. Default: MUMPS.

    Attributes
    ----------
    rtol, atol, max_it, relaxation_parameter, convergence_criterion
        As in DOLFINx, except that ``rtol`` is relative to the first residual: DOLFINx
        compares with the length of the first increment, whatever the units. ``atol``
        is a force, by default the rounding error of the stiffest part, below which a
        solve goes on as long as that brings anything (theory, 5.4).
    krylov_solver
        The PETSc KSP.

    Raises
    ------
    ContactError
        Where DOLFINx no longer has its Newton solver: use `SNESSolver`.
    """

    def __init__(
        self, problem: NonlinearProblem, options: Mapping[str, Any] | None = None
    ) -> None:
        try:
            self._newton = compat.make_newton_solver(problem.comm)
        except NotImplementedError as error:
            raise ContactError(f"{error} (raymortar.SNESSolver)") from None
        self.problem = problem
        self.A, self.b = problem.create_matrix(), problem.create_vector()
        # Weak, or C++ would keep the solver alive in a cycle that nothing finds
        this = cast("Callable[[], NewtonSolver]", weakref.ref(self))

        def residual(x: PETSc.Vec, b: PETSc.Vec) -> None:
            problem.F(x, b)
            this()._measure()

        def tangent(x: PETSc.Vec, A: PETSc.Mat) -> None:
            if problem.J(x, A):
                _renew(this().krylov_solver, A)

        self._newton.setF(residual, self.b)
        self._newton.setJ(tangent, self.A)
        self._newton.set_form(problem.form)
        self._newton.rtol = 1e-10
        self._floor = problem.residual_floor()
        self._newton.atol = self._floor
        self._newton.max_it = 25
        self._newton.report = False
        self._newton.error_on_nonconvergence = False
        _configure(
            self,
            self.krylov_solver,
            f"raymortar_newton_{next(_counter)}_",
            DIRECT if options is None else options,
        )
        solvers.attach(self.krylov_solver, problem.contact)

    def __getattr__(self, name: str) -> Any:
        """Settings are those of DOLFINx's solver."""
        if name == "_newton":
            raise AttributeError(name)
        return getattr(self._newton, name)

    def __setattr__(self, name: str, value: Any) -> None:
        newton = self.__dict__.get("_newton")
        if newton is not None and hasattr(type(newton), name):
            setattr(newton, name, value)
        else:
            object.__setattr__(self, name, value)

    def solve(self) -> tuple[int, bool]:
        """Solve from the present u and multiplier.

        Returns
        -------
        iterations, converged

        Raises
        ------
        ConvergenceError
            With pairs, active points, gap range and residual history.
        """
        x = self.problem.start()
        self._tolerances: tuple[float, float] = self._newton.rtol, self._newton.atol
        converged, reason = False, ""
        try:
            iterations, converged = self._newton.solve(x)
            reason = f"after {iterations} iterations"
        except ContactError as error:
            # An iterate that is no number; a start that is none is the user's fault
            if not self.problem.history:
                raise
            reason = f"({error})"
        finally:
            x.destroy()
            self.rtol, self.atol = self._tolerances
            if not converged:
                _renew(self.krylov_solver, self.A)
        _require(self.problem, converged, reason)
        return iterations, converged

    @property
    def tolerances(self) -> tuple[float, float]:
        """rtol and atol."""
        return self.rtol, self.atol

    @tolerances.setter
    def tolerances(self, values: tuple[float, float]) -> None:
        self.rtol, self.atol = values

    def _measure(self) -> None:
        """Make the relative tolerance one of the first residual."""
        if self.convergence_criterion == "residual":
            rtol, atol = self._tolerances
            self.rtol, self.atol = 0.0, _goal(self.problem, rtol, atol, self._floor)


def _goal(problem: NonlinearProblem, rtol: float, atol: float, floor: float) -> float:
    """Residual that ends the solve at the present iterate. Force.

    The default `atol`, the floor, is the rounding error of the stiffest part. All forces
    of a soft one may lie below it, so it counts only once iterations bring nothing more.
    """
    history = problem.history
    goal = rtol * history[0]
    if atol == floor and history[-1] > 0.0 and _improves(history):
        return goal
    return max(atol, goal)


def _improves(history: Sequence[float]) -> bool:
    """Whether the last iteration has taken nine tenths of the residual, or none was."""
    return len(history) < 2 or history[-1] < 0.1 * history[-2]


def _renew(ksp: PETSc.KSP, A: PETSc.Mat) -> None:
    """Drop the factors: after a failure MUMPS refuses to factorise anew, and PETSc
    takes a new pattern for the old one (`Contact.make_room`)."""
    ksp.reset()
    ksp.setOperators(A)


def _require(problem: NonlinearProblem, converged: bool, reason: str) -> None:
    """Raise, on every rank, if a solve has failed, and warn of a doubtful end."""
    if not converged:
        message = f"Newton did not converge {reason}: {problem.describe()}"
        raise_everywhere(problem.comm, message, ConvergenceError)
    warn_of_penetration(problem.contact)


def _line_search(problem: NonlinearProblem) -> str:
    """Full steps cycle where springs are touched and slip in the same large step; with
    multipliers they are best (docs/parameters)."""
    contact = problem.contact
    springs = isinstance(contact.method, Penalty) and contact.friction is not None
    return "bt" if springs else "basic"


class SNESSolver:
    """PETSc SNES on [u, multiplier], with line search. Collective.

    Parameters
    ----------
    problem
        Problem to solve.
    options
        PETSc options without prefix, such as ``{"snes_linesearch_type": "bt",
        "snes_monitor": None}``. They complete the defaults: Newton with a full step
        (penalty with friction: line search ``bt``), ``snes_rtol`` 1e-10, ``snes_atol``
        the rounding error of the residual, MUMPS.

    Attributes
    ----------
    snes
        The petsc4py SNES.
    """

    def __init__(
        self, problem: NonlinearProblem, options: Mapping[str, Any] | None = None
    ) -> None:
        self.problem = problem
        self.A, self.b = problem.create_matrix(), problem.create_vector()
        self.snes = PETSc.SNES().create(problem.comm)
        # What a callback raised: newer petsc4py raises an error of its own instead
        self._raised: list[ContactError] = []
        # rtol and atol of the present solve, which each residual may change for SNES
        self._tolerances = [0.0, 0.0]
        # Not self: C would keep it alive in a cycle
        raised, tolerances = self._raised, self._tolerances
        floor = problem.residual_floor()

        def residual(snes: PETSc.SNES, x: PETSc.Vec, b: PETSc.Vec) -> None:
            try:
                problem.F(x, b)
            except ContactError as error:
                raised.append(error)
                raise
            # Of the forces: SNES counts the constrained rows in, which are lengths
            rtol, atol = tolerances
            goal = _goal(problem, rtol, atol, floor)
            snes.setTolerances(rtol=0.0, atol=goal)

        def tangent(snes: PETSc.SNES, x: PETSc.Vec, A: PETSc.Mat, P: PETSc.Mat) -> None:
            if problem.J(x, A):
                _renew(snes.ksp, A)

        self.snes.setFunction(residual, self.b)
        self.snes.setJacobian(tangent, self.A)
        defaults = {
            "snes_type": "newtonls",
            "snes_linesearch_type": _line_search(problem),
            "snes_rtol": 1e-10,
            "snes_atol": floor,
            "snes_stol": 0.0,
            "snes_max_it": 25,
        }
        _configure(
            self,
            self.snes,
            f"raymortar_snes_{next(_counter)}_",
            {**defaults, **DIRECT, **(options or {})},
        )
        solvers.attach(self.krylov_solver, problem.contact)

    @property
    def krylov_solver(self) -> PETSc.KSP:
        """The PETSc KSP."""
        return self.snes.ksp

    @property
    def tolerances(self) -> tuple[float, float]:
        """rtol and atol."""
        rtol, atol, _, _ = self.snes.getTolerances()
        return rtol, atol

    @tolerances.setter
    def tolerances(self, values: tuple[float, float]) -> None:
        self.snes.setTolerances(rtol=values[0], atol=values[1])

    def solve(self) -> tuple[int, bool]:
        """Solve from the present u and multiplier.

        Returns
        -------
        iterations, converged

        Raises
        ------
        ConvergenceError
            With PETSc's reason, pairs, active points, gaps and residual history.
        """
        x = self.problem.start()
        self._raised.clear()
        rtol, atol = self._tolerances[:] = self.tolerances
        try:
            self.snes.solve(None, x)
        except PETSc.Error:
            if not self._raised:
                raise
            raise self._raised[0] from None
        finally:
            self.tolerances = rtol, atol
        # The last residual may be of a rejected trial step
        self.problem.form(x)
        x.destroy()
        reason = self.snes.getConvergedReason()
        iterations = self.snes.getIterationNumber()
        # Of a residual that is rounding error no line search finds a smaller one
        no_descent = reason == PETSc.SNES.ConvergedReason.DIVERGED_LINE_SEARCH
        converged = reason > 0 or (no_descent and self.snes.getFunctionNorm() <= atol)
        if not converged:
            _renew(self.krylov_solver, self.A)
        _require(
            self.problem,
            converged,
            f"after {iterations} iterations (SNES reason {reason})",
        )
        return iterations, True

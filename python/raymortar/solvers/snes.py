"""Newton's method on the coupled unknowns by PETSc SNES."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Mapping
from typing import Any

from petsc4py import PETSc

import numpy as np

from ..diagnose.failure import NOT_A_NUMBER, reason_in_words
from ..diagnose.outcome import require_convergence
from ..errors import ContactError, require_agreement
from ..options.methods import Penalty
from ..problem import CoupledProblem
from .automatic import linear_options
from .elimination import attach
from .forcing import Forcing
from .newton import NewtonSolver
from .petsc_objects import (
    new_prefix,
    release,
    renew,
    solve_closely,
    take_tangent,
    tangent_with,
)
from .petsc_options import PetscOptions, check_solver_input, check_unknowns

STUCK = PETSc.SNES.ConvergedReason.DIVERGED_LOCAL_MIN
# Name by which a SNES has the factors of its rows
SCALE = "raymortar_row_scale"
NO_DESCENT = PETSc.SNES.ConvergedReason.DIVERGED_LINE_SEARCH


def _line_search(problem: CoupledProblem) -> str:
    """The default line search. With springs, full steps cycle where points close and
    slip in the same large step; with multipliers full steps are best
    (docs/solving.md)."""
    springs = any(
        isinstance(contact.method, Penalty) and contact.friction is not None
        for contact in problem.contact.contacts
    )
    return "bt" if springs else "basic"


def _defaults(problem: CoupledProblem, floor: float) -> dict[str, Any]:
    """Options of SNES, without those of the linear solver."""
    return {
        "snes_type": "newtonls",
        "snes_linesearch_type": _line_search(problem),
        # Of PETSc 3.23 and later 1e-15 in "l2": the square of a force, in any unit
        "snes_linesearch_atol": 0.0,
        "snes_rtol": 1e-10,
        "snes_atol": floor,
        "snes_stol": 0.0,
        "snes_max_it": 25,
    }


def _convergence_test(
    problem_of: Callable[[], CoupledProblem], snes: PETSc.SNES, floor: float
) -> Callable[..., int]:
    """Convergence test for a SNES whose options are in PETSc's table.

    It compares forces with forces. PETSc's own test compares the norm of all rows with
    that of the first iterate, which lacks the forces that a body meets on its way. If
    the user sets a divergence tolerance, it is relative to the first residual above
    rounding error. Where systems are solved inexactly, it tells the linear solver how
    exactly the next one is needed.
    """
    reasons = PETSc.SNES.ConvergedReason
    options = PETSc.Options(snes.getOptionsPrefix())
    divergence = options.getReal("snes_divergence_tolerance", -1.0)
    first = options.getReal("snes_inexact", 0.0)
    forcing = Forcing(first, snes.ksp.getTolerances()[0]) if first > 0.0 else None

    def test(snes: PETSc.SNES, iteration: int, norms: tuple[float, ...]) -> int:
        size, step, norm = norms
        rtol, atol, stol, _ = snes.getTolerances()
        convergence, history = problem_of().convergence, problem_of().history
        convergence.accept()
        if not np.isfinite(norm):
            return NOT_A_NUMBER
        if convergence.reached(rtol, None if atol == floor else atol):
            return reasons.CONVERGED_FNORM_RELATIVE
        first = next((norm for norm in history if norm > convergence.floor), 0.0)
        if 0.0 < divergence * first < history[-1]:
            return reasons.DIVERGED_DTOL
        if convergence.is_stuck:
            return STUCK
        if iteration > 0 and step < stol * size and not convergence.now.pending:
            return reasons.CONVERGED_SNORM_RELATIVE
        if 0 <= snes.getMaxFunctionEvaluations() <= snes.getFunctionEvaluations():
            return reasons.DIVERGED_FUNCTION_COUNT
        if forcing is not None:
            excess = convergence.excess(rtol, None if atol == floor else atol)
            snes.ksp.setTolerances(rtol=forcing.tolerance(iteration, excess))
        return reasons.CONVERGED_ITERATING

    return test


class SNESSolver:
    """PETSc SNES on [u, multiplier], with line search. Collective.

    Parameters
    ----------
    problem
        Problem to solve.
    options
        PETSc options without prefix, such as ``{"snes_linesearch_type": "bt",
        "snes_monitor": None}``. They complete the defaults: Newton's method with full
        steps (for a penalty with friction the line search ``bt``), ``snes_rtol`` 1e-10,
        ``snes_atol`` the rounding error of the residual, and a linear solver that
        depends on the size, see `solvers.linear_options`.
    matrix
        Matrix of another solver of this problem, to share it.
    prefix
        Prefix of the options in PETSc's table; None: one that no other solver has.
    owned
        Whether the problem keeps this solver; then the solver does not keep the problem
        alive.

    Attributes
    ----------
    snes
        The petsc4py SNES.
    A, b, x
        Tangent and residual, with weighed rows (`row_scale` of the problem), and
        unknowns [u, multiplier / gamma].
    options
        `PetscOptions`, as for `NewtonSolver`.
    """

    def __init__(
        self,
        problem: CoupledProblem,
        options: Mapping[str, Any] | None = None,
        matrix: PETSc.Mat | None = None,
        *,
        prefix: str | None = None,
        owned: bool = False,
    ) -> None:
        check_solver_input(self, problem, options)
        # The communicator ends with the mesh, which has to outlive PETSc's objects
        self._contact = problem.contact
        self._problem: Any = weakref.ref(problem) if owned else lambda: problem
        self.A = problem.create_matrix() if matrix is None else matrix
        self.b, self.x = problem.create_vector(), problem.create_vector()
        self.snes = PETSc.SNES().create(problem.comm)
        # Errors of callbacks: newer petsc4py raises an error of its own instead
        self._raised: list[ContactError] = []
        self._floor = problem.residual_floor()
        self._scale = problem.create_vector()
        self._scale.set(1.0)
        self._set_callbacks()
        if prefix is None:
            prefix = new_prefix("snes")
        linear = linear_options(problem, options, prefix, snes=True)
        self.options = PetscOptions(
            prefix, {**_defaults(problem, self._floor), **linear, **(options or {})}
        )
        self.options.configure(self.snes)
        # A failure is raised with a message that says more than PETSc's
        self.snes.setErrorIfNotConverged(False)
        with self.options:
            test = _convergence_test(self._problem, self.snes, self._floor)
        self.snes.setConvergenceTest(test)
        attach(self.krylov_solver, problem, self._scale)
        # It changes where SNES solves its systems inexactly
        self._linear_rtol = self.krylov_solver.getTolerances()[0]

    def _set_callbacks(self) -> None:
        """Tell PETSc how to find residual and tangent."""
        # Not self: C would keep it alive in a cycle. Nor objects of PETSc: it loses what
        # these functions drop when it destroys them
        problem_of, raised = self._problem, self._raised
        self.snes.compose(SCALE, self._scale)

        def residual(snes: PETSc.SNES, x: PETSc.Vec, b: PETSc.Vec) -> None:
            try:
                problem_of().F(x, b)
            except ContactError as error:
                raised.append(error)
                raise
            b.pointwiseMult(b, snes.query(SCALE))

        def tangent(snes: PETSc.SNES, x: PETSc.Vec, A: PETSc.Mat, P: PETSc.Mat) -> None:
            take_tangent(problem_of(), x, A, snes.ksp)
            A.diagonalScale(snes.query(SCALE))

        self.snes.setFunction(residual, self.b)
        self.snes.setJacobian(tangent, self.A)

    def __del__(self) -> None:
        contact = self.__dict__.get("_contact")
        comm = None if contact is None else contact.layout.comm
        release(self, comm, "snes", "A", "b", "x", "_scale")

    @property
    def problem(self) -> CoupledProblem:
        """What is solved."""
        found: CoupledProblem = self._problem()
        return found

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

    def take_settings(self, other: NewtonSolver | SNESSolver, times: int) -> None:
        """Take another solver's tolerances and a multiple of its most iterations."""
        self.snes.setTolerances(rtol=other.tolerances[0], max_it=times * other.max_it)
        if other.force_tolerance is not None:
            self.snes.setTolerances(atol=other.force_tolerance)

    @property
    def max_it(self) -> int:
        """Most iterations."""
        most: int = self.snes.getTolerances()[3]
        return most

    def linearise(self, x: PETSc.Vec, springs: Mapping[int, float]) -> None:
        """Take the tangent at x, and springs by row, for `correct`. Collective."""
        self._scale.array[:] = self.problem.row_scale()
        tangent_with(self, x, springs)
        self.A.diagonalScale(self._scale)
        self.krylov_solver.setOperators(self.A)

    def correct(self, b: PETSc.Vec, dx: PETSc.Vec) -> None:
        """Solve tangent dx = b, within ``with solver.options:``. Collective."""
        scaled = b.duplicate()
        scaled.pointwiseMult(b, self._scale)
        solve_closely(self.krylov_solver, scaled, dx, self._linear_rtol)
        scaled.destroy()

    def _settings(self) -> dict[str, Any]:
        """Settings that must be the same on all ranks, or one would stop before the
        others."""
        _, _, _, max_it = self.snes.getTolerances()
        name = type(self).__name__
        return {"solver": name, "tolerances": self.tolerances, "max_it": max_it}

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
        check_unknowns(self.problem, u)
        require_agreement(self.problem.comm, **self._settings())
        x = self.problem.start(self.x)
        self._raised.clear()
        self._scale.array[:] = self.problem.row_scale()
        try:
            with self.options:
                self.snes.solve(None, x)
        except PETSc.Error:
            renew(self.krylov_solver, self.A)
            if not self._raised:
                raise
            raise self._raised[0] from None
        # The last residual may be of a rejected trial step
        self.problem.form(x)
        reason = self.snes.getConvergedReason()
        iterations = self.snes.getIterationNumber()
        if reason == NO_DESCENT and self._is_rounding_error(x):
            reason = PETSc.SNES.ConvergedReason.CONVERGED_FNORM_ABS
            self.snes.setConvergedReason(reason)
        converged = reason > 0
        if not converged:
            renew(self.krylov_solver, self.A)
        require_convergence(
            self.problem,
            converged,
            f"after {iterations} iterations ({reason_in_words(reason)})",
        )
        return iterations, True

    @property
    def force_tolerance(self) -> float | None:
        """`snes_atol` where the user has given one."""
        atol = self.tolerances[1]
        return None if atol == self._floor else atol

    def _is_rounding_error(self, x: PETSc.Vec) -> bool:
        """Whether the residual at x is rounding error, so that no line search finds a
        smaller one. Collective."""
        self.problem.F(x, self.b)
        rtol = self.tolerances[0]
        return self.problem.convergence.reached(rtol, self.force_tolerance, True)

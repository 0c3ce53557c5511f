"""Newton's method on the coupled unknowns: DOLFINx's solver, and PETSc SNES."""

from __future__ import annotations

import itertools
import sys
import warnings
import weakref
from collections.abc import Callable, Mapping
from typing import Any, cast

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from .. import compat
from ..convergence.failure import NOT_A_NUMBER, reason_in_words
from ..convergence.lost_contact import lost_contact
from ..convergence.penetration import warn_of_penetration
from ..errors import (
    ContactError,
    ContactWarning,
    ConvergenceError,
    raise_everywhere,
    require_agreement,
)
from ..host.dropped import agreed_name, put_aside
from ..options.methods import Penalty
from ..problem import CoupledProblem
from .automatic import linear_options
from .elimination import attach
from .petsc_options import PetscOptions, check_solver_input

# Each solver has its own prefix in the PETSc options, or one would set the other's
_counter = itertools.count()

STUCK = PETSc.SNES.ConvergedReason.DIVERGED_LOCAL_MIN
NO_DESCENT = PETSc.SNES.ConvergedReason.DIVERGED_LINE_SEARCH


class _Ended(Exception):
    """Ends a solve of DOLFINx's Newton solver, which offers no other way.

    Attributes
    ----------
    converged
        Whether the solve has converged.
    """

    def __init__(self, converged: bool) -> None:
        self.converged = converged


def _setting(name: str, meaning: str) -> Any:
    """Attribute of a `NewtonSolver` that DOLFINx's solver has."""

    def read(solver: NewtonSolver) -> Any:
        return getattr(solver.newton, name)

    def write(solver: NewtonSolver, value: Any) -> None:
        setattr(solver.newton, name, value)

    return property(read, write, doc=meaning)


class NewtonSolver:
    """DOLFINx's Newton solver on [u, multiplier]. Collective.

    Parameters
    ----------
    problem
        Problem to solve.
    options
        PETSc options of the linear solver, without prefix. The default depends on the
        size, see `solvers.linear_options`.

    Attributes
    ----------
    rtol, atol, max_it, relaxation_parameter, convergence_criterion, report, \
    error_on_nonconvergence
        As in DOLFINx, except for the test that ends a solve. (DOLFINx compares lengths
        and forces with the length of the first increment.) ``rtol`` is relative to the
        forces of each body and each surface of contact. ``atol`` is a force. By default
        it is the rounding error of each body and surface, and a solve ends there only
        once iterations no longer reduce the residual (theory (5.4)).
    newton
        DOLFINx's solver. With the criterion ``"residual"`` its own tolerances are zero.
    options
        `PetscOptions`. To use the KSP by itself, write ``with solver.options:``, which
        puts them into PETSc's table.

    Raises
    ------
    ContactError
        If this DOLFINx no longer has a Newton solver: use `SNESSolver`.
    """

    max_it = _setting("max_it", "Most iterations.")
    relaxation_parameter = _setting("relaxation_parameter", "Factor of a correction.")
    convergence_criterion = _setting(
        "convergence_criterion", '``"residual"`` or ``"incremental"``.'
    )
    report = _setting("report", "Whether DOLFINx's log has each iteration.")
    error_on_nonconvergence = _setting(
        "error_on_nonconvergence", "Whether DOLFINx raises an error of its own."
    )

    def __init__(
        self, problem: CoupledProblem, options: Mapping[str, Any] | None = None
    ) -> None:
        check_solver_input(self, problem, options)
        try:
            self.newton = compat.make_newton_solver(problem.comm)
        except NotImplementedError as error:
            raise ContactError(f"{error} (raymortar.SNESSolver)") from None
        self.problem = problem
        self.A, self.b = problem.create_matrix(), problem.create_vector()
        # Weak, or C++ would keep the solver alive in a cycle that nothing finds
        this = cast("Callable[[], NewtonSolver]", weakref.ref(self))

        def residual(x: PETSc.Vec, b: PETSc.Vec) -> None:
            problem.F(x, b)
            this()._judge()

        def tangent(x: PETSc.Vec, A: PETSc.Mat) -> None:
            if problem.J(x, A):
                renew(this().krylov_solver, A)

        self.newton.setF(residual, self.b)
        self.newton.setJ(tangent, self.A)
        self.newton.set_form(problem.form)
        self._floor = problem.residual_floor()
        self.rtol, self.atol = 1e-10, self._floor
        self.max_it = 25
        self.report = self.error_on_nonconvergence = False
        self._name = agreed_name(problem.comm)
        prefix = f"raymortar_newton_{next(_counter)}_"
        if options is None:
            options = linear_options(problem, None, prefix)
        self.options = PetscOptions(prefix, options)
        self.options.configure(self.krylov_solver)
        attach(self.krylov_solver, problem)

    @property
    def krylov_solver(self) -> PETSc.KSP:
        """The PETSc KSP."""
        return self.newton.krylov_solver

    def __del__(self) -> None:
        kept = self.__dict__
        comm = kept["problem"].comm if "problem" in kept else None
        if "_name" in kept and comm.size > 1 and not sys.is_finalizing():
            put_aside(kept["_name"], comm, kept["newton"])
        _release(self, comm, "newton", "A", "b")

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
        require_agreement(self.problem.comm, **self._settings())
        x = self.problem.start()
        self.newton.rtol, self.newton.atol = self._tolerances_of_dolfinx
        converged, reason = False, ""
        try:
            with self.options:
                iterations, converged = self.newton.solve(x)
            reason = f"after {iterations} iterations"
        except ContactError as error:
            # An iterate is not finite. A start that is not finite is the user's fault
            if not self.problem.history:
                raise
            reason = f"({error})"
        except _Ended as end:
            converged, iterations = end.converged, len(self.problem.history) - 1
            reason = f"after {iterations} iterations, and was stopped"
        finally:
            x.destroy()
            if not converged:
                renew(self.krylov_solver, self.A)
        require_convergence(self.problem, converged, reason)
        return iterations, converged

    @property
    def tolerances(self) -> tuple[float, float]:
        """rtol and atol."""
        return self.rtol, self.atol

    @tolerances.setter
    def tolerances(self, values: tuple[float, float]) -> None:
        self.rtol, self.atol = values

    @property
    def force_tolerance(self) -> float | None:
        """`atol` where the user has given one."""
        return None if self.atol == self._floor else self.atol

    def linearise(self, x: PETSc.Vec, springs: Mapping[int, float]) -> None:
        """Take the tangent at x, and springs by row, for `correct`. Collective."""
        _tangent_with(self, x, springs)
        self.krylov_solver.setOperators(self.A)

    def correct(self, b: PETSc.Vec, dx: PETSc.Vec) -> None:
        """Solve tangent dx = b, within ``with solver.options:``. Collective."""
        self.krylov_solver.solve(b, dx)

    def _settings(self) -> dict[str, Any]:
        """Settings that must be the same on all ranks, or one would stop before the
        others."""
        names = "max_it", "convergence_criterion", "relaxation_parameter"
        settings = {name: getattr(self, name) for name in names}
        return {
            "solver": type(self).__name__,
            "tolerances": self.tolerances,
            **settings,
        }

    @property
    def _tolerances_of_dolfinx(self) -> tuple[float, float]:
        """rtol and atol that DOLFINx takes. It compares lengths, for which a force is
        no tolerance. `_judge` judges residuals, where DOLFINx's norm mixes lengths and
        forces."""
        if self.convergence_criterion == "residual":
            return 0.0, 0.0
        return self.rtol, self.force_tolerance or 0.0

    def _judge(self) -> None:
        """End the solve if the last residual is small enough, or if the solve is
        stuck."""
        if self.convergence_criterion == "residual":
            convergence = self.problem.convergence
            convergence.accept()
            if convergence.reached(self.rtol, self.force_tolerance):
                raise _Ended(converged=True)
            if convergence.is_stuck:
                raise _Ended(converged=False)


def _release(solver: Any, comm: MPI.Comm | None, *names: str) -> None:
    """Drop PETSc objects of a solver that ends, and free them.

    Ranks may do so at different times. On several ranks, the next solver on the mesh
    frees the objects that all ranks have dropped.
    """
    if sys.is_finalizing():
        return
    for name in names:
        solver.__dict__.pop(name, None)
    if comm is None or PETSc.Sys.isFinalized():
        return
    if comm.size == 1:
        compat.destroy_garbage(comm)


def renew(ksp: PETSc.KSP, A: PETSc.Mat) -> None:
    """Drop the factors: after a failure MUMPS refuses to factorise anew, and PETSc
    takes a new pattern for the old one (`Contact.make_room`)."""
    ksp.reset()
    ksp.setOperators(A)


def _tangent_with(solver: Any, x: PETSc.Vec, springs: Mapping[int, float]) -> None:
    """Tangent at x with springs on its diagonal, those of this rank. Collective."""
    A = solver.A
    if solver.problem.J(x, A):
        renew(solver.krylov_solver, A)
    for row, stiffness in springs.items():
        A.setValue(row, row, stiffness, addv=PETSc.InsertMode.ADD_VALUES)
    A.assemble()


def require_convergence(problem: CoupledProblem, converged: bool, reason: str) -> None:
    """Raise on every rank if a solve has failed; warn if its result is doubtful."""
    if not converged:
        message = f"Newton did not converge {reason}: {problem.describe()}"
        raise_everywhere(problem.comm, message, ConvergenceError)
    warn_of_penetration(problem.contact)
    loss = lost_contact(problem) if problem.tells_of_loss else None
    if loss is not None:
        warnings.warn(
            f"converged, but contact is lost: {loss}. Take smaller steps",
            ContactWarning,
            stacklevel=3,
        )


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
    rounding error.
    """
    reasons = PETSc.SNES.ConvergedReason
    options = PETSc.Options(snes.getOptionsPrefix())
    divergence = options.getReal("snes_divergence_tolerance", -1.0)

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
            prefix = f"raymortar_snes_{next(_counter)}_"
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
        # SNES changes it if it solves its systems inexactly
        self._linear_rtol = self.krylov_solver.getTolerances()[0]

    def _set_callbacks(self) -> None:
        """Tell PETSc how to find residual and tangent."""
        # Not self: C would keep it alive in a cycle
        problem_of, raised, scale = self._problem, self._raised, self._scale

        def residual(snes: PETSc.SNES, x: PETSc.Vec, b: PETSc.Vec) -> None:
            try:
                problem_of().F(x, b)
            except ContactError as error:
                raised.append(error)
                raise
            b.pointwiseMult(b, scale)

        def tangent(snes: PETSc.SNES, x: PETSc.Vec, A: PETSc.Mat, P: PETSc.Mat) -> None:
            if problem_of().J(x, A):
                renew(snes.ksp, A)
            A.diagonalScale(scale)

        self.snes.setFunction(residual, self.b)
        self.snes.setJacobian(tangent, self.A)

    def __del__(self) -> None:
        contact = self.__dict__.get("_contact")
        comm = None if contact is None else contact.layout.comm
        _release(self, comm, "snes", "A", "b", "x", "_scale")

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
        _tangent_with(self, x, springs)
        self.A.diagonalScale(self._scale)
        self.krylov_solver.setOperators(self.A)

    def correct(self, b: PETSc.Vec, dx: PETSc.Vec) -> None:
        """Solve tangent dx = b, within ``with solver.options:``. Collective."""
        scaled = b.duplicate()
        scaled.pointwiseMult(b, self._scale)
        self.krylov_solver.setTolerances(rtol=self._linear_rtol)
        self.krylov_solver.solve(scaled, dx)
        scaled.destroy()

    def _settings(self) -> dict[str, Any]:
        """What all ranks must have alike: one that stops sooner leaves the others."""
        _, _, _, max_it = self.snes.getTolerances()
        name = type(self).__name__
        return {"solver": name, "tolerances": self.tolerances, "max_it": max_it}

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
        require_agreement(self.problem.comm, **self._settings())
        x = self.problem.start(self.x)
        self._raised.clear()
        self._scale.array[:] = self.problem.row_scale()
        try:
            with self.options:
                self.snes.solve(None, x)
        except PETSc.Error:
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

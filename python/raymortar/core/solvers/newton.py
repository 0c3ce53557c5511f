"""Newton's method on the coupled unknowns, by DOLFINx's solver and by PETSc's SNES."""

from __future__ import annotations

import sys
import weakref
from collections.abc import Callable, Mapping
from typing import Any, cast

from petsc4py import PETSc

import numpy as np

from .. import compat
from ..discretization.ranks import agreed_name, put_aside
from ..errors import ContactError, NotFinite
from ..hooks import hooks
from ..options.methods import Penalty
from ..problem import CoupledProblem
from .convergence_test import convergence_test
from .petsc_objects import (
    DIRECT,
    NOT_A_NUMBER,
    make_regular,
    new_prefix,
    raising,
    take_tangent,
)
from .solver import MAX_IT, CoupledSolver, forwarded


class _Ended(Exception):
    """Ends a solve of DOLFINx's Newton solver, which offers no other way."""


class NewtonSolver(CoupledSolver):
    """DOLFINx's Newton solver on [u, multiplier]. Collective.

    Parameters
    ----------
    problem
        Problem to solve.
    options
        PETSc options of the linear solver, without prefix. The default depends on the
        size, see `solvers.iterative`.

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

    newton: Any
    rtol: float
    atol: float
    max_it = forwarded("newton", "max_it", "Most iterations.")
    relaxation_parameter = forwarded(
        "newton", "relaxation_parameter", "Factor of a correction."
    )
    convergence_criterion = forwarded(
        "newton", "convergence_criterion", '``"residual"`` or ``"incremental"``.'
    )
    report = forwarded("newton", "report", "Whether DOLFINx's log has each iteration.")
    error_on_nonconvergence = forwarded(
        "newton",
        "error_on_nonconvergence",
        "Whether DOLFINx raises an error of its own.",
    )

    def __init__(
        self, problem: CoupledProblem, options: Mapping[str, Any] | None = None
    ) -> None:
        super().__init__(problem, options)
        try:
            self.newton = compat.make_newton_solver(problem.comm)
        except NotImplementedError as error:
            raise ContactError(f"{error} (raymortar.SNESSolver)") from None
        self.krylov_solver = self.newton.krylov_solver
        # Weak, or C++ would keep the solver alive in a cycle that nothing finds
        this = cast("Callable[[], NewtonSolver]", weakref.ref(self))

        def residual(x: PETSc.Vec, b: PETSc.Vec) -> None:
            problem.F(x, b)
            this()._judge(x, b)

        def tangent(x: PETSc.Vec, A: PETSc.Mat) -> None:
            take_tangent(problem, x, A, this().krylov_solver)

        self.newton.setF(residual, self.b)
        self.newton.setJ(tangent, self.A)

        def form(x: PETSc.Vec) -> None:
            if this().raised:  # x is no number
                raise _Ended(False)
            problem.form(x)

        self.newton.set_form(form)
        self.rtol, self.atol = 1e-10, self._floor
        self.max_it = MAX_IT
        self.report = self.error_on_nonconvergence = False
        self._name = agreed_name(problem.comm)
        prefix = new_prefix("newton")
        by_user = options or ()
        if options is None:
            options = _linear_solver(problem, None, prefix, False)
        self._configure(self.krylov_solver, prefix, options, by_user)

    def __del__(self) -> None:
        if "_name" in self.__dict__ and not sys.is_finalizing():
            comm = self._contact.layout.comm
            if comm.size > 1:
                put_aside(self._name, comm, self.newton)
        super().__del__()

    @property
    def tolerances(self) -> tuple[float, float]:
        """rtol and atol."""
        return self.rtol, self.atol

    @tolerances.setter
    def tolerances(self, values: tuple[float, float]) -> None:
        self.rtol, self.atol = values

    def _settings(self) -> dict[str, Any]:
        names = "max_it", "convergence_criterion", "relaxation_parameter"
        return {name: getattr(self, name) for name in names}

    def _iterate(self, x: PETSc.Vec) -> tuple[int, str | None]:
        newton, history = self.newton, self.problem.history
        # DOLFINx compares lengths, for which a force is no tolerance
        newton.rtol, newton.atol = self.rtol, self.force_tolerance or 0.0
        if self.convergence_criterion == "residual":
            newton.rtol = newton.atol = 0.0
        with raising(self.raised):
            try:
                iterations, converged = newton.solve(x)
                return iterations, None if converged else ""
            except NotFinite as error:
                # A start that is not finite is the user's fault
                if not history:
                    raise
                return len(history), f" ({error})"
            except _Ended as end:
                return len(history) - 1, None if end.args[0] else ", and was stopped"
        raise AssertionError("an error is raised at the end of the block")

    def _judge(self, x: PETSc.Vec, b: PETSc.Vec) -> None:
        """End the solve if the last residual is small enough, or if it is stuck.

        DOLFINx's own norm mixes lengths and forces.
        """
        if self.convergence_criterion == "residual":
            if self.on_iterate is not None:
                self.on_iterate(x, b)
            convergence = self.problem.convergence
            convergence.accept()
            has_converged = convergence.reached(self.rtol, self.force_tolerance)
            if has_converged or convergence.is_stuck:
                raise _Ended(has_converged)


# Name by which a SNES has the factors of its rows
SCALE = "raymortar_row_scale"
NO_DESCENT = PETSc.SNES.ConvergedReason.DIVERGED_LINE_SEARCH


def _linear_solver(
    problem: CoupledProblem, given: Mapping[str, Any] | None, prefix: str, snes: bool
) -> Mapping[str, Any]:
    """PETSc options of the linear solver of a problem, see `Hooks.linear_solver`.
    Collective."""
    if hooks.linear_solver is None:
        return DIRECT
    return hooks.linear_solver(problem, given, prefix, snes)


def _defaults(problem: CoupledProblem, floor: float) -> dict[str, Any]:
    """Make options of SNES, without those of the linear solver."""
    # With springs, full steps cycle where points close and slip in the same large step;
    # with multipliers full steps are best (docs/measured/solving.md)
    springs = any(
        isinstance(contact.method, Penalty) and contact.friction is not None
        for contact in problem.contact.contacts
    )
    return {
        "snes_type": "newtonls",
        "snes_linesearch_type": "bt" if springs else "basic",
        # Of PETSc 3.23 and later 1e-15 in "l2": the square of a force, in any unit
        "snes_linesearch_atol": 0.0,
        "snes_rtol": 1e-10,
        "snes_atol": floor,
        "snes_stol": 0.0,
        "snes_max_it": MAX_IT,
    }


class SNESSolver(CoupledSolver):
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
        depends on the size, see `solvers.iterative`.
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

    snes: PETSc.SNES
    x: PETSc.Vec

    def __init__(
        self,
        problem: CoupledProblem,
        options: Mapping[str, Any] | None = None,
        matrix: PETSc.Mat | None = None,
        *,
        prefix: str | None = None,
        owned: bool = False,
    ) -> None:
        super().__init__(problem, options, matrix, owned)
        self.x, self.scale = problem.create_vector(), problem.create_vector()
        self.scale.set(1.0)
        self.snes = PETSc.SNES().create(problem.comm)
        self.krylov_solver = self.snes.ksp
        self._set_callbacks()
        prefix = new_prefix("snes") if prefix is None else prefix
        options = options or {}
        linear = _linear_solver(problem, options, prefix, True)
        given = {**_defaults(problem, self._floor), **linear, **options}
        self._configure(self.snes, prefix, given, options)
        # A failure is raised with a message that says more than PETSc's
        self.snes.setErrorIfNotConverged(False)
        with self.options:
            corrected = weakref.WeakMethod(self._corrected)
            test = convergence_test(self._problem, corrected, self.snes, self._floor)
        self.snes.setConvergenceTest(test)

    def _set_callbacks(self) -> None:
        """Tell PETSc how to find residual and tangent."""
        # Not self: C would keep it alive in a cycle. Nor objects of PETSc: it loses what
        # these functions drop when it destroys them
        problem_of, raised = self._problem, self.raised
        self.snes.compose(SCALE, self.scale)

        # Errors never leave through PETSc, which would keep vectors locked and its stack
        # of calls as it was: they end the solve as a residual that is no number, and are
        # raised after it
        def residual(snes: PETSc.SNES, x: PETSc.Vec, b: PETSc.Vec) -> None:
            try:
                if not raised:
                    problem_of().F(x, b)
            except Exception as error:
                raised.append(error)
            if raised:
                b.set(np.nan)
            else:
                b.pointwiseMult(b, snes.query(SCALE))

        def tangent(snes: PETSc.SNES, x: PETSc.Vec, A: PETSc.Mat, P: PETSc.Mat) -> None:
            try:
                take_tangent(problem_of(), x, A, snes.ksp)
            except Exception as error:
                raised.append(error)
                make_regular(A)
            else:
                A.diagonalScale(snes.query(SCALE))

        self.snes.setFunction(residual, self.b)
        self.snes.setJacobian(tangent, self.A)

    @property
    def tolerances(self) -> tuple[float, float]:
        """rtol and atol."""
        rtol, atol = self.snes.getTolerances()[:2]
        return rtol, atol

    @tolerances.setter
    def tolerances(self, values: tuple[float, float]) -> None:
        self.snes.setTolerances(rtol=values[0], atol=values[1])

    @property
    def max_it(self) -> int:
        """Largest number of iterations."""
        return int(self.snes.getTolerances()[3])

    @max_it.setter
    def max_it(self, value: int) -> None:
        self.snes.setTolerances(max_it=value)

    @property
    def finds_no_descent(self) -> bool:
        """Whether the last solve ended because a line search found no smaller
        residual."""
        return bool(self.snes.getConvergedReason() == NO_DESCENT)

    def _corrected(self) -> bool:
        """Let the iterate be corrected; return False after an error, which does not
        leave through PETSc but is raised after the solve. Collective."""
        try:
            if self.on_iterate is not None:
                self.on_iterate(self.snes.getSolution(), self.snes.getFunction()[0])
        except Exception as error:
            self.raised.append(error)
        return not self.raised

    def _settings(self) -> dict[str, Any]:
        return {"max_it": self.max_it}

    def _iterate(self, x: PETSc.Vec) -> tuple[int, str | None]:
        snes = self.snes
        x.copy(self.x)
        self.weigh_rows()
        with raising(self.raised):
            snes.solve(None, self.x)
        # The last residual may be of a rejected trial step
        self.problem.form(self.x)
        reason = snes.getConvergedReason()
        if reason == NO_DESCENT:
            # No line search reduces a residual that is rounding error
            self.problem.F(self.x, self.b)
            limits = self.tolerances[0], self.force_tolerance
            if self.problem.convergence.reached(*limits, at_once=True):
                reason = PETSc.SNES.ConvergedReason.CONVERGED_FNORM_ABS
                snes.setConvergedReason(reason)
        failed = None if reason > 0 else f" ({hooks.reason(reason)})"
        return snes.getIterationNumber(), failed

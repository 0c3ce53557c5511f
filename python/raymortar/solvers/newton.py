"""Newton's method on the coupled unknowns by DOLFINx's solver."""

from __future__ import annotations

import sys
import weakref
from collections.abc import Callable, Mapping
from typing import Any, cast

from petsc4py import PETSc

from .. import compat
from ..discretization.ranks import agreed_name, put_aside
from ..errors import ContactError
from ..problem import CoupledProblem
from .automatic import linear_options
from .petsc_objects import new_prefix, take_tangent
from .solver import MAX_IT, CoupledSolver


class _Ended(Exception):
    """Ends a solve of DOLFINx's Newton solver, which offers no other way."""


def _setting(name: str, meaning: str) -> Any:
    """Make an attribute of a `NewtonSolver` from one of DOLFINx's solver."""
    return property(
        lambda solver: getattr(solver.newton, name),
        lambda solver, value: setattr(solver.newton, name, value),
        doc=meaning,
    )


class NewtonSolver(CoupledSolver):
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

    newton: Any
    rtol: float
    atol: float
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
            this()._judge()

        def tangent(x: PETSc.Vec, A: PETSc.Mat) -> None:
            take_tangent(problem, x, A, this().krylov_solver)

        self.newton.setF(residual, self.b)
        self.newton.setJ(tangent, self.A)
        self.newton.set_form(problem.form)
        self.rtol, self.atol = 1e-10, self._floor
        self.max_it = MAX_IT
        self.report = self.error_on_nonconvergence = False
        self._name = agreed_name(problem.comm)
        prefix = new_prefix("newton")
        by_user = sorted(options or ())
        if options is None:
            options = linear_options(problem, None, prefix)
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
        try:
            iterations, converged = newton.solve(x)
            return iterations, None if converged else ""
        except ContactError as error:
            # An iterate is not finite. A start that is not finite is the user's fault
            if not history:
                raise
            return len(history), f" ({error})"
        except _Ended as end:
            return len(history) - 1, None if end.args[0] else ", and was stopped"

    def _judge(self) -> None:
        """End the solve if the last residual is small enough, or if it is stuck.

        DOLFINx's own norm mixes lengths and forces.
        """
        if self.convergence_criterion == "residual":
            convergence = self.problem.convergence
            convergence.accept()
            has_converged = convergence.reached(self.rtol, self.force_tolerance)
            if has_converged or convergence.is_stuck:
                raise _Ended(has_converged)

"""Newton's method on the coupled unknowns by DOLFINx's solver."""

from __future__ import annotations

import sys
import weakref
from collections.abc import Callable, Mapping
from typing import Any, cast

from petsc4py import PETSc

from .. import compat
from ..diagnose.outcome import require_convergence
from ..errors import ContactError, require_agreement
from ..host.dropped import agreed_name, put_aside
from ..problem import CoupledProblem
from .automatic import linear_options
from .elimination import attach
from .petsc_objects import (
    new_prefix,
    release,
    renew,
    solve_closely,
    take_tangent,
    tangent_with,
)
from .petsc_options import PetscOptions, check_solver_input, check_unknowns


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
            take_tangent(problem, x, A, this().krylov_solver)

        self.newton.setF(residual, self.b)
        self.newton.setJ(tangent, self.A)
        self.newton.set_form(problem.form)
        self._floor = problem.residual_floor()
        self.rtol, self.atol = 1e-10, self._floor
        self.max_it = 25
        self.report = self.error_on_nonconvergence = False
        self._name = agreed_name(problem.comm)
        prefix = new_prefix("newton")
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
        release(self, comm, "newton", "A", "b")

    def solve(self, u: Any = None) -> tuple[int, bool]:
        """Solve from the present u and multiplier, as `SNESSolver.solve`. A failure has
        no reason of PETSc's."""
        check_unknowns(self.problem, u)
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
        tangent_with(self, x, springs)
        self.krylov_solver.setOperators(self.A)

    def correct(self, b: PETSc.Vec, dx: PETSc.Vec) -> None:
        """Solve tangent dx = b, within ``with solver.options:``. Collective."""
        ksp = self.krylov_solver
        solve_closely(ksp, b, dx, ksp.getTolerances()[0])

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

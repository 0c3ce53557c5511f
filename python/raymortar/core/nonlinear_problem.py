"""Contact as a nonlinear problem that is solved as DOLFINx's own are."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

from petsc4py import PETSc

from .contact import Contact
from .errors import ContactError, ConvergenceError, require_agreement, together, warn
from .finding import Finding
from .hooks import hooks
from .problem import CoupledProblem
from .solvers.newton import SNESSolver
from .terms import Addition

# PETSc's option of that name
ERROR = "snes_error_if_not_converged"


class NonlinearProblem(CoupledProblem):
    """Solves F(u; v) + contact = 0, like DOLFINx's class of this name from 0.10 on.

    ``solve()`` solves by PETSc's SNES, which is made when it is first needed:
    ``solver``, ``A``, ``b`` and ``x`` are its objects. `SNESSolver` and `NewtonSolver`
    solve the problem too, with options of their own. Collective.

    Parameters
    ----------
    F
        UFL residual of everything but contact: a linear form in the test function of
        the displacement's space, or of the mixed space that it is a part of. Of several
        unknowns a list, by unknown.
    contact
        Contact terms; of several interactions a list, each with its own method, law and
        search, all of the same displacement. Fluxes (`Flux`) and ties of fields
        (`FieldTie`) may be among them.
    bcs
        Dirichlet conditions on the unknowns, or on parts of them.
    J
        UFL Jacobian of F; by default its derivative. Of several unknowns a list of
        lists, by test and trial space, None for zero.
    u
        Unknowns, if F is a list: Functions, of which the contact's displacement is one,
        or a part of one.
    petsc_options
        Options of SNES and of what it holds, without prefix, which complete the
        defaults: see `SNESSolver`. A `solve` that does not converge raises an error, or
        warns with ``"snes_error_if_not_converged": False``.
    petsc_options_prefix
        Prefix of these options on the command line, and of ``A``, ``b`` and ``x``,
        usually ending in ``_``; None: one that no other solver has.
    form_compiler_options, jit_options
        Options for the forms of F and J, as for ``dolfinx.fem.form``.
    update
        Function without argument that sets coefficients of F and J, such as stresses
        and tangents at quadrature points, from the present unknowns. Every rank calls
        it once for each iterate, before residual and tangent are assembled, and when
        the problem is made. Give J, as UFL does not see how coefficients change. An
        error in it is raised on all ranks; `ConvergenceError` lets `LoadSteps` take a
        smaller step. No part of F then counts as linear.
    constraints
        Linear constraints between unknowns, as of periodic cells: a finalized
        ``dolfinx_mpc.MultiPointConstraint``, or a sparse matrix T over the dofs of the
        displacement, u = T u, in DOLFINx's order. Rows of slaves have the coefficients
        of their masters, the others are rows of the identity. Slave nodes of contact that are slaves of constraints need
        masters that are slave nodes of the same contact.

    Attributes
    ----------
    contact
        The contact, or `interactions.Interactions` of several.
    history
        Norms of the forces of the residuals since `start`, without constrained rows.
    forms
        UFL residual and Jacobian of the volume, as lists where there are several.
    volume
        Assembles the compiled forms `L` and `a`. ``volume.is_linear``: whether the
        tangent is kept.
    convergence
        Judges the last residual; see `convergence.Convergence`.
    steps_accepted
        Load steps so far, of all `LoadSteps` of the problem.

    Notes
    -----
    One contact may belong to several problems, of which the first sets the automatic
    gamma, and one problem to several solvers. All problems of a contact have the same
    contacts.

    Constrained rows are rows of the identity. A Dirichlet increment is lifted for volume
    and contact alike, so that the first iterate of a large prescribed step accounts for
    contact.

    Here ``F`` and ``J`` are functions that assemble residual and tangent. The compiled
    forms, which DOLFINx calls ``F`` and ``J``, are ``L`` and ``a``.
    """

    def __init__(
        self,
        F: Any,
        contact: Contact | Sequence[Contact | Addition],
        bcs: Sequence[Any] = (),
        J: Any = None,
        u: Any = None,
        petsc_options: Mapping[str, Any] | None = None,
        petsc_options_prefix: str | None = None,
        form_compiler_options: Mapping[str, Any] | None = None,
        jit_options: Mapping[str, Any] | None = None,
        update: Callable[[], object] | None = None,
        constraints: Any = None,
    ) -> None:
        forms = form_compiler_options, jit_options
        super().__init__(F, contact, bcs, J, u, *forms, update, constraints)
        with together(self.comm):
            _check(petsc_options, petsc_options_prefix)
        self._petsc_options = None if petsc_options is None else dict(petsc_options)
        require_agreement(self.comm, petsc_options_prefix=petsc_options_prefix)
        self._prefix = petsc_options_prefix

    @cached_property
    def snes_solver(self) -> SNESSolver:
        """Solver that `solve` uses, for `LoadSteps`. It does not keep the problem
        alive. Collective."""
        prefix = self._prefix
        own = SNESSolver(self, self._petsc_options, prefix=prefix, owned=True)
        if prefix is not None:
            for name in ("A", "b", "x"):
                getattr(own, name).setOptionsPrefix(f"{prefix}{name}_")
        return own

    def solve(self) -> Any:
        """Solve from the present u and multiplier.

        With friction, or if the next load continues from this one, accept the solution
        by ``contact.advance()``.

        Returns
        -------
        u
            The Function that is solved for, of several unknowns a list.

        Raises
        ------
        ConvergenceError
            With PETSc's reason, pairs, active points, gaps and residual history. With
            ``"snes_error_if_not_converged": False`` that is a `ContactWarning`, and
            ``solver.getConvergedReason()`` is negative.
        """
        own = self.snes_solver
        try:
            own.solve()
        except ConvergenceError as failure:
            # Failures are errors unless the options say otherwise
            with own.options:
                if PETSc.Options(own.options.prefix).getBool(ERROR, True):
                    raise
            warn(str(failure), page="")
        return self.u

    def check(self) -> list[Finding]:
        """Find what is doubtful about the present state, after a solve.

        Returns
        -------
        findings
            Of all sizes, each with pair, place and remedy; solves warn of those only
            that make figures wrong by more than 10 %. Empty if there is no doubt.

        Raises
        ------
        ContactError
            If nothing has been solved yet. Collective.
        """
        for part in self.contact.parts:
            part.present.require_results()
        return hooks.check(self)

    def describe(self) -> str:
        """State of contact and residual history, for messages. Collective."""
        return hooks.describe(self)

    @property
    def solver(self) -> PETSc.SNES:
        """The petsc4py SNES. Collective."""
        return self.snes_solver.snes

    @property
    def A(self) -> PETSc.Mat:
        """Tangent over [u, multiplier / gamma], its rows weighed. Collective."""
        return self.snes_solver.A

    @property
    def b(self) -> PETSc.Vec:
        """Residual, its rows weighed as those of ``A``. Collective."""
        return self.snes_solver.b

    @property
    def x(self) -> PETSc.Vec:
        """Unknowns [u, multiplier / gamma] of the last `solve`. Collective."""
        return self.snes_solver.x


def _check(options: Any, prefix: Any) -> None:
    """Raise for no options by name; whether these are such the solver checks."""
    if prefix is not None and not (isinstance(prefix, str) and prefix):
        raise ContactError(
            f"petsc_options_prefix must be a text that is not empty, not {prefix!r}"
        )
    if options is not None and not isinstance(options, Mapping):
        raise ContactError(
            f"petsc_options must be PETSc options by name, not {options!r}"
        )

"""Problems of fields alone, with fluxes and ties between bodies that stay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property, partial
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
from dolfinx.fem import Function

from ..core import compat
from ..core.convergence.balance import EPS
from ..core.discretization.forms import (
    derivative,
    extended,
    find_unknowns,
    list_of_conditions,
)
from ..core.discretization.layout import CoupledRows
from ..core.discretization.unknowns import Unknowns
from ..core.errors import ContactError, ConvergenceError, described, of_type, together
from ..core.solvers.petsc_objects import make_regular, new_prefix, raising
from ..core.system.volume import Forms
from ..core.terms import apart, require_apart
from ..entries import row_sums
from ..solvers.inner import kept_inside
from ..solvers.linear import direct
from ..solvers.settings import WatchedOptions, reason_in_words
from .field_tie import FieldTie
from .flux import Flux
from .flux_terms import FluxTerms

# Defaults of PETSc's options
OPTIONS = {
    "snes_type": "newtonls",
    "snes_linesearch_type": "basic",
    "snes_rtol": 1e-10,
    "snes_max_it": 50,
    # Full steps may first take residuals up by any factor, as fourth powers of radiation
    "snes_divergence_tolerance": 1e300,
    **direct(),
}
# Remedies by the reason why a solve has ended
_REMEDIES = {
    "MAX_IT": "a start nearer to the answer, a larger snes_max_it, or "
    'petsc_options={"snes_linesearch_type": "bt"}',
    "LINE_SEARCH": 'full steps, which are the default (snes_linesearch_type "basic")',
    "DTOL": "snes_divergence_tolerance as it is by default, which stops no solve",
    "LINEAR_SOLVE": "a condition, or a flux that is not zero, for each body: without one "
    "a field has no level",
}
_OTHERWISE = "a start nearer to the answer"
# Rounding error of a residual, over the sum of its terms
_NOTHING = 64.0 * EPS


class FieldProblem:
    """F(T; s) + fluxes + ties = 0 for fields on bodies at rest. Collective.

    It is a `NonlinearProblem` without a displacement among its unknowns: fluxes go
    through contacts whose displacement and multiplier are known, from an earlier solve
    or as they were set.

    Parameters
    ----------
    F
        UFL residual of the field, without fluxes and ties. Of several fields, or bodies
        on meshes of their own, a list.
    u
        Unknown: a Function, or a list of them if F is a list.
    terms
        `Flux`, `FieldTie`, or a list of them.
    bcs
        Dirichlet conditions on the fields.
    J
        UFL Jacobian of F; by default its derivative. Of several fields a list of lists.
    petsc_options
        Options of SNES, which complete the defaults: Newton's method with full steps,
        and a direct solver.
    form_compiler_options, jit_options
        Options for the forms of F and J, as for ``dolfinx.fem.form``.

    Attributes
    ----------
    unknowns, layout
        Unknowns, multipliers of ties included, and their rows.
    iterations
        Newton iterations of the last `solve`.

    Raises
    ------
    ContactError
        For input that cannot work, on every rank alike.

    Examples
    --------
    >>> contact = raymortar.Contact(u, facet_tags, pairs)  # u: zero, or of a solve before
    >>> flux = raymortar.fluxes.Flux(contact, T, conductance)
    >>> raymortar.fluxes.FieldProblem(F, T, flux, bcs).solve()
    """

    def __init__(
        self,
        F: Any,
        u: Function | Sequence[Function],
        terms: Flux | FieldTie | Sequence[Flux | FieldTie],
        bcs: Sequence[Any] = (),
        J: Any = None,
        petsc_options: Mapping[str, Any] | None = None,
        form_compiler_options: Mapping[str, Any] | None = None,
        jit_options: Mapping[str, Any] | None = None,
    ) -> None:
        functions = list(u) if isinstance(u, (list, tuple)) else [u]
        for f in functions:
            of_type("u", f, Function, "a Function")
        self.comm = functions[0].function_space.mesh.comm
        with together(self.comm):
            others, given = apart(terms)
            if others or not given:
                raise ContactError(
                    "FieldProblem takes F, u, terms, bcs in this order: terms must be a "
                    f"Flux, a FieldTie or a list of them, not {described(terms)}"
                )
            require_apart(given)
            self.bcs = list_of_conditions(bcs)
            self.unknowns = Unknowns(functions[0])
            several = isinstance(F, (list, tuple))
            forms = list(F) if several else [F]
            table = J if several or J is None else [[J]]
            find_unknowns(forms, table, functions, self.unknowns)
            if J is None:
                table = [[derivative(form, f) for f in functions] for form in forms]
        self.terms, self._fluxes = given, FluxTerms(given, moves=False)
        own = list(self._fluxes.functions)
        self.unknowns.solve_for([*functions, *own], False)
        with together(self.comm):
            self.unknowns.conditions(self.bcs)  # refuses foreign ones
        self.layout = CoupledRows(self.unknowns, [])
        self.zones: list[Any] = []
        self._fluxes.start(self)
        compiled = partial(
            compat.form,
            form_compiler_options=form_compiler_options,
            jit_options=jit_options,
        )
        if several or own:
            full = extended(forms, table, len(own))
            self.L, self.a = compiled(full[0]), compiled(full[1])
        else:
            self.L, self.a = compiled(forms[0]), compiled(table[0][0])
        self._forms = Forms(self, self.L, self.a)
        given_options = {**OPTIONS, **(petsc_options or {})}
        self._options = WatchedOptions(
            new_prefix("field"), given_options, sorted(petsc_options or {})
        )
        self._sums = row_sums(self.a, self.layout)
        self.raised: list[Exception] = []  # in a solve, see `kept_inside`
        self._fluxes.choose_scales(self._sums)
        self.iterations = 0

    def __repr__(self) -> str:
        names = ", ".join(repr(f.name) for f in self.unknowns.functions)
        return f"<FieldProblem for {names}, {self.layout.size_global} unknowns, {self.terms}>"

    # Equations

    def create_vector(self) -> PETSc.Vec:
        """Vector of the unknowns: the fields, then the multipliers of ties."""
        return self.layout.create_vector()

    def create_matrix(self) -> PETSc.Mat:
        """Matrix of the unknowns, which takes new entries where fluxes need them."""
        A = self.layout.create_matrix()
        A.setPreallocationNNZ((64, 32))
        A.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
        return A

    def F(self, x: PETSc.Vec, b: PETSc.Vec) -> None:
        """Residual at x into b. Collective."""
        self.layout.from_vector(x, [])
        lacking = self.unknowns.lacking(self.bcs)
        rows = self._forms.residual(self.bcs, lacking.increment)
        rows += self._fluxes.residual(self.bcs, lacking)
        b.array[:] = np.where(lacking.fixed, -lacking.owned, rows)

    def J(self, x: PETSc.Vec, A: PETSc.Mat) -> None:
        """Tangent at x into A. Collective."""
        self.layout.from_vector(x, [])
        A.zeroEntries()
        fixed = self.unknowns.owned_prescribed(self.bcs)
        self._forms.add_tangent(A, self.bcs, fixed)
        A.assemble(PETSc.Mat.AssemblyType.FLUSH)
        self._fluxes.add_tangent(A, self.bcs)
        A.assemble()

    # Solving

    @cached_property
    def solver(self) -> PETSc.SNES:
        """PETSc's SNES that `solve` uses. Collective."""
        snes = PETSc.SNES().create(self.comm)
        snes.setOptionsPrefix(self._options.prefix)
        snes.setFunction(self._residual, self.create_vector())
        snes.setJacobian(self._tangent, self.create_matrix())
        with self._options:
            snes.setFromOptions()
        return snes

    def attach(self, snes: PETSc.SNES) -> None:
        """Give a PETSc SNES residual and tangent of this problem. Collective."""
        snes.setFunction(lambda _, x, b: self.F(x, b), self.create_vector())
        A = self.create_matrix()
        snes.setJacobian(lambda _, x, J, P: self.J(x, P), A)

    # PETSc puts its errors in place of ours: these end the solve, by a residual
    # that is no number, and are raised after it

    @kept_inside
    def _residual(self, snes: PETSc.SNES, x: PETSc.Vec, b: PETSc.Vec) -> None:
        self.F(x, b)

    def _tangent(
        self, snes: PETSc.SNES, x: PETSc.Vec, J: PETSc.Mat, P: PETSc.Mat
    ) -> None:
        try:
            self.J(x, P)
        except Exception as error:
            self.raised.append(error)
            make_regular(P)

    def update(self) -> None:
        """Pair the contacts of the fluxes at their present displacement. Collective."""
        contacts = {id(t.contact): t.contact for t in self.terms if isinstance(t, Flux)}
        for contact in contacts.values():
            if contact.gamma is None:
                contact.set_gamma(1.0)  # no results depend on it
            contact.update()

    def solve(self) -> Any:
        """Solve from the present fields.

        Returns
        -------
        The unknowns: a list of Functions.

        Raises
        ------
        ConvergenceError
            With PETSc's reason.
        """
        self.update()
        x = self.create_vector()
        self.layout.to_vector(x, [])
        snes = self.solver
        snes.setTolerances(atol=self._nothing())
        with self._options, raising(self.raised):
            snes.solve(None, x)
        self.layout.from_vector(x, [])
        self.iterations, reason = snes.getIterationNumber(), snes.getConvergedReason()
        norm = snes.getFunctionNorm()
        x.destroy()
        if self.iterations > 0:
            self._options.tell_unread()
        if reason < 0:
            reasons = PETSc.SNES.ConvergedReason
            found = {getattr(reasons, f"DIVERGED_{k}"): v for k, v in _REMEDIES.items()}
            raise ConvergenceError(
                f"FieldProblem has not converged after {self.iterations} iterations "
                f"({reason_in_words(reason)}), residual {norm:.3e}. Try "
                f"{found.get(reason, _OTHERWISE)}"
            )
        return self.unknowns.functions

    def _nothing(self) -> float:
        """Norm of a residual that is rounding error. Collective."""
        _, values = self.unknowns.prescribed(self.bcs)
        sizes = np.abs([self.unknowns.values(), values])
        largest = self.comm.allreduce(float(sizes.max(initial=0.0)), op=MPI.MAX)
        terms = self.comm.allreduce(float(self._sums @ self._sums))
        return float(_NOTHING * largest * np.sqrt(terms))

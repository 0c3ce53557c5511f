"""The coupled nonlinear problem: a user's UFL residual plus contact."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import numpy.typing as npt
import ufl

from . import compat
from .compat import Array
from .contact import Contact, one_or_several
from .convergence.convergence import Convergence
from .discretization.forms import extended, find_unknowns, jacobians, list_of_conditions
from .errors import (
    ContactError,
    SetUpError,
    raise_everywhere,
    require_agreement,
    together,
)
from .hooks import hooks
from .residual import assemble_residual
from .system.groups import groups_of
from .system.volume import Updated, Volume
from .terms import (
    Addition,
    Term,
    added_sizes,
    apart,
    inertia_of,
    is_linear,
    kept_with,
    require_apart,
    terms_of,
)


class CoupledProblem:
    """Residual and tangent of F(u; v) + contact = 0, for any solver. Collective.

    Arguments are those of `NonlinearProblem`, which is such a problem with a solver of its
    own, and so are `contact`, `history`, `forms`, `volume`, `convergence` and
    `steps_accepted`.

    Attributes
    ----------
    terms
        Terms of the equations beside forms and contact.
    constraints
        Unknowns that are combinations of others; None: there are none.
    tangents, solves
        Tangents and nonlinear solves so far, those of failed solves included.
    """

    def __init__(
        self,
        F: Any,
        contact: Contact | Sequence[Contact | Addition],
        bcs: Sequence[Any] = (),
        J: Any = None,
        u: Any = None,
        form_compiler_options: Mapping[str, Any] | None = None,
        jit_options: Mapping[str, Any] | None = None,
        update: Callable[[], object] | None = None,
        constraints: Any = None,
    ) -> None:
        contacts, additions = apart(contact)
        if additions and not contacts:
            name = type(additions[0]).__name__
            raise ContactError(
                f"contact has a {name} and no Contact: give at least one Contact beside "
                f"it, [contact, {name.lower()}], or the field alone to a FieldProblem"
            )
        self.contact = one_or_several(contacts)
        unknowns, system = self.contact.unknowns, self.contact.system
        comm = unknowns.comm
        with together(comm):
            functions = find_unknowns(F, J, u, unknowns)
            self.bcs = list_of_conditions(bcs)
            if update is not None and not callable(update):
                raise ContactError(f"update must be a function, not {update!r}")
            for one in additions:
                one.require_among(self.contact.contacts)
            require_apart(additions)
        self.terms: list[Term] = terms_of(additions)
        self.terms += [term for one in self.contact.contacts for term in one.terms]
        own = [f for term in self.terms for f in term.functions]
        system.solve_for([*functions, *own])
        with together(comm):
            unknowns.conditions(self.bcs)  # refuses foreign ones
        self.constraints: Any = None
        if constraints is not None:
            assert hooks.constrain is not None, "the core alone has no constraints"
            self.constraints = hooks.constrain(constraints, system, self.bcs)
        for term in self.terms:
            term.start(system)
        with together(comm):
            is_derivative = J is None
            J = jacobians(F, functions, unknowns) if J is None else J
        require_agreement(comm, number_of_conditions=len(self.bcs), update=update)
        if own:
            F, J = extended(F, J, len(own))
        self.forms = F, J
        compiled = partial(
            compat.form,
            form_compiler_options=form_compiler_options,
            jit_options=jit_options,
        )
        L, a = compiled(F), compiled(J)
        self.history: list[float] = []
        self.steps_accepted = self.tangents = self.solves = 0
        # Revision of the contact at the last `form`; None: no iterate yet
        self._revision: int | None = None
        updated = None if update is None else Updated(unknowns, update)
        if updated is not None:
            updated.bring()  # the stiffness of the volume is read
        self._pattern = system.prepare(a, self.bcs)
        self._pattern.terms = self.terms
        for term in self.terms:
            term.couple(self._pattern)
        kept = is_linear(self.terms) and self.constraints is None
        known = F if is_derivative and kept else None
        self.volume = Volume(self.contact, L, a, known, self._pattern, updated)
        groups = groups_of(system)
        self.convergence: Any = (hooks.convergence or Convergence)(groups)
        for term in self.terms:
            term.set_groups(groups)
        system.set_groups(groups.of_row, groups.count, groups.mass, groups.fields)
        for call in hooks.on_made:
            call(self)

    def __repr__(self) -> str:
        solved_for = ", ".join(repr(f.name) for f in self.contact.unknowns.functions)
        unknowns, n = self.contact.system.layout.ranges[-1], len(self.bcs)
        return (
            f"<{type(self).__name__} for {solved_for}, {unknowns} unknowns, "
            f"{n} Dirichlet condition{'' if n == 1 else 's'}, {self.contact!r}>"
        )

    # Type checkers do not see names that have moved
    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            return hooks.moved(self, name)

    @property
    def comm(self) -> MPI.Comm:
        """Communicator of the mesh."""
        return self.contact.system.layout.comm

    @property
    def u(self) -> Any:
        """Unknown of the problem: a Function, of several unknowns a list."""
        functions = self.contact.unknowns.functions
        return list(functions) if self.volume.has_several else functions[0]

    @property
    def L(self) -> Any:
        """The volume's compiled residual; for several unknowns a list."""
        return self.volume.L

    @property
    def a(self) -> Any:
        """The volume's compiled Jacobian; for several unknowns a list of lists."""
        return self.volume.a

    def create_matrix(self) -> PETSc.Mat:
        """Matrix with room for the tangent. Collective."""
        self.contact.system.use_volume(self._pattern)
        is_first = not self.contact.system.preallocations
        A = self.contact.system.create_matrix()
        if is_first:
            for call in hooks.on_setup:
                call(self)
        return A if self.constraints is None else self.constraints.create_matrix(A)

    def make_room_for(self, M: PETSc.Mat) -> None:
        """Let the tangent have room for another matrix over the coupled unknowns, with
        entries between those of the forms. Collective."""
        self._pattern.include(M)

    def create_vector(self) -> PETSc.Vec:
        """Vector of the coupled unknowns."""
        return self.contact.system.layout.create_vector()

    def residual_floor(self) -> float:
        """Norm below which a residual is rounding error: of every body its stiffness
        times its size, or its distance from the origin if that is larger, times the
        machine's precision [theory (5.4)]. Force."""
        return self.convergence.floor

    def start(self, x: PETSc.Vec | None = None) -> PETSc.Vec:
        """Present u and multiplier as a vector of unknowns, x or a new one; clears the
        history."""
        fault = self.contact.unknowns.fault_of_conditions(self.bcs)
        raise_everywhere(self.comm, fault, SetUpError)
        self.history.clear()
        self.convergence.start()
        self.contact.system.require_mesh()
        self._revision = None
        if self.volume.updated is not None:
            self.volume.updated.forget()
        if self.contact.system.layout.bodies:
            self.contact.system.free_bodies.close_gaps()
        x = self.create_vector() if x is None else x
        self.contact.system.to_vector(x)
        if self.constraints is not None:
            self.constraints.apply(x)
        return x

    def form(self, x: PETSc.Vec) -> None:
        """Take over an iterate: functions, pairing, integration. Collective.

        Nothing is done again where neither x nor the contact has changed since the last
        call.

        Raises
        ------
        ContactError
            If x has another number of unknowns than the problem.
        """
        size, mine = x.getSize(), self.contact.system.layout.ranges[-1]
        if size != mine:
            raise ContactError(
                f"x has {size} unknowns, the problem {mine}: [u, multiplier / gamma, "
                "free bodies]. A solver that knows u only, as DOLFINx's own "
                "NewtonSolver, cannot solve it: take raymortar.NewtonSolver(problem)"
            )
        if self.contact.parts[0].volume is not self._pattern:
            self.contact.system.use_volume(self._pattern)
        seen = self._revision
        full = x if self.constraints is None else self.constraints.applied(x)
        self._revision = self.contact.system.take(full, seen)
        if seen is None:
            # The motion of segments below rigid bodies that have moved in this step is
            # left out of the tangent. It is not lifted, so that the first residual is
            # that of gaps that close in this iteration: rims move by gap times rotation,
            # and from there on by next to nothing
            for zone in self.contact.zones:
                if zone.motions.have_moved():
                    zone.cpp.cast()
        if self.volume.updated is not None:
            self.volume.updated.bring()

    def evaluate(self) -> None:
        """Call `update`, if the problem was given one, where the unknowns have changed
        since its last call. Collective."""
        if self.volume.updated is not None:
            self.volume.updated.bring()

    def F(self, x: PETSc.Vec, b: PETSc.Vec) -> None:
        """Residual at x into b. Collective."""
        self.form(x)
        if self.volume.updated is not None:
            self.volume.updated.bring_for_residual()
        norms = assemble_residual(self, b)
        # Most problems have no terms, whose sums would be calls that add nothing
        sizes = added_sizes(self.terms) if self.terms else None
        inertia = self.inertia if self.terms else None
        self.history.append(self.convergence.measure(norms, sizes, inertia).norm)

    def loads(self, b: PETSc.Vec) -> None:
        """Assemble into b what loads and prescribed displacements add to the residual
        at the last x of `form`: the residual without contact forces. Collective."""
        if self.volume.updated is not None:
            self.volume.updated.forget()
        assemble_residual(self, b, contact=False)

    @property
    def form_of_u(self) -> tuple[ufl.Form, ufl.Form]:
        """UFL residual in the displacement's test function, and its derivative by the
        displacement, or by the mixed Function that has it."""
        F, J = self.forms
        at = self.contact.unknowns.only.at
        return (F[at], J[at][at]) if self.volume.has_several else (F, J)

    @property
    def constrained(self) -> npt.NDArray[np.bool_]:
        """Whether conditions prescribe an owned dof of u. Collective."""
        system = self.contact.system
        return system.constrained(self.bcs)[: system.layout.n_u]

    @property
    def prescribed(self) -> npt.NDArray[np.bool_]:
        """Whether conditions prescribe an owned unknown of the forms. Collective."""
        return self.contact.unknowns.owned_prescribed(self.bcs)

    def row_scale(self) -> Array:
        """Factors of the owned rows for solvers that add up their squares, as line
        searches do; see `convergence.Convergence.row_scale`. Collective."""
        values = self.contact.unknowns.values()
        return self.convergence.row_scale(self.prescribed, values)

    def J(self, x: PETSc.Vec, A: PETSc.Mat) -> bool:
        """Tangent at x into A. Collective.

        Returns
        -------
        Whether A has a new pattern: see `Contact.make_room`.
        """
        self.form(x)
        self.tangents += 1
        whole = A
        if self.constraints is not None:
            A = self.constraints.inner
        renewed = self.contact.system.extend_room(A)
        if not renewed:
            A.zeroEntries()
        for term in self.terms:
            term.add_matrices(A, self.bcs)
        self.volume.add_tangent(A, self.bcs)
        self.contact.system.add_tangent(A, self.bcs)
        for term in self.terms:
            term.add_tangent(A, self.bcs)
        A.assemble()
        if self.constraints is not None:
            self.constraints.fill(whole)
        return renewed

    @contextmanager
    def extended_by(self, term: Term) -> Iterator[None]:
        """Have another term for a while. Collective."""
        self.terms.append(term)
        try:
            yield
        finally:
            self.terms.remove(term)

    @property
    def is_linear(self) -> bool:
        """Whether the tangent of all but contact is constant, and kept."""
        return self.volume.is_linear and is_linear(self.terms)

    @property
    def kept(self) -> Any:
        """Keeper of the constant tangent of all but contact: `tangent`, and `revision`,
        which counts its matrices; None where it is not constant. Collective."""
        return kept_with(self.terms, self.volume.kept) if self.is_linear else None

    @property
    def inertia(self) -> Array | None:
        """Force of inertia that a unit of each owned unknown of the forms takes, (n,);
        None: there is no inertia."""
        return inertia_of(self.terms)

    def forces_of_bodies(self) -> Array:
        """Residual at the owned unknowns of the forms without contact, (n,).
        Collective."""
        rows = self.volume.forces(self.bcs)
        for term in self.terms:
            rows += term.forces(self.bcs)
        return rows

    def forces(self) -> Array:
        """Residual at the owned dofs of u, contact included: forces that conditions have
        to add, (n,). Collective."""
        rows = self.forces_of_bodies()
        b = self.create_vector()
        self.contact.system.add_residual(b)
        rows += b.getArray(readonly=True)[: self.contact.system.layout.n]
        b.destroy()
        return rows[self.contact.unknowns.u_owned]

    def reactions(self, supports: Mapping[str, Any]) -> dict[str, Array]:
        """Forces by which conditions hold the bodies, after a solve. Collective.

        Each is the sum of the residual, contact included, over the dofs of its
        conditions.

        Parameters
        ----------
        supports
            Dirichlet condition, or a list of them, by the name of the support.

        Returns
        -------
        By name, (d,). Force (per thickness in 2D). Of solids of revolution the second
        is the force of a full turn along the axis; the first is the integral of radial
        tractions, which cancel.
        """
        assert hooks.reactions is not None, "the core alone has no results"
        return hooks.reactions(self, supports)

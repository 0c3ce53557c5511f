"""Contact in the user's own unknowns, for DOLFINx's solvers and PETSc's."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from ..core.compat import Array
from ..core.contact import Contact
from ..core.discretization.ranks import destroy
from ..core.errors import ContactError, SetUpError, described, together
from ..core.gamma.probing import product
from ..core.problem import CoupledProblem
from ..entries import copy_with_pattern
from .condensation import ELIMINATED, Condensation, Newton


class CondensedProblem:
    """F(u; v) + contact = 0 as a system of the user's unknowns alone. Collective.

    The rows of each slave node determine its dual multiplier. The system then has the
    rows of the form, with the forces on masters added, and with the law of contact in
    the rows of slave nodes (theory (4.30), (4.31)). So any solver for F works:
    ``dolfinx.nls.petsc.NewtonSolver(comm, problem)``, the SNES of
    ``dolfinx.fem.petsc.NonlinearProblem``, or one of your own, by `attach`.

    Parameters
    ----------
    F
        UFL residual of everything but contact, as for `NonlinearProblem`.
    u
        Function that is solved for, that of F; it is or contains the displacement.
    contact
        `Contact` with ``AugmentedLagrangian(condition="nodes", multiplier="dual")``; of
        several a list. Without free rigid bodies.
    bcs
        Dirichlet conditions on u, or on parts of it.
    J
        UFL Jacobian of F; by default its derivative.
    form_compiler_options, jit_options
        Options for the forms of F and J, as for ``dolfinx.fem.form``.
    update
        Function that sets coefficients, as for `NonlinearProblem`.

    Attributes
    ----------
    coupled
        The problem with multipliers as unknowns, which assembles the forms and contact.
    contact
        The contact, or `interactions.Interactions` of several.
    bcs, u
        Dirichlet conditions, and what is solved for.
    L, a
        Compiled residual and Jacobian of everything but contact.

    Notes
    -----
    ``F`` and ``J`` are functions, which assemble residual and tangent;
    ``L`` and ``a`` are the compiled forms, as of DOLFINx's ``NonlinearProblem`` of 0.5
    to 0.9. Results belong to the last residual. After a solve accept the step by
    ``contact.advance()``.

    If conditions prescribe a slave node, its multiplier extends those of the slave
    nodes next to it, or follows from the law where the master is prescribed too. Rows
    of the law have the unit of a force.

    Raises
    ------
    SetUpError
        If a slave node is one of a master too, or of another contact's slave.
    """

    def __init__(
        self,
        F: Any,
        u: Any,
        contact: Contact | Sequence[Contact],
        bcs: Sequence[Any] = (),
        J: Any = None,
        form_compiler_options: Mapping[str, Any] | None = None,
        jit_options: Mapping[str, Any] | None = None,
        update: Callable[[], object] | None = None,
    ) -> None:
        several = contact if isinstance(contact, (list, tuple)) else [contact]
        if not (several and isinstance(several[0], Contact)):
            raise ContactError(
                "CondensedProblem takes F, u, contact, bcs in this order: contact must "
                f"be a Contact, not {described(contact)}"
            )
        with together(several[0].unknowns.comm):
            for one in several:
                _check(one)
        given = u if isinstance(F, (list, tuple)) else None
        self.coupled = CoupledProblem(
            F, contact, bcs, J, given, form_compiler_options, jit_options, update
        )
        self.contact, self.comm = self.coupled.contact, self.coupled.comm
        self.bcs, self.u = self.coupled.bcs, self.coupled.u
        self.L, self.a = self.coupled.L, self.coupled.a
        with together(self.comm):
            _check_unknown(u, self.coupled.u)
        self._A = self.coupled.create_matrix()
        self._x, self._b = (self.coupled.create_vector() for _ in range(2))
        self._condensation = Condensation(self.contact.system)
        self._n = self._condensation.n
        self._shown, self._begun = self._present(), self._returns()
        self._newton = Newton(self._shown)
        # State of the last residual: the user's unknowns, None without one; its rows,
        # the multipliers, and how these have to change to balance slave nodes
        self._at: Array | None = None
        self._rows: Array = np.empty(0)
        self._lam: Array = self._rows
        self._change: Array = self._rows

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.coupled!r}>"

    # Equations

    def form(self, x: PETSc.Vec) -> None:
        """Update the ghosts of an iterate, as DOLFINx's solver asks for. Collective."""
        x.ghostUpdate(PETSc.InsertMode.INSERT, PETSc.ScatterMode.FORWARD)

    def F(self, x: PETSc.Vec, b: PETSc.Vec) -> None:
        """Residual at x into b. Collective."""
        self._evaluate(x.array_r[: self._n].copy())
        b.array[: self._n] = self._rows

    def J(self, x: PETSc.Vec, A: PETSc.Mat) -> None:
        """Tangent at x into A, whatever pattern it has had. Collective."""
        problem, now = self.coupled, x.array_r[: self._n].copy()
        same = self._at is not None and np.array_equal(now, self._at)
        if not self.comm.allreduce(same, op=MPI.LAND):
            self._evaluate(now)
        problem.tangents += 1
        problem.volume.add_tangent(self._A, self.bcs)
        self._A.assemble()
        found, by_x, eliminated = self._condensation.tangent(self._A)
        size = self.comm.allreduce(float(self._rows @ self._rows))
        share = product(found, self._rows, transposed=True) / -(size or 1.0)
        destroy(self._newton.by_x)
        self._newton = Newton(self._lam, now, self._change, by_x, share)
        self._at = None  # the tangent of contact has become that of all
        before = A.getAttr(ELIMINATED)
        if before is not None:
            before.spread.destroy()
        copy_with_pattern(found, A)
        found.destroy()
        A.setAttr(ELIMINATED, eliminated)

    def _evaluate(self, x: Array) -> None:
        """Find the residual where the user's owned unknowns are x. Collective.

        Multipliers are those of Newton's method. What slave nodes lack of balance then
        goes into the other rows, by the tangent of contact.
        """
        problem, contact, condensation = self.coupled, self.contact, self._condensation
        with together(self.comm):
            for zone in contact.zones:
                offsets = zone.offset, zone.adjustment
                has_offset = any(o is not None and o.any() for o in offsets)
                if zone.frictional and has_offset:
                    raise SetUpError(
                        "CondensedProblem has no offset with friction, whose couple acts "
                        "on several slave nodes: take NonlinearProblem"
                    )
        contact.system.constrained(self.bcs)
        condensation.set_prescribed(problem.prescribed)
        self._at = None
        self._lam = self._multipliers(x)
        self._show(x, self._lam)
        condensation.weigh()
        lacking = contact.unknowns.lacking(self.bcs)
        volume = problem.volume.residual(self.bcs, lacking.increment)
        contact.system.assemble_residual(self._b, self.bcs, volume, lacking)
        if not contact.system.extend_room(self._A):
            self._A.zeroEntries()
        contact.system.add_tangent(self._A, self.bcs)
        self._A.assemble()
        found = self._b.array_r.copy()
        self._change = condensation.change(found, self._lam)
        known = np.concatenate([np.zeros(self._n), self._change])
        rows = found + product(self._A, known)
        self._rows = condensation.residual(rows)
        of_kept = condensation.changes_of_kept(rows)
        self._change += of_kept
        self._at = x
        # Rows may vanish where slave nodes alone are out of balance, as all of a body of
        # one cell: results are then of multipliers that balance them
        norm = np.sqrt(self.comm.allreduce(float(self._rows @ self._rows)))
        lifts = self.comm.allreduce(bool(lacking.increment.any()), op=MPI.LOR)
        if not lifts and condensation.unbalance(found) > norm:
            self._show(x, self._lam + self._change)
        elif self.comm.allreduce(bool(of_kept.any()), op=MPI.LOR):
            self._show(x, self._lam + of_kept)

    def _multipliers(self, x: Array) -> Array:
        """Owned multipliers where the user's owned unknowns are x: those of Newton's
        method, or the present ones if something else has set these. Collective."""
        present, returns = self._present(), self._returns()
        is_own = np.array_equal(present, self._shown) and returns == self._begun
        if not self.comm.allreduce(is_own, op=MPI.LAND):
            destroy(self._newton.by_x)
            self._newton, self._begun = Newton(present), returns
        found = self._newton.at(x)
        if self.comm.allreduce(bool(np.isfinite(found).all()), op=MPI.LAND):
            return found
        # A solve has failed, which the next one has nothing to do with
        destroy(self._newton.by_x)
        self._newton = Newton(np.zeros_like(found))
        return self._newton.lam

    def _returns(self) -> int:
        """Count how often the contacts have gone back to a state."""
        return sum(part.present.returns for part in self.contact.parts)

    def _present(self) -> Array:
        """Owned multipliers that the contact has at present."""
        self.contact.system.to_vector(self._x)
        return self._x.array_r[self._n :].copy()

    def _show(self, x: Array, lam: Array) -> None:
        """Let the contact have unknowns, and its results be theirs. Collective."""
        self._x.array[:] = np.concatenate([x, lam])
        self.coupled.form(self._x)
        self._shown = self._present()

    # Room

    def create_vector(self, L: Any = None) -> PETSc.Vec:
        """Vector of the user's unknowns, with DOLFINx's layout and ghosts; the form L is
        not needed. Collective."""
        return self.contact.layout.create_form_vector()

    def create_matrix(self, a: Any = None) -> PETSc.Mat:
        """Matrix of the user's unknowns, which `J` gives its pattern; the form a is not
        needed."""
        unknowns = self.contact.unknowns
        A = PETSc.Mat().create(self.comm)
        A.setSizes(((self._n, None), (self._n, None)))
        A.setType(PETSc.Mat.Type.AIJ)
        if unknowns.is_plain:  # multigrid asks which rows are of one node
            A.setBlockSize(unknowns.u.function_space.dofmap.index_map_bs)
        return A

    # Results

    def reactions(self, supports: Mapping[str, Any]) -> dict[str, Array]:
        """Forces by which conditions hold the bodies, after a solve: as
        `NonlinearProblem.reactions`. Collective."""
        return self.coupled.reactions(supports)

    # Solvers

    def attach(self, snes: PETSc.SNES) -> None:
        """Give a PETSc SNES residual and tangent of this problem. Collective.

        The vector that it solves for is one of `create_vector`, or that of u.
        """
        snes.setFunction(lambda _, x, b: self.F(x, b), self.create_vector())
        A = self.create_matrix()
        snes.setJacobian(lambda _, x, J, P: self.J(x, P), A)


def _check(contact: Any) -> None:
    """Raise for a contact whose multiplier cannot be condensed."""
    if not isinstance(contact, Contact):
        raise ContactError(
            f"CondensedProblem needs a Contact, not {type(contact).__name__}: a tie has "
            "no dual multiplier"
        )
    method = contact.method
    if not method.is_dual:
        raise ContactError(
            "CondensedProblem needs a Contact with AugmentedLagrangian(condition="
            f"'nodes', multiplier='dual'), not {described(method)}"
        )
    for term in contact.terms:
        raise ContactError(
            f"CondensedProblem has no {term.spoken} of a contact: take NonlinearProblem"
        )
    if contact.layout.bodies:
        raise ContactError(
            "CondensedProblem has the unknowns of u alone, and a rigid body that is "
            "free has its own: take NonlinearProblem"
        )


def _check_unknown(u: Any, solved_for: Any) -> None:
    """Raise unless u is what the form solves for."""
    given = list(u) if isinstance(u, (list, tuple)) else [u]
    known = solved_for if isinstance(solved_for, list) else [solved_for]
    if len(given) != len(known) or any(map(operator.is_not, given, known)):
        names = ", ".join(f.name for f in known)
        raise ContactError(f"u must be what F solves for, {names}")

"""The coupled nonlinear problem: a user's UFL residual plus contact."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt
import ufl

from mpi4py import MPI
from petsc4py import PETSc

from . import compat
from .compat import Array
from .contact import Contact
from .convergence import Convergence
from .errors import ContactError, require_agreement, together
from .failure import describe_failure
from .forms import check_forms, check_supports, list_of_conditions
from .held import rigid_slaves
from .lost_contact import unheld


class NonlinearProblem:
    """Residual and tangent of F(u; v) + contact = 0 for PETSc solvers. Collective.

    Parameters
    ----------
    F
        UFL residual of everything but contact: a linear form in the test function of
        ``contact.u``'s space.
    contact
        Contact terms.
    bcs
        Dirichlet conditions on the displacement.
    J
        UFL Jacobian of F; by default its derivative.

    Attributes
    ----------
    history
        Norms of the residuals since `start`, without constrained rows. Force.
    forms
        UFL residual and Jacobian of the volume.
    convergence
        Judges the last residual; see `convergence.Convergence`.
    rays_only
        Whether iterates keep the segments and integration points of the last pairing and
        only cast their rays anew, as `FixedPointSolver` asks for.

    tells_of_loss
        Whether a converged solve warns of contact that it has lost.

    Notes
    -----
    Several problems may have one contact, whose automatic gamma is that of the first,
    and several solvers one problem.

    Constrained rows are those of the identity. The columns' effect of a Dirichlet
    increment is lifted for volume and contact alike, so that the first iterate of a
    large prescribed step knows about contact.
    """

    def __init__(
        self,
        F: ufl.Form,
        contact: Contact,
        bcs: Sequence[Any] = (),
        J: ufl.Form | None = None,
    ) -> None:
        if not isinstance(contact, Contact):
            raise ContactError(
                f"contact must be a Contact, not {type(contact).__name__}"
            )
        u = contact.u
        with together(contact.layout.comm):
            check_forms(F, J, u)
            self.contact, self.bcs = contact, list_of_conditions(bcs)
            compat.dirichlet_dofs(self.bcs, u.function_space)  # refuses foreign ones
        require_agreement(contact.layout.comm, number_of_conditions=len(self.bcs))
        if J is None:
            J = ufl.derivative(F, u, ufl.TrialFunction(u.function_space))
        self.forms = F, J
        self.L, self.a = compat.form(F), compat.form(J)
        self.history: list[float] = []
        self.rays_only, self.tells_of_loss = False, True
        # Where `form` was last, and which revision of the contact that was
        self._at: np.ndarray | None = None
        self._revision = 0
        dofmap = u.function_space.dofmap
        self._r = compat.create_la_vector(dofmap.index_map, dofmap.index_map_bs)
        self._volume = contact.prepare(self.a, self.bcs)
        self.convergence = Convergence(contact)

    @property
    def comm(self) -> MPI.Comm:
        """Communicator of the mesh."""
        return self.contact.layout.comm

    def create_matrix(self) -> PETSc.Mat:
        """Matrix with room for the tangent. Collective."""
        self.contact.belong_to(self._volume)
        return self.contact.create_matrix(self.a)

    def create_vector(self) -> PETSc.Vec:
        """Vector of the coupled unknowns."""
        return self.contact.create_vector(self.L)

    def residual_floor(self) -> float:
        """Norm below which a residual is rounding error: of every body its stiffness
        times its size, or its distance from the origin if that is larger, times the
        machine's precision [theory (5.4)]. Force."""
        return self.convergence.floor

    def start(self) -> PETSc.Vec:
        """Present u and multiplier as a vector of unknowns; clears the history."""
        self.history.clear()
        self.convergence.start()
        self._at = None
        x = self.create_vector()
        self.contact.layout.to_vector(x, self.contact.gamma_scale)
        return x

    def form(self, x: PETSc.Vec) -> None:
        """Take over an iterate: functions, pairing, integration. Collective.

        Nothing is done again where neither x nor the contact has changed since the last
        call.
        """
        self.contact.belong_to(self._volume)
        array, n = x.getArray(readonly=True), self.contact.layout.n_u
        same = (
            self._at is not None
            and self._revision == self.contact.revision
            and np.array_equal(array, self._at)
            and np.array_equal(array[:n], self.contact.u.x.array[:n])
        )
        if self.comm.allreduce(int(same)) == self.comm.size:
            return
        self._at = array.copy()
        self.contact.layout.from_vector(x, self.contact.gamma_scale)
        self.contact.update(self.rays_only)
        self._revision = self.contact.revision

    def F(self, x: PETSc.Vec, b: PETSc.Vec) -> None:
        """Residual at x into b. Collective."""
        self.form(x)
        volume, increment = self._assemble(b, True)
        imbalance = self.convergence.measure(
            b.getArray(readonly=True), volume, self.constrained, increment
        )
        self.history.append(imbalance.norm)

    def loads(self, b: PETSc.Vec) -> None:
        """What of the residual depends on loads and prescribed displacements, at the
        last x of `form`, into b: all but contact's forces. Collective."""
        self._assemble(b, False)

    def _assemble(self, b: PETSc.Vec, contact: bool) -> tuple[Array, Array]:
        """Residual, with contact's forces or without; its part of the user's form, and
        what prescribed displacements lack. Collective."""
        u, n = self.contact.u, self.contact.layout.n_u
        r = self._r.array
        r[:] = 0.0
        compat.assemble_residual(r, self.L)
        increment = compat.dirichlet_increment(self.bcs, u.x.array)
        if increment.any():  # takes the tangents of all cells with constrained dofs
            compat.apply_lifting(r, self.a, self.bcs, u.x.array, -1.0)
        compat.scatter_reverse_add(self._r)
        volume = r[:n].copy()
        compat.set_bc(r, self.bcs, u.x.array, -1.0)
        b.set(0.0)
        b.getArray()[:n] = r[:n]
        # Constrained rows are left out by contact, so the values set above stay
        if contact:
            self.contact.assemble_vector(b, self.bcs)
        self.contact.lift(b, increment, -1.0)
        b.assemble()
        return volume, increment

    @contextmanager
    def silent_about_loss(self) -> Iterator[None]:
        """Leave it to the caller to ask for lost contact, as `LoadSteps` does."""
        before, self.tells_of_loss = self.tells_of_loss, False
        try:
            yield
        finally:
            self.tells_of_loss = before

    @property
    def constrained(self) -> npt.NDArray[np.bool_]:
        """Whether conditions prescribe an owned dof of u. Collective."""
        return self.contact.constrained(self.bcs)[: self.contact.layout.n_u]

    def row_scale(self) -> Array:
        """Factors of the owned rows for solvers that add up their squares, as line
        searches do; see `convergence.Convergence.row_scale`. Collective."""
        return self.convergence.row_scale(self.constrained)

    def J(self, x: PETSc.Vec, A: PETSc.Mat) -> bool:
        """Tangent at x into A. Collective.

        Returns
        -------
        Whether A has a new pattern: see `Contact.make_room`.
        """
        self.form(x)
        renewed = self.contact.make_room(A)
        if not renewed:
            A.zeroEntries()
        compat.assemble_jacobian(A, self.a, self.bcs)
        self.contact.assemble_matrix(A, self.bcs)
        A.assemble()
        return renewed

    def reactions(self, supports: Mapping[str, Any]) -> dict[str, Array]:
        """Forces by which conditions hold the bodies, after a solve. Collective.

        The residual, contact included, in the dofs of the conditions: what external
        forces and stresses leave to them.

        Parameters
        ----------
        supports
            Dirichlet condition, or a list of them, by the name of the support.

        Returns
        -------
        By name, (d,). Force (per thickness in 2D).
        """
        V, n = self.contact.u.function_space, self.contact.layout.n_u
        with together(self.comm):
            supports = check_supports("supports", supports)
        r = self._r
        r.array[:] = 0.0
        compat.assemble_residual(r.array, self.L)
        compat.scatter_reverse_add(r)
        b = self.create_vector()
        self.contact.assemble_vector(b)
        b.assemble()
        forces = r.array[:n] + b.getArray(readonly=True)[:n]
        b.destroy()
        dim = V.dofmap.index_map_bs
        local = []
        for bcs in supports.values():
            held, _ = compat.dirichlet_dofs(bcs, V)
            local.append(np.where(held[:n] == 1, forces, 0.0).reshape(-1, dim).sum(0))
        total = self.comm.allreduce(np.array(local).reshape(-1, dim))
        return dict(zip(supports, total))

    def describe(self) -> str:
        """State of contact and residual history, for messages. Collective."""
        return describe_failure(
            self.history,
            self.contact.statistics,
            unheld(self),
            self.convergence.describe(),
            rigid_slaves(self.contact, self.contact.constrained(self.bcs)),
        )

"""Inertia of the bodies, whose contact surfaces have no mass."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from petsc4py import PETSc

import numpy as np
import ufl
from dolfinx.fem import Function

from ..core import compat
from ..core.compat import Array, Mask
from ..core.contact import Contact, one_or_several
from ..core.discretization.ranks import destroy
from ..core.errors import (
    ContactError,
    SetUpError,
    choice,
    described,
    require_agreement,
    together,
    warn,
)
from ..core.gamma.probing import product
from ..entries import without_zeros
from .massless import RULES, replacement
from .nodal_forms import NodalForms

MASSES = (*RULES, "consistent")
# Share of the largest mass of an unknown up to which a negative one is rounding
ROUNDING = 1e-12
# Share of the free mass that may be put on held nodes without a word
LOST = 0.1


class Inertia:
    """Inertia r_I(a) of the bodies, as Q^T r_I(Q a), and their damping. Collective.

    Q replaces the value of each node of a contact surface by values of nodes off the
    surface, so that these nodes have no mass. Implicit schemes then keep the energy of
    an impact; with a consistent mass they multiply it [theory (6.1)].

    Parameters
    ----------
    form
        Bilinear form of the acceleration and a test function, such as ``rho *
        ufl.inner(a, v) * ufl.dx``, both in the space of the problem's unknown. With
        several unknowns a list with a form for each, None for those without inertia.
        Its values at an acceleration are forces, in the unit of the problem's forms.
    contact
        Contact, or the list of interactions, of the problem.
    mass
        ``"nearest"``: the nearest nodes off the surface, which gives the smoothest
        pressure; the mass is exact. ``"affine"``: nodes from which affine fields
        extrapolate; mass, centre and inertia tensor are exact. ``"consistent"``: Q is
        the identity.
    damping
        Bilinear form of the velocity and a test function, such as Rayleigh's ``alpha *
        rho * ufl.inner(w, v) * ufl.dx + beta * ufl.inner(sigma(w), eps(v)) * ufl.dx``
        with a trial function ``w``, by unknown as `form`. Its values at a velocity are
        forces that oppose it, as Q^T r_D(Q w) [theory (6.20)]. None: no damping.

    Attributes
    ----------
    mass
        Rule for the mass, as it was given.

    Raises
    ------
    ContactError
        If a form is none in the displacement's space, or has complex values.
    SetUpError
        At the first use: if the form gives some unknown a negative mass, if a body is
        too thin for nodes off its contact surfaces, if what moves is damped and has no
        mass, or if a form depends on the unknowns.

    Notes
    -----
    Nodes of slave and master surfaces of contacts have no mass, of ties those of the
    slaves. The matrices are assembled when they are first needed, and again where
    Constants or Functions in the forms have changed.
    """

    def __init__(
        self,
        form: ufl.Form | Sequence[ufl.Form | None],
        contact: Contact | Sequence[Contact],
        mass: str = "nearest",
        damping: ufl.Form | Sequence[ufl.Form | None] | None = None,
    ) -> None:
        self.contact = one_or_several(contact)
        unknowns = self.contact.unknowns
        with together(unknowns.comm):
            self.mass = choice("mass", mass, MASSES)
            self._mass = NodalForms("form", "acceleration", form, unknowns)
            self._damping = None
            if damping is not None:
                self._damping = NodalForms("damping", "velocity", damping, unknowns)
        require_agreement(
            unknowns.comm, mass=mass, damping=damping is not None,
            forms=[len(one.forms) for one in self._all],
        )  # fmt: skip
        for one in self._all:
            one.compile()
        self._at: tuple[int, ...] = ()
        self._Q: Any = None
        # Unknowns that conditions prescribe where a path begins
        self._held: Mask | None = None
        self._moving = 1.0  # mass of the others, over that with a consistent mass

    @property
    def _all(self) -> list[NodalForms]:
        return [self._mass] + ([] if self._damping is None else [self._damping])

    @property
    def is_damped(self) -> bool:
        """Whether there is a form of damping."""
        return self._damping is not None

    @property
    def revision(self) -> int:
        """Number of matrices so far."""
        return sum(one.revision for one in self._all)

    def __repr__(self) -> str:
        damped = " and damping" * self.is_damped
        return (
            f"<Inertia with mass {self.mass!r}, {len(self._mass.forms)} forms{damped}>"
        )

    def begin(self, fixed: Mask) -> None:
        """Take the owned unknowns that conditions prescribe where a path begins, (n,),
        and warn of mass that they hold. Collective."""
        if self._held is None or self._comm_any(self._held != fixed):
            self._held, self._at = fixed.copy(), ()
        self._renew()
        if self._moving < (1.0 - LOST):
            warn(
                f'mass="{self.mass}" puts {1.0 - self._moving:.2g} of the mass that is '
                "free to move on nodes that conditions hold: mesh more cells "
                'across, or take mass="consistent"',
                page="fields",
            )

    def _comm_any(self, marks: Mask) -> bool:
        """Whether any rank has a mark. Collective."""
        return bool(self.contact.layout.comm.allreduce(int(marks.any())))

    @property
    def matrix(self) -> PETSc.Mat:
        """Q^T M Q over the rows of the coupled unknowns. Mass. Collective."""
        self._renew()
        return self._mass.matrix

    @property
    def damping_matrix(self) -> PETSc.Mat | None:
        """Q^T C Q over the rows of the coupled unknowns; None: no damping. Mass per
        time. Collective."""
        self._renew()
        return None if self._damping is None else self._damping.matrix

    def _renew(self) -> None:
        """Assemble matrices whose forms, rows or held unknowns have changed."""
        layout = self.contact.layout
        at = (*layout.ranges.tolist(), layout.n)
        changed = np.array([one.have_changed() for one in self._all])
        changed |= at != self._at
        changed = layout.comm.allreduce(changed.astype(np.int32)) > 0
        if changed[0]:
            self._at = at
            self._assemble_mass()
        if self._damping is not None and changed.any():
            self._assemble_damping(self._damping)

    def _fixed(self) -> Mask:
        """Whether conditions prescribe an owned unknown where a path begins, (rows,)."""
        fixed = np.zeros(self.contact.layout.size, dtype=bool)
        if self._held is not None:
            fixed[: len(self._held)] = self._held
        return fixed

    def _assemble_mass(self) -> None:
        """Assemble Q^T M Q, and Q."""
        layout = self.contact.layout
        M = self._mass.assembled(layout)
        destroy(self._Q)
        self._Q = None
        diagonal = M.getDiagonal()
        least, most = diagonal.min()[1], diagonal.max()[1]
        diagonal.destroy()
        if least < -ROUNDING * abs(most):
            raise SetUpError(
                f"the form of inertia has a negative mass, {least:.6g} at one unknown: "
                "the density rho of rho * inner(a, v) must not be negative"
            )
        if self.mass != "consistent":
            fixed = self._fixed()
            self._Q = replacement(self.contact, layout, M, self.mass, fixed)
            whole = M.ptap(self._Q)
            self._moving = _share_of_free(M, whole, fixed)
            M.destroy()
            M = whole
        self._mass.set(without_zeros(M))
        M.destroy()

    def _assemble_damping(self, damping: NodalForms) -> None:
        """Assemble Q^T C Q."""
        C = damping.assembled(self.contact.layout)
        if self._Q is not None:
            C, plain = C.ptap(self._Q), C
            plain.destroy()
        damping.set(without_zeros(C))
        C.destroy()
        n = self.contact.layout.n
        is_damped = damping.diagonal(n) != 0.0
        alone = is_damped & ~(self._mass.diagonal(n) > 0.0) & ~self._fixed()[:n]
        if self._comm_any(alone):
            raise SetUpError(
                "damping acts on unknowns without mass, which have no velocity of their "
                "own: give their bodies a density, or leave damping out of them"
            )

    def between_free(self, fixed: Mask) -> list[PETSc.Mat]:
        """Entries of the mass, and of the damping if there is one, between owned unknowns
        that are not `fixed`, zero elsewhere. Collective."""
        self._renew()
        comm = self.contact.layout.comm
        return [one.between_free(fixed, comm) for one in self._all]

    def only_between(self, chosen: Mask) -> PETSc.Mat:
        """Copy the entries of the mass between chosen owned unknowns, and set the others
        to zero. Collective."""
        self._renew()
        return self._mass.only_between(chosen)

    @property
    def is_massive(self) -> Mask:
        """Whether each owned unknown of the forms has mass, (n,). Collective."""
        return self.diagonal() > 0.0

    def diagonal(self) -> Array:
        """Diagonal of the matrix at the owned unknowns of the forms, (n,). Mass.
        Collective."""
        self._renew()
        return self._mass.diagonal(self.contact.layout.n)

    def damping_diagonal(self) -> Array:
        """Diagonal of the damping matrix at the owned unknowns of the forms, (n,), zero
        without one. Mass per time. Collective."""
        self._renew()
        n = self.contact.layout.n
        return np.zeros(n) if self._damping is None else self._damping.diagonal(n)

    # Products

    def times(self, values: Array) -> Array:
        """Multiply Q^T M Q with values of the owned unknowns of the forms, (n,).
        Collective."""
        return product(self.matrix, values)[: len(values)]

    def damped(self, velocity: Array) -> Array:
        """Forces of damping at velocities of the owned unknowns of the forms, (n,): Q^T C
        Q times them, zero without damping. Collective."""
        C = self.damping_matrix
        if C is None:
            return np.zeros(len(velocity))
        return product(C, velocity)[: len(velocity)]

    def smooth(self, values: Array) -> Array:
        """Replace values of massless nodes by those that stand for them: Q times values
        of the owned unknowns, (n,). Collective."""
        _ = self.matrix
        return (
            values.copy()
            if self._Q is None
            else product(self._Q, values)[: len(values)]
        )

    def gather(self, forces: Array) -> Array:
        """Give forces on massless nodes to those that stand for them: Q^T times forces
        on the owned unknowns of the forms, (n,). Collective."""
        _ = self.matrix
        if self._Q is None:
            return forces.copy()
        return product(self._Q, forces, transposed=True)[: len(forces)]

    def apply(self, a: Function | Sequence[Function]) -> Array:
        """Forces of inertia at accelerations, for time integration of your own.

        Collective.

        Parameters
        ----------
        a
            Accelerations in the spaces of the unknowns: a Function, of several unknowns
            a list. Length per time squared.

        Returns
        -------
        Q^T M Q a at the owned unknowns, one Function's after the other, (n,). Force.
        """
        given = list(a) if isinstance(a, (list, tuple)) else [a]
        return self.times(owned_values(self.contact.unknowns, given, "a"))


def _share_of_free(M: PETSc.Mat, moved: PETSc.Mat, fixed: Mask) -> float:
    """Mass that moves if all unknowns that are not fixed do alike, of a matrix over that
    of another one; 1 if that has none. Collective."""
    free, product = M.createVecs()
    free.array[:] = ~fixed
    found = []
    for one in (M, moved):
        one.mult(free, product)
        found.append(free.dot(product))
    destroy(free, product)
    return float(found[1] / found[0]) if found[0] > 0.0 else 1.0


def owned_values(unknowns: Any, given: Sequence[Any], name: str) -> Array:
    """Join the owned values of Functions in the spaces of the unknowns. Collective."""
    functions = unknowns.functions
    with together(unknowns.comm):
        fits = len(given) == len(functions) and all(
            isinstance(f, Function)
            and compat.is_same_space(f.function_space, g.function_space)
            for f, g in zip(given, functions)
        )
        if not fits:
            names = ", ".join(f.name for f in functions)
            raise ContactError(
                f"{name} must be a Function in the space of each unknown ({names}), "
                f"not {described(given)}; the unknowns are {described(functions)}"
            )
        for f in given:
            if not np.all(np.isfinite(f.x.array)):
                raise ContactError(
                    f"{name} has values that are not finite, in {f.name}"
                )
    sizes = np.diff(unknowns.owned_starts)
    return np.concatenate([f.x.array[:n] for f, n in zip(given, sizes)])

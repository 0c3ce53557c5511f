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
from ..core.discretization.forms import check_form
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
from ..solvers.kept_forms import Inputs, inputs_of
from .massless import RULES, coupled_mass, replacement

MASSES = (*RULES, "consistent")
# Share of the largest mass of an unknown up to which a negative one is rounding
ROUNDING = 1e-12
# Share of the free mass that may be put on held nodes without a word
LOST = 0.1


class Inertia:
    """Inertia r_I(a) of the bodies, as Q^T r_I(Q a). Collective.

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

    Attributes
    ----------
    mass
        Rule for the mass, as it was given.

    Raises
    ------
    ContactError
        If the form is none in the displacement's space.
    SetUpError
        At the first use: if the form gives some unknown a negative mass, or if a body is
        too thin for nodes off its contact surfaces.

    Notes
    -----
    Nodes of slave and master surfaces of contacts have no mass, of ties those of the
    slaves. The matrix Q^T M Q is assembled when it is first needed, and again where
    Constants or Functions in the form have changed.
    """

    def __init__(
        self,
        form: ufl.Form | Sequence[ufl.Form | None],
        contact: Contact | Sequence[Contact],
        mass: str = "nearest",
    ) -> None:
        self.contact = one_or_several(contact)
        comm = self.contact.unknowns.comm
        with together(comm):
            self._forms = list(form) if isinstance(form, (list, tuple)) else [form]
            self.mass = choice("mass", mass, MASSES)
            self._check()
        require_agreement(comm, mass=mass, forms=len(self._forms))
        self._compiled = [compat.form(one) for one in self._forms]
        self._inputs = Inputs(*inputs_of(self._forms), [])
        self._at: tuple[int, ...] = ()
        self._M: Any = None  # Q^T M Q from the first use on, as `_Q`
        self._Q: Any = None
        self._free: Any = None
        self._fixed: Mask = np.zeros(0, dtype=bool)
        # Unknowns that conditions prescribe where a path begins
        self._held: Mask | None = None
        self._moving = 1.0  # mass of the others, over that with a consistent mass
        self.revision = 0

    def __repr__(self) -> str:
        return f"<Inertia with mass {self.mass!r}, {len(self._forms)} forms>"

    def _check(self) -> None:
        """Raise unless each form is bilinear in one space."""
        wanted = (
            "a bilinear form in trial and test function of the displacement's space"
        )
        if all(one is None for one in self._forms):
            raise ContactError(f"form must be {wanted}")
        for one in self._forms:
            if one is not None:
                check_form("form", one, 2, wanted)
                V, W = (argument.ufl_function_space() for argument in one.arguments())
                if not compat.is_same_space(V, W):
                    raise ContactError(f"form must be {wanted}, not of two spaces")

    def _check_unknowns(self) -> None:
        """Raise unless there is a form for each unknown, in its space."""
        functions = self.contact.unknowns.functions
        if len(self._forms) != len(functions):
            raise ContactError(
                f"inertia has {len(self._forms)} forms for {len(functions)} unknowns: "
                "give a list with one for each, None for what has no inertia"
            )
        for one, f in zip(self._forms, functions):
            if one is not None:
                V, space = one.arguments()[0].ufl_function_space(), f.function_space
                if not compat.is_same_space(V, space):
                    raise ContactError(
                        f"the form of inertia is not in the space of {f.name}, which "
                        "the problem solves for"
                    )

    def begin(self, fixed: Mask) -> None:
        """Take the owned unknowns that conditions prescribe where a path begins, (n,),
        and warn of mass that they hold. Collective."""
        if self._held is None or self._comm_any(self._held != fixed):
            self._held, self._M = fixed.copy(), None
        _ = self.matrix
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
        layout = self.contact.layout
        at = (*layout.ranges.tolist(), layout.n)
        changed = self._inputs.have_changed() or at != self._at or self._M is None
        if layout.comm.allreduce(int(changed)):
            self._at = at
            self._assemble()
        return self._M

    def _assemble(self) -> None:
        """Assemble Q^T M Q."""
        layout = self.contact.layout
        with together(layout.comm):
            self._check_unknowns()
        destroy(self._M, self._Q, self._free)
        self._free = self._Q = None
        M = coupled_mass(layout, self._compiled)
        diagonal = M.getDiagonal()
        least, most = diagonal.min()[1], diagonal.max()[1]
        diagonal.destroy()
        if least < -ROUNDING * abs(most):
            raise SetUpError(
                f"the form of inertia has a negative mass, {least:.6g} at one unknown: "
                "the density rho of rho * inner(a, v) must not be negative"
            )
        if self.mass != "consistent":
            fixed = np.zeros(layout.size, dtype=bool)
            if self._held is not None:
                fixed[: len(self._held)] = self._held
            self._Q = replacement(self.contact, layout, M, self.mass, fixed)
            whole = M.ptap(self._Q)
            self._moving = _share_of_free(M, whole, fixed)
            M.destroy()
            M = whole
        self._M = without_zeros(M)
        M.destroy()
        self.revision += 1

    def between_free(self, fixed: Mask) -> PETSc.Mat:
        """Entries of the matrix between owned unknowns that are not `fixed`, zero
        elsewhere. Collective."""
        _, layout = self.matrix, self.contact.layout
        anew = self._free is None or not np.array_equal(fixed, self._fixed)
        if layout.comm.allreduce(int(anew)):
            destroy(self._free)
            self._free, self._fixed = self.only_between(~fixed), fixed.copy()
            self.revision += 1
        return self._free

    def only_between(self, chosen: Mask) -> PETSc.Mat:
        """Copy the entries of the matrix between chosen owned unknowns, and set the
        others to zero. Collective."""
        found = self.matrix.copy()
        mark = found.createVecRight()
        mark.array[: len(chosen)] = chosen
        found.diagonalScale(mark, mark)
        mark.destroy()
        return found

    @property
    def is_massive(self) -> Mask:
        """Whether each owned unknown of the forms has mass, (n,). Collective."""
        return self.diagonal() > 0.0

    def diagonal(self) -> Array:
        """Diagonal of the matrix at the owned unknowns of the forms, (n,). Mass.
        Collective."""
        diagonal = self.matrix.getDiagonal()
        found: Array = diagonal.array_r[: self.contact.layout.n].copy()
        diagonal.destroy()
        return found

    # Products

    def times(self, values: Array) -> Array:
        """Multiply Q^T M Q with values of the owned unknowns of the forms, (n,).
        Collective."""
        return product(self.matrix, values)[: len(values)]

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

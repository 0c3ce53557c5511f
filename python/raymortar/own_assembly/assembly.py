"""Matrices and vectors of contact for a user's own assembly."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from petsc4py import PETSc

import numpy as np

from .. import _cpp
from ..core import compat
from ..core.compat import Array
from ..core.errors import ContactError, raise_everywhere, together
from ..core.interaction import Interaction
from ..core.system.coupled import ROOM
from .checks import (
    check_bilinear,
    check_linear,
    require,
    require_alpha,
    require_conditions,
    require_no_terms,
    require_rows,
    require_turns,
)


class OwnAssembly:
    """Adds contact to matrices and vectors that a user assembles. Collective.

    Each method is that of `Contact` of this name, or of several contacts.
    """

    def __init__(self, contact: Interaction) -> None:
        self._contacts, self._system = contact.contacts, contact.system

    def create_matrix(self, a: Any) -> PETSc.Mat:
        require_no_terms(self._contacts)
        system = self._system
        volume = system.parts[0].volume
        if volume is None or volume.form is not a:
            with together(system.comm):
                check_bilinear(a, system.unknowns)
            for part in system.parts:
                if part.unknowns.spaces is None:
                    part.unknowns.spaces = [compat.test_space(a)]
            system.prepare(a)
        return system.create_matrix()

    def create_vector(self, L: Any) -> PETSc.Vec:
        with together(self._system.comm):
            check_linear(L)
        layout = self._system.layout
        if layout.more_than_forms:
            return layout.create_vector()
        return layout.create_form_vector()

    @contextmanager
    def form_block(self, b: PETSc.Vec) -> Iterator[PETSc.Vec]:
        require_rows(self._system, "form_block", b, PETSc.Vec)
        layout = self._system.layout
        n = layout.n
        if not layout.more_than_forms:
            with b.localForm() as local:
                local.array[n:] = 0.0
            yield b
            return
        part = layout.create_form_vector()
        try:
            part.array[:] = b.array_r[:n]
            yield part
            b.array[:n] = part.array_r
        finally:
            part.destroy()

    def make_room(self, A: PETSc.Mat) -> bool:
        require(self._system, "make_room", A, PETSc.Mat)
        return self._system.extend_room(A)

    def assemble_matrix(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        require_no_terms(self._contacts)
        system = self._system
        require(system, "assemble_matrix", A, PETSc.Mat)
        is_foreign = A.getAttr(ROOM) is None  # not from `create_matrix`
        if not is_foreign and system.lacks_room(A):
            raise ContactError(
                "A has no room for the present pairs: call contact.make_room(A) after "
                "update, before the forms are assembled; several contacts share A as "
                "NonlinearProblem(F, contacts).contact"
            )
        bcs = require_conditions(system, bcs)
        # PETSc has no memory for the flush of a matrix that is not set up
        A.setUp()
        # PETSc refuses to mix adding and inserting without a flush between them
        A.assemble(PETSc.Mat.AssemblyType.FLUSH)
        if is_foreign:
            self._add_to_foreign(A, bcs)
        else:
            system.add_tangent(A, bcs)

    def _add_to_foreign(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        """Add the tangent to a matrix in which each rank may find no room for its
        rows. Collective."""
        with together(self._system.comm):
            try:
                self._system.add_tangent(A, bcs)
            except _cpp.Error as error:
                raise ContactError(
                    "A has no room for contact: make it by "
                    "contact.create_matrix(a), or call contact.make_room(A) before the "
                    f"forms are assembled ({error})"
                ) from error

    def assemble_vector(self, b: PETSc.Vec, bcs: Sequence[Any]) -> None:
        require_no_terms(self._contacts)
        require(self._system, "assemble_vector", b, PETSc.Vec)
        bcs = require_conditions(self._system, bcs)
        b.assemble()  # what was inserted
        self._system.add_residual(b, bcs)

    def apply_lifting(
        self, b: PETSc.Vec, bcs: Sequence[Any], x0: Array, alpha: float
    ) -> None:
        system = self._system
        require(system, "apply_lifting", b, PETSc.Vec)
        found, shape = np.shape(x0), system.u.x.array.shape
        message = f"x0 must be a ghosted array of u, of shape {shape}, not {found}"
        raise_everywhere(system.comm, None if found == shape else message)
        require_alpha(system, alpha)
        bcs = require_conditions(system, bcs)
        system.constrained(bcs)
        b.assemble()  # what was inserted
        system.cpp.lift(b.handle, system.unknowns.increment_u(bcs, x0), alpha)
        b.assemble()

    def from_vector(self, x: PETSc.Vec) -> None:
        system = self._system
        require_rows(system, "from_vector", x, PETSc.Vec)
        with x.localForm() as local:
            has_ghosts = bool(local)
        if has_ghosts:
            x.ghostUpdate(PETSc.InsertMode.INSERT, PETSc.ScatterMode.FORWARD)
        if system.layout.bodies:
            require_turns(system, x)
        system.layout.from_vector(x, system.scales)

    def to_vector(self, x: PETSc.Vec) -> None:
        require_rows(self._system, "to_vector", x, PETSc.Vec)
        self._system.to_vector(x)

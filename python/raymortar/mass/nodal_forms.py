"""Bilinear forms of accelerations or velocities, and their matrices."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
import ufl
from ufl.algorithms import expand_derivatives

from ..core import compat
from ..core.compat import Array, Mask
from ..core.discretization.layout import CoupledRows
from ..core.discretization.ranks import destroy
from ..core.discretization.unknowns import Unknowns
from ..core.errors import ContactError, SetUpError, together
from ..setup.forms import check_form
from ..solvers.kept_forms import Inputs, inputs_of
from .massless import coupled_matrix


class NodalForms:
    """Bilinear forms in what nodes have, one by unknown, and their matrix.

    Parameters
    ----------
    name, of
        Argument that they were given as, and what they are forms of.
    given
        One form, or a list with one for each unknown, None for zero.
    unknowns
        Unknowns of the contact.

    Attributes
    ----------
    matrix
        Matrix over the coupled rows, as `set` was given it.
    revision
        Number of matrices so far.

    Raises
    ------
    ContactError
        If a form is not bilinear in one space.
    """

    def __init__(self, name: str, of: str, given: Any, unknowns: Unknowns) -> None:
        wanted = (
            f"a bilinear form of the {of}, a trial function, and a test function, both "
            "of the displacement's space"
        )
        self.forms: Sequence[ufl.Form | None] = (
            list(given) if isinstance(given, (list, tuple)) else [given]
        )
        self._name, self._unknowns = name, unknowns
        if all(one is None for one in self.forms):
            raise ContactError(f"{name} must be {wanted}")
        for one in self.forms:
            if one is not None:
                check_form(name, one, 2, wanted)
                V, W = (argument.ufl_function_space() for argument in one.arguments())
                if not compat.is_same_space(V, W):
                    raise ContactError(f"{name} must be {wanted}, not of two spaces")
        self.forms = [None if f is None else expand_derivatives(f) for f in self.forms]
        self._inputs = Inputs(*inputs_of(self.forms), [])
        self.matrix: Any = None
        self._free: Any = None
        self._fixed: Mask = np.zeros(0, dtype=bool)
        self.revision = 0

    def compile(self) -> None:
        """Compile the forms. Collective."""
        self._compiled = [compat.form(one) for one in self.forms]

    def have_changed(self) -> bool:
        """Whether the forms' values have changed on this rank since the last call, or
        there is no matrix."""
        return self._inputs.have_changed() or self.matrix is None

    def assembled(self, layout: CoupledRows) -> PETSc.Mat:
        """Assemble the forms over the coupled rows. Collective."""
        with together(layout.comm):
            self._check_unknowns()
        return coupled_matrix(layout, self._compiled)

    def _check_unknowns(self) -> None:
        """Raise unless there is a form for each unknown, in its space, and none depends
        on an unknown."""
        functions, name = self._unknowns.functions, self._name
        if len(self.forms) != len(functions):
            raise ContactError(
                f"{name} has {len(self.forms)} forms for {len(functions)} unknowns: "
                "give a list with one for each, None for zero"
            )
        for one, f in zip(self.forms, functions):
            if one is None:
                continue
            V = one.arguments()[0].ufl_function_space()
            if not compat.is_same_space(V, f.function_space):
                raise ContactError(
                    f"{name} is not in the space of {f.name}, which the problem solves "
                    "for"
                )
            for c in one.coefficients():
                if any(compat.same_values(c, g) for g in functions):
                    raise SetUpError(
                        f"{name} depends on {c}, which the problem solves for: its "
                        "forces must be linear in what it is a form of; give it a copy"
                    )

    def set(self, matrix: PETSc.Mat) -> None:
        """Take a matrix."""
        destroy(self.matrix, self._free)
        self.matrix, self._free = matrix, None
        self.revision += 1

    def diagonal(self, n: int) -> Array:
        """The first n owned entries of the diagonal. Collective."""
        diagonal = self.matrix.getDiagonal()
        found: Array = diagonal.array_r[:n].copy()
        diagonal.destroy()
        return found

    def between_free(self, fixed: Mask, comm: MPI.Comm) -> PETSc.Mat:
        """Entries between owned unknowns that are not `fixed`, zero elsewhere.
        Collective."""
        anew = self._free is None or not np.array_equal(fixed, self._fixed)
        if comm.allreduce(int(anew)):
            destroy(self._free)
            self._free, self._fixed = self.only_between(~fixed), fixed.copy()
            self.revision += 1
        return self._free

    def only_between(self, chosen: Mask) -> PETSc.Mat:
        """Copy the entries between chosen owned unknowns, and set the others to zero.
        Collective."""
        found = self.matrix.copy()
        mark = found.createVecRight()
        mark.array[: len(chosen)] = chosen
        found.diagonalScale(mark, mark)
        mark.destroy()
        return found

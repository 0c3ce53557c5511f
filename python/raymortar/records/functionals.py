"""UFL functionals, such as stored energies."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from mpi4py import MPI

import ufl
from dolfinx import fem

from ..core import compat
from ..core.errors import ContactError


def check_functional(name: str, given: Any) -> list[ufl.Form]:
    """UFL forms without arguments as a list: one, a list of one for each mesh, or None
    for none.

    Raises
    ------
    ContactError
        If it is anything else.
    """
    forms = list(given) if isinstance(given, (list, tuple)) else [given]
    found = [form for form in forms if form is not None]
    if not all(isinstance(form, ufl.Form) and not form.arguments() for form in found):
        raise ContactError(
            f"{name} must be a UFL functional: a form without test function, or a list "
            "of one for each mesh"
        )
    return found


def functional(forms: Sequence[ufl.Form], comm: MPI.Comm) -> Callable[[], float]:
    """Compile functionals; what is returned finds their sum. Collective."""
    compiled = [compat.form(form) for form in forms]

    def value() -> float:
        return float(comm.allreduce(sum(map(fem.assemble_scalar, compiled))))

    return value

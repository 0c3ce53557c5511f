"""Functions of PETSc that petsc4py does not have."""

from __future__ import annotations

import ctypes

from petsc4py import PETSc


def option_was_read(name: str) -> bool:
    """Whether anything has read an option that is in PETSc's table now.

    Parameters
    ----------
    name
        With its prefix and without a dash.
    """
    # The module's own symbols include those of the libraries that it is linked with.
    # PETSc writes an int or a byte, by its version
    used = ctypes.c_int(0)
    ctypes.CDLL(PETSc.__file__).PetscOptionsUsed(
        None, name.encode(), ctypes.byref(used)
    )
    return used.value != 0

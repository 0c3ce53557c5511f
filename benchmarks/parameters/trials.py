"""What the tables share: runs that may fail, and coefficients off the automatic one."""

from __future__ import annotations

import contextlib
from unittest import mock

from mpi4py import MPI
from petsc4py import PETSc

import raymortar

COMM = MPI.COMM_SELF
FAILURES = (raymortar.ConvergenceError, raymortar.ContactError, PETSc.Error)
METHODS = {
    "augmented": raymortar.AugmentedLagrangian,
    "penalty": raymortar.Penalty,
}


@contextlib.contextmanager
def automatic_times(factor):
    """The automatic coefficient of either method, times a factor."""
    with contextlib.ExitStack() as stack:
        for method in METHODS.values():
            changed = factor * method.automatic_factor
            patch = mock.patch.object(method, "automatic_factor", changed)
            stack.enter_context(patch)
        yield


def attempt(run, *args, **options):
    """What `run` gives; None if it does not converge."""
    try:
        return run(*args, **options)
    except FAILURES:
        return None


def listed(numbers):
    """Numbers in one field, apart by blanks."""
    return " ".join(f"{number:g}" for number in numbers)

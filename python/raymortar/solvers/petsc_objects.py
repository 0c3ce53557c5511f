"""Matrices, factors and option prefixes of PETSc that solvers share."""

from __future__ import annotations

import itertools
import sys
from collections.abc import Mapping
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

from .. import compat
from ..system.coupled import ROOM

_counter = itertools.count()

# The tangent is unsymmetric and, with a multiplier, has zeros on its diagonal: a
# direct solver has to pivot. Contact fills in more than MUMPS guesses by default.
DIRECT = {
    "ksp_type": "preonly",
    "pc_type": "lu",
    "pc_factor_mat_solver_type": "mumps",
    "mat_mumps_icntl_14": 60,
}

# Relative tolerance of systems that paths solve with one tangent, whose solutions they
# combine
CLOSE = 1e-8


def new_prefix(kind: str) -> str:
    """Prefix of PETSc options that no other solver has, or one would set the other's."""
    return f"raymortar_{kind}_{next(_counter)}_"


def release(solver: Any, comm: MPI.Comm | None, *names: str) -> None:
    """Drop PETSc objects of a solver that ends, and free them.

    Ranks may do so at different times. On several ranks, the next solver on the mesh
    frees the objects that all ranks have dropped.
    """
    if sys.is_finalizing():
        return
    for name in names:
        solver.__dict__.pop(name, None)
    if comm is None or PETSc.Sys.isFinalized():
        return
    if comm.size == 1:
        compat.destroy_garbage(comm)


def renew(ksp: PETSc.KSP, A: PETSc.Mat) -> None:
    """Drop the factors: after a failure MUMPS refuses to factorise anew, and PETSc
    takes a new pattern for the old one (`Contact.make_room`)."""
    ksp.reset()
    ksp.setOperators(A)


def solve_closely(ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec, rtol: float) -> None:
    """x = A^-1 b to `CLOSE`, or to a smaller tolerance, with that of the solver as
    before. Collective."""
    before = ksp.getTolerances()[0]
    ksp.setTolerances(rtol=min(rtol, CLOSE))
    ksp.solve(b, x)
    ksp.setTolerances(rtol=before)


def take_tangent(problem: Any, x: PETSc.Vec, A: PETSc.Mat, ksp: PETSc.KSP) -> None:
    """Tangent at x into A, for a KSP that then knows A's pattern, whichever solver of
    the same matrix has changed it. Collective."""
    problem.J(x, A)
    room = A.getAttr(ROOM)
    if ksp.getAttr(ROOM) != room:
        renew(ksp, A)
        ksp.setAttr(ROOM, room)


def tangent_with(solver: Any, x: PETSc.Vec, springs: Mapping[int, float]) -> None:
    """Tangent at x with springs on its diagonal, those of this rank. Collective."""
    A = solver.A
    take_tangent(solver.problem, x, A, solver.krylov_solver)
    for row, stiffness in springs.items():
        A.setValue(row, row, stiffness, addv=PETSc.InsertMode.ADD_VALUES)
    A.assemble()

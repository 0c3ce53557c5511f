"""Python contexts that know the problem, solvers within solvers, and their errors."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from ..core.discretization.ranks import destroy

# Directions of GMRES that it keeps: they fit into memory at any size that was measured
RESTART = 200

# Difference of two sums that is rounding, over the sums: these may nearly cancel
ROUNDING = 1e-9


def nested(context: type, **inner: Mapping[str, Any]) -> dict[str, Any]:
    """Make options of a Python KSP, and of its inner solvers by prefix."""
    found: dict[str, Any] = {
        "ksp_type": "python",
        "ksp_python_type": f"{context.__module__}.{context.__name__}",
        "pc_type": "none",
    }
    for prefix, options in inner.items():
        found |= {f"{prefix}_{name}": value for name, value in options.items()}
    return found


class KnowsProblem:
    """A Python context of PETSc's that `attach` gives the problem.

    Attributes
    ----------
    contact, row_scale
        The problem's contact, and the factors of the rows of its matrices.
    raised
        Errors that the solver raises after a solve, see `kept_inside`; None:
        nobody does.
    """

    def __init__(self) -> None:
        self.contact: Any = None
        self.raised: list[Exception] | None = None
        self.row_scale: PETSc.Vec | None = None
        # Weak: C would keep the problem alive in a cycle
        self._problem: Any = None

    @property
    def problem(self) -> Any:
        """The problem that is solved."""
        return self._problem()

    def know(
        self,
        problem: Any,
        row_scale: PETSc.Vec | None,
        raised: list[Exception] | None = None,
    ) -> None:
        """Take the problem, the factors of its rows, and the list of errors."""
        self._problem, self.contact = weakref.ref(problem), problem.contact
        self.row_scale, self.raised = row_scale, raised

    def _destroy(self, *names: str) -> None:
        """Free and forget PETSc objects, those that have been made."""
        for name in names:
            destroy(getattr(self, name, None))
            setattr(self, name, None)


def attach(
    ksp: PETSc.KSP,
    problem: Any,
    row_scale: PETSc.Vec | None = None,
    raised: list[Exception] | None = None,
) -> None:
    """Give the problem, the factors of its rows, and a list of errors to raise after a
    solve, to a solver whose options have been read.

    Raises
    ------
    ContactError
        If the solver is iterative, and there are unknowns beside the displacement, or a
        free rigid body.
    """
    for thing in (ksp, ksp.getPC()):
        if thing.getType() == "python":
            context = thing.getPythonContext()
            if isinstance(context, KnowsProblem):
                context.know(problem, row_scale, raised)


class InnerSolvers(KnowsProblem):
    """A PETSc python KSP that leaves systems to an iterative and a direct solver."""

    def __init__(self) -> None:
        super().__init__()
        self.krylov: Any = None  # PETSc.KSP from the first use on, as `direct`
        self.direct: Any = None

    def _made(self, ksp: PETSc.KSP, name: str) -> PETSc.KSP:
        """Make an inner solver with its own prefix. Collective."""
        one = inner_solver(ksp, name)
        one.setFromOptions()
        return one

    def _solve_directly(self, ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """Solve by the direct solver, which is made for its first system. Collective."""
        if self.direct is None:
            self.direct = self._made(ksp, "direct_")
        self._solve_by(self.direct, ksp, b, x)

    def _solve_by(
        self, one: PETSc.KSP, ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec
    ) -> bool:
        """Solve by an inner solver; whether it has converged. Collective."""
        one.setOperators(*ksp.getOperators())
        # SNES and paths may change it from one system to the next
        one.setTolerances(rtol=ksp.getTolerances()[0])
        one.solve(b, x)
        ksp.setConvergedReason(one.getConvergedReason())
        ksp.setIterationNumber(one.getIterationNumber())
        return bool(one.getConvergedReason() > 0)

    def reset(self, ksp: PETSc.KSP) -> None:
        """Forget the operators. Collective."""
        for one in (self.krylov, self.direct):
            if one is not None:
                one.reset()

    def destroy(self, ksp: PETSc.KSP) -> None:
        """Free the inner solvers, as PETSc asks at the end. Collective."""
        self._destroy("krylov", "direct")


def inner_solver(outer: PETSc.KSP | PETSc.PC, name: str) -> PETSc.KSP:
    """Make a solver whose prefix adds a name to the outer one's. Collective."""
    ksp = PETSc.KSP().create(outer.comm)
    ksp.setOptionsPrefix(f"{outer.getOptionsPrefix() or ''}{name}")
    return ksp


def finished(
    outer: PETSc.PC, name: str, matrix: PETSc.Mat, kind: str | None = None
) -> PETSc.KSP:
    """Make an inner solver of a matrix, which it takes over, by default with one
    preconditioner. Collective."""
    ksp = inner_solver(outer, name)
    ksp.setType("preonly")
    ksp.setOperators(matrix)
    if kind is not None:
        ksp.getPC().setType(kind)
    if kind == "lu":
        ksp.getPC().setFactorSolverType("mumps")
    ksp.setFromOptions()
    ksp.setUp()
    matrix.destroy()
    return ksp


def is_symmetric(A: PETSc.Mat) -> bool:
    """Tell whether a matrix is symmetric but for rounding. Collective.

    A x and A^T x of a random x are compared row by row, as bodies and fields may have
    other units.
    """
    x, rows = A.createVecs()
    columns = rows.duplicate()
    x.array[:] = np.random.default_rng(A.comm.rank).uniform(-1.0, 1.0, x.local_size)
    A.mult(x, rows)
    A.multTranspose(x, columns)
    a, b = rows.array_r, columns.array_r
    same = bool(np.all(np.abs(a - b) <= ROUNDING * (np.abs(a) + np.abs(b))))
    destroy(x, rows, columns)
    return bool(A.comm.tompi4py().allreduce(same, MPI.LAND))


def kept_inside(method: Callable[..., None]) -> Callable[..., None]:
    """Let no error of a method that PETSc calls leave through PETSc where a solver raises
    it afterwards: that would keep vectors locked, and petsc4py and DOLFINx put errors of
    their own in its place. A solve ends with values that are no numbers instead."""

    @wraps(method)
    def inside(self: Any, thing: Any, *vectors: PETSc.Vec) -> None:
        if self.raised is None:
            method(self, thing, *vectors)
            return
        try:
            if not self.raised:
                method(self, thing, *vectors)
        except Exception as error:
            self.raised.append(error)
        if self.raised:
            for x in vectors[1:]:
                x.set(np.nan)
            if isinstance(thing, PETSc.KSP):
                thing.setConvergedReason(PETSc.KSP.ConvergedReason.DIVERGED_NANORINF)

    return inside

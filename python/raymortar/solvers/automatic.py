"""The linear solver of a problem whose user chooses none."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from petsc4py import PETSc

from .. import compat
from ..errors import ContactWarning
from .elimination import KnowsProblem, attach
from .lagged_factors import lagged_factors
from .linear import iterative
from .petsc_objects import DIRECT

if TYPE_CHECKING:
    from ..problem import CoupledProblem

log = logging.getLogger("raymortar")

# Unknowns in 3D, by the degree of the displacement, up to which the direct solver is
# the faster one or nearly so, on one rank (measured: docs/parallel.md). In 2D it is
# faster at all sizes that were measured.
MOST_DIRECT = {1: 40_000, 2: 20_000}

# Least and most unknowns, by dimension, for which lagged factors are faster than the
# direct solver. Multigrid comes first (measured: docs/solving.md)
LAGGED = {2: (1_500, 5_000), 3: (2_000, float("inf"))}

# A Krylov solver that does well needs less than a third of this
MOST_ITERATIONS = 100

# Option of SNES, and tolerance of its first linear system. Those that follow are solved
# as exactly as Newton's method needs them (`Forcing`): a third to a half of the Krylov
# iterations go, and Newton iterations stay the same (measured: docs/parallel.md)
INEXACT = {"snes_inexact": 1e-4}

# After so many stalls the iterative solver is not tried again
MOST_STALLS = 2

# Prefixes of options with which the user chooses the linear solver
_ITS_OPTIONS = ("ksp_", "pc_", "mat_", "displacement_", "near_")


def direct() -> dict[str, Any]:
    """PETSc options of the direct solver, MUMPS, for problems of any size."""
    return dict(DIRECT)


def kept_factors(most: float | None = None) -> dict[str, Any]:
    """PETSc options of `direct`. Deprecated: use `direct` or `lagged_factors`.

    Parameters
    ----------
    most
        Without effect.
    """
    warnings.warn(
        "solvers.kept_factors is deprecated and returns solvers.direct(), as factors of "
        "linear bodies are no longer kept: use solvers.direct() or "
        "solvers.lagged_factors()",
        DeprecationWarning,
        stacklevel=2,
    )
    return direct()


def linear_options(
    problem: CoupledProblem,
    given: Mapping[str, Any] | None,
    prefix: str,
    snes: bool = False,
) -> dict[str, Any]:
    """PETSc options of the linear solver that a problem gets. Collective.

    Parameters
    ----------
    problem
        Problem.
    given
        Options that the user has given, without prefix.
    prefix
        Prefix of the options: those in PETSc's table count too.
    snes
        Whether the options are for SNES, which may solve its first systems less
        exactly.

    Returns
    -------
    If the user gives any option of the linear solver, the options of the direct solver,
    which those of the user complete. Otherwise options of the solver that suits the
    size.
    """
    table = PETSc.Options(prefix)
    told = any(name.startswith(_ITS_OPTIONS) for name in given or ())
    told = told or any(table.hasName(name) for name in ("ksp_type", "pc_type"))
    layout = problem.contact.layout
    if layout.comm.allreduce(int(told)):
        return direct()
    unknowns, options, name = layout.size_global, direct(), "a direct one"
    if _suits_multigrid(problem):
        options = {**(INEXACT if snes else {}), **with_fallback()}
        name = "multigrid for the bodies"
    elif _suits_lagged_factors(problem):
        options, name = lagged_factors(_package(problem)), "GMRES with lagged factors"
    if layout.comm.rank == 0:
        log.info("linear solver of %d unknowns: %s", unknowns, name)
    return options


def _suits_lagged_factors(problem: CoupledProblem) -> bool:
    """Whether the problem has a size at which lagged factors pay."""
    dim: int = problem.contact.u.function_space.mesh.topology.dim
    least, most = LAGGED[dim]
    return least <= problem.contact.layout.size_global <= most


def _package(problem: CoupledProblem) -> str:
    """The quicker direct solver for lagged factors: in small problems of 2D a solve with
    UMFPACK's takes a third of the time of MUMPS', which works on several ranks."""
    dim: int = problem.contact.u.function_space.mesh.topology.dim
    alone = problem.contact.layout.comm.size == 1
    has_umfpack = PETSc.Sys.hasExternalPackage("suitesparse")
    return "umfpack" if dim == 2 and alone and has_umfpack else "mumps"


def _suits_multigrid(problem: CoupledProblem) -> bool:
    """Whether the iterative solver is the better choice. Collective."""
    contact = problem.contact
    unknowns = contact.layout.size_global
    if not contact.host.is_plain:
        return False
    if contact.u.function_space.mesh.topology.dim < 3:
        return False
    degree = compat.element_info(contact.u.function_space).degree
    return bool(unknowns > MOST_DIRECT.get(degree, MOST_DIRECT[2]))


def with_fallback(**options: Any) -> dict[str, Any]:
    """PETSc options of an iterative solver that falls back to the direct one.

    Parameters
    ----------
    options
        Further options, as for `iterative`, without prefix.
    """
    first = iterative("bodies", **{"ksp_max_it": MOST_ITERATIONS, **options})
    return {
        "ksp_type": "python",
        "ksp_python_type": f"{__name__}.{SolverWithFallback.__name__}",
        "ksp_rtol": first["ksp_rtol"],
        "pc_type": "none",
        **{f"iterative_{name}": value for name, value in first.items()},
        **{f"direct_{name}": value for name, value in DIRECT.items()},
    }


class SolverWithFallback(KnowsProblem):
    """An iterative solver, and a direct one where it stalls. A PETSc python KSP.

    Attributes
    ----------
    iterative, direct
        Inner solvers, whose prefixes add ``iterative_`` and ``direct_`` to that of the
        outer one. The direct solver is made at the first stall.
    stalls
        Number of linear solves in which the iterative solver has stalled.
    """

    def __init__(self) -> None:
        super().__init__()
        self.iterative: Any = None
        self.direct: Any = None
        self.stalls = 0

    def solve(self, ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """x = A^-1 b. Collective."""
        if self.stalls < MOST_STALLS:
            if self.iterative is None:
                self.iterative = self._made(ksp, "iterative_")
                attach(self.iterative, self.problem, self.row_scale)
            reason = self._try(ksp, b, x)
            if reason > 0:
                return
            self.stalls += 1
            self._tell(ksp, reason)
            self.iterative.reset()
        if self.direct is None:
            self.direct = self._made(ksp, "direct_")
        self.direct.setOperators(*ksp.getOperators())
        self.direct.solve(b, x)
        ksp.setConvergedReason(self.direct.getConvergedReason())

    def _try(self, ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec) -> int:
        """Solve with the iterative solver; PETSc's reason for its end. Collective."""
        self.iterative.setOperators(*ksp.getOperators())
        # SNES may change it from one system to the next
        self.iterative.setTolerances(rtol=ksp.getTolerances()[0])
        self.iterative.solve(b, x)
        reason = int(self.iterative.getConvergedReason())
        ksp.setConvergedReason(reason)
        ksp.setIterationNumber(self.iterative.getIterationNumber())
        return reason

    def _made(self, ksp: PETSc.KSP, name: str) -> PETSc.KSP:
        """An inner solver with options of its own. Collective."""
        one = PETSc.KSP().create(ksp.comm)
        one.setOptionsPrefix(f"{ksp.getOptionsPrefix() or ''}{name}")
        one.setFromOptions()
        return one

    def _tell(self, ksp: PETSc.KSP, reason: int) -> None:
        """Warn, on every rank, that the direct solver takes over."""
        more = self.stalls == MOST_STALLS
        warnings.warn(
            f"the iterative linear solver has stalled after "
            f"{self.iterative.getIterationNumber()} iterations (PETSc's reason "
            f"{reason}): the direct one takes over"
            + (" from here on" if more else " for this system"),
            ContactWarning,
            stacklevel=2,
        )

    def reset(self, ksp: PETSc.KSP) -> None:
        """Forget the operators. Collective."""
        for one in (self.iterative, self.direct):
            if one is not None:
                one.reset()

    def destroy(self, ksp: PETSc.KSP) -> None:
        """The end, called by PETSc. Collective."""
        for one in (self.iterative, self.direct):
            if one is not None:
                one.destroy()
        self.iterative = self.direct = None

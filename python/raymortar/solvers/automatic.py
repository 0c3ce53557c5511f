"""The linear solver that suits the size of a problem, and iterative ones."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any

from petsc4py import PETSc

import numpy as np

from .. import _cpp
from ..core import compat, on_demand
from ..core.errors import warn
from ..core.problem import CoupledProblem
from ..core.solvers.petsc_objects import DIRECT
from .inner import RESTART, InnerSolvers, attach, kept_inside, nested
from .linear import direct, inexact

log = logging.getLogger("raymortar")

# Prefixes of options with which the user chooses the linear solver, and an option of
# ours, which PETSc does not know
_ITS_OPTIONS = ("ksp_", "pc_", "mat_", "displacement_", "near_")
INEXACT_OPTION = "snes_inexact"

# Unknowns in 3D, by the degree of the displacement, and in 2D, up to which the direct
# solver is the faster one or nearly so, on one rank and on two
# (docs/measured/linear_choice.md)
MOST_DIRECT = {1: 20_000, 2: 15_000}
MOST_DIRECT_2D = 300_000

# Unknowns in 3D from which linear bodies keep their factors, in place of the direct
# solver's, and the share of its operations that they may take (measured:
# docs/measured/linear_bodies.md)
LEAST_KEPT, MOST_KEPT = 2_000, 0.7

# Least and most unknowns, by dimension, for which lagged factors are faster than the
# direct solver. The solvers above come first (docs/measured/solving.md)
LAGGED = {2: (1_500, 5_000), 3: (2_000, float("inf"))}

# A Krylov solver that does well needs less than a third of this
MOST_ITERATIONS = 100

# After so many stalls the iterative solver is not tried again
MOST_STALLS = 2

_KRYLOV = {"ksp_type": "gmres", "ksp_gmres_restart": RESTART, "ksp_rtol": 1e-8}

# Only problems of their sizes need these modules
_BODIES_PRECONDITIONER = f"{__package__}.elimination.BodiesPreconditioner"
_kept_factors = on_demand.function(f"{__package__}.keeping_factors.kept_factors")
_lagged_factors = on_demand.function(f"{__package__}.lagging_factors.lagged_factors")

# For `BodiesPreconditioner`, whose relaxation depends on the number of ranks
_BODIES = {
    "displacement_pc_type": "mg",
    # On several ranks: smaller eigenvalues than a tenth of the largest matter here
    "displacement_mg_levels_ksp_chebyshev_esteig": "0,0.05,0,1.05",
    "displacement_mg_coarse_ksp_type": "preonly",
    "displacement_mg_coarse_pc_type": "lu",
    "displacement_mg_coarse_pc_factor_mat_solver_type": "mumps",
    "displacement_levels_ksp_type": "preonly",
    "displacement_levels_pc_type": "gamg",
    # Not the zeros in rows of prescribed dofs
    "displacement_levels_pc_gamg_threshold": 0.01,
    # The order of PETSc up to 3.18, which ignores the option: without, iterations
    # grow
    "displacement_levels_pc_gamg_mis_k_minimum_degree_ordering": 1,
    "displacement_levels_pc_gamg_coarse_eq_limit": 3000,
    # Only the interpolations are used
    "displacement_levels_mg_levels_ksp_type": "richardson",
    "displacement_levels_mg_levels_pc_type": "none",
    "displacement_levels_mg_coarse_pc_type": "none",
    "near_pc_type": "lu",
    "near_pc_factor_mat_solver_type": "mumps",
    "near_mat_mumps_icntl_14": 60,
}

MULTIGRIDS = ("bodies",)


def iterative(multigrid: str = "bodies", **options: Any) -> dict[str, Any]:
    """PETSc options of an iterative linear solver, for `NewtonSolver` or `SNESSolver`.

    The tangent is [[K, B], [C, D]] over [u, multiplier / gamma]: unsymmetric, and D is
    zero where contact is closed. Multigrid works for neither property. With a penalty
    there is K alone, whose coarse levels must represent the rigid motions of the
    bodies.

    Parameters
    ----------
    multigrid
        ``"bodies"``: levels of the bodies without contact, and a direct solver for the
        unknowns near contact.
    options
        Options to add or to replace, such as ``ksp_rtol=1e-6``. ``bodies_most``: Krylov
        iterations that blocks of a former tangent may cost before new ones are taken,
        twice as many ahead of a solve's last tangent; -1: each tangent gives new ones.

    Returns
    -------
    GMRES with `BodiesPreconditioner`, whose multigrid has the prefix ``displacement_``.
    """
    if multigrid not in MULTIGRIDS:
        raise ValueError(f"multigrid must be one of {MULTIGRIDS}, not {multigrid!r}")
    outer = {"pc_type": "python", "pc_python_type": _BODIES_PRECONDITIONER}
    return {**_KRYLOV, **outer, **_BODIES, **options}


def with_fallback(**options: Any) -> dict[str, Any]:
    """PETSc options of an iterative solver that falls back to the direct one.

    Parameters
    ----------
    options
        Further options, as for `iterative`, without prefix.
    """
    first = iterative("bodies", **{"ksp_max_it": MOST_ITERATIONS, **options})
    inner = nested(SolverWithFallback, iterative=first, direct=DIRECT)
    return inner | {"ksp_rtol": first["ksp_rtol"]}


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
    If the user gives any option of the linear solver, the options of the direct solver
    (those of MUMPS only if factors are made), which the user's complete. Otherwise
    options of the solver that suits the size. With them those that the tolerance
    ``snes_inexact`` stands for.
    """
    given, table = given or {}, PETSc.Options(prefix)
    given_by_options = any(name.startswith(_ITS_OPTIONS) for name in given) or any(
        table.hasName(name) for name in ("ksp_type", "pc_type")
    )
    comm = problem.comm
    if comm.allreduce(int(given_by_options)):
        kind = given.get("pc_type", table.getString("pc_type", "lu"))
        # MUMPS makes no factors of other kinds, such as ILU
        named = DIRECT if kind in ("lu", "cholesky") else ("ksp_type", "pc_type")
        options = {name: DIRECT[name] for name in named}
    else:
        options, name = suited_to_size(problem, snes)
        unknowns = problem.contact.layout.size_global
        if comm.rank == 0:
            log.info("linear solver of %d unknowns: %s", unknowns, name)
    if INEXACT_OPTION in given:
        options |= inexact(float(given[INEXACT_OPTION]))
    return options


def suited_to_size(problem: CoupledProblem, snes: bool) -> tuple[dict[str, Any], str]:
    """Choose the linear solver of a problem by its size: PETSc options, and a name.
    Collective."""
    contact = problem.contact
    comm, unknowns = contact.layout.comm, contact.layout.size_global
    V = contact.u.function_space
    dim: int = V.mesh.topology.dim
    least, most = LAGGED[dim]
    options, name = direct(), "a direct one"
    most_direct = np.inf
    if contact.unknowns.is_plain and dim == V.mesh.geometry.dim:
        degree = compat.element_info(V).degree
        in_3d = MOST_DIRECT.get(degree, MOST_DIRECT[2])
        most_direct = in_3d if dim == 3 else MOST_DIRECT_2D
    if unknowns > most_direct:
        options = {**(inexact() if snes else {}), **with_fallback()}
        name = "multigrid for the bodies"
    elif (
        comm.size == 1
        and V.mesh.geometry.dim == 3
        and unknowns >= LEAST_KEPT
        and problem.is_linear
    ):
        options, name = _kept_factors(MOST_KEPT), "a direct one that keeps factors"
    elif least <= unknowns <= most:
        # In small problems of 2D a solve with UMFPACK's factors takes a third of the
        # time of MUMPS', which works on several ranks
        names = "umfpack", "suitesparse"  # of PETSc 3.22, and before
        alone = comm.size == 1 and any(map(PETSc.Sys.hasExternalPackage, names))
        options = _lagged_factors("umfpack" if dim == 2 and alone else "mumps")
        name = "GMRES with lagged factors"
    return options, name


class SolverWithFallback(InnerSolvers):
    """An iterative solver, and a direct one where it stalls. A PETSc python KSP.

    Attributes
    ----------
    krylov, direct
        Inner solvers, whose prefixes add ``iterative_`` and ``direct_`` to that of the
        outer one. The direct solver is made at the first stall.
    stalls
        Number of linear solves in which the iterative solver has stalled.
    """

    def __init__(self) -> None:
        super().__init__()
        self.stalls = 0

    @kept_inside
    def solve(self, ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """Solve A x = b. Collective."""
        if self.stalls < MOST_STALLS:
            if self.krylov is None:
                self.krylov = self._made(ksp, "iterative_")
                attach(self.krylov, self.problem, self.row_scale, self.raised)
            reused = _cpp.is_reused(ksp.getPC().handle)
            self.krylov.getPC().setReusePreconditioner(reused)
            if self._solve_by(self.krylov, ksp, b, x) or self._solve_anew(ksp, b, x):
                return
            self._drop_blocks()
            self.stalls += 1
            last = self.stalls == MOST_STALLS
            until = "from here on" if last else "for this system"
            warn(  # on every rank
                f"the iterative linear solver has stalled after "
                f"{self.krylov.getIterationNumber()} iterations (PETSc's reason "
                f"{self.krylov.getConvergedReason()}): the direct one takes over "
                f"{until}",
                page="solves",
            )
        self._solve_directly(ksp, b, x)

    def _solve_anew(self, ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec) -> bool:
        """Solve with blocks of the present tangent where those of a former one have not
        served; whether that has converged. Collective."""
        context = self._bodies
        if context is None or context.was_new:
            return False
        self._drop_blocks()
        x.set(0.0)
        return self._solve_by(self.krylov, ksp, b, x)

    def _drop_blocks(self) -> None:
        """Free what the preconditioner has of tangents. Collective."""
        if self._bodies is not None:
            self._bodies.forget()
        self.krylov.reset()

    @property
    def _bodies(self) -> Any:
        """The `BodiesPreconditioner`; None where the user has chosen another one."""
        pc = self.krylov.getPC()
        return pc.getPythonContext() if pc.getType() == "python" else None

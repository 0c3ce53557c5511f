"""Iterative linear solvers: PETSc options for each method.

The tangent is [[K, B], [C, D]] over [u, multiplier / gamma]: unsymmetric, and D is zero
where contact is closed. Multigrid works for neither property. With a penalty there is K
alone, whose coarse levels must represent the rigid motions of the bodies.
"""

from __future__ import annotations

from typing import Any

from .bodies import BodiesPreconditioner
from .elimination import ContactPreconditioner

_KRYLOV = {"ksp_type": "gmres", "ksp_gmres_restart": 200, "ksp_rtol": 1e-8}

_GAMG = {
    "pc_type": "gamg",
    # All entries: those that vanish in slip leave nodes without a neighbour
    "pc_gamg_threshold": -1.0,
    # A node without neighbours has fewer unknowns than there are rigid motions, so that
    # diagonals of coarse levels vanish: PETSc's Jacobi accepts that, its SOR does not
    "mg_levels_ksp_type": "chebyshev",
    "mg_levels_ksp_max_it": 3,
    "mg_levels_pc_type": "jacobi",
}

_MULTIGRID = {
    "gamg": _GAMG,
    # Aggregates of direct neighbours on the finest level too: twice the set-up, and
    # iterations that do not grow (measured: docs/parallel.md)
    "gamg-bounded": {
        **_GAMG,
        "pc_gamg_aggressive_coarsening": 0,
        # What PETSc did up to 3.18, which passes over this: without, iterations grow
        "pc_gamg_mis_k_minimum_degree_ordering": 1,
        "pc_mg_cycle_type": "w",
    },
    "hypre": {
        "pc_type": "hypre",
        "pc_hypre_type": "boomeramg",
        "pc_hypre_boomeramg_strong_threshold": 0.5,
        "pc_hypre_boomeramg_nodal_coarsen": 6,
        "pc_hypre_boomeramg_relax_type_all": "SOR/Jacobi",
    },
}

# Of `BodiesPreconditioner`, whose relaxation depends on the number of ranks
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
    # What PETSc did up to 3.18, as above
    "displacement_levels_pc_gamg_mis_k_minimum_degree_ordering": 1,
    "displacement_levels_pc_gamg_coarse_eq_limit": 1000,
    # Only the interpolations are used
    "displacement_levels_mg_levels_ksp_type": "richardson",
    "displacement_levels_mg_levels_pc_type": "none",
    "displacement_levels_mg_coarse_pc_type": "none",
    "near_pc_type": "lu",
    "near_pc_factor_mat_solver_type": "mumps",
    "near_mat_mumps_icntl_14": 60,
}

MULTIGRIDS = (*_MULTIGRID, "bodies")


def iterative(multigrid: str = "gamg", **options: Any) -> dict[str, Any]:
    """PETSc options of an iterative linear solver, for `NewtonSolver` or `SNESSolver`.

    Parameters
    ----------
    multigrid
        ``"gamg"`` (PETSc's own, smoothed aggregation), ``"gamg-bounded"`` (the same
        with finer coarse levels, for iterations that refinement does not change),
        ``"hypre"`` (BoomerAMG) or ``"bodies"`` (levels of the bodies without contact,
        and a direct solver for the unknowns near contact; the best for degree 2).
    options
        Options to add or to replace, such as ``ksp_rtol=1e-6``.

    Returns
    -------
    GMRES with `ContactPreconditioner`, whose multigrid has the prefix
    ``displacement_``, or with `BodiesPreconditioner`.
    """
    if multigrid not in MULTIGRIDS:
        raise ValueError(f"multigrid must be one of {MULTIGRIDS}, not {multigrid!r}")
    if multigrid == "bodies":
        context: type[ContactPreconditioner] = BodiesPreconditioner
        inner = _BODIES
    else:
        context = ContactPreconditioner
        inner = {f"displacement_{k}": v for k, v in _MULTIGRID[multigrid].items()}
    outer = {
        "pc_type": "python",
        "pc_python_type": f"{context.__module__}.{context.__name__}",
    }
    return {**_KRYLOV, **outer, **inner, **options}

"""Compiled forms, their vectors and matrices, conditions, and DOLFINx's solver."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import dolfinx
import dolfinx.fem.petsc  # noqa: F401 (makes the C++ module)
import dolfinx.nls.petsc  # noqa: F401 (makes the C++ module)
import numpy as np
import numpy.typing as npt
from dolfinx import cpp as _cpp
from dolfinx import fem

from .generation import Array, Indices, unwrap
from .meshes import contains

# Options of the form compiler and of just-in-time compilation, before DOLFINx 0.6
_FORM_OPTIONS = {"form_compiler_options": "form_compiler_params"}
_FORM_OPTIONS["jit_options"] = "jit_params"

_SEVERAL = (
    "forms of several unknowns: DOLFINx's own Newton solver takes one form, "
    "raymortar.NewtonSolver(problem) takes them all"
)


class _Forms(list[Any]):
    """Name the solver that takes several forms in the errors of DOLFINx's own."""

    def __repr__(self) -> str:
        return _SEVERAL

    @property
    def _cpp_object(self) -> Any:
        raise AttributeError(_SEVERAL)


def form(
    ufl_form: Any,
    form_compiler_options: Mapping[str, Any] | None = None,
    jit_options: Mapping[str, Any] | None = None,
) -> Any:
    """Compile a form, or lists of them with None for what is zero. Collective (the
    first rank compiles).

    Parameters
    ----------
    form_compiler_options, jit_options
        As of ``dolfinx.fem.form``; None: none.
    """
    if isinstance(ufl_form, (list, tuple)):
        options = form_compiler_options, jit_options
        return _Forms(form(one, *options) for one in ufl_form)
    if ufl_form is None:
        return None
    names = inspect.signature(fem.form).parameters
    known = {}
    for name, given in zip(_FORM_OPTIONS, (form_compiler_options, jit_options)):
        if given is not None:
            known[name if name in names else _FORM_OPTIONS[name]] = dict(given)
    return fem.form(ufl_form, **known)


def is_same_space(V: Any, W: fem.FunctionSpace) -> bool:
    """Whether two spaces are one: in a like one DOLFINx passes over W's conditions."""
    return V is W or unwrap(V) == unwrap(W)


def compiled_rank(form: Any) -> int | None:
    """Rank of a compiled form; None for anything else."""
    spaces = getattr(unwrap(form), "function_spaces", None)
    return None if spaces is None else len(spaces)


def compiled_spaces(form: Any) -> list[Any]:
    """C++ spaces of a compiled form's test and trial functions."""
    return list(unwrap(form).function_spaces)


def test_space(form: Any) -> Any:
    """C++ space of a compiled form's test function."""
    return unwrap(form).function_spaces[0]


# Vectors and matrices


def _packed(form: Any) -> tuple[Any, Any, Any]:
    """A compiled form in C++ with its constants and coefficients."""
    form = unwrap(form)
    return form, _cpp.fem.pack_constants(form), _cpp.fem.pack_coefficients(form)


def assemble_residual(b: Array, L: Any) -> None:
    """Add a compiled linear form into a ghosted array; ghosts are not sent home."""
    # Without DOLFINx's layer of Python: a residual is assembled in each iteration
    _cpp.fem.assemble_vector(b, *_packed(L))


def assemble_jacobian(A: PETSc.Mat, a: Any, bcs: Sequence[Any]) -> None:
    """Add a compiled bilinear form into the displacement block of a matrix.

    Constrained rows and columns are left out, and their owned diagonal set to 1.
    Collective, but the final assembly is the caller's; in between, values may be
    inserted or added.

    Parameters
    ----------
    A
        Coupled matrix. Its local-to-global map starts with the ghosted dofs of the
        form's space, unrolled; what follows them is not touched.
    a
        Compiled bilinear form with the same test and trial space.
    bcs
        Dirichlet conditions on that space.
    """
    bcs = [unwrap(bc) for bc in bcs]
    # Unrolled: the multiplier's rows leave the matrix no common block size.
    form, *values = _packed(a)
    _cpp.fem.petsc.assemble_matrix(A, form, *values, bcs, True)
    # PETSc refuses to mix adding and inserting without a flush between them.
    A.assemble(PETSc.Mat.AssemblyType.FLUSH)
    _cpp.fem.petsc.insert_diagonal(A, form.function_spaces[0], bcs, 1.0)
    A.assemble(PETSc.Mat.AssemblyType.FLUSH)


def assemble_blocks(
    A: PETSc.Mat,
    a: Sequence[Sequence[Any]],
    bcs: Sequence[Any],
    starts: npt.NDArray[np.int64],
    fixed: Indices,
) -> None:
    """Add compiled bilinear forms of several unknowns into a matrix.

    As `assemble_jacobian`, which does the same for one.

    Parameters
    ----------
    A
        Coupled matrix. Its local-to-global map has the ghosted dofs of all unknowns,
        one after the other, unrolled.
    a
        Forms by test and trial space; None: zero.
    bcs
        Dirichlet conditions on any of the spaces.
    starts
        First local dof of each unknown, then their number.
    fixed
        Rows of the constrained owned dofs, global.
    """
    bcs = [unwrap(bc) for bc in bcs]
    sets = [
        PETSc.IS().createGeneral(np.arange(*ends, dtype=PETSc.IntType), PETSc.COMM_SELF)
        for ends in zip(starts, starts[1:])
    ]
    for rows, forms in zip(sets, a):
        for columns, one in zip(sets, forms):
            if one is not None:
                part = A.getLocalSubMatrix(rows, columns)
                _cpp.fem.petsc.assemble_matrix(part, *_packed(one), bcs, True)
                A.restoreLocalSubMatrix(rows, columns, part)
    for one in sets:
        one.destroy()
    # PETSc refuses to mix adding and inserting without a flush between them.
    A.assemble(PETSc.Mat.AssemblyType.FLUSH)
    for row in fixed:
        A.setValue(row, row, 1.0, PETSc.InsertMode.INSERT_VALUES)
    A.assemble(PETSc.Mat.AssemblyType.FLUSH)


# Dirichlet conditions


def apply_lifting(
    b: Array, a: Any, bcs: Sequence[Any], x0: Array, scale: float
) -> None:
    """b <- b - scale A (g - x0) over the constrained columns of A; ghosted arrays.

    Parameters
    ----------
    b
        Array to change; ghosts are not sent home.
    a
        Compiled bilinear form of A.
    bcs
        Dirichlet conditions on the form's trial space: the values g.
    x0
        Present solution.
    scale
        Factor; -1 for the residual of Newton's method.
    """
    fem.apply_lifting(b, [a], [list(bcs)], [x0], scale)


def set_bc(
    b: Array, bcs: Sequence[Any], x0: Array | None = None, scale: float = 1.0
) -> None:
    """b = scale (g - x0) at the constrained dofs; ghosted arrays, x0 0 by default."""
    if hasattr(_cpp.fem, "set_bc"):
        _cpp.fem.set_bc(b, bcs, x0, scale)
        return
    for bc in bcs:
        bc.set(b, x0, scale)


def has_condition(V: fem.FunctionSpace, bc: Any) -> bool:
    """Whether a Dirichlet condition is on a space or a part of it."""
    return contains(V, bc.function_space)


def prescribed_values(
    bcs: Sequence[Any], index_map: Any, bs: int
) -> tuple[npt.NDArray[np.int8], Array]:
    """Mark the dofs that conditions on one space prescribe, and find their values.

    Returns
    -------
    marker, values
        Ghosted arrays: 1 where constrained, and the value there (0 elsewhere).
    """
    values = np.zeros((index_map.size_local + index_map.num_ghosts) * bs)
    marker = np.zeros(len(values), dtype=np.int8)
    for bc in bcs:
        marker[bc.dof_indices()[0]] = 1
    set_bc(values, bcs)
    return marker, values


# Solver


def destroy_garbage(comm: MPI.Comm) -> None:
    """Free the PETSc objects that no Python variable of any rank names. Collective.

    From petsc4py 3.18 on they are only put aside, as ranks may drop them at different
    times, and a solver's functions keep all that they refer to.
    """
    clean = getattr(PETSc, "garbage_cleanup", None)
    if clean is not None and not PETSc.Sys.isFinalized():
        clean(comm)


def newton_solver_class() -> type | None:
    """C++ Newton solver of DOLFINx; ``None`` where it has been removed."""
    return getattr(_cpp.nls.petsc, "NewtonSolver", None)


def make_newton_solver(comm: MPI.Comm) -> Any:
    """DOLFINx's C++ Newton solver, the same interface in all versions.

    It has ``setF(fn(x, b), b)``, ``setJ(fn(x, A), A)``, ``set_form(fn(x))``,
    ``set_update(fn(solver, dx, x))``, ``krylov_solver``, ``rtol``, ``atol``,
    ``max_it``, ``convergence_criterion`` (``"residual"`` or ``"incremental"``),
    ``relaxation_parameter``, ``report``, ``error_on_nonconvergence`` and
    ``solve(x) -> (iterations, converged)`` on ``PETSc.Vec``.

    Raises
    ------
    NotImplementedError
        If this DOLFINx no longer has it.
    """
    solver_class = newton_solver_class()
    if solver_class is None:
        raise NotImplementedError(
            f"DOLFINx {dolfinx.__version__} has no Newton solver: use SNES"
        )
    return solver_class(comm)

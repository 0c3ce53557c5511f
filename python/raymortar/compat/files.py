"""Functions in files for ParaView."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import dolfinx
import dolfinx.io
from dolfinx import fem

from ..errors import raise_everywhere, together, writing
from . import pvd
from .meshes import geometry_degree
from .spaces import element_info, space


def of_degree(function: fem.Function, degree: int) -> fem.Function:
    """The function, interpolated to continuous Lagrange of a degree if it is not that."""
    V = function.function_space
    info = element_info(V)
    if info.is_lagrange and not info.is_discontinuous and info.degree == degree:
        return function
    interpolated = fem.Function(space(V.mesh, "Lagrange", degree, info.value_shape))
    interpolated.interpolate(function)
    interpolated.name = function.name
    return interpolated


def of_one_degree(functions: Sequence[fem.Function]) -> list[fem.Function]:
    """Functions interpolated to the highest degree among them, 1 at least.

    What DOLFINx's writers of VTK and VTX files ask for: one element for all. Exact for
    continuous Lagrange functions.
    """
    degrees = (element_info(f.function_space).degree for f in functions)
    degree = max(1, *degrees)
    return [of_degree(f, degree) for f in functions]


def _functions_fault(functions: Any, least: int = 0) -> str | None:
    """Why these cannot be written, if so."""
    listed = isinstance(functions, (list, tuple)) and len(functions) >= least
    if not listed or not all(isinstance(f, fem.Function) for f in functions):
        return f"functions must be a list of Functions, not {functions!r}"
    return None


def _folder_fault(path: Path) -> str | None:
    """Why a file cannot be written there, if so: DOLFINx says nothing, or makes it."""
    found = path.parent.is_dir()
    return None if found else f"{path} cannot be written: there is no such folder"


def write_xdmf(
    filename: str | Path,
    mesh: dolfinx.mesh.Mesh,
    functions: Sequence[fem.Function],
    t: float = 0.0,
    append: bool = False,
) -> None:
    """Write functions on a mesh to an XDMF file for ParaView. Collective.

    XDMF holds values at the mesh's own nodes, or one per cell: functions of another
    degree are interpolated.

    Parameters
    ----------
    filename
        Path of the ``.xdmf`` file; the values go beside it (``.h5``).
    mesh
        Mesh of all functions.
    functions
        Functions with different names.
    t
        Time, or load factor.
    append
        Add a step to the file instead of starting it anew.

    Raises
    ------
    ContactError
        If the file cannot be written.
    """
    raise_everywhere(mesh.comm, _functions_fault(functions))
    raise_everywhere(mesh.comm, _folder_fault(Path(filename)))
    mode = "a" if append else "w"
    with writing(mesh.comm, filename, RuntimeError):
        with dolfinx.io.XDMFFile(mesh.comm, str(filename), mode) as file:
            if not append:
                file.write_mesh(mesh)
            for function in functions:
                cellwise = element_info(function.function_space).degree == 0
                degree = geometry_degree(mesh)
                written = function if cellwise else of_degree(function, degree)
                file.write_function(written, t)


def write_vtk(
    filename: str | Path,
    mesh: dolfinx.mesh.Mesh,
    functions: Sequence[fem.Function],
    t: float = 0.0,
    append: bool = False,
    part: int = 0,
) -> None:
    """Write functions on a mesh to VTK files for ParaView. Collective.

    Unlike XDMF at the nodes of degree 2 too; all are interpolated to the highest degree
    among them.

    Parameters
    ----------
    filename
        Path of the ``.pvd`` file; the ``.vtu`` files of the ranks go beside it.
    mesh
        Mesh of all functions.
    functions
        Functions with different names.
    t
        Time, or load factor.
    append
        Add a step to the file instead of starting it anew.
    part
        Number among what is shown at one time, such as bodies on meshes of their own.

    Raises
    ------
    ContactError
        If the file cannot be written, or read where it is added to.
    """
    raise_everywhere(mesh.comm, _functions_fault(functions, 1))
    path = Path(filename)
    raise_everywhere(mesh.comm, _folder_fault(path))
    before: list[pvd.Entry] = []
    with together(mesh.comm):
        if append and mesh.comm.rank == 0:
            before = pvd.read(path)
    # DOLFINx begins each file anew, with files of the same names beside it
    step = mesh.comm.bcast(len(before), root=0)
    own = path.with_name(f"{path.stem}_{step:04d}_.pvd") if step else path
    with writing(mesh.comm, path, RuntimeError, OSError):
        _write_one_step(own, mesh, of_one_degree(functions), t)
        if mesh.comm.rank == 0 and (step or part):
            (entry,) = pvd.read(own)
            if own != path:
                own.unlink()
            pvd.write(path, [*before, replace(entry, part=part)])


def _write_one_step(
    path: Path, mesh: dolfinx.mesh.Mesh, functions: Sequence[fem.Function], t: float
) -> None:
    """DOLFINx's files of one step; its object writes once more when it ends, which is
    on return. Collective."""
    with dolfinx.io.VTKFile(mesh.comm, str(path), "w") as file:
        file.write_function(functions, t)

"""Functions in files for ParaView."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from mpi4py import MPI

import dolfinx
import dolfinx.io
from dolfinx import fem

from ..errors import ContactError, together, writing
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


def _check(comm: MPI.Comm, path: Path, functions: Any, least: int = 0) -> None:
    """Raise for functions that cannot be written, or a folder that does not exist.

    Collective.
    """
    with together(comm):
        listed = isinstance(functions, (list, tuple)) and len(functions) >= least
        if not listed or not all(isinstance(f, fem.Function) for f in functions):
            raise ContactError(
                f"functions must be a list of Functions, not {functions!r}"
            )
        # DOLFINx says nothing, or makes it
        if not path.parent.is_dir():
            raise ContactError(f"{path} cannot be written: there is no such folder")


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
    _check(mesh.comm, Path(filename), functions)
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
    path = Path(filename)
    _check(mesh.comm, path, functions, 1)
    before: list[Entry] = []
    with together(mesh.comm):
        if append and mesh.comm.rank == 0:
            before = read_collection(path)
    # DOLFINx begins each file anew, with files of the same names beside it
    step = mesh.comm.bcast(len(before), root=0)
    own = path.with_name(f"{path.stem}_{step:04d}_.pvd") if step else path
    with writing(mesh.comm, path, RuntimeError, OSError):
        _write_one_step(own, mesh, of_one_degree(functions), t)
        if mesh.comm.rank == 0 and (step or part):
            (entry,) = read_collection(own)
            if own != path:
                own.unlink()
            write_collection(path, [*before, replace(entry, part=part)])


def _write_one_step(
    path: Path, mesh: dolfinx.mesh.Mesh, functions: Sequence[fem.Function], t: float
) -> None:
    """Write DOLFINx's files of one step. Collective.

    Its object writes once more when it ends, which is on return.
    """
    with dolfinx.io.VTKFile(mesh.comm, str(path), "w") as file:
        file.write_function(functions, t)


# ParaView's collections of files by time, which end in .pvd


@dataclass(frozen=True)
class Entry:
    """A file of a collection.

    Attributes
    ----------
    time
        As text, to the digit.
    part
        Number among the files of one time.
    file
        Name, in the folder of the collection.
    """

    time: str
    part: int
    file: str


def read_collection(path: Path) -> list[Entry]:
    """Files of a collection; none where there is no such file.

    Raises
    ------
    ContactError
        If it cannot be read.
    """
    if not path.exists():
        return []
    try:
        sets = ElementTree.parse(path).getroot().iter("DataSet")
        return [
            Entry(one.attrib["timestep"], int(one.get("part", 0)), one.attrib["file"])
            for one in sets
        ]
    except (OSError, ElementTree.ParseError, KeyError, ValueError) as error:
        raise ContactError(f"{path} cannot be read: {error}") from None


def write_collection(path: Path, entries: Sequence[Entry]) -> None:
    """Write a collection in place of an older one, which is there until then."""
    root = ElementTree.Element("VTKFile", type="Collection", version="1.0")
    collection = ElementTree.SubElement(root, "Collection")
    for one in entries:
        ElementTree.SubElement(
            collection, "DataSet", timestep=one.time, part=str(one.part), file=one.file
        )
    ElementTree.indent(root)
    new = path.with_name(path.name + ".new")
    ElementTree.ElementTree(root).write(new, encoding="utf-8", xml_declaration=True)
    new.replace(path)

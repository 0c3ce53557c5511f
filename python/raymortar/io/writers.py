"""Functions in files for ParaView."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from mpi4py import MPI

import dolfinx
import dolfinx.io
from dolfinx import fem

from ..arguments import writing
from ..core.compat import cell_name, element_info, geometry_degree, space
from ..core.errors import ContactError, described, together


def of_degree(function: fem.Function, degree: int) -> fem.Function:
    """Interpolate a function to continuous Lagrange of a degree, unless it is that."""
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

    DOLFINx's writers of VTK and VTX files need one element for all. Exact for
    continuous Lagrange functions.
    """
    degrees = (element_info(f.function_space).degree for f in functions)
    degree = max(1, *degrees)
    return [of_degree(f, degree) for f in functions]


def _check(comm: MPI.Comm, path: Path, functions: Any, least: int = 0) -> None:
    """Raise for functions or a folder that cannot be written to. Collective."""
    with together(comm):
        listed = isinstance(functions, (list, tuple)) and len(functions) >= least
        if not listed or not all(isinstance(f, fem.Function) for f in functions):
            raise ContactError(
                f"functions must be a list of Functions, not {described(functions)}"
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
    args = mesh.comm, str(filename), "a" if append else "w"
    degree = geometry_degree(mesh)
    with writing(mesh.comm, filename, RuntimeError), dolfinx.io.XDMFFile(*args) as file:
        if not append:
            file.write_mesh(mesh)
        for f in functions:
            cellwise = element_info(f.function_space).degree == 0
            file.write_function(f if cellwise else of_degree(f, degree), t)


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
        Path of the ``.pvd`` file; the ``.vtu`` files of the steps and ranks go into the
        folder ``<stem>_files`` beside it, which is made.
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
    step, folder = mesh.comm.bcast(len(before), root=0), folder_of(mesh.comm, path)
    own = folder / (f"{path.stem}_{step:04d}_.pvd" if step else path.name)
    with writing(mesh.comm, path, RuntimeError, OSError):
        # DOLFINx's object writes once more when it ends
        shown = of_one_degree(functions)
        with dolfinx.io.VTKFile(mesh.comm, str(own), "w") as file:
            file.write_function(shown, t)
        del file
        degree = max(
            element_info(shown[0].function_space).degree, geometry_degree(mesh)
        )
        if degree == 1 or cell_name(mesh) != "hexahedron":
            for part_file in own.parent.glob(f"{own.stem}_p{mesh.comm.rank}_*.vtu"):
                _set_version_1(part_file)
        if mesh.comm.rank == 0:
            (entry,) = read_collection(own)
            own.unlink()
            file = f"{folder.name}/{entry.file}"
            write_collection(path, [*before, entry._replace(part=part, file=file)])


def folder_of(comm: MPI.Comm, path: Path) -> Path:
    """Make the folder of the files that a collection names. Collective."""
    folder = path.with_name(f"{path.stem}_files")
    with writing(comm, path, OSError):
        if comm.rank == 0:
            folder.mkdir(exist_ok=True)
    return folder


def _set_version_1(path: Path) -> None:
    """Call a VTU file one of version 1.0, which is all that meshio reads.

    Later versions, which DOLFINx writes, differ in the order of nodes of hexahedra of
    degree 2 alone.
    """
    with open(path, "r+b") as file:
        head = file.read(300)
        at = head.find(b'version="2.')
        if at >= 0:
            file.seek(at)
            file.write(b'version="1.0"')


# ParaView's collections of files by time, which end in .pvd


class Entry(NamedTuple):
    """A file of a collection, by its path from there."""

    time: str  # to the digit
    part: int  # number among the files of one time
    file: str


def read_collection(path: Path) -> list[Entry]:
    """Files of a collection; none where there is no such file."""
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
    for time, part, file in entries:
        ElementTree.SubElement(
            collection, "DataSet", timestep=time, part=str(part), file=file
        )
    ElementTree.indent(root)
    new = path.with_name(path.name + ".new")
    ElementTree.ElementTree(root).write(new, encoding="utf-8", xml_declaration=True)
    new.replace(path)

"""VTK files of polygons and points, one piece per rank.

Segments are polygons of no mesh, which DOLFINx cannot write. docs/developers.md says why
neither meshio nor VTK does it here. The format is ascii XML:
https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from ..compat import Array
from ..errors import ContactError, writing

Numbers = npt.NDArray[Any]  # whole ones or reals

# VTK's numbers of cell types
VERTEX, LINE, POLYGON = 1, 3, 7


@dataclass
class Piece:
    """Cells of one rank.

    Attributes
    ----------
    points
        Positions, (n, 2) or (n, 3). Length.
    offsets
        Cell i has the points offsets[i] to offsets[i + 1], (cells + 1,).
    cell_type
        `VERTEX`, `LINE` or `POLYGON`.
    cell_data
        Arrays (cells,) or (cells, d) by name.
    """

    points: Array
    offsets: Numbers
    cell_type: int
    cell_data: Mapping[str, Numbers] = field(default_factory=dict)


def _padded(values: Numbers) -> Numbers:
    """Vectors with three components, as VTK wants them."""
    if values.ndim == 1:
        return values[:, None]
    return np.pad(values, ((0, 0), (0, 3 - values.shape[1])))


def _header(name: str, values: Numbers) -> str:
    """Attributes of a DataArray element."""
    kind = "Int64" if np.issubdtype(values.dtype, np.integer) else "Float64"
    components = 1 if values.ndim == 1 else 3
    return f'type="{kind}" Name="{name}" NumberOfComponents="{components}"'


def _array(name: str, values: Numbers) -> str:
    digits = "d" if np.issubdtype(values.dtype, np.integer) else ".17g"
    text = "\n".join(
        " ".join(format(v, digits) for v in row) for row in _padded(values)
    )
    return f'<DataArray {_header(name, values)} format="ascii">\n{text}\n</DataArray>'


def _document(kind: str, body: list[str]) -> str:
    lines = [
        '<?xml version="1.0"?>',
        f'<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian">',
        *body,
        "</VTKFile>",
    ]
    return "\n".join(lines) + "\n"


def _piece(piece: Piece) -> str:
    cells = len(piece.offsets) - 1
    size = int(piece.offsets[-1])
    types = np.full(cells, piece.cell_type, dtype=np.int64)
    body = [
        "<UnstructuredGrid>",
        f'<Piece NumberOfPoints="{size}" NumberOfCells="{cells}">',
        "<Points>",
        _array("Points", piece.points),
        "</Points>",
        "<Cells>",
        _array("connectivity", np.arange(size, dtype=np.int64)),
        _array("offsets", np.asarray(piece.offsets[1:], dtype=np.int64)),
        _array("types", types),
        "</Cells>",
        "<CellData>",
        *(_array(name, values) for name, values in piece.cell_data.items()),
        "</CellData>",
        "</Piece>",
        "</UnstructuredGrid>",
    ]
    return _document("UnstructuredGrid", body)


def _index(piece: Piece, files: list[str]) -> str:
    """The file that joins the pieces of all ranks."""
    body = [
        '<PUnstructuredGrid GhostLevel="0">',
        f"<PPoints><PDataArray {_header('Points', piece.points)}/></PPoints>",
        "<PCellData>",
        *(f"<PDataArray {_header(n, v)}/>" for n, v in piece.cell_data.items()),
        "</PCellData>",
        *(f'<Piece Source="{name}"/>' for name in files),
        "</PUnstructuredGrid>",
    ]
    return _document("PUnstructuredGrid", body)


def write(path: Path, piece: Piece, comm: MPI.Comm) -> None:
    """Write every rank's piece, and what joins them. Collective.

    Parameters
    ----------
    path
        Of the file, ending in ``.vtu``; with several ranks the pieces are
        ``<stem>_<rank>.vtu`` beside ``<stem>.pvtu``.
    piece
        This rank's cells; the names of its data are the same on all ranks.

    Raises
    ------
    ContactError
        If the name has another ending or a file cannot be written.
    """
    if path.suffix != ".vtu":
        raise ContactError(f"{path} must end in .vtu")
    files = [f"{path.stem}_{rank}.vtu" for rank in range(comm.size)]
    with writing(comm, path, OSError):
        if comm.size == 1:
            path.write_text(_piece(piece))
        else:
            path.with_name(files[comm.rank]).write_text(_piece(piece))
            if comm.rank == 0:
                path.with_suffix(".pvtu").write_text(_index(piece, files))

"""DOLFINx's way from a Gmsh model to a mesh, with a partition of the user's."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from types import FunctionType
from typing import Any

from mpi4py import MPI

import dolfinx
import numpy as np
import numpy.typing as npt
from dolfinx import cpp as _cpp

from ..core.compat import HAS_UFL_ELEMENTS, Array
from ..core.errors import ContactError, together
from .arrays import as_destinations, given_partition

Partition = Callable[[Array, int], npt.ArrayLike]
# Type of the coordinates, which 0.5 does not ask for
_REAL = () if HAS_UFL_ELEMENTS else (np.float64,)


def _converter() -> Any:
    """Import DOLFINx's module for Gmsh, which loads Gmsh."""
    try:
        from dolfinx.io import gmsh as converter  # 0.10 and later
    except ImportError:
        from dolfinx.io import gmshio as converter
    return converter


def _partitioner(model: Any, gdim: int, partition: Partition, size: int) -> Any:
    """Make DOLFINx's partitioner for the cells of a model, on the rank that has it."""
    if not callable(partition):
        raise ContactError(
            "partition must be a function of midpoints and the number of ranks, not "
            f"{partition!r}"
        )
    converter = _converter()
    found = converter.extract_topology_and_markers(model)
    # Names of groups come along since 0.10
    topologies = found[0] if isinstance(found, tuple) else found
    properties = model.mesh.getElementProperties
    kind = max(topologies, key=lambda k: int(properties(k)[1]))
    nodes = np.asarray(topologies[kind]["topology"], dtype=np.int64)
    midpoints = converter.extract_geometry(model)[nodes].mean(axis=1)[:, :gdim]
    ranks = as_destinations(partition(midpoints, size), len(nodes), size)
    # UFL's cells of a surface in space have names of their own in 0.5
    cell = str(converter.ufl_mesh(kind, int(properties(kind)[1]), *_REAL).ufl_cell())
    basix_order = converter.cell_perm_array(_cpp.mesh.to_type(cell), nodes.shape[1])
    return given_partition(nodes[:, basix_order], cell, ranks)


def model_to_mesh(
    model: Any, comm: MPI.Comm, gdim: int, rank: int, partition: Partition | None
) -> Any:
    """DOLFINx's function of this name, with a partitioner if one is given. Collective."""
    function = _converter().model_to_mesh
    if not comm.bcast(partition is not None, root=rank):
        return function
    partitioner = given_partition(np.empty((0, 0), np.int64), "", np.empty(0, np.int32))
    with together(comm):
        if comm.rank == rank and partition is not None:
            partitioner = _partitioner(model, gdim, partition, comm.size)
    if comm.size == 1:  # one rank has all cells, in DOLFINx's own order
        return function
    if not HAS_UFL_ELEMENTS:
        return partial(function, partitioner=partitioner)
    # The function of 0.5 takes no partitioner: a copy makes the mesh in another way
    mode, make = dolfinx.mesh.GhostMode.none, dolfinx.mesh.create_mesh
    create_mesh = partial(make, ghost_mode=mode, partitioner=partitioner)
    names = {**function.__globals__, "create_mesh": create_mesh}
    return FunctionType(function.__code__, names, argdefs=function.__defaults__)

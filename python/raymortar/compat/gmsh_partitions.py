"""Partitions of one's own for meshes from Gmsh."""

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

from ..errors import ContactError, together
from .generation import HAS_UFL_ELEMENTS, Array
from .new_meshes import as_destinations, given_partition

Partition = Callable[[Array, int], npt.ArrayLike]
# Type of the coordinates, which 0.5 does not ask for
_REAL = () if HAS_UFL_ELEMENTS else (np.float64,)


def _cells(converter: Any, model: Any) -> tuple[int, npt.NDArray[np.int64]]:
    """Gmsh's type of the cells and their nodes, both in Gmsh's order and in that in
    which ``model_to_mesh`` passes them on."""
    found = converter.extract_topology_and_markers(model)
    # Names of groups come along since 0.10
    topologies = found[0] if isinstance(found, tuple) else found
    kind = max(topologies, key=lambda k: int(model.mesh.getElementProperties(k)[1]))
    return kind, np.asarray(topologies[kind]["topology"], dtype=np.int64)


def _partitioner_of_model(
    converter: Any, model: Any, gdim: int, partition: Partition, size: int
) -> Any:
    """DOLFINx's partitioner for the cells of a model. On the rank that has it."""
    if not callable(partition):
        raise ContactError(
            "partition must be a function of midpoints and the number of ranks, not "
            f"{partition!r}"
        )
    kind, nodes = _cells(converter, model)
    midpoints = converter.extract_geometry(model)[nodes].mean(axis=1)[:, :gdim]
    ranks = as_destinations(partition(midpoints, size), len(nodes), size)
    # UFL's cells of a surface in space have names of their own in 0.5
    tdim = int(model.mesh.getElementProperties(kind)[1])
    cell = str(converter.ufl_mesh(kind, tdim, *_REAL).ufl_cell())
    basix_order = converter.cell_perm_array(_cpp.mesh.to_type(cell), nodes.shape[1])
    return given_partition(nodes[:, basix_order], cell, ranks)


def gmsh_partitioner(
    converter: Any,
    model: Any,
    comm: MPI.Comm,
    gdim: int,
    rank: int,
    partition: Partition | None,
) -> Any:
    """Partitioner that ``model_to_mesh`` can be given. Collective.

    Parameters
    ----------
    converter
        DOLFINx's module for Gmsh.
    model, comm, gdim, rank, partition
        As of `read_gmsh`; model and partition are looked at on ``rank`` only.

    Returns
    -------
    None without a partition, and on one rank: up to DOLFINx.

    Raises
    ------
    ContactError
        If the partition is no function, or does not give each cell a rank.
    """
    here = comm.rank == rank
    if not comm.bcast(partition is not None, root=rank):
        return None
    partitioner = given_partition(
        np.empty((0, 0), np.int64), "", np.empty(0, dtype=np.int32)
    )
    with together(comm):
        if here and partition is not None:
            partitioner = _partitioner_of_model(
                converter, model, gdim, partition, comm.size
            )
    # One rank has all cells, in DOLFINx's own order
    return partitioner if comm.size > 1 else None


def model_to_mesh(converter: Any, partitioner: Any) -> Any:
    """DOLFINx's function of this name, with a partitioner; ``None``: its own."""
    function = converter.model_to_mesh
    if partitioner is None:
        return function
    if not HAS_UFL_ELEMENTS:
        return partial(function, partitioner=partitioner)
    # That of 0.5 takes none: a copy of it, which makes the mesh by another function
    create_mesh = partial(
        dolfinx.mesh.create_mesh,
        ghost_mode=dolfinx.mesh.GhostMode.none,
        partitioner=partitioner,
    )
    names = {**function.__globals__, "create_mesh": create_mesh}
    return FunctionType(function.__code__, names, argdefs=function.__defaults__)

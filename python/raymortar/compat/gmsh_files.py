"""Meshes and tags from Gmsh."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mpi4py import MPI

import dolfinx

from ..errors import ContactError, raise_everywhere
from .generation import Indices
from .gmsh_partitions import Partition, gmsh_partitioner, model_to_mesh
from .meshes import connectivity, meshtags


@dataclass(frozen=True)
class GmshMesh:
    """What was read from Gmsh.

    Attributes
    ----------
    mesh
        The distributed mesh.
    cell_tags, facet_tags
        Tags of physical groups; ``facet_tags`` is empty if there are none.
    names
        (dimension, tag) of each named physical group.

    Examples
    --------
    >>> bodies = read_gmsh("meshes/two_blocks.msh", MPI.COMM_WORLD)
    >>> dofs = fem.locate_dofs_topological(V, 2, bodies.find("bottom"))
    """

    mesh: dolfinx.mesh.Mesh
    cell_tags: Any
    facet_tags: Any
    names: dict[str, tuple[int, int]]

    def find(self, name: str) -> Indices:
        """Cells or facets of a named physical group, those of this rank.

        Raises
        ------
        ContactError
            If no group of cells or facets has the name.
        """
        dim = self.mesh.topology.dim
        known = {k: group for k, group in self.names.items() if group[0] >= dim - 1}
        if name not in known:
            listed = ", ".join(map(repr, known)) or "none"
            raise ContactError(
                f"no physical group of cells or facets is named {name!r}; known names: "
                f"{listed}"
            )
        of_dim, tag = known[name]
        tags = self.cell_tags if of_dim == dim else self.facet_tags
        return tags.find(tag)


def _gmsh_converter() -> Any:
    """DOLFINx's module for Gmsh."""
    try:
        from dolfinx.io import gmsh as converter  # 0.10 and later
    except ImportError:
        from dolfinx.io import gmshio as converter
    return converter


def _physical_names(model: Any) -> dict[str, tuple[int, int]]:
    """Named physical groups of the current Gmsh model."""
    groups = [(int(dim), int(tag)) for dim, tag in model.getPhysicalGroups()]
    names = {model.getPhysicalName(*group): group for group in groups}
    return {name: group for name, group in names.items() if name}


def _gmsh_fault(model: Any) -> str | None:
    """Why the current Gmsh model cannot be read, if so."""
    if not hasattr(model, "getPhysicalGroups"):
        return f"source must be gmsh.model or the path of a .msh file, not {model!r}"
    groups = model.getPhysicalGroups()
    if not groups:
        return "the Gmsh model has no physical groups, which is all that is read"
    top = max(dim for dim, _ in groups)
    types = set()
    for dim, tag in groups:
        if dim == top:
            for entity in model.getEntitiesForPhysicalGroup(dim, tag):
                types.update(model.mesh.getElements(dim, entity)[0])
    if len(types) != 1:
        # DOLFINx before 0.10 crashes on these, and contact needs one type anyway.
        names = sorted(model.mesh.getElementProperties(t)[0] for t in types)
        return f"the cells of the Gmsh model must be of one type, not of {names}"
    return None


def _convert_gmsh(
    model: Any, comm: MPI.Comm, gdim: int, rank: int, partition: Partition | None
) -> GmshMesh:
    """Mesh, tags and names of the Gmsh model that lives on one rank. Collective."""
    here = comm.rank == rank
    raise_everywhere(comm, _gmsh_fault(model) if here else None)
    names = comm.bcast(_physical_names(model) if here else None, root=rank)
    converter = _gmsh_converter()
    partitioner = gmsh_partitioner(converter, model, comm, gdim, rank, partition)
    convert = model_to_mesh(converter, partitioner)
    # A tuple before 0.10, a named tuple with further tags since.
    mesh, cell_tags, facet_tags = convert(model, comm, rank, gdim=gdim)[:3]
    if facet_tags is None:
        facet_tags = meshtags(mesh, mesh.topology.dim - 1, [], [])
    # DOLFINx's locate_dofs_topological asks the user for it, for facets and cells
    tdim = mesh.topology.dim
    for dim in (tdim - 1, tdim):
        connectivity(mesh, dim, tdim)
    return GmshMesh(mesh, cell_tags, facet_tags, names)


def _open_in_gmsh(gmsh: Any, path: Path) -> str | None:
    """Open a file; what is wrong with it, if anything."""
    try:
        gmsh.open(str(path))
    except Exception as error:  # Gmsh raises nothing narrower
        return f"{path} is not a whole Gmsh file: {error}"
    return None


def _read_gmsh_file(
    path: Path, comm: MPI.Comm, gdim: int, rank: int, partition: Partition | None
) -> GmshMesh:
    """Open a file on one rank and convert it. Collective.

    DOLFINx 0.5.2 has such a function too, which returns an undefined name.
    """
    missing = comm.rank == rank and not path.is_file()
    raise_everywhere(comm, f"there is no Gmsh file {path}" if missing else None)
    if comm.rank != rank:
        raise_everywhere(comm, None)  # unless the reading rank has a reason to
        return _convert_gmsh(None, comm, gdim, rank, partition)
    import gmsh

    # Gmsh 4.8 cannot tell, and then a session of the caller's ends here too.
    ours = not getattr(gmsh, "isInitialized", bool)()
    if ours:
        gmsh.initialize(["", "-v", "1"])
    try:
        raise_everywhere(comm, _open_in_gmsh(gmsh, path))
        return _convert_gmsh(gmsh.model, comm, gdim, rank, partition)
    finally:
        if ours:
            gmsh.finalize()


def read_gmsh(
    source: Any,
    comm: MPI.Comm,
    gdim: int = 3,
    rank: int = 0,
    partition: Partition | None = None,
) -> GmshMesh:
    """Mesh and tags from a Gmsh model or file. Collective.

    Parameters
    ----------
    source
        ``gmsh.model``, or the path of a ``.msh`` file; looked at on ``rank`` only.
    comm
        Communicator over which to distribute the mesh.
    gdim
        Dimension of the space, 2 or 3.
    rank
        The rank that holds the model or reads the file.
    partition
        Takes midpoints of cells, shape (n, gdim), and the number of ranks to the rank
        of each cell, shape (n,), such as those of `raymortar.partitions`; looked at on
        ``rank`` only. The mesh then has no ghost cells. Default: up to DOLFINx's graph
        partitioner.

    Raises
    ------
    ContactError
        If the file does not exist or is damaged, there are no physical groups, the
        cells are of several types, or the partition does not give each cell a rank.
    """
    # All ranks take the same branch, whatever was passed on the others.
    is_file = comm.bcast(isinstance(source, (str, Path)), root=rank)
    if is_file:
        path = Path(source) if comm.rank == rank else Path()
        return _read_gmsh_file(path, comm, gdim, rank, partition)
    return _convert_gmsh(source, comm, gdim, rank, partition)

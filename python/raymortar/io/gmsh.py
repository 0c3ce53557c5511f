"""Meshes and tags from Gmsh."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mpi4py import MPI

import dolfinx
import numpy as np

from ..core.compat import Indices, connectivity, meshtags
from ..core.errors import ContactError, format_point, spoken_tag, together
from ..versions.gmsh import Partition, model_to_mesh
from .gmsh_nodes import without_holes


@dataclass(frozen=True)
class GmshMesh:
    """Mesh, tags and names that were read from Gmsh.

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
        tags = {dim: self.cell_tags, dim - 1: self.facet_tags}
        known = {k: group for k, group in self.names.items() if group[0] in tags}
        if name not in known:
            listed = ", ".join(map(repr, known)) or "none"
            raise ContactError(
                f"no physical group of cells or facets is named {name!r}; known names: "
                f"{listed}"
            )
        of_dim, tag = known[name]
        return tags[of_dim].find(tag)


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
        ``rank`` only. The mesh then has no ghost cells. Default: DOLFINx's graph
        partitioner decides.

    Raises
    ------
    ContactError
        If the file does not exist or is damaged, there are no physical groups, the
        cells are of several types, a group has facets that belong to no cell, or the
        partition does not give each cell a rank.
    """
    here, model = comm.rank == rank, source
    with ExitStack() as stack:
        with together(comm):
            if here and isinstance(source, (str, Path)):
                model = stack.enter_context(_opened(Path(source)))
            if here:
                _check_model(model)
                model = without_holes(model)
        names: dict[str, tuple[int, int]] = {}
        for dim, tag in model.getPhysicalGroups() if here else ():
            names[model.getPhysicalName(dim, tag)] = int(dim), int(tag)
        names = comm.bcast(names, root=rank)
        names.pop("", None)
        convert = model_to_mesh(model, comm, gdim, rank, partition)
        # A tuple before 0.10, a named tuple with further tags since.
        mesh, cell_tags, facet_tags = convert(model, comm, rank, gdim=gdim)[:3]
    tdim = mesh.topology.dim
    if facet_tags is None:
        facet_tags = meshtags(mesh, tdim - 1, [], [])
    # DOLFINx's locate_dofs_topological asks the user for it, for facets and cells
    for dim in (tdim - 1, tdim):
        connectivity(mesh, dim, tdim)
    return GmshMesh(mesh, cell_tags, facet_tags, names)


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Open a file in Gmsh; the name of DOLFINx 0.5.2's own reader is undefined."""
    if not path.is_file():
        raise ContactError(f"there is no Gmsh file {path}")
    import gmsh

    # Gmsh 4.8 cannot tell, and then a session of the caller's ends here too.
    ours = not getattr(gmsh, "isInitialized", bool)()
    if ours:
        gmsh.initialize(["", "-v", "1"])
    try:
        try:
            gmsh.open(str(path))
        except Exception as error:  # Gmsh raises nothing narrower
            raise ContactError(f"{path} is not a whole Gmsh file: {error}") from None
        yield gmsh.model
    finally:
        if ours:
            gmsh.finalize()


def _check_model(model: Any) -> None:
    """Raise for a Gmsh model that cannot be read."""
    if not hasattr(model, "getPhysicalGroups"):
        raise ContactError(
            f"source must be gmsh.model or the path of a .msh file, not {model!r}"
        )
    groups = model.getPhysicalGroups()
    if not groups:
        raise ContactError(
            "the Gmsh model has no physical groups, which is all that is read"
        )
    top = max(dim for dim, _ in groups)
    cells = [e for group in groups if group[0] == top for e in _entities(model, *group)]
    types = {k for entity in cells for k in model.mesh.getElements(*entity)[0]}
    if len(types) != 1:
        # DOLFINx before 0.10 crashes on these, and contact needs one type anyway.
        names = sorted(model.mesh.getElementProperties(t)[0] for t in types)
        raise ContactError(
            f"the cells of the Gmsh model must be of one type, not of {names}"
        )
    if top > 1:
        _check_facets(model, groups, cells, *types)


def _entities(model: Any, dim: int, tag: int) -> list[tuple[int, int]]:
    """Entities of a physical group, as Gmsh takes them."""
    return [(dim, int(k)) for k in model.getEntitiesForPhysicalGroup(dim, tag)]


def _check_facets(model: Any, groups: Any, cells: Any, kind: int) -> None:
    """Raise for a group with facets that are none of a cell: DOLFINx crashes on those
    with nodes of their own, and drops the others."""
    mesh, dim = model.mesh, cells[0][0] - 1
    corners = mesh.getElementProperties(kind)[5]
    if corners in (5, 6):  # facets of two shapes, which contact does not take
        return
    rows: dict[int, list[tuple[int, ...]]] = {}
    for tag in (tag for of_dim, tag in groups if of_dim == dim):
        rows[tag] = []
        for entity in _entities(model, dim, tag):
            for k, _, nodes in zip(*mesh.getElements(*entity)):
                *_, width, _, count = mesh.getElementProperties(k)
                found = np.asarray(nodes, dtype=np.int64).reshape(-1, width)
                rows[tag] += map(tuple, np.sort(found[:, :count], axis=1).tolist())
    n = 4 if corners == 8 else dim + 1
    # Corners of the facets of each cell, n for each facet
    faces = np.concatenate(
        [
            mesh.getElementEdgeNodes(kind, entity, True)
            if of_dim == 2
            else mesh.getElementFaceNodes(kind, n, entity, True)
            for of_dim, entity in cells
        ]
    )
    faces = faces.astype(np.int64).reshape(-1, n)
    nodes = [node for of_group in rows.values() for row in of_group for node in row]
    is_used = np.bincount(np.array(nodes, int), minlength=faces.max() + 1) > 0
    near = faces[is_used[faces].all(axis=1)]
    known = set(map(tuple, np.sort(near, axis=1).tolist()))
    for tag, of_group in rows.items():
        bare = [row for row in of_group if row not in known]
        if bare:
            x = np.mean([mesh.getNode(node)[0] for node in bare[0]], axis=0)
            name = model.getPhysicalName(dim, tag) or None
            raise ContactError(
                f"the physical group {spoken_tag(tag, name)} "
                f"has {len(bare)} facet(s) of no cell in a physical group, the first at "
                f"{format_point(x)}: take them out of it, or give their cells a group"
            )

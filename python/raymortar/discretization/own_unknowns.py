"""Functions that a term of the equations brings: on some facets, or one number."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from dolfinx.fem import Function, FunctionSpace
from scipy.spatial import cKDTree

from .. import compat
from ..compat import Array, Indices
from ..errors import ContactError
from .facets import Facets, join
from .joined import Displacement
from .ranks import keep_communicator
from .unknowns import Unknowns


def function_on_facets(V: FunctionSpace, facets: Sequence[Facets], name: str) -> Any:
    """Make a Function of a space's element on facets alone. Collective.

    Its mesh is that of the facets, so it has no other dofs.
    """
    info, mesh = compat.element_info(V), V.mesh
    surface = compat.submesh(mesh, mesh.topology.dim - 1, np.unique(join(facets).facets))
    keep_communicator(surface)
    space = compat.space(surface, "Lagrange", info.degree, info.value_shape)
    return Function(space, name=name)


def dofs_at(f: Function, x: Array) -> Indices:
    """Find a Function's local block dofs at their positions (..., 3)."""
    nodes = f.function_space.tabulate_dof_coordinates()
    if x.size == 0:
        return np.empty(x.shape[:-1], dtype=np.int32)
    _, found = cKDTree(nodes).query(x)
    return np.asarray(found, dtype=np.int32)


def single_number(mesh: Any, name: str) -> Function:
    """Make a Function with one dof in all, on one rank. Collective."""
    comm, dim = mesh.comm, mesh.topology.dim
    owned = mesh.topology.index_map(dim).size_local
    first = comm.allgather(owned > 0).index(True)
    cells = np.arange(int(comm.rank == first), dtype=np.int32)
    alone = compat.submesh(mesh, dim, cells)
    keep_communicator(alone)
    return Function(compat.space(alone, "DG", 0), name=name)


def find_fields(
    fields: Sequence[Displacement], unknowns: Unknowns, owner: str
) -> None:
    """Note which unknown each field is, or is a part of; raise if it is none."""
    for one in fields:
        found = [
            k
            for k, f in enumerate(unknowns.functions)
            if compat.same_values(f, one.given)
        ]
        if not found:
            names = ", ".join(f.name for f in unknowns.functions)
            raise ContactError(
                f"the field {one.given.name} that {owner} was given is none of the "
                f"unknowns [{names}], nor a part of one: give the problem its equation "
                "too, F and u as lists"
            )
        one.at = found[0]

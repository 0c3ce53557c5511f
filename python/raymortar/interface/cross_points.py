"""Slave nodes of ties that take part in other ties or contacts, and corners."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

from mpi4py import MPI

import numpy as np
import numpy.typing as npt

from .. import compat
from ..compat import Array
from ..errors import ContactWarning
from ..host.facets import format_point
from ..host.ranks import marked_everywhere
from ..host.reference_facets import facet_nodes, normals, shape_functions
from ..host.surfaces import Surface
from .contact_surfaces import ContactSurfaces
from .cover import STRAIGHT


def crossing(
    tie: ContactSurfaces, contacts: Sequence[ContactSurfaces]
) -> list[npt.NDArray[np.int8]]:
    """Marks slave dofs of a tie that other interactions share, zone by zone.
    Collective. Shared are dofs on any master surface, and on slave surfaces of other
    contacts.

    Parameters
    ----------
    tie
        Surfaces of the tie, which is one of the contacts.
    contacts
        Surfaces of all contacts of a problem.
    """
    V = tie.u.function_space
    surfaces = [zone.facets.master_surface for one in contacts for zone in one.zones]
    surfaces += [
        zone.facets.slave_surface
        for one in contacts
        if one is not tie
        for zone in one.zones
    ]
    others = marked_everywhere(V, np.concatenate([s.dofs for s in surfaces]))
    return [
        others[zone.facets.slave_surface.dofs].astype(np.int8) for zone in tie.zones
    ]


def warn_of_corners(tie: ContactSurfaces) -> None:
    """Warn of corners of a slave surface: one multiplier cannot be the traction on two
    faces. Collective."""
    assert tie.multiplier is not None
    W = tie.multiplier.function_space
    dim = W.mesh.geometry.dim
    sums = compat.create_la_vector(W.dofmap.index_map, dim + 1)
    table = sums.array.reshape(-1, dim + 1)
    for zone in tie.zones:
        found = _facet_normals(zone.facets.slave_surface)
        # The last column counts facets
        ones = np.hstack([found, np.ones((len(found), 1))])
        np.add.at(table, zone.multiplier_table, ones[:, None, :])
    compat.scatter_reverse_add(sums)
    owned = table[: W.dofmap.index_map.size_local]
    sharp = np.linalg.norm(owned[:, :dim], axis=1) < STRAIGHT * owned[:, dim]
    comm = tie.comm
    count = comm.allreduce(int(np.count_nonzero(sharp)))
    if not count:
        return
    rank = comm.allreduce(comm.rank if sharp.any() else comm.size, op=MPI.MIN)
    place = ""
    if comm.rank == rank:
        x = W.tabulate_dof_coordinates()[np.flatnonzero(sharp)[0], :dim]
        place = format_point(x)
    warnings.warn(
        f"the slave surface of {tie.tags} turns by more than 60 degrees at {count} "
        f"node(s), for example at {comm.bcast(place, root=rank)}: one multiplier there "
        "is not the traction of two faces. Give each face a tag, and a Tie of its own",
        ContactWarning,
        stacklevel=4,
    )


def _facet_normals(surface: Surface) -> Array:
    """Unit normals at the centres of the undeformed facets, (facets, d)."""
    centre = facet_nodes(surface.shape, 1).mean(axis=0, keepdims=True)
    _, gradients = shape_functions(surface.shape, surface.node_degree, centre)
    nodes = surface.X[surface.facet_nodes]
    m = normals(np.einsum("ia,fad->ifd", gradients[:, 0], nodes))
    units: Array = m / np.linalg.norm(m, axis=1, keepdims=True)
    return units

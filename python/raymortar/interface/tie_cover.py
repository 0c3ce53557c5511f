"""Slave nodes of a tie that have no master opposite."""

from __future__ import annotations

import numpy as np

from .. import compat
from ..compat import Array
from ..errors import raise_everywhere
from ..host.facets import format_point
from ..host.reference_facets import shape_functions
from ..host.surfaces import surface_normals
from .contact_surfaces import ContactSurfaces
from .point_results import OPEN

# Share of a node's area that masters must cover
ENOUGH = 0.5
# Largest number of nodes that a message names
NAMED = 10


def node_shares(tie: ContactSurfaces) -> tuple[Array, Array]:
    """Share of the area of each owned slave node that masters cover. Collective. The
    area of a node is the integral of the square of its shape function.

    Returns
    -------
    Positions (n, d) and shares (n,) of the owned nodes on slave surfaces.
    """
    V = tie.scalar
    degree = compat.element_info(V).degree
    vectors = [compat.create_la_vector(V.dofmap.index_map, 1) for _ in range(2)]
    met, whole = (vector.array for vector in vectors)
    for zone in tie.zones:
        points, surface = zone.cpp.points(), zone.facets.slave_surface
        hit = points["status"] >= OPEN
        N, _ = shape_functions(surface.shape, degree, points["xi"][hit])
        dofs = zone.result_table[points["slave"][hit]]
        np.add.at(met, dofs, points["area"][hit, None] * N**2)
        xi, weights, m = surface_normals(surface)
        N, _ = shape_functions(surface.shape, degree, xi)
        areas = np.einsum("q,fq,qa->fa", weights, np.linalg.norm(m, axis=-1), N**2)
        np.add.at(whole, zone.result_table, areas)
    for vector in vectors:
        compat.scatter_reverse_add(vector)
    n, dim = V.dofmap.index_map.size_local, V.mesh.geometry.dim
    on = np.flatnonzero(whole[:n] > 0.0)
    return V.tabulate_dof_coordinates()[on, :dim], met[on] / whole[on]


def require_masters(tie: ContactSurfaces, partial: bool) -> None:
    """Raise for slave nodes without a master. Collective.

    Parameters
    ----------
    tie
        After it has been paired.
    partial
        Whether some nodes may have none. One at least must have a master.
    """
    comm = tie.comm
    x, share = node_shares(tie)
    if partial and comm.allreduce(int((share > 0.0).any())):
        return
    bad = np.flatnonzero(share < ENOUGH)
    found = [
        pair for part in comm.allgather((x[bad], share[bad])) for pair in zip(*part)
    ]
    raise_everywhere(comm, _message(tie.tags, found, comm.allreduce(len(share))))


def _message(tags: str, found: list[tuple[Array, float]], total: int) -> str | None:
    """Nodes and shares as text, the least covered first."""
    if not found:
        return None
    found = sorted(found, key=lambda pair: (pair[1], tuple(pair[0])))
    named = ", ".join(f"{format_point(x)}: {share:.2g}" for x, share in found[:NAMED])
    more = ", ..." if len(found) > NAMED else ""
    return (
        f"{len(found)} of {total} slave nodes of {tags} have no master for most of what "
        f"they stand for (node: covered share): {named}{more}. Move or enlarge a master, "
        "take a larger Search(reach=), or leave them free with partial=True"
    )

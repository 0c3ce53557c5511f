"""Surfaces that share vertices in the mesh."""

from __future__ import annotations

import numpy as np
from dolfinx.mesh import Mesh

from ..core import compat
from ..core.compat import Indices, Mask
from ..core.discretization import facets as lookup
from ..core.discretization.facets import FACET_SHAPE, Facets, coordinates
from ..core.discretization.ranks import count_marks, sums_at
from ..core.errors import ContactError, format_point, together

# Least cosine between the mean normals of the two faces of a crack at its tip: 10 degrees
CRACK = 0.985


def shared(
    mesh: Mesh, slave: Facets, master: Facets, may_share: bool, may_crack: bool
) -> tuple[bool, bool]:
    """Whether two surfaces that may do so share vertices, and whether surfaces that may
    not are faces of a crack that share its tip. Collective."""
    if may_share:
        return shared_vertices(mesh, slave, master)[0] > 0, False
    return False, check_pair(mesh, slave, master, may_crack)


def _vertices(mesh: Mesh, facets: Facets) -> Indices:
    """Local vertices of facets, in Basix's order, (facets, vertices)."""
    element = compat.basix_element(compat.cell_name(mesh), 1)
    to_vertices = compat.connectivity_table(mesh, mesh.topology.dim, 0)
    of_facets = np.array(element.facet_vertices)
    found: Indices = to_vertices[facets.cells[:, None], of_facets[facets.local_facets]]
    return found


def shared_vertices(mesh: Mesh, slave: Facets, master: Facets) -> tuple[int, Mask]:
    """Count the vertices that two surfaces share in the mesh. Collective.

    Also mark those of this rank's slave facets, (facets, vertices), in Basix's order.
    """
    vertices, others = (_vertices(mesh, one) for one in (slave, master))
    vertex_map = mesh.topology.index_map(0)
    # The two surfaces may sit on different ranks
    shared = count_marks(vertex_map, vertices) * count_marks(vertex_map, others) > 0
    count = mesh.comm.allreduce(int(shared[: vertex_map.size_local].sum()))
    return count, shared[vertices]


def _face_each_other(mesh: Mesh, slave: Facets, master: Facets) -> Mask:
    """Whether the facets of two surfaces around a vertex of each slave facet look at each
    other, as the faces of a crack do at its tip, (facets, vertices). Collective."""
    vertex_map, d = mesh.topology.index_map(0), mesh.geometry.dim
    means = []
    for one in (slave, master):
        shape = FACET_SHAPE[compat.cell_name(mesh)]
        n = lookup.middle_normals(shape, 1, lookup.facet_corners(mesh, one))
        n = n / np.linalg.norm(n, axis=1, keepdims=True)
        n[lookup.points_inward(mesh, one)] *= -1.0
        vertices = _vertices(mesh, one)
        means.append(sums_at(vertex_map, d, (vertices, n[:, None])))
    cosine = np.einsum("vd,vd->v", *means)
    sizes = np.prod([np.linalg.norm(one, axis=1) for one in means], axis=0)
    found: Mask = (cosine < -CRACK * sizes)[_vertices(mesh, slave)]
    return found


def check_pair(
    mesh: Mesh, slave: Facets, master: Facets, may_be_crack: bool = False
) -> bool:
    """Refuse a slave and a master surface that share vertices in the mesh, other than as
    faces of a crack share its tip; return whether they do so. Collective."""
    count, marks = shared_vertices(mesh, slave, master)
    if count and may_be_crack:
        marks &= ~_face_each_other(mesh, slave, master)
    with together(mesh.comm):
        if np.any(marks):
            # In Basix's order of the facet's vertices too
            example = lookup.facet_corners(mesh, slave)[marks][0]
            slave_tag, master_tag = (
                f"({one.spoken})" if one.name is None else one.spoken
                for one in (slave, master)
            )
            raise ContactError(
                f"the slave surface {slave_tag} and the master surface {master_tag} "
                f"share {count} vertex(es), for example at "
                f"{format_point(example, coordinates(mesh))}: they must be apart in "
                "the mesh. Give bodies nodes of their own; on one body leave out of a tag "
                "the facets between the surfaces, or take method=Penalty()"
            )
    return count > 0

"""Slave nodes: which are covered by masters, at corners, or shared."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx.fem import FunctionSpace

from .. import compat
from ..compat import Array, Mask
from ..errors import ContactWarning, raise_everywhere
from ..host.facets import format_point
from ..host.ranks import marked_everywhere
from ..host.reference_facets import facet_nodes, normals, shape_functions
from ..host.surfaces import Surface, surface_normals, vector_areas
from .contact_surfaces import ContactSurfaces
from .point_results import OPEN
from .zone_data import ZoneData

# A node is a corner if the mean of the unit normals around it is shorter. The mean of
# two normals is, if they are more than 60 degrees apart
STRAIGHT = np.cos(np.pi / 6.0)
# Share of the area of a tie's node that masters must cover
ENOUGH = 0.5
# Largest number of nodes that a message names
NAMED = 10


class Cover:
    """Tells zones which of their multiplier nodes are covered. Collective.

    A surface may be cut into any tags: a node that one zone covers counts as covered in
    all of them. At corners between surfaces, each zone counts by itself.

    Attributes
    ----------
    alone
        Whether no other zone or rank has nodes of the zone.
    """

    def __init__(self, zones: Sequence[ZoneData], W: FunctionSpace) -> None:
        self._zones, self._W = zones, W
        self.alone = len(zones) == 1 and W.mesh.comm.size == 1
        self._corners: Mask | None = None
        if len(zones) > 1:
            self._corners = self._find_corners()
            for zone in zones:
                corners = self._corners[zone.multiplier_nodes]
                zone.cpp.set_corner_nodes(corners.astype(np.int8))

    def _find_corners(self) -> Mask:
        """Mark block dofs at corners, where zones have different normals."""
        index_map, degree = (
            self._W.dofmap.index_map,
            compat.element_info(self._W).degree,
        )
        total: Any = 0.0
        count: Any = 0
        for zone in self._zones:
            # Vector areas as directions, on the axis of revolution too
            surface = replace(zone.facets.slave_surface, axisymmetric=False)
            vector = vector_areas(surface, index_map, degree, zone.multiplier_table)
            compat.scatter_forward(vector)
            areas = vector.array.reshape(-1, surface.gdim)
            length = np.linalg.norm(areas, axis=1)
            has = length > 0.0
            total = total + areas / np.where(has, length, 1.0)[:, None]
            count = count + has
        corners: Mask = np.linalg.norm(total, axis=1) < STRAIGHT * count
        return corners

    def share(self) -> None:
        """Send the common marks to the zones, after they have been paired."""
        if self.alone:
            return
        own = [
            marked_everywhere(
                self._W, zone.multiplier_nodes[zone.cpp.covered_nodes() != 0]
            )
            for zone in self._zones
        ]
        anywhere = np.logical_or.reduce(own)
        for zone, covered in zip(self._zones, own):
            if self._corners is not None:
                covered = np.where(self._corners, covered, anywhere)
            zone.cpp.set_covered_nodes(covered[zone.multiplier_nodes].astype(np.int8))


def _node_shares(tie: ContactSurfaces) -> tuple[Array, Array]:
    """Find owned slave nodes (n, d), and the share of their area that masters cover.

    The area of a node is the integral of the square of its shape function. Collective.
    """
    V = tie.scalar
    degree = compat.element_info(V).degree
    vector = compat.create_la_vector(V.dofmap.index_map, 2)
    table = vector.array.reshape(-1, 2)
    for zone in tie.zones:
        points, surface = zone.cpp.points(), zone.facets.slave_surface
        hit = points["status"] >= OPEN
        N, _ = shape_functions(surface.shape, degree, points["xi"][hit])
        dofs = zone.result_table[points["slave"][hit]]
        np.add.at(table[:, 0], dofs, points["area"][hit, None] * N**2)
        xi, weights, m = surface_normals(surface)
        N, _ = shape_functions(surface.shape, degree, xi)
        areas = np.einsum("q,fq,qa->fa", weights, np.linalg.norm(m, axis=-1), N**2)
        np.add.at(table[:, 1], zone.result_table, areas)
    compat.scatter_reverse_add(vector)
    n, dim = V.dofmap.index_map.size_local, V.mesh.geometry.dim
    met, whole = vector.array.reshape(-1, 2)[:n].T
    on = np.flatnonzero(whole > 0.0)
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
    x, share = _node_shares(tie)
    if partial and comm.allreduce(int((share > 0.0).any())):
        return
    bad = np.flatnonzero(share < ENOUGH)
    parts, total = comm.allgather((x[bad], share[bad])), comm.allreduce(len(share))
    # The least covered first
    found = sorted((s, tuple(x)) for part in parts for x, s in zip(*part))
    if not found:
        return
    named = ", ".join(f"{format_point(np.array(x))}: {s:.2g}" for s, x in found[:NAMED])
    more = ", ..." if len(found) > NAMED else ""
    raise_everywhere(
        comm,
        f"{len(found)} of {total} slave nodes of {tie.tags} have no master for most of "
        f"what they stand for (node: covered share): {named}{more}. Move or enlarge a "
        "master, take a larger Search(reach=), or leave them free with partial=True",
    )


def crossing(
    tie: ContactSurfaces, contacts: Sequence[ContactSurfaces]
) -> list[npt.NDArray[np.int8]]:
    """Mark slave dofs of a tie that other interactions share, zone by zone.

    Shared are dofs on any master surface, and on slave surfaces of other contacts. The
    tie is one of the contacts. Collective.
    """
    surfaces = [zone.facets.master_surface for one in contacts for zone in one.zones]
    others = [one for one in contacts if one is not tie]
    surfaces += [zone.facets.slave_surface for one in others for zone in one.zones]
    shared = marked_everywhere(
        tie.u.function_space, np.concatenate([s.dofs for s in surfaces])
    )
    return [
        shared[zone.facets.slave_surface.dofs].astype(np.int8) for zone in tie.zones
    ]


def warn_of_corners(tie: ContactSurfaces) -> None:
    """Warn of corners of a slave surface: one multiplier cannot be the traction on two
    faces. Collective."""
    assert tie.multiplier is not None
    W = tie.multiplier.function_space
    dim, n = W.mesh.geometry.dim, W.dofmap.index_map.size_local
    sums = compat.create_la_vector(W.dofmap.index_map, dim + 1)
    for zone in tie.zones:
        found = _facet_normals(zone.facets.slave_surface)
        # The last column counts facets
        ones = np.hstack([found, np.ones((len(found), 1))])
        table = sums.array.reshape(-1, dim + 1)
        np.add.at(table, zone.multiplier_table, ones[:, None, :])
    compat.scatter_reverse_add(sums)
    owned = sums.array.reshape(-1, dim + 1)[:n]
    length = np.linalg.norm(owned[:, :dim], axis=1)
    sharp = np.flatnonzero(length < STRAIGHT * owned[:, dim])
    found = W.tabulate_dof_coordinates()[sharp, :dim]
    places = [x for part in tie.comm.allgather(found) for x in part]
    if places:
        warnings.warn(
            f"the slave surface of {tie.tags} turns by more than 60 degrees at "
            f"{len(places)} node(s), for example at {format_point(places[0])}: one "
            "multiplier there is not the traction of two faces. Give each face a tag, "
            "and a Tie of its own",
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

"""Stiffness and shear modulus of the bodies at contact surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx import fem

from .. import compat
from ..compat import Array, Mask
from ..discretization.facets import Facets
from ..discretization.joined import Places, parts_of, places_of
from ..discretization.layout import CoupledRows
from ..discretization.ranks import marked_everywhere
from ..discretization.surfaces import (
    Surface,
    surface_areas,
    surface_sizes,
    vector_areas,
)
from ..errors import ContactError, raise_everywhere
from ..interface.coefficients import Interfaces, Measure
from ..interface.contact_surfaces import ContactSurfaces
from .probing import VolumePattern, deviators, stiffness_without_bulk


def owned_nodes_on(V: Any, surfaces: Sequence[Surface]) -> Places:
    """Find owned nodes on surfaces, whoever owns the facets. Collective."""
    used = np.unique(np.concatenate([surface.dofs for surface in surfaces]))
    on = marked_everywhere(V, used)[: V.dofmap.index_map.size_local]
    return np.flatnonzero(on)


def _free_nodes(layout: CoupledRows, bcs: Sequence[Any]) -> Mask:
    """Mark owned nodes that conditions do not prescribe in all directions."""
    dofmap = layout.u.function_space.dofmap
    fixed = layout.unknowns.prescribed_u(bcs)[0].reshape(-1, dofmap.index_map_bs)
    return (fixed[: dofmap.index_map.size_local] == 0).any(axis=1)


def of_sides(
    volume: VolumePattern, interfaces: Interfaces, bcs: Sequence[Any]
) -> Measure:
    """Make the measure of one side of pairs of bodies for `Interfaces.tables`.

    By body it gives the stiffness over area, whether the body can move, and the size of
    facets.
    """
    layout, bodies = interfaces.layout, interfaces.bodies
    V = layout.u.function_space
    d = V.dofmap.index_map_bs
    free = _free_nodes(layout, bcs)
    columns = [volume.diagonal.reshape(-1, d).sum(axis=1), free]
    if volume.response is not None:
        # By kind of strain; the product gives ranks without nodes their columns, too
        width = int(np.prod(volume.response.shape[1:]))
        columns += list(volume.response.reshape(len(free), width).T)
    nodal = np.column_stack(columns)

    def measure(surfaces: Sequence[Surface]) -> Array:
        nodes = owned_nodes_on(V, surfaces)
        # A facet may be in several zones: count it once
        ids = np.concatenate([surface.facet_ids for surface in surfaces])
        _, first = np.unique(ids, return_index=True)
        body, area, own = (
            np.concatenate([of(surface) for surface in surfaces])[first]
            for of in (interfaces.of_facets, surface_areas, surface_sizes)
        )
        total = np.zeros((bodies.count, 3 + nodal.shape[1]))
        np.add.at(total[:, :3], body, np.column_stack([area, own, np.ones(len(first))]))
        np.add.at(total[:, 3:], bodies.dofs[nodes], nodal[nodes])
        layout.comm.Allreduce(MPI.IN_PLACE, total)
        area, own, facets, diagonal, moves, *responses = total.T
        with np.errstate(divide="ignore", invalid="ignore"):  # bodies without facets
            stiffness = diagonal / (d * area)
            size = (own / facets) ** (1.0 / (d - 1))
        if responses:
            sheared, swollen = np.reshape(responses, (2, -1, bodies.count))
            stiffness *= stiffness_without_bulk(sheared, swollen, d).min(axis=0)
        return np.column_stack([stiffness, moves > 0, size])

    return measure


def contact_stiffness(
    volume: VolumePattern,
    interfaces: Interfaces,
    bcs: Sequence[Any] = (),
    times_size: bool = False,
) -> list[Array]:
    """Stiffness over area of the softer side of pairs of bodies [theory (5.2)].

    It is about the shear modulus over the mesh size, a force per length and area; times
    the mean size of the pair's slave facets a modulus. A side that is prescribed
    throughout counts as rigid. A table for each zone, see `Interfaces`; pairs without a
    stiffness have the least of the others. Collective.
    """
    sides: list[Array] = []

    def pair(slave: Array, master: Array) -> Array:
        sides[:] = slave[0, :1], master[0, :1]
        found, moves, _ = np.stack([slave.T, master.T], axis=1)
        counts = moves > 0.0
        with np.errstate(invalid="ignore"):
            counts = (counts | ~counts.any(axis=0)) & np.isfinite(found) & (found > 0.0)
        softer = np.where(counts, found, np.inf).min(axis=0)
        return softer * (slave[:, 2] if times_size else 1.0)

    tables = interfaces.tables(of_sides(volume, interfaces, bcs), pair)
    least = min(float(table.min()) for table in tables)
    message = None
    if not np.isfinite(least):
        message = (
            f"no automatic gamma: the form's stiffness over area is {sides[0][0]} on the "
            f"slave, {sides[1][0]} on the master surface; give gamma a value"
        )
    raise_everywhere(interfaces.layout.comm, message, ContactError)
    return [np.where(np.isfinite(table), table, least) for table in tables]


def shear_moduli(
    surfaces: ContactSurfaces, volume: VolumePattern, bcs: Sequence[Any]
) -> list[float]:
    """Shear modulus of the softer body of each zone that can move; 0 where the volume's
    form tells none. Stress. Collective.

    In a uniform shear E the nodal force of a homogeneous body is 2 mu E c, with the
    node's share c of the boundary's vector area [theory (5.8)]. Neither the mesh within
    the bodies nor its size enters.
    """
    assert volume.response is not None
    free = _free_nodes(surfaces.layout, bcs)
    nodal, moduli = np.column_stack([volume.response[:, 0], free]), []
    for zone in surfaces.zones:
        of = zone.facets
        facets, parts = (of.slave, of.master), (of.slave_part, of.master_part)
        sides = zip(of.sides, facets, parts)
        found = np.array([_moduli(surfaces, nodal, *side) for side in sides])
        least = float(found.min(initial=np.inf, where=found > 0.0))
        moduli.append(least if np.isfinite(least) else 0.0)
    return moduli


def _moduli(
    surfaces: ContactSurfaces, nodal: Array, surface: Surface, facets: Facets, part: int
) -> Array:
    """Modulus of each body on a side; 0 where it has no facet or cannot move.

    Nodal are squares of the shears' forces, and whether a node is free; the facets are
    on the mesh of a part. Collective.
    """
    V, bodies = surfaces.u.function_space, surfaces.bodies
    n, d = len(nodal), surface.gdim
    table = surface.dofs[surface.facet_dofs]
    degree = surface.displacement_degree
    c = vector_areas(surface, V.dofmap.index_map, degree, table)[:n]
    values = np.column_stack([(c**2).sum(axis=1), nodal])
    on = marked_everywhere(V, surface.dofs)[:n]
    # Nodes on exterior facets besides these
    own = parts_of(surfaces.u)[part].function_space
    others = np.setdiff1d(compat.exterior_facets(own.mesh), facets.facets)
    rim = fem.locate_dofs_topological(
        own, own.mesh.topology.dim - 1, others.astype(np.int32)
    )
    places = places_of(surfaces.u, part)
    on_rim = marked_everywhere(V, rim if places is None else places[rim])[:n]
    sums = np.zeros((2, bodies.count, values.shape[1]))
    for total, nodes in zip(sums, (on & ~on_rim, on)):
        np.add.at(total, bodies.dofs[:n][nodes], values[nodes])
    surfaces.comm.Allreduce(MPI.IN_PLACE, sums)
    inner, every = sums
    # Use inner nodes, if there are any: at the rim other facets add to the forces
    used = np.where(inner[:, :1] > 0.0, inner, every)
    # Sum of the squares of the deviators, a multiple of the identity
    kappa = sum((E @ E)[0, 0] for E in deviators(d))
    with np.errstate(divide="ignore", invalid="ignore"):
        squares = used[:, 1:-1].min(axis=1) / (4.0 * kappa * used[:, 0])
    moves = (every[:, -1] > 0.0) & (used[:, 0] > 0.0)
    return np.where(moves, np.sqrt(squares), 0.0)

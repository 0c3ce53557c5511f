"""Pattern and stiffness of the volume, for the matrix and the automatic gamma."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

import numpy as np

from ..compat import Array, Indices
from ..errors import ContactError, raise_everywhere
from ..host.axisymmetry import warn_of_plane_form
from ..host.displacements import Places
from ..host.facet_areas import surface_areas, surface_sizes
from ..host.host_blocks import HostBlocks
from ..host.layout import CoupledRows
from ..host.marks import marked_everywhere
from ..host.surfaces import Surface
from .interfaces import Interfaces
from .strain_response import (
    response_of_revolution,
    stiffness_without_bulk,
    strain_response,
    translation_forces,
)

if TYPE_CHECKING:
    from .zone_data import ZoneData

_numbers = itertools.count()


class VolumePattern:
    """Sparsity and diagonal of the volume's matrix, in the coupled numbering.

    Read off one assembly, which every version of DOLFINx offers. Collective.

    Attributes
    ----------
    offsets, columns
        Compressed rows of this rank, int32; columns in the coupled numbering.
    diagonal
        Diagonal entries of the owned displacement dofs, unrolled. Force per length.
    translation
        Forces of the body's translation by 1 along each axis, of the owned displacement
        dofs, (d, dofs): those of masses and springs. Force per length.
    response
        Response of the owned nodes, see `strain_response` and `response_of_revolution`.
    couplings
        What a unit of each field but the displacement can do to each owned row of the
        host, and what the displacement can; see `HostBlocks.couplings`.
    number
        Its number, which no other pattern has.
    """

    def __init__(
        self, form: Any, layout: CoupledRows, axisymmetric: bool = False
    ) -> None:
        self.form, self.number = form, next(_numbers)
        host = layout.host
        blocks = HostBlocks(form, layout)
        self.offsets, self.columns = blocks.pattern()
        self.couplings = blocks.couplings() if host.is_known else np.empty((0, 0))
        K = blocks.of_displacement()
        diagonal = K.getDiagonal()
        self.diagonal: Array = diagonal.array.copy()
        self.translation = translation_forces(K, layout.u)
        if axisymmetric:
            warn_of_plane_form(self.translation[0], self.diagonal, layout.comm)
            self.response = response_of_revolution(K, layout.u)
        else:
            self.response = strain_response(K, layout.u)
        diagonal.destroy()
        blocks.destroy()


def owned_nodes_on(V: Any, surfaces: Sequence[Surface]) -> Places:
    """Owned nodes of a space that are on surfaces, whoever owns the facets. Collective."""
    used = np.unique(np.concatenate([surface.dofs for surface in surfaces]))
    on = marked_everywhere(V, used)[: V.dofmap.index_map.size_local]
    return np.flatnonzero(on)


class _Side:
    """Measures one side of pairs of bodies, for `Interfaces.tables`.

    Parameters
    ----------
    volume, layout, interfaces
        Of the contact.
    bcs
        Dirichlet conditions.
    """

    def __init__(
        self,
        volume: VolumePattern,
        layout: CoupledRows,
        interfaces: Interfaces,
        bcs: Sequence[Any],
    ) -> None:
        self.volume, self.layout, self.interfaces = volume, layout, interfaces
        V = layout.u.function_space
        self._bs, self._owned = V.dofmap.index_map_bs, V.dofmap.index_map.size_local
        fixed, _ = layout.host.prescribed_u(bcs)
        fixed = fixed.reshape(-1, self._bs)[: self._owned]
        diagonal = volume.diagonal.reshape(-1, self._bs)
        free = (fixed == 0).any(axis=1)
        response = volume.response.reshape(self._owned, 2 * volume.response.shape[2])
        self._nodal = np.column_stack([diagonal.sum(axis=1), free, response])

    def __call__(self, surfaces: Sequence[Surface]) -> Array:
        """Stiffness over area, whether it can move, and size of facets, by body."""
        bodies, V = self.interfaces.bodies, self.layout.u.function_space
        nodes = owned_nodes_on(V, surfaces)
        # A facet may be in several zones: count it once
        ids, first = np.unique(
            np.concatenate([surface.facet_ids for surface in surfaces]),
            return_index=True,
        )
        area, own = (
            np.concatenate([of(surface) for surface in surfaces])[first]
            for of in (surface_areas, surface_sizes)
        )
        body = np.concatenate(
            [self.interfaces.of_facets(surface) for surface in surfaces]
        )[first]

        def by_body(of: Indices, values: Array) -> list[Any]:
            n = bodies.count
            return [np.bincount(of, column, minlength=n) for column in values.T]

        sums = by_body(bodies.dofs[nodes], self._nodal[nodes])
        sums += by_body(body, np.column_stack([area, own, np.ones(len(ids))]))
        total = np.array(sums, dtype=np.float64)  # empty counts are integers
        self.layout.comm.Allreduce(MPI.IN_PLACE, total, op=MPI.SUM)
        diagonal, free, *response, area, own, facets = total
        sheared, swollen = np.reshape(response, (2, -1, bodies.count))
        with np.errstate(divide="ignore", invalid="ignore"):  # bodies without facets
            stiffness = diagonal / (self._bs * area)
            share = stiffness_without_bulk(sheared, swollen, self._bs)
            stiffness *= share.min(axis=0)
            size = (own / facets) ** (1.0 / (self._bs - 1))
        return np.column_stack([stiffness, free > 0, size])


def _softer(slave: Array, master: Array) -> Array:
    """Stiffness of the softer one of the sides that can move; infinite if none can."""
    found = np.stack([slave[:, 0], master[:, 0]])
    free = np.stack([slave[:, 1], master[:, 1]]) > 0.0
    counts = free | ~free.any(axis=0)
    with np.errstate(invalid="ignore"):
        counts &= np.isfinite(found) & (found > 0.0)
    return np.where(counts, found, np.inf).min(axis=0)


def contact_stiffness(
    volume: VolumePattern,
    layout: CoupledRows,
    interfaces: Interfaces,
    bcs: Sequence[Any] = (),
    times_size: bool = False,
) -> list[Array]:
    """Stiffness over area of the softer side of pairs of bodies [theory (5.2)].

    It is about the shear modulus over the mesh size, a force per length and area, and
    needs no material parameter. A side that is prescribed throughout counts as rigid.
    Collective.

    Parameters
    ----------
    times_size
        Multiply by the mean size of the pair's slave facets: a modulus.

    Returns
    -------
    (slave's bodies, master's bodies) of each zone, see `Interfaces`. Pairs without
    a stiffness have the least of the others.

    Raises
    ------
    ContactError
        If the stiffness has no positive diagonal on any side that can move.
    """
    sides: list[Array] = []

    def pair(slave: Array, master: Array) -> Array:
        sides[:] = slave[0, :1], master[0, :1]
        return _softer(slave, master) * (slave[:, 2] if times_size else 1.0)

    tables = interfaces.tables(_Side(volume, layout, interfaces, bcs), pair)
    least = min(float(table.min()) for table in tables)
    message = None
    if not np.isfinite(least):
        message = (
            f"no automatic gamma: the form's stiffness over area is {sides[0][0]} on the "
            f"slave, {sides[1][0]} on the master surface; give gamma a value"
        )
    raise_everywhere(layout.comm, message, ContactError)
    return [np.where(np.isfinite(table), table, least) for table in tables]


def stiffness_ratios(
    volume: VolumePattern,
    layout: CoupledRows,
    interfaces: Interfaces,
    bcs: Sequence[Any] = (),
) -> list[Array]:
    """Modulus of the slave's side of pairs of bodies over that of the master's.
    Collective.

    Returns
    -------
    (slave's bodies, master's bodies) of each zone; 0 where one of them cannot move, or
    has no stiffness.
    """

    def pair(slave: Array, master: Array) -> Array:
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = slave[:, 0] * slave[:, 2] / (master[:, 0] * master[:, 2])
        moves = (slave[:, 1] > 0.0) & (master[:, 1] > 0.0)
        return np.where(moves & np.isfinite(ratio), ratio, 0.0)

    return interfaces.tables(_Side(volume, layout, interfaces, bcs), pair)


def mean_facet_size(layout: CoupledRows, zones: Sequence[ZoneData]) -> float:
    """Mean size of all slave facets. Length. Collective."""
    sides = [zone.facets.slave_surface for zone in zones]
    area = layout.comm.allreduce(
        sum(float(surface_sizes(side).sum()) for side in sides)
    )
    facets = layout.comm.allreduce(sum(len(side.facet_dofs) for side in sides))
    return float((area / facets) ** (1.0 / (sides[0].gdim - 1)))

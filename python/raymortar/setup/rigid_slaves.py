"""Slaves that are prescribed throughout, on masters that are not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mpi4py import MPI

import numpy as np

from ..core import compat
from ..core.compat import Indices, Mask
from ..core.discretization.facets import middle_normals, units
from ..core.discretization.surfaces import facet_lengths
from ..core.errors import SetUpError
from ..core.interface.contact_surfaces import ContactSurfaces
from ..core.interface.pairs import in_other_order
from ..core.interface.point_results import OPEN
from ..core.interface.slave_nodes import fixed_components
from ..core.interface.zone_data import ZoneData
from .overlap import of_hit_masters
from .straight_facets import FLAT

# Distance of a master's nodes over that of the tractions on a prescribed slave, up to
# which the master may balance these: at 1.5 Newton's method fails on flat surfaces; at
# 1.025 it may, with many facets
CLOSE = 1.01


@dataclass(frozen=True)
class RigidSlave:
    """A slave with tractions that its master balances alone."""

    zone: ZoneData
    components: Indices  # of the displacement that are prescribed at all of its nodes

    @property
    def prescribed(self) -> str:
        """Say what is prescribed: nothing more where all is."""
        if len(self.components) == self.zone.facets.slave_surface.gdim:
            return "prescribed"
        return "prescribed along " + ", ".join("xyz"[i] for i in self.components)


def rigid_slaves(surfaces: ContactSurfaces, marker: Mask) -> dict[int, RigidSlave]:
    """Find slaves that are prescribed throughout in components in which their masters are
    free, by number. Collective.

    The master alone balances these components of the traction. Without friction it has
    those of the normal alone, and the slave must be prescribed in all of them.
    """
    if surfaces.multiplier is None or not surfaces.zones:
        return {}
    fixed = [
        [fixed_components(side, marker).all(axis=0) for side in zone.sides]
        for zone in surfaces.zones
    ]
    held = np.array(fixed, dtype=np.int32)
    across = np.array([_normal_axis(zone) for zone in surfaces.zones], dtype=np.int32)
    for marks in (held, across):
        surfaces.comm.Allreduce(MPI.IN_PLACE, marks, op=MPI.MIN)
    found = {}
    for k, (zone, sides, normal) in enumerate(
        zip(surfaces.zones, held > 0, across > 0)
    ):
        slave, master = sides
        alone = slave & ~master
        if not zone.frictional:
            has = normal if normal.any() else ~normal
            alone &= has & slave[has].all()
        if alone.any():
            found[k] = RigidSlave(zone, np.flatnonzero(slave))
    return found


def _normal_axis(zone: ZoneData) -> Mask:
    """Mark the axis along which the normals of all slave facets are, (d,)."""
    surface = zone.facets.slave_surface
    normals = units(middle_normals(surface.shape, surface.node_degree, surface.nodes))
    return (np.abs(normals) > FLAT).all(axis=0)


def refuse_finer_rigid_slaves(problem: Any) -> None:
    """Raise for prescribed slaves with more tractions than their masters can balance.
    Collective.

    A `Tie` has no such limit, nor has the penalty.
    """
    contact = problem.contact
    fixed = contact.system.constrained(problem.bcs)
    for one in contact.contacts:
        if one.tied is not None:
            continue
        for k, rigid in rigid_slaves(one.surfaces, fixed).items():
            ratio = distance_ratio(rigid.zone, one.surfaces)
            if ratio > CLOSE:
                own = [pair for pair in one.pairs if pair.surface == k]
                raise SetUpError(
                    f"all of {rigid.zone.facets.spoken} is {rigid.prescribed}, and its "
                    f"nodes are {ratio:.3g} times as close as those of its master, which "
                    "cannot balance so many tractions: give the sides in the other "
                    f"order, {in_other_order(own)}"
                )


def distance_ratio(zone: ZoneData, surfaces: ContactSurfaces) -> float:
    """Distance of a master's nodes over that of the multiplier's, where they face each
    other; without any hit, the least that it can come to anywhere. Collective.
    """
    comm, (slave_side, master_side) = surfaces.comm, zone.sides
    slave = facet_lengths(slave_side) / compat.element_info(surfaces.scalar).degree
    master = facet_lengths(master_side) / master_side.displacement_degree
    points = zone.points()
    met = of_hit_masters(zone, points, master)
    hit = (points["status"] >= OPEN) & np.isfinite(met)
    area = points["area"][hit]
    sums = np.array([area @ met[hit], area @ slave[points["slave"][hit]]])
    comm.Allreduce(MPI.IN_PLACE, sums)
    if sums[1] > 0.0:
        return float(sums[0] / sums[1])
    # A mean would have facets that never meet
    ends = np.array([master.min(initial=np.inf), -slave.max(initial=0.0)])
    comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MIN)
    return float(ends[0] / -ends[1])

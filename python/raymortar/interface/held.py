"""Slave nodes whose displacement is prescribed, and tractions that nothing determines."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from mpi4py import MPI

import numpy as np

from .. import compat
from ..compat import Mask
from ..errors import ContactWarning, SetUpError, raise_everywhere
from ..host.surfaces import Surface, surface_sizes
from .contact_surfaces import ContactSurfaces
from .overlap import of_hit_masters
from .pairs import Pair, spoken
from .point_results import CLOSED, OPEN
from .zone_data import ZoneData, global_masters

# Distance of a master's nodes over that of the tractions on a prescribed slave, up to
# which the master may balance these. At 1.5 Newton's method fails on flat surfaces, at
# 1.25 it may
CLOSEST = 1.4


def _fixed(surface: Surface, marker: Mask) -> Mask:
    """Mark prescribed components of a surface's dofs, (dofs, d)."""
    return marker.reshape(-1, surface.gdim)[surface.dofs]


def held_slaves(surfaces: ContactSurfaces, marker: Mask) -> tuple[bool, bool]:
    """Tell whether a slave facet is prescribed throughout, and whether any slave node.

    Collective.
    """
    held = np.zeros(2, dtype=np.int32)
    for zone in surfaces.zones:
        surface = zone.facets.slave_surface
        fixed = _fixed(surface, marker)
        throughout = fixed.all(axis=1)[surface.facet_dofs].all(axis=1)
        held |= [throughout.any(), fixed.any()]
    surfaces.comm.Allreduce(MPI.IN_PLACE, held, op=MPI.MAX)
    return bool(held[0]), bool(held[1])


def rigid_slaves(surfaces: ContactSurfaces, marker: Mask) -> list[ZoneData]:
    """Find slaves that are prescribed throughout, on masters that are not. Collective."""
    if surfaces.multiplier is None or not surfaces.zones:
        return []
    sides = [(z.facets.slave_surface, z.facets.master_surface) for z in surfaces.zones]
    fixed = [[_fixed(side, marker).all() for side in both] for both in sides]
    held = np.array(fixed, dtype=np.int32)
    surfaces.comm.Allreduce(MPI.IN_PLACE, held, op=MPI.MIN)
    found = zip(surfaces.zones, held)
    return [zone for zone, (slave, master) in found if slave and not master]


def warn_of_finer_rigid_slaves(
    surfaces: ContactSurfaces, pairs: Sequence[Pair], marker: Mask
) -> None:
    """Warn of prescribed slaves with more tractions than their masters may balance.
    Collective.

    A slave of few facets in contact often solves all the same. A `Tie` has no such
    limit.
    """
    if surfaces.tied is not None:
        return
    for zone in rigid_slaves(surfaces, marker):
        ratio = _distance_ratio(zone, surfaces)
        if ratio > CLOSEST:
            own = [pair for pair in pairs if surfaces.zones[pair.surface] is zone]
            swapped = ", ".join(pair.in_other_order for pair in own)
            slave = spoken(own[0].slave_name, own[0].slave)
            warnings.warn(
                f"all of slave {slave} is prescribed, and its nodes are {ratio:.3g} "
                "times as close as those of its master, which may not balance so many "
                f"tractions: give the sides in the other order, pairs=[{swapped}]",
                ContactWarning,
                stacklevel=4,
            )


def _distance_ratio(zone: ZoneData, surfaces: ContactSurfaces) -> float:
    """Distance of a master's nodes over that of the multiplier's, where they face each
    other; without any hit, of the smallest over that of the largest facets. Collective.
    """
    assert surfaces.multiplier is not None
    comm, q = surfaces.comm, compat.element_info(surfaces.scalar).degree
    sides = zone.facets.slave_surface, zone.facets.master_surface
    slave, master = (surface_sizes(s) ** (1.0 / (s.gdim - 1)) for s in sides)
    slave, master = slave / q, master / sides[1].displacement_degree
    points = zone.points()
    met = of_hit_masters(zone, points, master, comm)
    hit = (points["status"] >= OPEN) & np.isfinite(met)
    area = points["area"][hit]
    sums = np.array([area @ met[hit], area @ slave[points["slave"][hit]]])
    comm.Allreduce(MPI.IN_PLACE, sums)
    if sums[1] > 0.0:
        return float(sums[0] / sums[1])
    largest = comm.allreduce(slave.max(initial=0.0), op=MPI.MAX)
    return float(comm.allreduce(master.min(initial=np.inf), op=MPI.MIN) / largest)


def refuse_held_on_tools(surfaces: ContactSurfaces, marker: Mask) -> None:
    """Raise for slaves that are prescribed throughout, on rigid bodies that are not free.

    Nothing could give way. Collective.
    """
    for zone in surfaces.zones:
        bodies = zone.facets.bodies
        if not bodies or any(body.is_free for body in bodies):
            continue
        held = bool(_fixed(zone.facets.slave_surface, marker).all())
        if surfaces.comm.allreduce(held, op=MPI.LAND):
            names = ", ".join(body.name for body in bodies)
            raise SetUpError(
                f"slave tag {zone.facets.slave_tag} is prescribed throughout, and what it "
                f"meets is rigid ({names}): nothing can give way. Leave some of its "
                "displacement free, or free the rigid body"
            )


def refuse_held(surfaces: ContactSurfaces) -> None:
    """Raise where the multiplier is in no equation. Collective.

    That is where contact is closed all around a node of the multiplier, between facets
    whose displacement is prescribed on both sides, and no damped facet ties it to
    another node.
    """
    assert surfaces.multiplier is not None
    W = surfaces.multiplier.function_space
    known, closed = (compat.create_la_vector(W.dofmap.index_map) for _ in range(2))
    for zone in surfaces.zones:
        points = zone.cpp.points()
        shut = points["status"] >= CLOSED
        # Points on uncovered parts integrate nothing
        free = ((zone.cpp.free_points() == 1) | ~shut) & (points["seed"] >= 0)
        for vector, which in ((known, free), (closed, shut)):
            vector.array[zone.multiplier_table[points["slave"][which]]] = 1.0
    for vector in (known, closed):
        compat.scatter_reverse_add(vector)
    compat.scatter_forward(known)
    for (
        zone
    ) in surfaces.zones:  # mark nodes that share a damped facet with a marked one
        share = zone.cpp.segments()["covered"]
        partly = np.flatnonzero((share > 0.0) & (share < 1.0))
        table = zone.multiplier_table[np.union1d(zone.cpp.held_facets(), partly)]
        known.array[table[(known.array[table] > 0.0).any(axis=1)]] = 1.0
    compat.scatter_reverse_add(known)
    n = W.dofmap.index_map.size_local
    held = np.flatnonzero((known.array[:n] == 0.0) & (closed.array[:n] > 0.0))
    count = surfaces.comm.allreduce(len(held))
    message = None
    if len(held):
        x = np.round(W.tabulate_dof_coordinates()[held[0], : W.mesh.geometry.dim], 12)
        place = ", ".join(f"{value:.6g}" for value in x)
        message = (
            f"{count} node(s) of the contact traction, for example the one at ({place}), "
            "are between facets whose displacement is prescribed on both sides: leave "
            "these out of the slave's tag, or use a penalty"
        )
    raise_everywhere(surfaces.comm, message)

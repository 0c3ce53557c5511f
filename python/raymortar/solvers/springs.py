"""Measures for the springs that stand for closed contact in a preconditioner."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mpi4py import MPI

import numpy as np

from .. import compat
from ..compat import Array
from ..host.reference_facets import shape_functions
from ..interface.stiffness import owned_nodes_on

if TYPE_CHECKING:
    from ..contact import Contact


def lumped_mass(contact: Contact) -> Array:
    """int N_a dG at the owned unknowns of the multiplier, (nodes,). Collective."""
    assert contact.multiplier is not None
    W = contact.multiplier.function_space
    mass = compat.create_la_vector(W.dofmap.index_map, 1)
    degree = compat.element_info(W).degree
    for zone in contact.zones:
        points = zone.cpp.points()
        shape = zone.facets.slave_surface.shape
        N, _ = shape_functions(shape, degree, points["xi"])
        if contact.axisymmetric:  # of degree 2 they have no mean at a node on the axis
            N = np.abs(N)
        dofs = zone.multiplier_table[points["slave"]]
        np.add.at(mass.array, dofs, points["weight"][:, None] * N)
    compat.scatter_reverse_add(mass)
    return mass.array[contact.layout.owned_multipliers]


def surface_stiffness(contact: Contact) -> float:
    """Diagonal of the volume's stiffness per area of the slave surface. Collective."""
    V, comm = contact.u.function_space, contact.layout.comm
    bs = V.dofmap.index_map_bs
    slave = owned_nodes_on(V, [zone.facets.slave_surface for zone in contact.zones])
    diagonal = contact.stiffness_diagonal.reshape(-1, bs)[slave].sum() / bs
    sums = np.array([diagonal, lumped_mass(contact).sum()])
    comm.Allreduce(MPI.IN_PLACE, sums)
    return float(sums[0] / sums[1])

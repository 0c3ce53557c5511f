"""Facets that share a vertex meet where the fold between them has closed, and not through
the material of a sharp edge (3.14)."""

from __future__ import annotations

from mpi4py import MPI

import gathered
import numpy as np
import pytest
import states
from balances import out_of_balance
from dolfinx import fem
from folding import SKIN, closed_hinge, hinge
from problems import COMM
from tangents import Branch, is_second_order, remainders_of, slopes

from raymortar import Contact, Coulomb, Penalty
from raymortar.core import compat

pytestmark = pytest.mark.mpi
GAMMA = 50.0


SLIVER = 1e-12  # of area: rounding may make some at what both sides have in common


class BesideSlivers(Branch):
    """What must not change along a smooth branch, at points of some area."""

    def __init__(self, contact):
        super().__init__(contact)
        real = gathered.points(contact)["weight"] > SLIVER
        self.master, self.status = self.master[real], self.status[real]


def closed(cell, degrees=(1, 1), beyond=0.0, pairs=((SKIN, SKIN),), **options):
    """Contact of a hinge that is turned up by a right angle, and beyond."""
    degree, geometry_degree = degrees
    scene = hinge(cell, geometry_degree)
    V = compat.vector_space(scene.mesh, degree)
    u, tags = fem.Function(V), scene.facet_tags
    contact = Contact(u, tags, pairs, Penalty(GAMMA), **options)
    # The middle stays where it is
    u.x.array[:] = closed_hinge(states.dof_positions(V), beyond).ravel()
    contact.update()
    return contact


@pytest.mark.parametrize("degrees", [(1, 1), (2, 1), (2, 2)])
@pytest.mark.parametrize("cell", states.CELLS)
def test_a_crease_that_has_closed_is_pushed_open(cell, degrees):
    """By forces and moments in balance; one that is open is only seen."""
    ajar, contact = (closed(cell, degrees, beyond) for beyond in (-0.05, 0.03))
    for state, expected in ((ajar, 1), (contact, 3)):
        points = gathered.points(state)
        real = points["weight"] > SLIVER
        assert (points["status"][real] == expected).all()
    force, moment = out_of_balance(contact)
    assert force < 1e-13
    assert moment < 1e-12
    b = contact.create_vector()
    contact.assemble_vector(b, [])
    b.assemble()
    # It turns the halves back: the work of closing is against contact
    V = contact.u.function_space
    more = closed_hinge(states.dof_positions(V), 0.031)
    way = more.ravel() - contact.u.x.array
    own = V.dofmap.index_map.size_local * V.dofmap.index_map_bs
    b_own = b.getArray(readonly=True)[:own]
    assert COMM.allreduce(float(b_own @ way[:own]), op=MPI.SUM) > 0.0


@pytest.mark.parametrize("degrees, friction", [((1, 1), Coulomb(0.3)), ((2, 2), None)])
@pytest.mark.parametrize("cell", states.CELLS)
def test_tangent_of_a_crease_is_exact(cell, degrees, friction):
    """Slave and master have nodes in common; Taylor slope 2 with moving segments."""
    for state in range(10):
        contact = closed(cell, degrees, friction=friction)
        V = contact.u.function_space
        # Edges of both sides cross at more than 0.57 degrees
        rough = 0.02 * states.rough_field(np.random.default_rng(state), V)
        for beyond in (0.03, 0.05):
            moved = closed_hinge(states.dof_positions(V), beyond) + rough
            contact.advance()
            contact.u.x.array[:] = moved.ravel()
            contact.update()
        assert (gathered.points(contact)["status"] > 1).any()
        K = states.tangent(contact, states.mass_form(V))
        found = remainders_of(contact, K, state, (1e-4, 1e-5), BesideSlivers)
        if found is not None:
            assert is_second_order(slopes(*found)), slopes(*found)
            return
    raise AssertionError("no state without a kink nearby")


@pytest.mark.parametrize("cell", states.CELLS)
def test_facets_do_not_meet_through_a_sharp_edge(cell):
    """A roof whose sides meet at 53 degrees: each is behind the other."""
    scene = hinge(cell)
    x = scene.mesh.geometry.x
    dim = scene.mesh.geometry.dim
    x[:, dim - 1] -= 2.0 * np.abs(x[:, 0])
    u = fem.Function(compat.vector_space(scene.mesh, 1))
    contact = Contact(u, scene.facet_tags, [(SKIN, SKIN)], Penalty(GAMMA))
    contact.update()
    points = gathered.points(contact)
    assert (points["status"] == 0).all()

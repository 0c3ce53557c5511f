"""All that a contact makes for its two sides, and their exchange where the slave is
prescribed.

A slave that is prescribed throughout, with finer facets than its free master, has more
tractions than the master has displacements to tell them apart; with friction so has one
that is prescribed throughout along the surface. Contact is then integrated
over the master, as if the pair had been given in the other order, and forces keep the
names that the user gave the sides. Points, fields and the multiplier are on the master.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from .discretization.layout import Layout
from .discretization.ranks import marked_everywhere
from .discretization.slave_fields import FieldValue
from .errors import ContactError, is_real_number, together
from .interactions import Interaction, Interactions
from .interface.contact_surfaces import ContactSurfaces, Given, make_surfaces
from .interface.friction_at_points import spread_coefficient
from .interface.offsets import Offsets
from .interface.pairs import in_other_order
from .interface.present import PresentState
from .interface.slave_nodes import CLOSE, distance_ratio, rigid_slaves
from .interface.zone_data import ZoneData
from .options.friction import Friction, Law
from .state import Owners
from .system.assembly import ContactAssembly


class Sides(Interaction):
    """Surfaces, state and terms of a contact with its sides as they are. Collective.

    Parameters
    ----------
    given
        Arguments of the contact.
    friction
        Its law.
    """

    def __init__(self, given: Given, friction: Law | None) -> None:
        self.friction, self.owners = friction, Owners()
        self._make(given, given.options.method.gamma, given.options.offset)
        self._are_kept = False

    def _make(self, given: Given, gamma: Any, offset: FieldValue | None) -> None:
        """Make all that depends on which side is the slave. Collective."""
        self._given, options = given, given.options
        self._surfaces = made = make_surfaces(given)
        self.layout: Layout = made.layout
        self._present = PresentState(made, options)
        self.assembly = ContactAssembly(made, self._present, options.method)
        super().__init__(made.unknowns, [self.assembly], made.pairs)
        self._offsets = Offsets(made)
        if gamma is not None:
            self.assembly.set_gamma(gamma)
        if offset is not None:
            self._offsets.set(offset)
        mesh = made.slave_u.function_space.mesh
        spread_coefficient(self.friction, made.zones, mesh)

    # Members that depend on the slave: once one is read, the sides stay as they are

    @property
    def surfaces(self) -> ContactSurfaces:
        """Zones and the functions on them."""
        self.keep_sides()
        return self._surfaces

    @property
    def slave_u(self) -> Function:
        """Displacement on the mesh that all slave surfaces are on."""
        return self.surfaces.slave_u

    @property
    def multiplier(self) -> Function | None:
        """Traction on the slave: a scalar ``Function`` (normal component, negative in
        compression), a vector one in global coordinates, or None with penalty. Zero
        off the slave surfaces."""
        return self.surfaces.multiplier

    def keep_sides(self) -> None:
        """Let slave and master stay what they are from here on.

        Without this call, a problem exchanges the two where all of the slave is prescribed
        and finer than its master. Forces keep the names that the user gave.
        """
        self._are_kept = True

    def _require_sides(self, reader: str) -> None:
        """Keep slave and master as the user gave them, for what is of the slave.

        Raises
        ------
        ContactError
            If they have been exchanged.
        """
        self.keep_sides()
        if self._surfaces.exchanged:
            raise ContactError(
                f"{reader} is of the slave, and contact is solved as by "
                f"{in_other_order(p for p in self.pairs if p.is_exchanged)}, since the "
                "slave is prescribed throughout and finer than its master: give the sides "
                f"in this order, or {reader} before the problem is made"
            )

    @property
    def _may_be_exchanged(self) -> bool:
        """Whether nothing depends on which side is the slave, no option, result or
        reader. Collective."""
        options, law = self._given.options, self.friction
        values = (
            self.assembly.gamma,
            self._offsets.value,
            getattr(law, "coefficient", None),
        )
        depends = (
            self._are_kept
            or self.updates > 0
            or self._present.has_history
            or self.assembly.volume is not None
            or len(self.unknowns.displacements) > 1
            or options.frame != "automatic"
            or bool(options.smooth)
            or isinstance(law, Friction)
            or not all(one is None or is_real_number(one) for one in values)
        )
        return not self._comm.allreduce(depends, op=MPI.LOR)

    def _exchange(self, surfaces: Mapping[int, float]) -> None:
        """Make all anew with the sides of some slave surfaces exchanged: numbers as of
        `ContactSurfaces`. Collective."""
        self.require_mesh()  # positions are taken anew
        before = self._present
        given, gamma = self._given.with_exchanged(surfaces), self.assembly.gamma
        self._make(given, gamma, self._offsets.value)
        self._present.dt, self._present.u_old[:] = before.dt, before.u_old


def exchange_where_needed(contact: Any, bcs: Sequence[Any]) -> bool:
    """Exchange the sides of pairs of prescribed slaves and coarser masters. Collective.

    No node of them may be in another pair, and nothing may depend on which is the slave.

    Parameters
    ----------
    contact
        Contact or `Interactions` of a problem, which solves for its unknowns.
    bcs
        Dirichlet conditions of the problem.

    Returns
    -------
    Whether there were any: the contact then has other rows.
    """
    fixed, found = contact.unknowns.prescribed_u(bcs)[0] == 1, False
    for one in contact.contacts:
        surfaces, finer = one.assembly.surfaces, {}
        rigid = {} if surfaces.tied else rigid_slaves(surfaces, fixed)
        if not (rigid and one._may_be_exchanged):
            continue
        for k, slave in rigid.items():
            zone = slave.zone
            if not _is_alone(zone, contact):
                continue
            with together(surfaces.comm):
                zone.cpp.pair()  # undeformed
            ratio = distance_ratio(zone, surfaces)
            if ratio > CLOSE:
                finer[k] = ratio
        if finer:
            one._exchange(finer)
            found = True
    if found and isinstance(contact, Interactions):
        contact.join()
    return found


def _is_alone(zone: ZoneData, contact: Interaction) -> bool:
    """Whether a slave has one master, and no other pair has a node of either.
    Collective."""
    V = contact.u.function_space
    mine = np.concatenate([side.dofs for side in zone.sides])
    others = [
        side.dofs
        for part in contact.parts
        for other in part.zones
        for side in other.sides
        if other is not zone
    ]
    is_shared = marked_everywhere(V, np.concatenate([mine[:0], *others]))[mine].any()
    one_master = len(zone.facets.master_tags) == 1
    return one_master and not zone.comm.allreduce(bool(is_shared), op=MPI.LOR)

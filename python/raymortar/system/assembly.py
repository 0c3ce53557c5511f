"""One contact's share of PETSc matrices and vectors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from petsc4py import PETSc

import numpy as np
import numpy.typing as npt
from dolfinx.fem import Function

from .. import _cpp
from ..errors import ContactError, together
from ..host.bodies import Bodies
from ..interface.coefficients import one_or_each
from ..interface.held import any_held, any_node_held, refuse_held, refuse_held_on_tools
from ..interface.interfaces import Interfaces
from ..interface.shear_modulus import shear_moduli
from ..interface.stiffness import VolumePattern, contact_stiffness, mean_facet_size
from ..interface.zones import on_sides
from ..results.fields import ContactFields
from .coupled import CoupledSystem


class ContactAssembly(CoupledSystem, ContactFields):
    """What one contact adds to matrices and vectors: a base class of `Contact`.

    Attributes
    ----------
    number
        Number of this contact, which no other contact has.
    partners
        Numbers of all contacts of its problem, its own included.
    preallocations, extensions
        How often a matrix was preallocated, and the pattern of entries extended.
    """

    method: Any
    bodies: Bodies
    number: int
    partners: tuple[int, ...]
    gamma_scale: float
    extensions: int
    _interfaces: Interfaces | None
    _fixed_by: tuple[Any, ...] | None
    _fixed: npt.NDArray[np.int8]
    _some_held: bool
    _crosses = False  # whether some nodes are damped that are not held

    @property
    def contacts(self) -> tuple[Any, ...]:  # type: ignore[override]
        """This contact alone; see `CoupledSystem`."""
        return (self,)

    def set_gamma(self, gamma: Any) -> None:
        """Set the augmentation or penalty coefficient: `Contact` defines it.
        Collective."""
        raise NotImplementedError

    @property
    def interfaces(self) -> Interfaces:
        """Pairs of bodies that meet. Collective at first."""
        if self._interfaces is None:
            self._interfaces = Interfaces(self.zones, self.layout, self.bodies)
        return self._interfaces

    def solve_for(self, functions: Sequence[Function]) -> None:
        """Take the functions that a problem solves for. Collective.

        Raises
        ------
        ContactError
            If the displacement is not among them, if another problem of this contact
            has other unknowns, or if that problem has several contacts.
        """
        was_alone = self.partners == (self.number,)
        self.settle(functions, (self.number,))
        if not (self.host.is_plain and was_alone):
            self.layout.place(0, self.layout.owned_size)
            self.send_rows()
        self.meet((self,))

    def settle(self, functions: Sequence[Function], partners: tuple[int, ...]) -> None:
        """Take the functions of a problem and the numbers of its contacts.
        Collective."""
        with together(self._comm):
            settled = self._volume is not None
            if settled and partners != self.partners:
                raise ContactError(
                    f"the contact of slave {self.tags} belongs to a problem "
                    f"{'alone' if len(self.partners) == 1 else 'with others'}: make "
                    "another Contact for this one, or problems of the same contacts in "
                    "the same order"
                )
            self.host.solve_for(functions, settled)
        self.partners = partners

    def meet(self, contacts: Sequence[Any]) -> None:
        """Take the interactions of its problem. Collective."""

    @property
    def tags(self) -> str:
        """Slave tags, for messages."""
        tags = [str(zone.facets.slave_tag) for zone in self.zones]
        return f"tag{'s' * (len(tags) > 1)} {', '.join(tags)}"

    def send_rows(self) -> None:
        """Rows of the unknowns to the zones. Collective."""
        for zone in self.zones:
            sides = zone.facets.slave_surface, zone.facets.master_surface
            zone.cpp.set_rows(
                *(self.layout.u_rows[side.dofs] for side in sides),
                self.layout.multiplier_rows[zone.multiplier_nodes],
            )

    def take_over(self, volume: VolumePattern, bcs: Sequence[Any]) -> None:
        """Take a volume, and the automatic gamma from it if none is set. Collective."""
        self._volume = volume
        self._fixed_by = None  # held nodes need its stiffness
        if self.gamma is None:
            tables = contact_stiffness(volume, self.layout, self.interfaces, bcs)
            stiffness = one_or_each(self.interfaces, tables)
            self.set_gamma(self.method.automatic_factor * stiffness)

    def belong_to(self, volume: VolumePattern) -> None:
        """Take the volume, from `prepare`, of another problem of this contact."""
        if volume is not self._volume:
            self._volume = volume
            self._fixed_by = None

    def note_room(self, extended: bool) -> None:
        """Count a preallocation, and whether patterns have been extended for it."""
        self.preallocations += 1
        self.extensions += extended

    def _fix(self, bcs: Sequence[Any]) -> None:
        """Tell the zones which displacements are prescribed. Collective."""
        by = self._fixed_by
        if by is not None and tuple(map(id, bcs)) == tuple(map(id, by)):
            return
        self._fixed, _ = self.host.prescribed_u(bcs)
        for zone in self.zones:
            zone.cpp.set_fixed(*on_sides(zone, self._fixed.astype(np.float64)))
        self._fixed_by = tuple(bcs)
        if self.multiplier is None:
            return
        if self._volume is not None:
            for zone, modulus in zip(self.zones, shear_moduli(self, bcs)):
                zone.cpp.set_shear_modulus(modulus)
        refuse_held_on_tools(self, self._fixed)
        self._some_held = any_held(self, self._fixed)
        if any_node_held(self, self._fixed) or self._crosses:
            for zone, modulus in zip(self.zones, self._moduli(bcs)):
                zone.cpp.set_modulus(modulus)

    def _moduli(self, bcs: Sequence[Any]) -> list[float]:
        """Modulus of the softest body of each zone. If the volume's form gives none,
        the coefficient times the size of facets. Stress. Collective."""
        if self._volume is not None:
            try:
                tables = contact_stiffness(
                    self._volume, self.layout, self.interfaces, bcs, times_size=True
                )
            except ContactError:  # on all ranks
                pass
            else:
                return [float(table.min()) for table in tables]
        size = mean_facet_size(self.layout, self.zones)
        return [self.gamma_scale * size] * len(self.zones)

    def prescribed(self, bcs: Sequence[Any]) -> npt.NDArray[np.bool_]:
        """Whether Dirichlet conditions prescribe a dof of u; ghosted. Collective."""
        self._fix(bcs)
        return self._fixed == 1

    def add_tangent(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        """Add this contact's part of `assemble_matrix`. Collective."""
        self._fix(bcs)
        if self._some_held:
            refuse_held(self)
        with together(self._comm):
            for zone in self.zones:
                _cpp.add_tangent(zone.cpp, A.handle, zone.positions, zone.assembly)

    def add_residual(self, b: PETSc.Vec, bcs: Sequence[Any]) -> None:
        """Add this contact's part of `assemble_vector`. Collective."""
        self._fix(bcs)
        with together(self._comm):
            for zone in self.zones:
                _cpp.add_residual(zone.cpp, b.handle, zone.assembly)

"""One contact's share of PETSc matrices and vectors."""

from __future__ import annotations

import itertools
import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from mpi4py import MPI

import numpy as np
from dolfinx.fem import Function

from ... import _cpp
from ..compat import Array, Mask
from ..errors import ContactError, together
from ..gamma.probing import VolumePattern
from ..gamma.stiffness import contact_stiffness, shear_moduli
from ..hooks import hooks
from ..interface.coefficients import PairCoefficients, one_or_each, spread
from ..interface.contact_surfaces import ContactSurfaces
from ..interface.present import PresentState
from ..interface.slave_nodes import crack_tips, crossing, held_slaves
from ..interface.zone_data import mean_facet_size, on_sides
from ..options.methods import AugmentedLagrangian, Penalty

_numbers = itertools.count()

log = logging.getLogger("raymortar")

# Sets of conditions of which a contact remembers what they prescribe
MOST_KNOWN = 2


Coefficient: TypeAlias = float | Function | PairCoefficients


@dataclass
class Prescribed:
    """Displacements of a contact that Dirichlet conditions prescribe.

    Attributes
    ----------
    bcs
        The conditions.
    u
        Whether they prescribe a dof of u; ghosted.
    held
        The same with the nodes at the tips of cracks, at which gaps do not depend on u.
    some_held
        Whether they prescribe some slave facet throughout.
    shear_moduli, moduli
        Of each zone, where they are needed. Stress.
    """

    bcs: tuple[Any, ...]
    u: Mask
    held: Mask
    some_held: bool = False
    shear_moduli: Sequence[float] = ()
    moduli: Sequence[float] = ()

    def __post_init__(self) -> None:
        self.ids = tuple(map(id, self.bcs))


class ContactAssembly:
    """Terms of one contact in matrices and vectors, and its coefficient.

    Attributes
    ----------
    number
        Number of this contact, which no other contact has.
    partners
        Numbers of all contacts of its problem, its own included.
    method, why
        Method with the law that was chosen, and why it was; None: it was given.
    gamma
        Coefficient in use, see `Contact`.
    own_gamma
        The contact's own coefficient, where another is in use for some steps.
    automatic_gamma, soft_gamma
        The coefficient that was taken where none was given, None if one was, and the one
        of (5.16) that `paths.SoftStart` has put in its place, None before.
    gamma_scale
        Mean of gamma, by which the multiplier is divided among the unknowns.
    volume
        Pattern of the volume, once there is a problem.
    preallocations, extensions
        How often a matrix was preallocated, and the pattern of entries extended.
    """

    def __init__(
        self,
        surfaces: ContactSurfaces,
        present: PresentState,
    ) -> None:
        self.surfaces, self.present = surfaces, present
        self.method: AugmentedLagrangian | Penalty = surfaces.options.method
        self.why = surfaces.why
        self.zones, self.layout = surfaces.zones, surfaces.layout
        self.unknowns = surfaces.unknowns
        self.number = next(_numbers)
        self.partners: tuple[int, ...] = (self.number,)
        self.gamma: Coefficient | None = None
        self.own_gamma: Coefficient | None = None
        self.automatic_gamma: float | PairCoefficients | None = None
        self.soft_gamma: float | PairCoefficients | None = None
        self.gamma_scale = 1.0
        self.volume: VolumePattern | None = None
        self.preallocations, self.extensions = 0, 0
        # Prescribed values that the zones know; None: to be sent anew
        free = np.zeros(len(surfaces.u.x.array), dtype=bool)
        self._prescribed: Prescribed | None = Prescribed((), free, free)
        self._known: list[Prescribed] = []
        self._crosses = False  # whether nodes are damped that are not held
        self._log_choice()

    # Law

    def change_law(self, condition: str, multiplier: str | None, why: str) -> bool:
        """Take another law of the same unknowns, if the present one was chosen and no
        step depends on it. A multiplier None is the present one. Collective.

        Returns
        -------
        Whether the contact has that law now.
        """
        method, is_chosen = self.method, self.why is not None
        if isinstance(method, Penalty) or not is_chosen:
            return False
        if self.surfaces.comm.allreduce(self.present.has_history, op=MPI.LOR):
            return False
        self.method = method = replace(
            method, condition=condition, multiplier=multiplier or method.multiplier
        )
        self.why = why
        at = getattr(_cpp.Condition, condition)
        for zone in self.zones:
            zone.cpp.set_law(at, method.is_dual)
            zone.has_law_at_nodes = condition == "nodes"
            zone.dual_multiplier = self.surfaces.multiplier if method.is_dual else None
        self._forget_prescribed()  # zones have forgotten it
        self.present.note_change()
        self._log_choice()
        return True

    def _log_choice(self) -> None:
        """Tell which law was chosen, once over all ranks."""
        if self.why is not None and self.surfaces.comm.rank == 0:
            log.info(
                "contact of %s: law at %s%s, as %s",
                self.surfaces.tags,
                self.method.condition,
                " with dual multipliers" * self.method.is_dual,
                self.why,
            )

    def set_gamma(self, gamma: Coefficient, own: Coefficient | None = None) -> None:
        """Set the coefficient; see `Contact.set_gamma`. Given its own, it is lent to the
        contact, which keeps that. Collective."""
        mesh = self.surfaces.slave_u.function_space.mesh
        found, self.gamma_scale = spread(gamma, self.surfaces.interfaces, mesh)
        for zone, (values, factors) in zip(self.zones, found):
            zone.cpp.set_gamma(values, self.gamma_scale, factors)
        self.gamma, self.own_gamma = gamma, gamma if own is None else own
        self._forget_prescribed()  # the modulus may be that of gamma
        self.present.note_change()

    # Unknowns

    def solve_for(self, functions: Sequence[Function]) -> None:
        """Take what a problem of this contact alone solves for. Collective."""
        was_alone = self.partners == (self.number,)
        self.set_functions(functions, (self.number,))
        if not (self.unknowns.is_plain and was_alone):
            self.layout.number()
            self.send_rows()
        self.find_cross_points([self.surfaces])

    def set_functions(
        self, functions: Sequence[Function], partners: tuple[int, ...]
    ) -> None:
        """Take the functions of a problem and the numbers of its contacts.
        Collective."""
        with together(self.surfaces.comm):
            settled = self.volume is not None
            if settled and partners != self.partners:
                raise ContactError(
                    f"the contact of slave {self.surfaces.tags} belongs to a problem "
                    f"{'alone' if len(self.partners) == 1 else 'with others'}: make "
                    "another Contact for this one, or problems of the same contacts in "
                    "the same order"
                )
            self.unknowns.solve_for(functions, settled)
        self.partners = partners

    def find_cross_points(self, contacts: Sequence[ContactSurfaces]) -> None:
        """Take the surfaces of all contacts of a problem: where a tie shares slave nodes
        with one, its multipliers are damped [theory (4.20)]. Collective."""
        if self.surfaces.tied is None or self.surfaces.multiplier is None:
            return
        marked = crossing(self.surfaces, contacts)
        for zone, dofs in zip(self.zones, marked):
            zone.cpp.set_crossing(dofs)
        count = sum(int(dofs.sum()) for dofs in marked)
        self._crosses = self.surfaces.comm.allreduce(count) > 0
        self._forget_prescribed()  # the modulus is asked for anew

    def send_rows(self) -> None:
        """Rows of the unknowns to the zones. Collective."""
        for zone in self.zones:
            zone.cpp.set_rows(
                self.layout.u_rows[zone.facets.slave_surface.dofs],
                self.layout.u_rows[zone.facets.master_surface.dofs],
                self.layout.multiplier_rows[zone.multiplier_nodes],
            )

    # Volume

    @property
    def gamma_is_soft(self) -> bool:
        """Whether a law at points has the coefficient of what its surfaces yield."""
        return self.soft_gamma is not None and self.gamma is self.soft_gamma

    @property
    def may_bend(self) -> bool:
        """Whether it matters that bodies bend: for a law that is open, or at nodes."""
        return self.why is not None or self.method.condition == "nodes"

    def set_volume(
        self, volume: VolumePattern, bcs: Sequence[Any], bending: Any = None
    ) -> None:
        """Take a volume, and the automatic gamma from it if none is set. Collective.

        The answer of a penalty, the scale of a tie and, with friction, a law at points
        depend on it: it is the stiffness of (5.2) times a factor. A law at nodes has the
        one that suits bodies which bend, if these are asked for; see `Hooks.bending`.
        """
        self.volume, surfaces = volume, self.surfaces
        self._forget_prescribed()  # held nodes need its stiffness
        if bending is not None and bending.bends(self):
            self.change_law("nodes", None, "bodies bend")
        if self.gamma is None:
            at_nodes = surfaces.tied is None and self.method.condition == "nodes"
            if bending is not None and at_nodes:
                tables = bending.coefficients(self)
            else:
                tables = contact_stiffness(volume, surfaces.interfaces, bcs)
            tables = [self.method.automatic_factor * table for table in tables]
            self.automatic_gamma = one_or_each(surfaces.interfaces, tables)
            self.set_gamma(self.automatic_gamma)

    def use_volume(self, volume: VolumePattern) -> None:
        """Take the volume, from `prepare`, of another problem of this contact."""
        if volume is not self.volume:
            self.volume = volume
            self._forget_prescribed()

    # Assembly

    def prescribed(self, bcs: Sequence[Any]) -> Mask:
        """Whether Dirichlet conditions prescribe a dof of u; ghosted. Sent to the zones
        if they did not know. Collective."""
        now = self._prescribed
        if now is None or now.ids != tuple(map(id, bcs)):
            ids = tuple(map(id, bcs))
            now = next((one for one in self._known if one.ids == ids), None)
            if now is None:
                now = self._find_prescribed(bcs)
                # A path asks in turn for those of its steps and, for reactions, none
                self._known = [now, *self._known][:MOST_KNOWN]
            marker = now.held.astype(np.float64)
            for zone in self.zones:
                zone.cpp.set_fixed(*on_sides(zone, marker))
            self.present.unfelt.send(self.present.u_old)
            for zone, shear_modulus in zip(self.zones, now.shear_moduli):
                zone.cpp.set_shear_modulus(shear_modulus)
            for zone, modulus in zip(self.zones, now.moduli):
                zone.cpp.set_modulus(modulus)
            self._prescribed = now
        return now.u

    def _forget_prescribed(self) -> None:
        """Forget prescribed values: they are found and sent anew."""
        self._prescribed, self._known = None, []

    def _find_prescribed(self, bcs: Sequence[Any]) -> Prescribed:
        """Find the values that conditions prescribe. Collective."""
        surfaces = self.surfaces
        u = self.unknowns.prescribed_u(bcs)[0] == 1
        found = Prescribed(tuple(bcs), u, u)
        if surfaces.multiplier is None:
            return found
        if self.volume is not None:
            found.shear_moduli = shear_moduli(surfaces, self.volume, bcs)
        if any(zone.facets.bodies for zone in surfaces.zones):
            for look in hooks.on_prescribed:
                look(surfaces, found.u)
        found.some_held, some_nodes = held_slaves(surfaces, found.u)
        if any(zone.facets.has_tips for zone in surfaces.zones):
            found.held, some_nodes = u | crack_tips(surfaces), True
        if some_nodes or self._crosses:
            found.moduli = self.moduli(bcs)
        return found

    def moduli(self, bcs: Sequence[Any]) -> list[float]:
        """Modulus of the softest body of each zone. If the volume's form gives none,
        the coefficient times the size of facets. Stress. Collective."""
        tables = self.contact_stiffness(bcs, times_size=True)
        if tables is not None:
            return [float(table.min()) for table in tables]
        size = mean_facet_size(self.zones)
        return [self.gamma_scale * size] * len(self.zones)

    def stiffness(self) -> float | None:
        """Largest stiffness over area of pairs of bodies [theory (5.2)]; None where the
        forms have none. Traction per length. Collective."""
        tables = self.contact_stiffness(())
        return None if tables is None else max(float(table.max()) for table in tables)

    def contact_stiffness(
        self, bcs: Sequence[Any], times_size: bool = False
    ) -> list[Array] | None:
        """`stiffness.contact_stiffness`; None where the forms have none. Collective."""
        if self.volume is None:
            return None
        try:
            interfaces = self.surfaces.interfaces
            return contact_stiffness(self.volume, interfaces, bcs, times_size)
        except ContactError:  # on all ranks
            return None

    def refuse_held(self, bcs: Sequence[Any]) -> None:
        """Raise where conditions leave a tangent without a solution. Collective."""
        self.prescribed(bcs)
        unfelt = self.present.unfelt.normals
        some_held = self._prescribed is not None and self._prescribed.some_held
        if some_held or unfelt is not None:
            for check in hooks.on_held:
                check(self.surfaces, unfelt)

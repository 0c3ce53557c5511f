"""Values, pairs, residuals and norms of iterates of a list of contacts."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from operator import attrgetter
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
from dolfinx.fem import Function

from ... import _cpp
from ..compat import Array, Indices, Mask
from ..discretization.layout import CoupledRows, Layout
from ..discretization.surfaces import Bodies
from ..discretization.unknowns import Field, Lacking, Unknowns
from ..errors import ContactError, NotFinite, SetUpError, raise_everywhere
from .assembly import ContactAssembly

# Without Python frames: each iterate asks
_REVISION, _SCALE = attrgetter("present.revision"), attrgetter("gamma_scale")


class CoupledIterates:
    """Iterates of [u, multipliers, bodies] of a list of contacts. Collective.

    Attributes
    ----------
    zones
        Slave surfaces of all contacts.
    """

    def __init__(self, unknowns: Unknowns, parts: Sequence[ContactAssembly]) -> None:
        self.unknowns, self.parts = unknowns, tuple(parts)
        self.comm: MPI.Comm = unknowns.comm
        self._cpp: tuple[_cpp.CoupledValues, _cpp.ContactSystem] | None = None
        self._groups: tuple[Any, ...] | None = None
        self.zones = [zone for part in self.parts for zone in part.zones]
        if len(self.parts) == 1:
            self.layout = self.parts[0].layout

    @cached_property
    def layout(self) -> Layout | CoupledRows:
        """Rows of the unknowns. Several contacts that no problem has yet, as in one's own
        assembly, are solved for together from here on. Collective."""
        self.solve_for(self.unknowns.functions)
        return self.layout

    @property
    def u(self) -> Function:
        """Displacement on its own space."""
        return self.unknowns.u

    @property
    def bodies(self) -> Bodies:
        """Parts of the mesh that are connected, by displacement node."""
        return self.parts[0].surfaces.bodies

    @property
    def axisymmetric(self) -> bool:
        """Whether integrals go over a full turn."""
        return self.parts[0].surfaces.axisymmetric

    @property
    def updates(self) -> int:
        """Calls of `update` so far."""
        return min(part.present.updates for part in self.parts)

    @property
    def revision(self) -> int:
        """Changes so far of all that an assembled residual depends on, except `u` and
        `multiplier`: pairing, history, coefficient."""
        return sum(map(_REVISION, self.parts))

    @property
    def preallocations(self) -> int:
        """Number of times that a matrix was preallocated."""
        return max(part.preallocations for part in self.parts)

    @property
    def cpp(self) -> _cpp.ContactSystem:
        """The C++ system of the present rows."""
        if self._cpp is not None and self._cpp[0] is self.layout.made_values:
            return self._cpp[1]
        zones = [
            _cpp.SystemZone(
                zone=zone.cpp,
                positions=zone.positions,
                statistics=zone.assembly,
                contact=k,
                slave=zone.facets.slave_surface.dofs,
                master=zone.facets.master_surface.dofs,
                nodes=zone.multiplier_nodes,
                bodies=[body.cpp for body in zone.facets.bodies],
            )
            for k, part in enumerate(self.parts)
            for zone in part.zones
        ]
        values = self.layout.values
        made = _cpp.ContactSystem(zones, self.u.x.array, values)
        if self._groups is not None:
            made.set_groups(*self._groups)
        self._cpp = values, made
        return made

    def solve_for(self, functions: Sequence[Function]) -> None:
        """Take what a problem solves for, the displacement among it. Collective.

        Raises
        ------
        ContactError
            If the displacement is none of it, or if a contact belongs to a problem with
            other unknowns or other contacts.
        """
        if len(self.parts) == 1:
            self.parts[0].solve_for(functions)
            self.layout = self.parts[0].layout
            return
        partners = tuple(part.number for part in self.parts)
        for part in self.parts:
            part.set_functions(functions, partners)
        self.layout = CoupledRows(self.unknowns, [part.layout for part in self.parts])
        surfaces = [part.surfaces for part in self.parts]
        for part in self.parts:
            part.send_rows()
            part.find_cross_points(surfaces)

    # Iterates

    def update(self, pair: bool = True) -> None:
        """Pair and integrate, see `Contact.update`. Collective."""
        if not pair and self.updates == 0:
            raise ContactError(
                "update(pair=False) has no points to keep: call update()"
            )
        self.require_mesh()
        self.unknowns.pull()
        cpp = self.cpp
        self._require_finite()
        cpp.loads_changed()
        for part in self.parts:
            part.present.check_loads()
        self._pair(cpp, not pair)

    def require_mesh(self) -> None:
        """Raise if the mesh has been moved on the contact surfaces. Collective."""
        for part in self.parts:
            for reference in part.surfaces.references:
                raise_everywhere(self.comm, reference.fault(), SetUpError)

    def take(self, x: PETSc.Vec, seen: int | None) -> int:
        """Take over an iterate: unknowns, pairing, integration. Collective.

        Nothing is done if x is the last one and `seen`, the revision when it was taken,
        is the present one.

        Returns
        -------
        The revision.
        """
        cpp, now = self.cpp, sum(map(_REVISION, self.parts))
        anew = seen != now
        if cpp.loads_changed():
            anew = True
            for part in self.parts:
                part.present.check_loads()
        if not cpp.set_unknowns(x.handle, list(map(_SCALE, self.parts)), anew):
            return now
        if not self.unknowns.is_plain:
            self.unknowns.pull()
        if not (self.unknowns.is_plain and cpp.is_finite()):
            self._require_finite()
        self._pair(cpp, False)
        return sum(map(_REVISION, self.parts))

    @property
    def scales(self) -> list[float]:
        """Factors by which multipliers are divided among the unknowns."""
        return list(map(_SCALE, self.parts))

    def _require_finite(self) -> None:
        """Raise for values that are not finite. Collective."""
        functions = [("displacement", self.u)]
        functions += [("multiplier", part.surfaces.multiplier) for part in self.parts]
        if not self.unknowns.is_plain:
            functions += [(f.name, f) for f in self.unknowns.functions]
        message = None
        for name, f in functions:
            bad = 0 if f is None else np.count_nonzero(~np.isfinite(f.x.array))
            if bad and message is None:
                message = f"the {name} has {bad} entries that are not finite"
        raise_everywhere(self.comm, message, NotFinite)

    def _pair(self, cpp: _cpp.ContactSystem, rays_only: bool) -> None:
        """Send the present state to the zones and pair them. Collective."""
        for part in self.parts:
            part.present.begin_update()
        cpp.pair(rays_only)
        for part in self.parts:
            part.present.end_update(cpp.is_at(part.present.u_old))

    # Values

    def to_vector(self, x: PETSc.Vec) -> None:
        """Copy from the functions, see `Contact.to_vector`."""
        self.layout.to_vector(x, self.scales)

    # Residual

    def constrained(self, bcs: Sequence[Any]) -> Mask:
        """Whether Dirichlet conditions prescribe a dof of u; ghosted. Collective."""
        return [part.prescribed(bcs) for part in self.parts][0]

    def assemble_residual(
        self,
        b: PETSc.Vec,
        bcs: Sequence[Any],
        volume: Array,
        lacking: Lacking,
        contact: bool = True,
    ) -> tuple[Array, Array, Array, Array]:
        """Set b to the residual of volume and contact, assembled. Collective.

        Returns
        -------
        Norms of the residual's free rows and of the forces in balance, by group,
        (groups,) each; largest increment and largest value, by field, (fields,) each.
        """
        for part in self.parts:
            part.prescribed(bcs)
        return self.cpp.residual(b.handle, volume, *lacking, contact)

    def set_groups(
        self, of_row: Indices, count: int, mass: Array, fields: Sequence[Field]
    ) -> None:
        """Set the groups of rows whose norms are taken, from the group of each owned
        row, (rows,), below a count; see `balance.Groups`."""
        places = [field.local for field in fields] if len(fields) > 1 else []
        self._groups = of_row, count, mass, places
        self.cpp.set_groups(*self._groups)

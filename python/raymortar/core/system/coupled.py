"""The coupled system of a list of contacts: its matrices, vectors and iterates."""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
from dolfinx.fem import Function

from ... import _cpp
from .. import compat
from ..compat import Array, Indices, Mask
from ..discretization.layout import CoupledRows
from ..discretization.ranks import free_dropped
from ..discretization.surfaces import Bodies
from ..discretization.unknowns import Field, Lacking, Unknowns
from ..errors import ContactError, NotFinite, SetUpError, raise_everywhere
from ..gamma.probing import VolumePattern
from ..hooks import hooks
from .assembly import ContactAssembly

# Attribute of a PETSc matrix that tells what it has room for. PETSc keeps it with the
# matrix, whichever Python object refers to it
ROOM = "raymortar_room"
# Types of matrices that `make_room` gives a pattern
_WITH_ROOM = PETSc.Mat.Type.SEQAIJ, PETSc.Mat.Type.MPIAIJ
# Without Python frames: each iterate asks
_REVISION, _SCALE = attrgetter("present.revision"), attrgetter("gamma_scale")


class CoupledSystem:
    """Matrices, vectors and iterates over [u, multipliers, bodies] of a list of contacts.
    Collective.

    Attributes
    ----------
    zones
        Slave surfaces of all contacts.
    layout
        Rows of the unknowns.
    """

    def __init__(self, unknowns: Unknowns, parts: Sequence[ContactAssembly]) -> None:
        self.unknowns, self.parts = unknowns, tuple(parts)
        self.comm: MPI.Comm = unknowns.comm
        self._cpp: tuple[_cpp.CoupledValues, _cpp.ContactSystem] | None = None
        self._groups: tuple[Any, ...] | None = None
        self.zones = [zone for part in self.parts for zone in part.zones]
        self.layout: CoupledRows = self.parts[0].layout
        self._free_bodies: Any = None

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
        self.parts[0].solve_for(functions)

    @property
    def free_bodies(self) -> Any:
        """Equations of the free rigid bodies. Collective."""
        if self._free_bodies is None or self._free_bodies.layout is not self.layout:
            assert hooks.free_bodies is not None, "no target is free in the core alone"
            self._free_bodies = hooks.free_bodies(self)
        return self._free_bodies

    # Volume

    def prepare(self, a: Any, bcs: Sequence[Any] = ()) -> VolumePattern:
        """Read sparsity pattern and automatic gamma from the volume's form. Collective.

        If several forms are prepared, gamma comes from the first.

        Parameters
        ----------
        a
            Compiled bilinear form of everything but contact. For several unknowns a
            list of lists, by test and trial space.
        bcs
            Dirichlet conditions. A body that they prescribe throughout counts as rigid.

        Returns
        -------
        The volume, which `belong_to` takes.
        """
        # The size of a given penalty is checked without
        strains = any(
            part.surfaces.multiplier is not None or part.gamma is None
            for part in self.parts
        )
        volume = VolumePattern(a, self.layout, self.axisymmetric, strains)
        bending = None
        if hooks.bending is not None and any(p.may_bend for p in self.parts):
            bending = hooks.bending(self, volume, bcs)
        try:
            for part in self.parts:
                part.set_volume(volume, bcs, bending)
        finally:
            if bending is not None:
                bending.destroy()
            volume.destroy()
        for look in hooks.on_volume:
            look(self, bcs)
        return volume

    def use_volume(self, volume: VolumePattern) -> None:
        """Use the volume, from `prepare`, of another problem of these contacts."""
        for part in self.parts:
            part.use_volume(volume)

    @property
    def volume(self) -> VolumePattern:
        """The volume of the problem."""
        volume = self.parts[0].volume
        assert volume is not None, "call prepare first"
        return volume

    @property
    def stiffness_diagonal(self) -> Array:
        """Diagonal of the volume's matrix at set-up, owned dofs of u, unrolled."""
        return self.volume.diagonal

    # Room

    def create_matrix(self) -> PETSc.Mat:
        """Matrix with room for volume and contact; pairs anew. Collective."""
        # Free the memory of earlier solvers before more is needed
        free_dropped(self.comm)
        compat.destroy_garbage(self.comm)
        A = self.layout.create_matrix()
        self.update()
        for part in self.parts:
            part.present.updates_for_room += 1
        self._make_room(A)
        return A

    def _make_room(self, A: PETSc.Mat) -> None:
        extended = not self._patterns_cover()
        if extended:
            for zone in self.zones:
                zone.pattern.extend(zone.cpp)
        for zone in self.zones:
            zone.positions.forget()
        # A later matrix takes the memory of the last one
        if not self.preallocations:
            for look in hooks.on_matrix:
                look(self)
        for part in self.parts:
            part.preallocations += 1
            part.extensions += extended
        _cpp.preallocate(
            A.handle,
            self.volume.offsets,
            self.volume.columns,
            [zone.cpp for zone in self.zones],
            [zone.pattern for zone in self.zones],
            [rows for term in self.volume.terms for rows in term.rows()],
        )
        A.setAttr(ROOM, self._room)

    @property
    def _room(self) -> tuple[int, ...]:
        """Number of the volume, and how often each contact's patterns were extended."""
        return (self.volume.number, *[part.extensions for part in self.parts])

    def _patterns_cover(self) -> bool:
        """Whether the zones' patterns have all present pairs, on all ranks.
        Collective."""
        covered = all([zone.pattern.covers(zone.cpp) for zone in self.zones])
        return bool(self.comm.allreduce(covered, op=MPI.LAND))

    def extend_room(self, A: PETSc.Mat) -> bool:
        """See `Contact.make_room`. Collective."""
        lacks = self.lacks_room(A)
        if lacks:
            self._make_room(A)
        return lacks

    def lacks_room(self, A: PETSc.Mat) -> bool:
        """Whether a matrix has no room for the present pairs, or is an AIJ matrix that
        is not from `create_matrix`. Collective."""
        # Another solver or problem may have extended the patterns since it was made
        is_old = A.getType() in _WITH_ROOM and A.getAttr(ROOM) != self._room
        return is_old or not self._patterns_cover()

    # Assembly

    def add_tangent(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        """See `Contact.assemble_matrix`. Collective."""
        for part in self.parts:
            part.refuse_held(bcs)
        self.cpp.add_tangent(A.handle)
        if self.layout.bodies:
            self.free_bodies.add_tangent(A)

    def add_residual(self, b: PETSc.Vec, bcs: Sequence[Any] = ()) -> None:
        """See `Contact.assemble_vector`. Collective."""
        self.constrained(bcs)
        self.cpp.add_residual(b.handle)
        b.assemble()

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

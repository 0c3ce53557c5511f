"""The coupled system: what a problem needs from one contact or several."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from .. import _cpp, compat
from ..compat import Array
from ..errors import raise_everywhere, together
from ..host.dropped import free_dropped
from ..host.forms import check_compiled
from ..host.host import Host
from ..interface.stiffness import VolumePattern
from ..interface.zones import on_sides
from .free_bodies import FreeBodies
from .memory import matrix_bytes, require_memory

# Attribute of a PETSc matrix that tells what it has room for. PETSc keeps it with the
# matrix, whichever Python object refers to it
ROOM = "raymortar_room"


class CoupledSystem:
    """Matrices and vectors over [u, multipliers] of one contact, or of several.

    Attributes
    ----------
    contacts
        The contacts, in the order of their multipliers' rows.
    """

    contacts: tuple[Any, ...]
    zones: Any
    host: Host
    u: Any
    layout: Any
    updates: int
    gamma: Any
    gamma_scale: Any
    axisymmetric: bool
    _comm: MPI.Comm
    _volume: Any
    _free_bodies: FreeBodies

    def update(self, rays_only: bool = False) -> None:
        """Pair and integrate at the present displacement. Collective.

        `Contact` and `Interactions` define it.
        """
        raise NotImplementedError

    @property
    def free_bodies(self) -> FreeBodies:
        """Equations of the free rigid bodies. Collective."""
        known = getattr(self, "_free_bodies", None)
        if known is None or known.layout is not self.layout:
            known = self._free_bodies = FreeBodies(self)
        return known

    # Values

    def to_vector(self, x: PETSc.Vec) -> None:
        """Copy functions to the solver's unknowns; divide multipliers by gamma."""
        self.layout.to_vector(x, self.gamma_scale)

    def from_vector(self, x: PETSc.Vec) -> None:
        """Copy the solver's unknowns to the functions and their ghosts. Collective."""
        self.layout.from_vector(x, self.gamma_scale)

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
        with together(self._comm):
            check_compiled(a, len(self.host.functions))
        for contact in self.contacts:
            if contact.host.spaces is None:
                contact.host.spaces = [compat.test_space(a)]
        volume = self._volume = VolumePattern(a, self.layout, self.axisymmetric)
        for contact in self.contacts:
            contact.take_over(volume, bcs)
        return volume

    @property
    def stiffness_diagonal(self) -> Array:
        """Diagonal of the volume's matrix at set-up, owned dofs of u, unrolled."""
        return self._volume.diagonal

    @property
    def couplings(self) -> Array:
        """How fields are coupled at set-up, see `stiffness.VolumePattern`."""
        return self._volume.couplings

    @property
    def translation_forces(self) -> Array:
        """Forces of translations at set-up, see `stiffness.VolumePattern`."""
        return self._volume.translation

    # Room

    def create_vector(self, L: Any = None) -> PETSc.Vec:
        """Zero vector over [u, multiplier]; the form L is not needed."""
        return self.layout.create_vector()

    def create_matrix(self, a: Any) -> PETSc.Mat:
        """Matrix over [u, multiplier] with room for volume and contact. Collective.

        Parameters
        ----------
        a
            Compiled bilinear form of everything but contact.
        """
        # Free the memory of earlier solvers before more is needed
        free_dropped(self._comm)
        compat.destroy_garbage(self._comm)
        if self._volume is None or self._volume.form is not a:
            self.prepare(a)
        A = self.layout.create_matrix()
        self.update()
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
        if not any(contact.preallocations for contact in self.contacts):
            require_memory(self._comm, matrix_bytes(self._volume, self.contacts))
        for contact in self.contacts:
            contact.note_room(extended)
        _cpp.preallocate(
            A.handle,
            self._volume.offsets,
            self._volume.columns,
            [zone.cpp for zone in self.zones],
            [zone.pattern for zone in self.zones],
        )
        A.setAttr(ROOM, self._room)

    @property
    def _room(self) -> tuple[int, ...]:
        """Number of the volume, and how often each contact's patterns were extended."""
        return (self._volume.number, *(c.extensions for c in self.contacts))

    def _require(self, name: str, thing: Any, kind: type) -> None:
        """Raise unless a method may be called now, and with this object. Collective."""
        message = self._order_fault(name)
        if message is None and not isinstance(thing, kind):
            message = (
                f"{name} needs a PETSc {kind.__name__} over [u, multiplier], not "
                f"{type(thing).__name__}"
            )
        elif message is None:
            rows = thing.getLocalSize()
            rows = rows if kind is PETSc.Vec else rows[0]
            if rows != self.layout.size:
                message = (
                    f"{name} needs {self.layout.size} rows on this rank, those of [u, "
                    f"multiplier], and was given {rows}: use create_matrix or "
                    "create_vector"
                )
        raise_everywhere(self._comm, message)

    def _order_fault(self, name: str) -> str | None:
        """What the user should have called first, if anything."""
        if self._volume is None and name == "make_room":
            return "make_room needs the volume's pattern: call create_matrix(a) first"
        if self.updates == 0:
            return f"{name} needs pairs: call update first"
        if self.gamma is None:
            return f"{name} needs gamma: give one, or make a problem, which sets it"
        return None

    def _patterns_cover(self) -> bool:
        """Whether the zones' patterns have all present pairs, on all ranks.
        Collective."""
        covered = all(zone.pattern.covers(zone.cpp) for zone in self.zones)
        return self._comm.allreduce(covered, op=MPI.LAND)

    def _has_room(self, A: PETSc.Mat) -> bool:
        """Whether A can hold the present pairs, on all ranks. Collective.

        Since A was preallocated, another solver or problem may have extended the
        patterns. A matrix that is not from `create_matrix` is the user's
        responsibility.
        """
        room = A.getAttr(ROOM)
        known = room is None or room == self._room
        return known and self._patterns_cover()

    def make_room(self, A: PETSc.Mat) -> bool:
        """Preallocate A anew if pairs have appeared that it cannot hold. Collective.

        If so, A loses its values, and everything attached to it except null spaces and
        the prefix. A KSP that has factorised A must be ``reset()``: PETSc does not notice
        the new pattern, and would write the new values into memory of the old one.

        Returns
        -------
        Whether A was preallocated anew.
        """
        self._require("make_room", A, PETSc.Mat)
        if self._has_room(A):
            return False
        self._make_room(A)
        return True

    # Assembly

    def assemble_matrix(self, A: PETSc.Mat, bcs: Sequence[Any] = ()) -> None:
        """Add the tangent at the last `update`. Collective.

        Constrained rows and columns are left out. The caller assembles A afterwards.
        """
        self._require("assemble_matrix", A, PETSc.Mat)
        for contact in self.contacts:
            contact.add_tangent(A, bcs)
        if self.layout.bodies:
            self.free_bodies.add_tangent(A)

    def assemble_vector(self, b: PETSc.Vec, bcs: Sequence[Any] = ()) -> None:
        """Add the residual at the last `update`. Collective.

        Constrained rows are left out. The caller assembles b afterwards.
        """
        self._require("assemble_vector", b, PETSc.Vec)
        for contact in self.contacts:
            contact.add_residual(b, bcs)
        if self.layout.bodies:
            self.free_bodies.add_residual(b)

    def constrained(self, bcs: Sequence[Any]) -> Any:
        """Whether Dirichlet conditions prescribe a dof of u; ghosted. Collective."""
        return [contact.prescribed(bcs) for contact in self.contacts][0]

    def apply_lifting(
        self, b: PETSc.Vec, bcs: Sequence[Any], x0: Array, alpha: float
    ) -> None:
        """b <- b - alpha A_c (g - x0) over constrained columns. Collective.

        Parameters
        ----------
        b
            Vector over [u, multiplier]. The caller assembles it afterwards.
        bcs
            Dirichlet conditions.
        x0
            Ghosted array of u.
        alpha
            Factor, -1 for the residual of Newton's method.
        """
        self._require("apply_lifting", b, PETSc.Vec)
        found, shape = np.shape(x0), self.u.x.array.shape
        message = f"x0 must be a ghosted array of u, of shape {shape}, not {found}"
        raise_everywhere(self._comm, None if found == shape else message)
        self.constrained(bcs)
        self.lift(b, self.host.increment_u(bcs, x0), alpha)

    def lift(self, b: PETSc.Vec, increment: Array, alpha: float) -> None:
        """b <- b - alpha A_c increment. The increment is ghosted, for the conditions of
        the last call. Collective."""
        if not self._comm.allreduce(bool(np.any(increment)), op=MPI.LOR):
            return
        for zone in self.zones:
            slave, master = on_sides(zone, increment)
            with together(self._comm):
                _cpp.apply_lifting(
                    zone.cpp, b.handle, slave, master, alpha, zone.assembly
                )

"""Contact's share of PETSc matrices and vectors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx.fem import Function

from mpi4py import MPI
from petsc4py import PETSc

from . import _cpp
from .compat import Array
from .errors import ContactError, raise_everywhere, together
from .fields import ContactFields
from .held import any_held, any_node_held, refuse_held
from .host import Host
from .interfaces import Interfaces
from .memory import matrix_bytes, require_memory
from .shear_modulus import shear_moduli
from .stiffness import contact_stiffness, mean_facet_size
from .surfaces import Surface


# Attribute of a PETSc matrix, whatever Python object stands for it: what it has room for
ROOM = "raymortar_room"


class ContactAssembly(ContactFields):
    """Matrices and vectors over [u, multiplier]; `Contact` has them all."""

    host: Host
    _volume: Any
    _fixed_by: tuple[Any, ...] | None
    _fixed: npt.NDArray[np.int8]
    _some_held: bool
    gamma_scale: float
    interfaces: Interfaces
    _extensions: int

    def _on_surface(self, array: Array, surface: Surface) -> Array:
        """Values of a ghosted array of u at the surface's dofs, (dofs, gdim)."""
        return array.reshape(-1, surface.gdim)[surface.dofs]

    def _for_zones(self, send: str, array: Array) -> None:
        """Give every zone the values of an array of u on both its sides."""
        for zone in self.zones:
            getattr(zone.cpp, send)(
                self._on_surface(array, zone.facets.slave_surface),
                self._on_surface(array, zone.facets.master_surface),
            )

    def solve_for(self, functions: Sequence[Function]) -> None:
        """Take what a problem solves for, the displacement among it. Collective.

        Raises
        ------
        ContactError
            If the displacement is none of it, or if there is a problem with other
            unknowns.
        """
        with together(self._comm):
            self.host.solve_for(functions, self._volume is not None)
        if self.host.is_plain:
            return
        self.layout.number()
        for zone in self.zones:
            sides = zone.facets.slave_surface, zone.facets.master_surface
            zone.cpp.set_rows(
                *(self.layout.u_rows[side.dofs] for side in sides),
                self.layout.multiplier_rows[zone.multiplier_nodes],
            )

    def _fix(self, bcs: Sequence[Any]) -> None:
        """Tell the zones which displacements are prescribed. Collective."""
        by = self._fixed_by
        if by is not None and tuple(map(id, bcs)) == tuple(map(id, by)):
            return
        self._fixed, _ = self.host.prescribed_u(bcs)
        self._for_zones("set_fixed", self._fixed.astype(np.float64))
        self._fixed_by = tuple(bcs)
        if self.multiplier is None:
            return
        if self._volume is not None:
            for zone, modulus in zip(self.zones, shear_moduli(self, bcs)):
                zone.cpp.set_shear_modulus(modulus)
        self._some_held = any_held(self, self._fixed)
        if any_node_held(self, self._fixed):
            for zone, modulus in zip(self.zones, self._moduli(bcs)):
                zone.cpp.set_modulus(modulus)

    def _moduli(self, bcs: Sequence[Any]) -> list[float]:
        """Of the softest body of each zone; where the volume's form tells none, the
        coefficient times the size of facets. Stress. Collective."""
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

    def constrained(self, bcs: Sequence[Any]) -> npt.NDArray[np.bool_]:
        """Whether Dirichlet conditions prescribe a dof of u; ghosted. Collective."""
        self._fix(bcs)
        return self._fixed == 1

    def create_vector(self, L: Any = None) -> PETSc.Vec:
        """Zero vector over [u, multiplier]; the form L is not needed."""
        return self.layout.create_vector()

    def _make_room(self, A: PETSc.Mat) -> None:
        self._preallocations += 1
        if not self._patterns_cover():
            self._extensions += 1
            for zone in self.zones:
                zone.pattern.extend(zone.cpp)
        for zone in self.zones:
            zone.positions.forget()
        if self._preallocations == 1:  # later ones take the memory of the last
            needed = matrix_bytes(self._volume, self.zones, self.layout.components)
            require_memory(self._comm, needed)
        _cpp.preallocate(
            A.handle,
            self._volume.offsets,
            self._volume.columns,
            [zone.cpp for zone in self.zones],
            [zone.pattern for zone in self.zones],
        )
        A.setAttr(ROOM, (self._volume.number, self._extensions))

    def _require(self, name: str, thing: Any, kind: type) -> None:
        """Raise unless a method may be called now, and with this thing. Collective."""
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
        """What should have come before a call, if anything."""
        if self._volume is None and name == "make_room":
            return "make_room needs the volume's pattern: call create_matrix(a) first"
        if self.updates == 0:
            return f"{name} needs pairs: call update first"
        if self.gamma is None:
            return f"{name} needs gamma: give one, or make a problem, which sets it"
        return None

    def _patterns_cover(self) -> bool:
        """Whether the zones' patterns have all present pairs, on all ranks. Collective."""
        covered = all(zone.pattern.covers(zone.cpp) for zone in self.zones)
        return self._comm.allreduce(covered, op=MPI.LAND)

    def _has_room(self, A: PETSc.Mat) -> bool:
        """Whether A can hold the present pairs, on all ranks. Collective.

        Patterns may have been extended for the matrix of another solver or problem
        since A was preallocated. One that is not of `create_matrix` is the user's care.
        """
        room = A.getAttr(ROOM)
        known = room is None or room == (self._volume.number, self._extensions)
        return known and self._patterns_cover()

    def make_room(self, A: PETSc.Mat) -> bool:
        """Preallocate A anew if pairs have appeared that it cannot hold. Collective.

        A loses its values then, and a KSP that has factorised it must be ``reset()``:
        PETSc 3.22 (3.18 not yet) does not notice the new pattern of a parallel matrix and
        would write the new values into the old pattern's memory.

        Returns
        -------
        Whether it did.
        """
        self._require("make_room", A, PETSc.Mat)
        if self._has_room(A):
            return False
        self._make_room(A)
        return True

    def assemble_matrix(self, A: PETSc.Mat, bcs: Sequence[Any] = ()) -> None:
        """Add the tangent at the last `update`; assembly of A is the caller's.

        Constrained rows and columns are left out. Collective.
        """
        self._require("assemble_matrix", A, PETSc.Mat)
        self._fix(bcs)
        if self._some_held:
            refuse_held(self)
        with together(self._comm):
            for zone in self.zones:
                _cpp.add_tangent(zone.cpp, A.handle, zone.positions)

    def assemble_vector(self, b: PETSc.Vec, bcs: Sequence[Any] = ()) -> None:
        """Add the residual at the last `update`; assembly of b is the caller's.

        Constrained rows are left out. Collective.
        """
        self._require("assemble_vector", b, PETSc.Vec)
        self._fix(bcs)
        with together(self._comm):
            for zone in self.zones:
                _cpp.add_residual(zone.cpp, b.handle)

    def apply_lifting(
        self, b: PETSc.Vec, bcs: Sequence[Any], x0: Array, alpha: float
    ) -> None:
        """b <- b - alpha A_c (g - x0) over constrained columns. Collective.

        Parameters
        ----------
        b
            Vector over [u, multiplier]; its assembly is the caller's.
        bcs
            Dirichlet conditions.
        x0
            Ghosted array of u.
        alpha
            Factor; -1 for the residual of Newton's method.
        """
        self._require("apply_lifting", b, PETSc.Vec)
        found, shape = np.shape(x0), self.u.x.array.shape
        message = f"x0 must be a ghosted array of u, of shape {shape}, not {found}"
        raise_everywhere(self._comm, None if found == shape else message)
        self._fix(bcs)
        self.lift(b, self.host.increment_u(bcs, x0), alpha)

    def lift(self, b: PETSc.Vec, increment: Array, alpha: float) -> None:
        """b <- b - alpha A_c increment (ghosted, of the last conditions). Collective."""
        if not self._comm.allreduce(bool(np.any(increment)), op=MPI.LOR):
            return
        for zone in self.zones:
            sides = zone.facets.slave_surface, zone.facets.master_surface
            slave, master = (self._on_surface(increment, side) for side in sides)
            with together(self._comm):
                _cpp.apply_lifting(zone.cpp, b.handle, slave, master, alpha)

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

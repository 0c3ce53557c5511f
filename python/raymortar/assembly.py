"""Contact's share of PETSc matrices and vectors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from mpi4py import MPI
from petsc4py import PETSc

from . import _cpp, compat
from .compat import Array
from .errors import ContactError, together
from .fields import ContactFields
from .held import any_held, any_node_held, refuse_held
from .memory import matrix_bytes, require_memory
from .stiffness import contact_modulus, contact_stiffness
from .surfaces import Surface


class ContactAssembly(ContactFields):
    """Matrices and vectors over [u, multiplier]; `Contact` has them all."""

    _volume: Any
    _fixed_by: tuple[Any, ...] | None
    _fixed: npt.NDArray[np.int8]
    _some_held: bool
    gamma_scale: float

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

    def _fix(self, bcs: Sequence[Any]) -> None:
        """Tell the zones which displacements are prescribed. Collective."""
        by = self._fixed_by
        if by is not None and tuple(map(id, bcs)) == tuple(map(id, by)):
            return
        self._fixed, _ = compat.dirichlet_dofs(bcs, self.u.function_space)
        self._for_zones("set_fixed", self._fixed.astype(np.float64))
        self._fixed_by = tuple(bcs)
        if self.multiplier is None:
            return
        self._some_held = any_held(self, self._fixed)
        if any_node_held(self, self._fixed):
            modulus = contact_modulus(self._stiffness(bcs), self.layout, self.zones)
            for zone in self.zones:
                zone.cpp.set_modulus(modulus)

    def _stiffness(self, bcs: Sequence[Any]) -> float:
        """Of the softer body, force per length over area; where the volume's form tells
        none, the coefficient instead. Collective."""
        if self._volume is not None:
            try:
                return contact_stiffness(self._volume, self.layout, self.zones, bcs)
            except ContactError:  # on all ranks
                pass
        return self.gamma_scale

    def constrained(self, bcs: Sequence[Any]) -> npt.NDArray[np.bool_]:
        """Whether Dirichlet conditions prescribe a dof of u; ghosted. Collective."""
        self._fix(bcs)
        return self._fixed == 1

    def create_vector(self, L: Any = None) -> PETSc.Vec:
        """Zero vector over [u, multiplier]; the form L is not needed."""
        return self.layout.create_vector()

    def _make_room(self, A: PETSc.Mat) -> None:
        self._preallocations += 1
        for zone in self.zones:
            zone.pattern.extend(zone.cpp)
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

    def make_room(self, A: PETSc.Mat) -> bool:
        """Preallocate A anew if pairs have appeared that it cannot hold. Collective.

        A loses its values then, and a KSP that has factorised it must be ``reset()``:
        PETSc 3.22 (3.18 not yet) does not notice the new pattern of a parallel matrix and
        would write the new values into the old pattern's memory.

        Returns
        -------
        Whether it did.
        """
        short = any(not zone.pattern.covers(zone.cpp) for zone in self.zones)
        if not self._comm.allreduce(short, op=MPI.LOR):
            return False
        self._make_room(A)
        return True

    def assemble_matrix(self, A: PETSc.Mat, bcs: Sequence[Any] = ()) -> None:
        """Add the tangent at the last `update`; assembly of A is the caller's.

        Constrained rows and columns are left out. Collective.
        """
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
        self._fix(bcs)
        self.lift(b, compat.dirichlet_increment(bcs, x0), alpha)

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

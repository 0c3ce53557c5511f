"""The coupled system of a list of contacts: its matrices and vectors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from ... import _cpp
from .. import compat
from ..compat import Array
from ..discretization.ranks import free_dropped
from ..discretization.unknowns import Unknowns
from ..gamma.probing import VolumePattern
from ..hooks import hooks
from .assembly import ContactAssembly
from .iterates import CoupledIterates

# Attribute of a PETSc matrix that tells what it has room for. PETSc keeps it with the
# matrix, whichever Python object refers to it
ROOM = "raymortar_room"
# Types of matrices that `make_room` gives a pattern
_WITH_ROOM = PETSc.Mat.Type.SEQAIJ, PETSc.Mat.Type.MPIAIJ


class CoupledSystem(CoupledIterates):
    """Matrices and vectors over [u, multipliers, bodies] of a list of contacts."""

    def __init__(self, unknowns: Unknowns, parts: Sequence[ContactAssembly]) -> None:
        super().__init__(unknowns, parts)
        self._free_bodies: Any = None

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

    def volume_alone(self) -> VolumePattern:
        """Read the volume's form again, without strains; `destroy` frees its matrices.
        Collective."""
        form = self._volume.form
        return VolumePattern(form, self.layout, self.axisymmetric, strains=False)

    def use_volume(self, volume: VolumePattern) -> None:
        """Use the volume, from `prepare`, of another problem of these contacts."""
        for part in self.parts:
            part.use_volume(volume)

    @property
    def _volume(self) -> VolumePattern:
        """The volume of the problem."""
        volume = self.parts[0].volume
        assert volume is not None, "call prepare first"
        return volume

    @property
    def stiffness_diagonal(self) -> Array:
        """Diagonal of the volume's matrix at set-up, owned dofs of u, unrolled."""
        return self._volume.diagonal

    @property
    def own_couplings(self) -> Array:
        """Coupling of each row of the forms to its field, (owned rows,)."""
        found = np.zeros(self.layout.n)
        for field, row in zip(self.unknowns.fields(), self._volume.couplings):
            found[field.rows] = row[field.rows]
        return found

    @property
    def translation_forces(self) -> Array:
        """Forces of translations at set-up, see `probing.VolumePattern`."""
        return self._volume.translation

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
            self._volume.offsets,
            self._volume.columns,
            [zone.cpp for zone in self.zones],
            [zone.pattern for zone in self.zones],
            [rows for term in self._volume.terms for rows in term.rows()],
        )
        A.setAttr(ROOM, self._room)

    @property
    def _room(self) -> tuple[int, ...]:
        """Number of the volume, and how often each contact's patterns were extended."""
        return (self._volume.number, *[part.extensions for part in self.parts])

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

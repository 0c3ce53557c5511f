"""The coupled system of a list of contacts: its matrices and vectors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from ... import _cpp
from .. import compat
from ..compat import Array
from ..discretization.forms import list_of_conditions
from ..discretization.ranks import free_dropped
from ..discretization.unknowns import Unknowns
from ..errors import ContactError, raise_everywhere, require_agreement, together
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
        with together(self.comm):
            for check in hooks.on_compiled:
                check(a, self.unknowns)
        for part in self.parts:
            if part.unknowns.spaces is None:
                part.unknowns.spaces = [compat.test_space(a)]
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

    def create_vector(self, L: Any = None) -> PETSc.Vec:
        """See `Contact.create_vector`. Collective."""
        if self.layout.more_than_forms:
            return self.layout.create_vector()
        return self.layout.create_form_vector()

    @contextmanager
    def form_block(self, b: PETSc.Vec) -> Iterator[PETSc.Vec]:
        """See `Contact.form_block`. Collective."""
        self._require_rows("form_block", b, PETSc.Vec)
        n = self.layout.n
        if not self.layout.more_than_forms:
            with b.localForm() as local:
                local.array[n:] = 0.0
            yield b
            return
        part = self.layout.create_form_vector()
        try:
            part.array[:] = b.array_r[:n]
            yield part
            b.array[:n] = part.array_r
        finally:
            part.destroy()

    def create_matrix(self, a: Any) -> PETSc.Mat:
        """See `Contact.create_matrix`. Collective."""
        # Free the memory of earlier solvers before more is needed
        free_dropped(self.comm)
        compat.destroy_garbage(self.comm)
        volume = self.parts[0].volume
        if volume is None or volume.form is not a:
            self.prepare(a)
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

    def _require(self, name: str, thing: Any, kind: Any) -> None:
        """Raise unless a method may be called now, and with this object. Collective."""
        message = None
        if self.parts[0].volume is None and name == "make_room":
            message = (
                "make_room needs the volume's pattern: call create_matrix(a) first"
            )
        elif self.updates == 0:
            message = f"{name} needs pairs: call update first"
        elif any(part.gamma is None for part in self.parts):
            message = (
                f"{name} needs gamma: give one, or make a problem or create_matrix(a), "
                "which sets it"
            )
        raise_everywhere(self.comm, message)
        self._require_rows(name, thing, kind)

    def _require_rows(self, name: str, thing: Any, kind: Any) -> None:
        """Raise for all but a matrix or vector over the unknowns. Collective."""
        message = None
        if not isinstance(thing, kind):
            message = (
                f"{name} needs a PETSc {kind.__name__} over [u, multiplier], not "
                f"{type(thing).__name__}"
            )
        else:
            # A matrix has rows and columns
            sizes = np.unique(thing.getLocalSize())
            if (sizes != self.layout.size).any():
                found = " x ".join(map(str, np.ravel(thing.getLocalSize())))
                message = (
                    f"{name} needs {self.layout.size} rows on this rank, those of [u, "
                    f"multiplier], and was given {found}: use create_matrix or "
                    "create_vector"
                )
        raise_everywhere(self.comm, message)

    def _require_conditions(self, bcs: Any) -> list[Any]:
        """Dirichlet conditions as a list, or an error on all ranks. Collective."""
        with together(self.comm):
            found = list_of_conditions(bcs)
            self.unknowns.conditions(found)
        require_agreement(self.comm, number_of_conditions=len(found))
        return found

    def _patterns_cover(self) -> bool:
        """Whether the zones' patterns have all present pairs, on all ranks.
        Collective."""
        covered = all([zone.pattern.covers(zone.cpp) for zone in self.zones])
        return bool(self.comm.allreduce(covered, op=MPI.LAND))

    def from_vector(self, x: PETSc.Vec) -> None:
        self._require_rows("from_vector", x, PETSc.Vec)
        super().from_vector(x)

    def to_vector(self, x: PETSc.Vec) -> None:
        self._require_rows("to_vector", x, PETSc.Vec)
        super().to_vector(x)

    def make_room(self, A: PETSc.Mat) -> bool:
        """See `Contact.make_room`. Collective."""
        self._require("make_room", A, PETSc.Mat)
        return self.extend_room(A)

    def extend_room(self, A: PETSc.Mat) -> bool:
        """`make_room` of a matrix that is one of this system. Collective."""
        if A.getAttr(ROOM) is None:  # not from `create_matrix`
            is_plain = A.getType() in _WITH_ROOM
            lacks = is_plain or not self._patterns_cover()
        else:
            lacks = self._lacks_room(A)
        if lacks:
            self._make_room(A)
        return lacks

    def _lacks_room(self, A: PETSc.Mat) -> bool:
        """Whether a matrix from `create_matrix` has no room for the present pairs.
        Collective."""
        room = A.getAttr(ROOM)
        if room is None:
            return False
        # Another solver or problem may have extended the patterns since it was made
        return room != self._room or not self._patterns_cover()

    # Assembly

    def assemble_matrix(self, A: PETSc.Mat, bcs: Sequence[Any] = ()) -> None:
        """See `Contact.assemble_matrix`. Collective."""
        self._require("assemble_matrix", A, PETSc.Mat)
        if self._lacks_room(A):
            raise ContactError(
                "A has no room for the present pairs: call contact.make_room(A) after "
                "update, before the forms are assembled; several contacts share A as "
                "NonlinearProblem(F, contacts).contact"
            )
        bcs = self._require_conditions(bcs)
        # PETSc has no memory for the flush of a matrix that is not set up
        A.setUp()
        # PETSc refuses to mix adding and inserting without a flush between them
        A.assemble(PETSc.Mat.AssemblyType.FLUSH)
        self.add_tangent(A, bcs)

    def add_tangent(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        """`assemble_matrix` of a matrix that is one of this system. Collective."""
        for part in self.parts:
            part.refuse_held(bcs)
        if A.getAttr(ROOM) is None:
            self._add_to_foreign(A)
        else:
            self.cpp.add_tangent(A.handle)
        if self.layout.bodies:
            self.free_bodies.add_tangent(A)

    def _add_to_foreign(self, A: PETSc.Mat) -> None:
        """Add the tangent to a matrix that is not from `create_matrix`: each rank may
        find no room for its rows. Collective."""
        with together(self.comm):
            try:
                self.cpp.add_tangent(A.handle)
            except _cpp.Error as error:
                raise ContactError(
                    "A has no room for contact: make it by "
                    "contact.create_matrix(a), or call contact.make_room(A) before the "
                    f"forms are assembled ({error})"
                ) from error

    def assemble_vector(self, b: PETSc.Vec, bcs: Sequence[Any] = ()) -> None:
        """See `Contact.assemble_vector`. Collective."""
        self._require("assemble_vector", b, PETSc.Vec)
        self.constrained(self._require_conditions(bcs))
        b.assemble()  # what was inserted
        self.cpp.add_residual(b.handle)
        b.assemble()

    def apply_lifting(
        self, b: PETSc.Vec, bcs: Sequence[Any], x0: Array, alpha: float
    ) -> None:
        """See `Contact.apply_lifting`. Collective."""
        self._require("apply_lifting", b, PETSc.Vec)
        found, shape = np.shape(x0), self.u.x.array.shape
        message = f"x0 must be a ghosted array of u, of shape {shape}, not {found}"
        raise_everywhere(self.comm, None if found == shape else message)
        bcs = self._require_conditions(bcs)
        self.constrained(bcs)
        b.assemble()  # what was inserted
        self.cpp.lift(b.handle, self.unknowns.increment_u(bcs, x0), alpha)
        b.assemble()

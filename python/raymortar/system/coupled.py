"""The coupled system of a list of contacts: its matrices and vectors."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from .. import _cpp, compat
from ..compat import Array
from ..discretization.forms import check_compiled
from ..discretization.ranks import free_dropped
from ..discretization.unknowns import Unknowns
from ..errors import raise_everywhere, together
from ..interface.coefficients import PairCoefficients
from ..interface.probing import VolumePattern
from ..interface.surface_compliance import SurfaceCompliance
from ..interface.zone_data import ZoneData
from .assembly import ContactAssembly
from .free_bodies import FreeBodies
from .iterates import CoupledIterates

# Attribute of a PETSc matrix that tells what it has room for. PETSc keeps it with the
# matrix, whichever Python object refers to it
ROOM = "raymortar_room"


class CoupledSystem(CoupledIterates):
    """Matrices and vectors over [u, multipliers, bodies] of a list of contacts."""

    def __init__(self, unknowns: Unknowns, parts: Sequence[ContactAssembly]) -> None:
        super().__init__(unknowns, parts)
        self._free_bodies: FreeBodies | None = None

    @property
    def free_bodies(self) -> FreeBodies:
        """Equations of the free rigid bodies. Collective."""
        if self._free_bodies is None or self._free_bodies.layout is not self.layout:
            self._free_bodies = FreeBodies(self)
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
        with together(self._comm):
            check_compiled(a, len(self.unknowns.functions))
        for part in self.parts:
            if part.unknowns.spaces is None:
                part.unknowns.spaces = [compat.test_space(a)]
        # The size of a given penalty is checked without
        strains = any(
            part.surfaces.multiplier is not None or part.gamma is None
            for part in self.parts
        )
        volume = VolumePattern(a, self.layout, self.axisymmetric, strains)
        with self._compliance(volume, bcs) as compliance:
            for part in self.parts:
                part.set_volume(volume, bcs, compliance)
        return volume

    @contextmanager
    def _compliance(
        self, volume: VolumePattern, bcs: Sequence[Any]
    ) -> Iterator[SurfaceCompliance]:
        """Offer what the surfaces yield, as long as the volume has its matrices.
        Collective."""
        of = self.unknowns, self.parts[0].surfaces.bodies, bcs, self.axisymmetric
        compliance = SurfaceCompliance(volume, *of)
        try:
            yield compliance
        finally:
            compliance.destroy()
            volume.destroy()

    def softer(self, bcs: Sequence[Any]) -> list[float | PairCoefficients | None]:
        """Find what the coefficient of a law at nodes would be, for each part whose law
        at points has a multiplier; else None. Traction per length. Collective."""
        form = self._volume.form
        volume = VolumePattern(form, self.layout, self.axisymmetric, strains=False)
        with self._compliance(volume, bcs) as compliance:
            return [part.softer(bcs, compliance) for part in self.parts]

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
            parts = self.parts
            zones = ((z, part.layout.components) for part in parts for z in part.zones)
            require_memory(self._comm, self._volume, zones)
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
            message = f"{name} needs gamma: give one, or make a problem, which sets it"
        elif not isinstance(thing, kind):
            message = (
                f"{name} needs a PETSc {kind.__name__} over [u, multiplier], not "
                f"{type(thing).__name__}"
            )
        else:
            rows = np.ravel(thing.getLocalSize())[0]
            if rows != self.layout.size:
                message = (
                    f"{name} needs {self.layout.size} rows on this rank, those of [u, "
                    f"multiplier], and was given {rows}: use create_matrix or "
                    "create_vector"
                )
        raise_everywhere(self._comm, message)

    def _patterns_cover(self) -> bool:
        """Whether the zones' patterns have all present pairs, on all ranks.
        Collective."""
        covered = all([zone.pattern.covers(zone.cpp) for zone in self.zones])
        return bool(self._comm.allreduce(covered, op=MPI.LAND))

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
        return self.extend_room(A)

    def extend_room(self, A: PETSc.Mat) -> bool:
        """`make_room` of a matrix that is one of this system. Collective."""
        # Since A was preallocated, another solver or problem may have extended the
        # patterns. A matrix that is not from `create_matrix` is the user's responsibility
        room = A.getAttr(ROOM)
        if (room is None or room == self._room) and self._patterns_cover():
            return False
        self._make_room(A)
        return True

    # Assembly

    def assemble_matrix(self, A: PETSc.Mat, bcs: Sequence[Any] = ()) -> None:
        """Add the tangent at the last `update`. Collective.

        Constrained rows and columns are left out. The caller assembles A afterwards.
        """
        self._require("assemble_matrix", A, PETSc.Mat)
        self.add_tangent(A, bcs)

    def add_tangent(self, A: PETSc.Mat, bcs: Sequence[Any]) -> None:
        """`assemble_matrix` of a matrix that is one of this system. Collective."""
        for part in self.parts:
            part.refuse_held(bcs)
        self.cpp.add_tangent(A.handle)
        if self.layout.bodies:
            self.free_bodies.add_tangent(A)

    def assemble_vector(self, b: PETSc.Vec, bcs: Sequence[Any] = ()) -> None:
        """Add the residual at the last `update`. Collective.

        Constrained rows are left out. The caller assembles b afterwards.
        """
        self._require("assemble_vector", b, PETSc.Vec)
        self.constrained(bcs)
        self.cpp.add_residual(b.handle)

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
        self.cpp.lift(b.handle, self.unknowns.increment_u(bcs, x0), alpha)


# Average number of pairs of facets that share an entry: the number of facets around a
# node. This is exact for two regular lattices of any sizes
_AROUND_A_NODE = {"interval": 2, "triangle": 6, "quadrilateral": 4}


def available_memory() -> int | None:
    """Bytes of available memory on this machine; None if it is unknown."""
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
    except OSError:
        return None
    found = [line.split() for line in lines if line.startswith("MemAvailable:")]
    return 1024 * int(found[0][1]) if found else None


def contact_entries(zone: ZoneData, components: int) -> int:
    """Estimate the matrix entries of this rank's pairs from below.

    The zone's pattern has its pairs; components are those of the multiplier.
    """
    slave, master = zone.facets.slave_surface, zone.facets.master_surface
    rows = slave.facet_dofs.shape[1] * slave.gdim
    rows += zone.multiplier_table.shape[1] * components
    columns = master.facet_dofs.shape[1] * master.gdim
    return 2 * len(zone.pattern) * rows * columns // _AROUND_A_NODE[slave.shape]


def require_memory(
    comm: MPI.Comm, volume: VolumePattern, zones: Iterable[tuple[ZoneData, int]]
) -> None:
    """Raise if the ranks are about to allocate more than there is. Collective.

    Zones come with the components of their multipliers.

    Counted are entries of volume and contact, from below, and columns twice, as the
    pattern is made next to the matrix. The ranks of one machine share its memory.
    """
    entries = len(volume.columns) + sum(contact_entries(*zone) for zone in zones)
    index, value = (np.dtype(t).itemsize for t in (PETSc.IntType, PETSc.ScalarType))
    machine = comm.Split_type(MPI.COMM_TYPE_SHARED)
    size = machine.allreduce(entries * (value + 2 * index))
    ranks = machine.size
    machine.Free()
    available = available_memory()
    message = None
    if available is not None and size > available:
        message = (
            f"the matrix takes at least {size / 1e9:.3g} GB on a machine with "
            f"{ranks} rank(s), of which {available / 1e9:.3g} GB are available, and a "
            "direct solver several times that: take more machines, a coarser mesh, or "
            "an iterative solver"
        )
    raise_everywhere(comm, message, MemoryError)

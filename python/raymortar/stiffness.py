"""What contact takes from the volume's stiffness: its pattern, and gamma."""

from __future__ import annotations

from typing import Any

import numpy as np
from dolfinx.fem.petsc import assemble_matrix

from mpi4py import MPI

from .compat import Array
from .errors import ContactError, raise_everywhere
from .layout import Layout, marked_everywhere

# Newton's path hardly depends on it over two decades; docs/parameters has the curves
AUTOMATIC_FACTOR = 1.0


class VolumePattern:
    """Sparsity and diagonal of the volume's matrix, in the coupled numbering.

    Read off one assembly, which every version of DOLFINx offers. Collective.

    Attributes
    ----------
    offsets, columns
        Compressed rows of this rank, int32; columns in the coupled numbering.
    diagonal
        Of the owned displacement dofs, unrolled. Force per length.
    """

    def __init__(self, form: Any, layout: Layout) -> None:
        self.form = form
        K = assemble_matrix(form)
        K.assemble()
        offsets, columns, _ = K.getValuesCSR()
        self.offsets = np.asarray(offsets, dtype=np.int32)
        self.columns = layout.coupled_columns(columns)
        self.diagonal: Array = K.getDiagonal().array.copy()
        K.destroy()


def automatic_gamma(volume: VolumePattern, layout: Layout, zones: Any) -> float:
    """gamma = c sum(diag K) / sum(int N_a dG) over the slave displacement dofs.

    About the modulus over the mesh size, in force per length over area, with no
    material parameter asked for. Collective.

    Raises
    ------
    ContactError
        If the stiffness has no positive diagonal on the slave surface.
    """
    V = layout.u.function_space
    bs, owned = V.dofmap.index_map_bs, V.dofmap.index_map.size_local
    used = [zone.facets.slave_surface.dofs for zone in zones]
    slave = marked_everywhere(V, np.unique(np.concatenate(used)))[:owned]
    stiffness = volume.diagonal.reshape(-1, bs)[slave].sum()
    for zone in zones:
        zone.cpp.pair()
    area = sum(zone.cpp.segments()["whole_area"].sum() for zone in zones)
    stiffness, area = (layout.comm.allreduce(v, op=MPI.SUM) for v in (stiffness, area))
    gamma = AUTOMATIC_FACTOR * stiffness / (bs * area)
    fine = np.isfinite(gamma) and gamma > 0.0
    raise_everywhere(
        layout.comm,
        None
        if fine
        else "no automatic gamma: the form's stiffness has diagonal sum "
        f"{stiffness} on the slave surface; give gamma a value",
        ContactError,
    )
    return float(gamma)

"""What contact takes from the volume's stiffness: its pattern, and gamma."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from dolfinx.fem.petsc import assemble_matrix

from mpi4py import MPI

from . import compat
from .compat import Array
from .errors import ContactError, raise_everywhere
from .layout import Layout, marked_everywhere
from .reference_facets import normals, shape_functions
from .surfaces import Surface


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


def _area(surface: Surface) -> float:
    """Reference area (length in 2D) of this rank's facets."""
    points, weights = compat.quadrature(surface.shape, 2 * surface.node_degree)
    _, gradients = shape_functions(surface.shape, surface.node_degree, points)
    nodes = surface.X[surface.facet_nodes]
    tangents = np.einsum("iqa,fad->ifqd", gradients, nodes)
    return float((np.linalg.norm(normals(tangents), axis=-1) @ weights).sum())


def _side(
    volume: VolumePattern, layout: Layout, sides: Sequence[Surface], fixed: Any
) -> tuple[float, bool]:
    """Stiffness over area of all surfaces of one side, and whether it can move.

    Collective.
    """
    V = layout.u.function_space
    bs, owned = V.dofmap.index_map_bs, V.dofmap.index_map.size_local
    used = np.unique(np.concatenate([surface.dofs for surface in sides]))
    marked = marked_everywhere(V, used)[:owned]
    stiffness = volume.diagonal.reshape(-1, bs)[marked].sum()
    free = bool((fixed.reshape(-1, bs)[:owned][marked] == 0).any())
    area = sum(map(_area, sides))
    stiffness, area = (layout.comm.allreduce(v, op=MPI.SUM) for v in (stiffness, area))
    return stiffness / (bs * area), layout.comm.allreduce(free, op=MPI.LOR)


def contact_stiffness(
    volume: VolumePattern, layout: Layout, zones: Any, bcs: Sequence[Any] = ()
) -> float:
    """sum(diag K) / sum(int N_a dG) over a side's displacement dofs [theory (5.2)].

    About the modulus over the mesh size, in force per length over area, with no
    material parameter asked for, of the softer side. A side that is prescribed
    throughout is rigid, whatever stiffness it has been given. Collective.

    Raises
    ------
    ContactError
        If the stiffness has no positive diagonal on any side that can move.
    """
    fixed, _ = compat.dirichlet_dofs(bcs, layout.u.function_space)
    facets = [zone.facets for zone in zones]
    sides = {
        "slave": _side(volume, layout, [f.slave_surface for f in facets], fixed),
        "master": _side(volume, layout, [f.master_surface for f in facets], fixed),
    }
    soft = any(free for _, free in sides.values())
    found = [s for s, free in sides.values() if free or not soft]
    fine = [s for s in found if np.isfinite(s) and s > 0.0]
    described = ", ".join(f"{s} on the {name}" for name, (s, _) in sides.items())
    raise_everywhere(
        layout.comm,
        None
        if fine
        else f"no automatic gamma: the form's stiffness over area is {described} "
        "surface; give gamma a value",
        ContactError,
    )
    return float(min(fine))


def contact_modulus(stiffness: float, layout: Layout, zones: Any) -> float:
    """A stress: contact stiffness times the mean size of the slave facets. Collective."""
    sides = [zone.facets.slave_surface for zone in zones]
    area = layout.comm.allreduce(sum(map(_area, sides)), op=MPI.SUM)
    facets = layout.comm.allreduce(sum(len(side.facet_dofs) for side in sides))
    return stiffness * float((area / facets) ** (1.0 / (sides[0].gdim - 1)))

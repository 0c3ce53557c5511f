"""The shear modulus of the softer body of each zone, read off the stiffness matrix."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mpi4py import MPI

import numpy as np
import numpy.typing as npt
from dolfinx import fem

from .. import compat
from ..compat import Array
from ..host.facets import Facets
from ..host.joined import parts_of, places_of
from ..host.ranks import marked_everywhere
from ..host.surfaces import Surface, vector_areas
from .contact_surfaces import ContactSurfaces
from .stiffness import VolumePattern
from .strain_response import deviators


def shear_moduli(
    surfaces: ContactSurfaces, volume: VolumePattern, bcs: Sequence[Any]
) -> list[float]:
    """Shear modulus of the softer body of each zone that can move; 0 where the volume's
    form tells none. Stress. Collective.

    In a uniform shear E the nodal force of a homogeneous body is 2 mu E c, with the
    node's share c of the boundary's vector area [theory (5.8)]. Neither the mesh within
    the bodies nor its size enters.

    Parameters
    ----------
    surfaces
        Of a contact.
    volume
        Of its problem.
    bcs
        Dirichlet conditions.
    """
    sides = _Sides(surfaces, volume, bcs)
    moduli = []
    for zone in surfaces.zones:
        facets = zone.facets
        found = np.concatenate(
            [
                sides.moduli(facets.slave_surface, facets.slave, facets.slave_part),
                sides.moduli(facets.master_surface, facets.master, facets.master_part),
            ]
        )
        moduli.append(float(found.min(initial=np.inf, where=found > 0.0)))
    return [modulus if np.isfinite(modulus) else 0.0 for modulus in moduli]


class _Sides:
    """Measures the sides of zones."""

    def __init__(
        self, surfaces: ContactSurfaces, volume: VolumePattern, bcs: Sequence[Any]
    ) -> None:
        self._V = V = surfaces.u.function_space
        self._comm: MPI.Comm = surfaces.comm
        self._bodies = surfaces.bodies
        self._owned, d = V.dofmap.index_map.size_local, V.mesh.geometry.dim
        fixed, _ = surfaces.host.prescribed_u(bcs)
        self._free = (fixed.reshape(-1, d)[: self._owned] == 0).any(axis=1)
        self._sheared = volume.response[:, 0]
        # Sum of the squares of the deviators, a multiple of the identity
        self._kappa = sum((E @ E)[0, 0] for E in deviators(d))
        self._u = surfaces.u
        meshes = [part.function_space.mesh for part in parts_of(self._u)]
        self._exterior = [compat.exterior_facets(mesh) for mesh in meshes]

    def moduli(self, surface: Surface, facets: Facets, part: int) -> Array:
        """Modulus of each body. 0 for bodies that have no facet there or cannot move.
        The facets are on the mesh of a part."""
        bodies = self._bodies
        on = marked_everywhere(self._V, surface.dofs)[: self._owned]
        areas = self._squared_areas(surface)
        values = np.column_stack([areas, self._sheared, self._free])
        sums = []
        for nodes in (on & ~self._on_rim(facets, part), on):
            of = bodies.dofs[: self._owned][nodes]
            sums += [
                np.bincount(of, column, minlength=bodies.count)
                for column in values[nodes].T
            ]
        total = np.array(sums, dtype=np.float64)  # empty counts are integers
        self._comm.Allreduce(MPI.IN_PLACE, total)
        inner, every = np.split(total, 2)
        # Use inner nodes, if there are any: at the rim other facets add to the forces
        used = np.where(inner[0] > 0.0, inner, every)
        with np.errstate(divide="ignore", invalid="ignore"):
            squares = used[1:-1].min(axis=0) / (4.0 * self._kappa * used[0])
        return np.where((every[-1] > 0.0) & (used[0] > 0.0), np.sqrt(squares), 0.0)

    def _squared_areas(self, surface: Surface) -> Array:
        """Square of each owned node's share of the surface's vector area."""
        vector = vector_areas(
            surface,
            self._V.dofmap.index_map,
            surface.displacement_degree,
            surface.dofs[surface.facet_dofs],
        )
        table = vector.array.reshape(-1, surface.gdim)
        return np.einsum("nd,nd->n", table[: self._owned], table[: self._owned])

    def _on_rim(self, facets: Facets, part: int) -> npt.NDArray[np.bool_]:
        """Whether an owned node is on an exterior facet besides these."""
        V = parts_of(self._u)[part].function_space
        others = np.setdiff1d(self._exterior[part], facets.facets).astype(np.int32)
        dofs = fem.locate_dofs_topological(V, V.mesh.topology.dim - 1, others)
        places = places_of(self._u, part)
        dofs = dofs if places is None else places[dofs]
        return marked_everywhere(self._V, dofs)[: self._owned]

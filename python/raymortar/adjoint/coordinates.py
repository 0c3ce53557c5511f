"""Undeformed positions, by which functionals are differentiated."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx import mesh as meshes

from ..core import compat
from ..core.compat import Array
from ..core.errors import ContactError, of_type
from ..core.interface.point_results import OPEN
from .controls import Control, function_of
from .forms import by_coordinates
from .kinks import NEAR
from .linear import Linearised


class OfMesh(Control):
    """Undeformed positions of a mesh's nodes."""

    def __init__(self, mesh: Any) -> None:
        self._mesh = mesh

    def check(self, problem: Any, forms: Sequence[Any]) -> None:
        mesh = self._mesh
        own = [d.u.function_space for d in problem.contact.unknowns.displacements]
        fits = [k for k, V in enumerate(own) if V.mesh is mesh]
        if not fits:
            raise ContactError(
                "coordinates: no displacement of the problem is on this mesh"
            )
        (self._k, *_), p = fits, compat.element_info(own[fits[0]]).degree
        g = compat.geometry_degree(mesh)
        if g > p:
            raise ContactError(
                f"coordinates: the mesh has degree {g} and its displacement {p}, which "
                "does not move all of its nodes"
            )
        self._V = own[self._k]

    def check_state(self, problem: Any) -> None:
        for contact in problem.contact.contacts:
            refuse(contact)

    def start(self, problem: Any) -> Array:
        mesh = self._mesh
        X = compat.vector_space(mesh, compat.geometry_degree(mesh))
        self._X = fem.Function(X, name="coordinates")
        return np.zeros(len(self._X.x.array))

    def by_forms(self, forms: Sequence[Any], signs: Sequence[float]) -> Array | float:
        found: Array | float = 0.0
        for form, sign in zip(forms, signs):
            if form.ufl_domain() == self._mesh.ufl_domain():
                found = found + sign * by_coordinates(form, self._X)
        return found

    def by_contact(self, at: Linearised) -> Array | float:
        """x = X + u at the present and at the accepted step, and areas
        [theory (8.7)]."""
        zones = at.problem.contact.zones
        y = at.by_unknowns()
        for kind in ("old", "reference"):
            if kind == "reference" or any(zone.frictional for zone in zones):
                more = at.by_parameter(zones, kind)
                y.axpy(1.0, more)
                more.destroy()
        values = at.of_displacement(at.displacements(y), self._k)
        y.destroy()
        return self._to_nodes(values)

    def _to_nodes(self, values: Array) -> Array:
        """Take derivatives by the positions of the displacement's dofs to those by the
        mesh's nodes, ghosted arrays. Collective."""
        V, mesh, nodes = self._V, self._mesh, self._X.function_space
        d, degree = mesh.geometry.dim, compat.geometry_degree(mesh)
        points = compat.element_points(V)
        N = compat.tabulate(compat.cell_name(mesh), degree, points)[0]
        table, of_nodes = compat.dofmap_array(V), compat.dofmap_array(nodes)
        # Each owned dof in one of its cells
        dofs, place = np.unique(table.ravel(), return_index=True)
        own = dofs < V.dofmap.index_map.size_local
        cells, local = np.divmod(place[own], table.shape[1])
        parts = N[local][:, :, None] * values.reshape(-1, d)[dofs[own]][:, None, :]
        vector = compat.create_la_vector(*compat.unknowns_of(self._X))
        vector.array[:] = 0.0
        np.add.at(vector.array.reshape(-1, d), of_nodes[cells], parts)
        compat.scatter_reverse_add(vector)
        compat.scatter_forward(vector)
        return np.array(vector.array)

    def result(self, found: Array) -> Any:
        return function_of(self._X.function_space, found)


def refuse(contact: Any) -> None:
    """Raise for a contact whose derivative by undeformed positions is not known."""
    if any(side.arcs is not None for zone in contact.zones for side in zone.sides):
        raise ContactError("coordinates: smooth=True curves facets by positions")
    if contact.multiplier is None:
        return
    if any(len(zone.cpp.held_facets()) for zone in contact.zones):
        raise ContactError(
            "coordinates: a multiplier is smoothed on slave facets whose displacement is "
            "prescribed, by undeformed areas: free them, or take Penalty"
        )
    if any(_rim_counts(contact, zone) for zone in contact.zones):
        raise ContactError(
            "coordinates: a slave facet is partly uncovered, where a multiplier depends "
            "on undeformed areas: take a slave that lies on its master, or Penalty"
        )
    for zone in contact.zones:
        surface = zone.facets.slave_surface
        is_bent = surface.node_degree > 1 or surface.shape == "quadrilateral"
        if contact.method.is_dual and is_bent:
            raise ContactError(
                "coordinates: dual functions depend on where the undeformed area of a "
                "facet lies: take straight triangles, multiplier='vector' or Penalty"
            )


def _rim_counts(contact: Any, zone: Any) -> bool:
    """Whether rays of some points of a facet hit, and others do not, on this rank: with
    a law at nodes, of a facet with tractions."""
    points = zone.points()
    hit = points["status"] >= OPEN
    facets = np.intersect1d(points["slave"][hit], points["slave"][~hit])
    if contact.method.condition != "nodes":
        return bool(facets.size)
    values = np.abs(contact.multiplier.x.array)
    nodes = values.reshape(-1, contact.multiplier.function_space.dofmap.bs)
    there = nodes[zone.multiplier_table[facets]].max(initial=0.0)
    return bool(there > NEAR * values.max(initial=0.0))


def coordinates(mesh: Any) -> Control:
    """Undeformed positions of the nodes of a mesh, for derivatives by shape.

    Its derivative is a Function in the vector space of the geometry's degree: by the
    position of each node. Coefficients of the forms keep their dofs, and `gamma` keeps
    its value.
    """
    of_type("mesh", mesh, meshes.Mesh, "a Mesh")
    return OfMesh(mesh)

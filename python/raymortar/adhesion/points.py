"""Bonded points: which they are, and how far they are open."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from petsc4py import PETSc

import numpy as np
from dolfinx.fem import Function
from scipy.sparse import csr_matrix

from ..core import compat
from ..core.compat import Array, Indices, Mask
from ..core.discretization.facets import (
    dot,
    interpolate,
    normals,
    shape_functions,
    units,
)
from ..core.discretization.surfaces import facet_lengths
from ..core.errors import ContactError, SetUpError, together
from ..core.interface.zone_data import ZoneData
from ..core.options.methods import Penalty
from ..fluxes.flux_sides import TiedField
from ..ties.tie import Tie

# Largest gap of bonded points over the size of a slave facet
WITHIN = 0.05


class Opening(NamedTuple):
    """Jumps at points, and how they vary with y: the jump, then tangents of the slave."""

    normal: Array  # (n, d)
    jump: Array  # (n, d). Length
    along: Array  # of the jump along the normal, (n,). Length
    across: Array  # of the jump across it, (n, d). Length
    slopes: Array  # of `along`, (n, d, d): vectors of y, components
    bends: Array  # its second derivatives, (n, d, d, d, d)


def opening_of(y: Array) -> Opening:
    """Split jumps by normals that turn with the slave [theory (4.45), (4.49)].

    Parameters
    ----------
    y
        Jumps and tangents of the slave, (n, d, d).
    """
    jump, tangents = y[:, 0], y[:, 1:]
    n = units(normals(np.moveaxis(tangents, 1, 0)))
    metric = np.linalg.inv(tangents @ np.swapaxes(tangents, 1, 2))
    dual = metric @ tangents
    along, c = dot(n, jump), np.einsum("nkd,nd->nk", dual, jump)
    slopes = np.concatenate([n[:, None], -c[:, :, None] * n[:, None]], axis=1)
    bends = np.zeros((*y.shape, *y.shape[1:]))
    bends[:, 0, :, 1:] = -np.einsum("nki,nj->nikj", dual, n)
    bends[:, 1:, :, 0] = -np.einsum("nki,nj->nkji", dual, n)
    first = np.einsum("nl,ni,nkj->nkilj", c, n, dual)
    both = np.einsum("nkl,n,ni,nj->nkilj", metric, along, n, n)
    bends[:, 1:, :, 1:] = first + np.einsum("nkilj->nljki", first) - both
    return Opening(n, jump, along, jump - along[:, None] * n, slopes, bends)


class Side(NamedTuple):
    """Bonded points of one slave surface, (n,)."""

    zone: ZoneData  # of the tie that has paired them
    own: ZoneData  # of the contact
    number: Indices  # among the points of the tie
    facet: Indices  # slave facets
    xi: Array  # places on these
    weight: Array  # undeformed area
    gap: Array  # of the undeformed surfaces. Length
    start: Array  # jumps and tangents of the undeformed bodies, (n, d, d)


class BondedPoints:
    """Points of a contact that lie on their masters undeformed, and are bonded.

    Attributes
    ----------
    sides
        Those of each slave surface.
    weight, gap, start
        See `Side`, of all of these.
    """

    def __init__(
        self,
        law: Any,
        contact: Any,
        u: Any,
        facet_tags: Any,
        pairs: Any,
        names: Any,
    ) -> None:
        self._law, self._comm = law, contact.layout.comm
        with together(self._comm):
            _check(contact)
        # A tie of displacements, which stay zero, finds the pairs
        fields = contact.unknowns.displacements
        still = [_at_rest(one.u, one.given.name) for one in fields]
        options = contact.surfaces.options
        tie = Tie(
            still if isinstance(u, (list, tuple)) else still[0],
            facet_tags,
            pairs,
            Penalty(1.0),
            quadrature_degree=options.quadrature_degree,
            search=options.search,
            names=names,
            partial=True,
            axisymmetric=options.axisymmetric,
        )
        self._u = tie.surfaces.u
        with together(self._comm):
            self.sides = [self._side(*both) for both in zip(tie.zones, contact.zones)]
        self.weight = np.concatenate([side.weight for side in self.sides])
        self.gap = np.concatenate([side.gap for side in self.sides])
        self.start = np.concatenate([side.start for side in self.sides])

    def _side(self, zone: ZoneData, own: ZoneData) -> Side:
        """Choose the points of a slave surface that are bonded."""
        points, surface = zone.cpp.points(), zone.facets.slave_surface
        facet, xi, gap = points["slave"], points["xi"], points["distance"]
        shape, degree = surface.shape, surface.node_degree
        nodes = surface.X[surface.facet_nodes[facet]]
        within: Any = self._law.within
        if within is None:
            within = WITHIN * facet_lengths(surface)[facet]
        chosen = (points["status"] > 0) & (np.abs(gap) <= within)
        chosen &= self._is_wanted(interpolate(shape, degree, nodes, xi))
        at = np.flatnonzero(chosen).astype(np.int32)
        _, dN = shape_functions(shape, degree, xi[at])
        tangents = np.einsum("ina,nad->nid", dN, nodes[at])
        n = units(normals(np.moveaxis(tangents, 1, 0)))
        start = np.concatenate([(gap[at, None] * n)[:, None], tangents], axis=1)
        area = points["area"][at]
        return Side(zone, own, at, facet[at], xi[at], area, gap[at], start)

    def _is_wanted(self, X: Array) -> Mask | bool:
        """Ask the user which points at undeformed positions (n, d) are bonded."""
        if self._law.where is None:
            return True
        padded = np.zeros((3, len(X)))
        padded[: X.shape[1]] = X.T
        marks = np.asarray(self._law.where(padded))
        if marks.shape != (len(X),) or marks.dtype != bool:
            raise ContactError(
                "Cohesive.where must return True or False for each point, an array of "
                f"shape ({len(X)},), not of {marks.dtype} and shape {marks.shape}"
            )
        return marks

    def slices(self) -> list[slice]:
        """Places of the points of each side among all of them."""
        ends = np.cumsum([0, *(len(side.weight) for side in self.sides)])
        return [slice(*ends) for ends in zip(ends, ends[1:])]

    def matrix(self, system: Any) -> PETSc.Mat:
        """Matrix from the unknowns of a problem to changes of jumps and tangents.
        Collective."""
        layout, unknowns = system.layout, system.unknowns
        found, first, d = [], 0, self.start.shape[-1]
        for side in self.sides:
            field = TiedField(side.zone, self._u, unknowns.displacements, 0.0)
            field.set_rows(layout.rows, unknowns.starts)
            at = field.fixed_points(side.number, "area")
            shape = side.zone.facets.slave_surface.shape
            _, dN = shape_functions(shape, field.slave.degree, side.xi)
            of_master = np.zeros((*dN.shape[:2], at.N[1].shape[1]))
            of_tangents = np.concatenate([dN, of_master], axis=2)
            # Vectors of y by nodes of slave and master, (n, d, nodes)
            by = np.concatenate([-at.jump[None], of_tangents]).transpose(1, 0, 2)
            n, _, nodes = by.shape
            columns = field.rows_at(at).reshape(n, 1, nodes, d)
            rows = first + np.arange(n * d * d).reshape(n, d, 1, d)
            found.append(np.broadcast_arrays(rows, columns, by[..., None]))
            first += n * d * d
        rows, columns, values = (
            np.concatenate([one[k].ravel() for one in found]) for k in range(3)
        )
        C = csr_matrix((values, (rows, columns)), (first, int(layout.ranges[-1])))
        kind, sizes = PETSc.IntType, ((first, None), (layout.size, None))
        csr = C.indptr.astype(kind), C.indices.astype(kind), C.data
        matrix = PETSc.Mat().createAIJ(sizes, csr=csr, comm=self._comm)
        matrix.assemble()
        return matrix


def _at_rest(u: Function, name: str) -> Function:
    """A zero displacement like another one."""
    V = u.function_space
    return Function(
        compat.vector_space(V.mesh, compat.element_info(V).degree), name=name
    )


def _check(contact: Any) -> None:
    """Raise for contacts that cannot adhere."""
    for zone in contact.zones:
        if zone.facets.bodies:
            raise SetUpError(
                f"{zone.facets.spoken} meets the rigid {zone.facets.bodies[0].name}, to "
                "which nothing adheres: adhesion needs masters with facets"
            )
        if zone.facets.meets_itself:
            raise SetUpError(
                "a surface does not adhere to itself: adhesion needs pairs of a slave and "
                "another master"
            )

"""Compliance of the bodies' surfaces: how far single nodes yield to a pressure on them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from ..core.compat import Array, Indices, Mask
from ..core.discretization.ranks import destroy, of_all
from ..core.discretization.surfaces import Bodies, Surface, vector_areas
from ..core.discretization.unknowns import Unknowns
from ..core.errors import ContactError, raise_everywhere
from ..core.gamma.probing import VolumePattern, positions

# Nodes of each side of a body whose compliance is found. Single ones differ by the place
# of the supports, and a factor of 2 in the mean is one of 1.4 in gamma
NODES = 8
# Consecutive multiples of it, but for whole numbers, are spread evenly
GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
# Share of the diagonal that is added where bodies are loose. No force acts on their
# rigid motions but by rounding, and these are taken off again
SHIFT = 1e-8
# Motions that move prescribed dofs by less, as a share of all dofs, are free
FREE = 1e-9
# Unknowns of the displacement in 3D above which factors cost too much; 2D has no limit
MOST_FACTORISED = 60_000
# The iterative solver, for more unknowns
TOLERANCE, ITERATIONS = 1e-2, 200


class SurfaceCompliance:
    """Normal displacements of surface nodes under unit pressure on their areas.

    Bodies yield as their conditions hold them. Where conditions leave a body rigid
    motions, its load is balanced by forces throughout the body that stop these: forces
    in proportion to the diagonal of the stiffness. Collective.
    """

    def __init__(
        self,
        volume: VolumePattern,
        unknowns: Unknowns,
        bodies: Bodies,
        bcs: Sequence[Any],
        axisymmetric: bool,
    ) -> None:
        self._volume, self._unknowns, self._bodies = volume, unknowns, bodies
        self._bcs, self._axisymmetric = bcs, axisymmetric
        self._comm, self._V = unknowns.comm, unknowns.u.function_space
        dofmap = self._V.dofmap
        self._owned, self._d = dofmap.index_map.size_local, dofmap.index_map_bs
        self._body = bodies.dofs[: self._owned]
        self._solvers: list[tuple[_Factors, Any]] = []

    def destroy(self) -> None:
        """Free PETSc's objects. Collective."""
        for solver, _ in self._solvers:
            solver.destroy()
        self._solvers.clear()

    def _prepare(self) -> None:
        """Factorise the matrices. Collective."""
        n = self._owned * self._d
        self._free = self._unknowns.prescribed_u(self._bcs)[0][:n] == 0
        self._x = positions(self._unknowns.u)[-1]
        diagonal = np.where(self._free, np.abs(self._volume.diagonal), 0.0)
        self._weight = diagonal.reshape(-1, self._d)
        finite = bool(np.isfinite(self._x).all() and np.isfinite(diagonal).all())
        message = None if finite else "the stiffness of the bodies is not finite"
        raise_everywhere(self._comm, message, ContactError)
        self._find_motions()
        shift = np.repeat(self._loose[self._body], self._d) * SHIFT * diagonal
        factorise = self._d == 2 or self._comm.allreduce(n) <= MOST_FACTORISED
        self._solvers = [
            (_Factors(K, rows, self._free[at], shift[at], factorise), at)
            for K, rows, at in self._volume.stiffness
        ]

    def _find_motions(self) -> None:
        """Find the rigid motions that conditions leave to each body."""
        x, d, count = self._x, self._d, self._bodies.count
        size = self._comm.allreduce(np.abs(x).max(initial=0.0), op=MPI.MAX) or 1.0
        modes = [np.tile(axis, (len(x), 1)) for axis in np.eye(d)]
        for i, j in itertools.combinations(range(d), 2):
            turn = np.zeros((d, d))
            turn[i, j], turn[j, i] = 1.0, -1.0
            modes.append(x @ turn / size)
        modes = modes[1:2] if self._axisymmetric else modes
        R, fixed = np.stack(modes, axis=2), ~self._free.reshape(-1, d)
        held, every = self._grams(R, fixed), self._grams(R, np.ones(fixed.shape))
        turns = np.empty((count, R.shape[2], R.shape[2]))
        for body in range(count):
            values, vectors = np.linalg.eigh(held[body])
            free = values <= FREE * max(np.trace(every[body]), 1e-300)
            turns[body] = vectors * free
        self._loose = turns.any(axis=(1, 2))
        self._R = np.einsum("nik,nkl->nil", R, turns[self._body])
        self._R[fixed] = 0.0
        self._inverse = np.linalg.pinv(
            self._grams(self._R, self._weight), rcond=FREE, hermitian=True
        )

    def _grams(self, R: Array, weight: Any) -> Array:
        """Products of the motions of each body, (bodies, motions, motions)."""
        products = np.einsum("nik,ni,nil->nkl", R, weight, R)
        found = np.zeros((self._bodies.count, *products.shape[1:]))
        np.add.at(found, self._body, products)
        self._comm.Allreduce(MPI.IN_PLACE, found)
        return found

    def of_side(self, surfaces: Sequence[Surface]) -> Array:
        """Mean over some nodes of each body, 0 where none can move. Length per
        pressure. Collective."""
        if not self._solvers:
            self._prepare()
        rank, nodes, body, areas = self._chosen(surfaces)
        count = self._bodies.count
        total, number = np.zeros(count), np.bincount(body, minlength=count)
        # One place in each body's list: bodies do not feel each other's loads
        place = np.arange(len(body)) - np.searchsorted(body, body)
        for k in range(int(number.max(initial=0))):
            at = np.flatnonzero((place == k) & (rank == self._comm.rank))
            total += self._yields(nodes[at], body[at], areas[at])
        self._comm.Allreduce(MPI.IN_PLACE, total)
        return total / np.maximum(number, 1)

    def _chosen(
        self, surfaces: Sequence[Surface]
    ) -> tuple[Indices, Indices, Indices, Array]:
        """Choose nodes, the same on any number of ranks: their rank, place there, body
        and vector area, sorted by body. Collective."""
        index_map, owned = self._V.dofmap.index_map, self._owned
        area = np.zeros((owned, self._d))
        # A facet may be on several surfaces: count it once
        ids = np.concatenate([surface.facet_ids for surface in surfaces])
        counts = np.zeros(len(ids))
        counts[np.unique(ids, return_index=True)[1]] = 1.0
        ends = np.cumsum([len(surface.facet_ids) for surface in surfaces])
        for surface, once in zip(surfaces, np.split(counts, ends[:-1])):
            table, p = surface.dofs[surface.facet_dofs], surface.displacement_degree
            area += vector_areas(surface, index_map, p, table, once)[:owned]
        movable = np.where(self._free.reshape(-1, self._d), area, 0.0)
        size, moved = (np.linalg.norm(a, axis=1) for a in (area, movable))
        total = np.zeros((self._bodies.count, 2))
        np.add.at(total, self._body, np.column_stack([size, size > 0.0]))
        self._comm.Allreduce(MPI.IN_PLACE, total)
        # Some nodes of quadratic facets have no area or little of it
        large = size > 0.5 * (total[:, 0] / np.maximum(total[:, 1], 1.0))[self._body]
        mine = np.flatnonzero((moved > 0.5 * size) & large)
        rank = np.full(len(mine), self._comm.rank)
        of_body, x = self._body[mine], self._x[mine]
        rank, node, of_body, x, area = of_all(
            self._comm, rank, mine, of_body, x, area[mine]
        )
        step = 1e-9 * np.abs(x).max(initial=0.0) or 1.0
        order = np.lexsort([*np.round(x / step).T[::-1], of_body])
        begin = np.searchsorted(of_body[order], np.arange(self._bodies.count + 1))
        spread = np.modf(0.5 + GOLDEN * np.arange(NODES))[0]
        picked = [
            np.arange(a, b) if b - a <= NODES else a + ((b - a) * spread).astype(int)
            for a, b in itertools.pairwise(begin)
        ]
        chosen = order[np.concatenate(picked).astype(int)]
        return rank[chosen], node[chosen], of_body[chosen], area[chosen]

    def _yields(self, nodes: Indices, body: Indices, areas: Array) -> Array:
        """Displacements of loaded nodes, one on each body, (bodies,); of this rank's
        nodes. Collective."""
        load = np.zeros((self._owned, self._d))
        load[nodes] = areas
        load[~self._free.reshape(load.shape)] = 0.0
        load -= self._weight * self._rigid(load)
        flat, moved = load.ravel(), np.zeros(load.size)
        for solver, at in self._solvers:
            moved[at] = solver.solve(flat[at])
        moved = moved.reshape(load.shape)
        moved -= self._rigid(self._weight * moved)
        found = np.zeros(self._bodies.count)
        size = np.linalg.norm(areas, axis=1)
        found[body] = np.einsum("ni,ni->n", moved[nodes], areas) / size
        return found

    def _rigid(self, load: Array) -> Array:
        """Rigid motions of loose bodies under a load of all dofs, where the weights are
        their stiffness. Collective."""
        pushed = np.zeros(self._inverse.shape[:2])
        np.add.at(pushed, self._body, np.einsum("nik,ni->nk", self._R, load))
        self._comm.Allreduce(MPI.IN_PLACE, pushed)
        share = np.einsum("bkl,bl->bk", self._inverse, pushed)[self._body]
        return np.einsum("nik,nk->ni", self._R, share)


class _Factors:
    """Solves with the stiffness of one mesh, with its conditions. Collective.

    Its rows are those of the displacement, free where a mask says so. The shift is added
    to the diagonal.
    """

    def __init__(
        self, K: PETSc.Mat, rows: Any, free: Mask, shift: Array, factorise: bool
    ) -> None:
        comm = K.comm
        begin = K.getOwnershipRange()[0]
        if isinstance(rows, slice):
            self._A = K.copy()
        else:
            chosen = PETSc.IS().createGeneral((begin + rows).astype(np.int32), comm)
            self._A = K.createSubMatrix(chosen, chosen)
            chosen.destroy()
        self._A.setOption(PETSc.Mat.Option.NEW_NONZERO_LOCATION_ERR, False)
        begin = self._A.getOwnershipRange()[0]
        held = (begin + np.flatnonzero(~free)).astype(np.int32)
        self._A.zeroRowsColumns(held, 1.0)
        diagonal = self._A.getDiagonal()
        values = diagonal.array_r
        diagonal.array[:] = np.where(values == 0.0, 1.0, values + shift)
        self._A.setDiagonal(diagonal)
        diagonal.destroy()
        self._ksp = PETSc.KSP().create(comm)
        self._ksp.setOperators(self._A)
        preconditioner = self._ksp.getPC()
        if factorise:
            self._ksp.setType("preonly")
            preconditioner.setType("lu")
            preconditioner.setFactorSolverType("mumps")
        else:
            self._ksp.setType("gmres")
            self._ksp.setTolerances(rtol=TOLERANCE, max_it=ITERATIONS)
            preconditioner.setType("gamg")
        self._x, self._b = self._A.createVecs()

    def solve(self, load: Array) -> Array:
        """Displacement under a load of this rank's rows. Collective."""
        self._b.array[:] = load
        self._ksp.solve(self._b, self._x)
        return self._x.array_r.copy()

    def destroy(self) -> None:
        """Free PETSc's objects. Collective."""
        destroy(self._ksp, self._x, self._b, self._A)

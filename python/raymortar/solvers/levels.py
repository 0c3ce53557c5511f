"""Multigrid on the levels of the bodies without contact."""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

import numpy as np
from dolfinx.fem.petsc import assemble_matrix
from scipy import sparse

from ..core import compat
from ..core.compat import Array, Mask
from ..core.discretization.joined import Places, unrolled
from ..core.discretization.ranks import destroy, marked_everywhere
from ..core.problem import CoupledProblem
from ..core.solvers.petsc_objects import PetscOptions
from ..diagnose.rigid_motions import rigid_motions as motions_at

# Degree of the polynomial that takes, on several ranks, as many iterations as SOR
CHEBYSHEV_STEPS = 3

# Share of a motion that is rounding error once the other motions are taken off
NOTHING = 1e-8

# Size of a block that is rounding error, over the largest one in its rows
ROUNDING = 1e-12

# Difference of two products that is rounding error, over their size
SAME = 1e-10

_ANY = PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN


class BodiesLevels:
    """Interpolations between levels, finest first, and products with them. Collective.

    Aggregates of a tangent with contact would reach across the interface, and an
    aggregate cannot slide on itself. So aggregates are made from the volume's tangent
    alone, in degree 1, and serve any contact. Between a higher degree and degree 1
    there is interpolation. PETSc's GAMG makes the aggregates, with options under the
    prefix. `fixed` are the dofs of this rank that were prescribed. A is the tangent with
    contact, if there is one already, and `row_scale` has the factors of its rows.

    GAMG makes products with the volume's tangent on its way. They serve the first
    products with a tangent that has contact, which adds to the rows of its surfaces.
    """

    def __init__(
        self,
        problem: CoupledProblem,
        prefix: str,
        A: PETSc.Mat | None = None,
        row_scale: PETSc.Vec | None = None,
    ) -> None:
        V, self.fixed = problem.contact.u.function_space, problem.constrained
        is_high = compat.element_info(V).degree > 1
        # A tangent with constraints has other rows than contact
        if A is not None and problem.constraints is None:
            K = without_contact(problem, A, row_scale)
            K = K if is_high else _without_room(K)
        else:
            problem.evaluate()
            K = assemble_matrix(problem.a, bcs=problem.bcs)
            K.assemble()
        self._step: LinearInterpolation | None = None
        fixed, self.interpolations = self.fixed, []
        self._rows = _surface_rows(problem.contact)
        # The volume's tangent in these rows and on coarser levels, until its first use
        self._volume = [_block(K, self._rows)]
        if is_high:
            self._step = LinearInterpolation(V, fixed)
            self.interpolations.append(self._step.matrix)
            finest, K = K, _without_room(self._step.product(K))
            finest.destroy()
            self._volume.append(K)
            V, fixed = self._step.W, self._step.fixed
        near = nullspace_of(V, fixed)
        K.setNearNullSpace(near)
        ksp = PETSc.KSP().create(K.comm)
        ksp.setOptionsPrefix(prefix)
        ksp.setOperators(K)
        pc = ksp.getPC()
        pc.setType("gamg")
        name = "pc_gamg_aggressive_coarsening"
        # Above degree 1, levels of that degree are small already: finer ones pay
        with PetscOptions(prefix, {name: int(self._step is None)}), _products(K.comm):
            ksp.setFromOptions()
            ksp.setUp()
        levels = range(pc.getMGLevels() - 1, 0, -1)
        self.interpolations += [pc.getMGInterpolation(k) for k in levels]
        self._volume += [pc.getMGSmoother(k - 1).getOperators()[0] for k in levels]
        destroy(ksp, near)
        if self._step is None:
            K.destroy()

    def operators(self, S: PETSc.Mat) -> list[PETSc.Mat]:
        """Find S and its products with the interpolations, finest first. Collective."""
        # Each product is made regular before the next one is made of it: that would be
        # singular
        found, step = [S], self._step
        given = self._of_volume(S)
        for k, P in enumerate(self.interpolations):
            T = given[k] if k < len(given) else found[k].PtAP(P)
            found.append(_regular(T, step.fixed if k == 0 and step else None))
        return found

    def _of_volume(self, S: PETSc.Mat) -> list[PETSc.Mat]:
        """Make those of the volume the first products of S by what S adds to them, as
        long as the bodies are as they were; none after the first call. Collective."""
        if not self._volume:
            return []
        (own, *coarse), self._volume, found = self._volume, [], [S]
        change = _block(S, self._rows)
        change.axpy(-1.0, own, _ANY)
        own.destroy()
        for T, P in zip(coarse, self.interpolations):
            fine = change
            part = P if len(found) > 1 else _block(P, self._rows, columns=True)
            change = fine.PtAP(part)
            destroy(fine, *([part] if part is not P else []))
            T.axpy(1.0, change, _ANY)
            if not _is_product(T, found[-1], P):
                break
            found.append(T)
        destroy(change, *coarse[len(found) - 1 :])
        return found[1:]

    def destroy(self) -> None:
        """Free the matrices. Collective."""
        destroy(*self.interpolations, *self._volume)


def _products(comm: Any) -> PetscOptions:
    """An option by which PETSc makes P^T (K P) in place of P^T K P at once, in three
    quarters of the time. On several ranks it does so by itself."""
    return PetscOptions("", {"matptap_via": "rap"} if comm.size == 1 else {})


def _surface_rows(contact: Any) -> Places:
    """Owned rows of the displacement on the surfaces of contact. Collective."""
    V = contact.u.function_space
    marked = marked_everywhere(V, np.concatenate([one.dofs for one in sides(contact)]))
    nodes = np.flatnonzero(marked[: V.dofmap.index_map.size_local])
    return unrolled(nodes, V.dofmap.index_map_bs)


def _block(A: PETSc.Mat, rows: Places, columns: bool = False) -> PETSc.Mat:
    """Owned rows of a matrix, and the columns of the same numbers or all. Collective."""
    at = (rows + A.getOwnershipRange()[0]).astype(PETSc.IntType)
    of = PETSc.IS().createGeneral(at, comm=A.comm)
    of.setBlockSize(A.getBlockSizes()[0])
    if not columns:
        return A.createSubMatrix(of, of)
    begin, end = A.getOwnershipRangeColumn()
    every = PETSc.IS().createStride(end - begin, begin, 1, A.comm)
    every.setBlockSize(A.getBlockSizes()[1])
    return A.createSubMatrix(of, every)


def without_contact(
    problem: CoupledProblem, A: PETSc.Mat, row_scale: PETSc.Vec | None
) -> PETSc.Mat:
    """The displacement's part of a tangent less contact's own, with room for contact: in
    a third of the time of another assembly. Collective."""
    own, layout = A.duplicate(), problem.contact.layout
    own.zeroEntries()
    problem.contact.system.add_tangent(own, problem.bcs)
    own.assemble()
    if row_scale is not None:
        own.diagonalScale(L=row_scale)
    own.aypx(-1.0, A, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
    u = PETSc.IS().createStride(layout.n, layout.begin, 1, A.comm)
    u.setBlockSize(problem.contact.u.function_space.dofmap.index_map_bs)
    K = own.createSubMatrix(u, u)
    own.destroy()
    return K


def _without_room(K: PETSc.Mat) -> PETSc.Mat:
    """A matrix, which is destroyed, less its nodes' blocks that are rounding error: room
    for contact, of which the products of coarser levels would be full. Collective."""
    bs, (rows, columns) = K.getBlockSize(), K.getSizes()
    begin, at, values = K.getValuesCSR()
    A = sparse.csr_matrix((values, at, begin), (rows[0], columns[1])).tobsr((bs, bs))
    size, of_row = np.einsum("kij,kij->k", A.data, A.data), np.diff(A.indptr)
    most = np.repeat(np.maximum.reduceat(size, A.indptr[:-1]), of_row)
    kept = size > ROUNDING**2 * most
    ends = np.concatenate([[0], np.cumsum(kept)])[A.indptr]
    A = sparse.bsr_matrix((A.data[kept], A.indices[kept], ends), A.shape).tocsr()
    csr = tuple(a.astype(PETSc.IntType) for a in (A.indptr, A.indices))
    # On one rank it takes over the arrays, in a tenth of the time of a copy
    found = PETSc.Mat().createAIJWithArrays(K.getSizes(), (*csr, A.data), comm=K.comm)
    found.setBlockSize(bs)
    K.destroy()
    return found


def _is_product(T: PETSc.Mat, S: PETSc.Mat, P: PETSc.Mat) -> bool:
    """Whether T is P^T S P but for rounding, by its product with a random vector: the
    bodies may have changed, or their rows may have other factors. Collective.

    Rows that P^T S P lacks do not count.
    """
    x, own = T.createVecs()
    fine, image = S.createVecs()
    x.array[:] = np.random.default_rng(T.comm.rank).random(x.local_size)
    T.mult(x, own)
    P.mult(x, fine)
    S.mult(fine, image)
    P.multTranspose(image, x)
    size = x.norm(PETSc.NormType.NORM_INFINITY)
    own.array[x.array_r == 0.0] = 0.0
    own.axpy(-1.0, x)
    off = own.norm(PETSc.NormType.NORM_INFINITY)
    destroy(x, own, fine, image)
    return bool(off <= SAME * size)


def _regular(T: PETSc.Mat, rows: Mask | None = None) -> PETSc.Mat:
    """A product with its largest diagonal entry in some rows; by default where it has
    none, as aggregates of few dofs cannot have all rigid motions. Collective."""
    diagonal = T.getDiagonal()
    size = diagonal.norm(PETSc.NormType.NORM_INFINITY)
    rows = diagonal.array_r == 0.0 if rows is None else rows
    diagonal.array[rows] = size
    if T.comm.tompi4py().allreduce(int(np.count_nonzero(rows))):
        T.setDiagonal(diagonal)
    diagonal.destroy()
    return T


def set_levels(
    ksp: PETSc.KSP, levels: BodiesLevels, S: PETSc.Mat, stiff: bool = False
) -> list[PETSc.Mat]:
    """Make the preconditioner of S multigrid on these levels, before its options are
    read; returns the operators of the coarser levels, to be freed after use. Collective.

    Springs are `stiff` where they are much stiffer than the surfaces that they join. On
    each coarser level they are stiffer still, relative to what one node of it has: one
    visit does not reduce the error there, but a W-cycle's two do (measured:
    docs/measured/linear_solvers.md).
    """
    operators, alone, pc = levels.operators(S), ksp.comm.size == 1, ksp.getPC()
    pc.setType("mg")
    pc.setMGLevels(len(operators))
    if stiff:
        pc.setMGCycleType(PETSc.PC.MGCycleType.W)
    for k, P in enumerate(levels.interpolations):
        level = len(operators) - 1 - k
        pc.setMGInterpolation(level, P)
        smoother = pc.getMGSmoother(level)
        smoother.setOperators(operators[k])
        # SOR on one rank. Across ranks PETSc's SOR is Jacobi's, and diverges on thin
        # parts; Chebyshev's polynomial of the nodes' blocks does not depend on the
        # ranks, and costs a tenth more (docs/measured/linear_solvers.md)
        smoother.setType("richardson" if alone else "chebyshev")
        smoother.setTolerances(max_it=1 if alone else CHEBYSHEV_STEPS)
        smoother.getPC().setType("sor" if alone else "pbjacobi")
    pc.getMGCoarseSolve().setOperators(operators[-1])
    return operators[1:]


class LinearInterpolation:
    """Values of continuous functions of degree 1 at the nodes of a higher degree.

    Collective. Nodes are those of Lagrange elements: a node of the higher degree takes
    the shape functions of degree 1 at its place in a cell that has it. Prescribed dofs
    take nothing, and prescribed dofs of vertices give nothing. So the product P^T S P
    is the tangent with the conditions, except for its diagonal.

    W is the space of degree 1, `matrix` P, from the owned dofs of W to those of V, and
    `fixed` tells whether an owned dof of W is prescribed.
    """

    def __init__(self, V: Any, fixed: Mask) -> None:
        self.W = W = compat.vector_space(V.mesh, 1)
        bs, n = V.dofmap.index_map_bs, V.dofmap.index_map.size_local
        fine, coarse, values = _weights_by_cell(V, W)
        on_fine, vertices = fixed.reshape(n, bs), values == 1.0
        on_coarse = marked_everywhere(W, coarse[vertices], on_fine[fine[vertices]])
        index_map = W.dofmap.index_map
        owned = index_map.size_local
        self.fixed = on_coarse[:owned].ravel()
        # Entries of prescribed dofs are kept as zeros: all rows of a node have the same
        # columns, as relaxation by nodes and the product's diagonal need
        entries = values[:, None] * (~on_fine[fine] & ~on_coarse[coarse])
        at = unrolled(fine, bs), unrolled(compat.local_to_global(index_map)[coarse], bs)
        P = sparse.csr_matrix(
            (entries.ravel(), at), (bs * n, bs * index_map.size_global)
        )
        csr = tuple(a.astype(PETSc.IntType) for a in (P.indptr, P.indices))
        sizes = (bs * n, None), (bs * owned, None)
        self.matrix = PETSc.Mat().createAIJ(
            sizes, bsize=bs, csr=(*csr, P.data), comm=V.mesh.comm
        )
        self.matrix.assemble()

    def product(self, S: PETSc.Mat) -> PETSc.Mat:
        """P^T S P over the owned dofs of W, regular at prescribed dofs. Collective."""
        return _regular(S.PtAP(self.matrix), self.fixed)


def _weights_by_cell(V: Any, W: Any) -> tuple[Any, Any, Array]:
    """Owned block dofs of V in order, local block dofs of W, and shape functions.

    Each dof of V takes one of its cells; shape functions that vanish are left out."""
    points = compat.element_points(V)
    N = compat.tabulate(compat.cell_name(V.mesh), 1, points)[0]
    N[np.isclose(N, 0.0)], N[np.isclose(N, 1.0)] = 0.0, 1.0
    table, coarse = compat.dofmap_array(V), compat.dofmap_array(W)
    dofs, first = np.unique(table, return_index=True)
    owned = dofs < V.dofmap.index_map.size_local
    cells, nodes = np.divmod(first[owned], table.shape[1])
    row, b = np.nonzero(N[nodes])
    return dofs[owned][row], coarse[cells[row], b], N[nodes[row], b]


def sides(contact: Any) -> list[Any]:
    """List the slave and master surfaces of all zones."""
    return [side for zone in contact.zones for side in zone.sides]


def rigid_motions(V: Any) -> list[Array]:
    """Translations and rotations at the owned dofs of a vector space, unrolled.

    Rotations are about the mean of all ranks' dofs. Collective.
    """
    dim, index_map = V.mesh.geometry.dim, V.dofmap.index_map
    x = V.tabulate_dof_coordinates()[: index_map.size_local, :dim]
    x = x - V.mesh.comm.allreduce(x.sum(axis=0)) / index_map.size_global
    return list(motions_at(x))


def near_nullspace(contact: Any) -> PETSc.NullSpace:
    """Rigid motions as vectors over the owned displacement dofs. Collective."""
    return nullspace_of(contact.u.function_space)


def nullspace_of(V: Any, fixed: Mask | None = None) -> PETSc.NullSpace:
    """Rigid motions of a vector space, orthonormal, with 0 at fixed dofs. Collective.

    A motion that depends on the others without these dofs is left out.
    """
    comm = V.mesh.comm
    vectors: list[PETSc.Vec] = []
    for motion in rigid_motions(V):
        vector = PETSc.Vec().createMPI((len(motion), None), comm=comm)
        vector.array[:] = motion if fixed is None else np.where(fixed, 0.0, motion)
        size = vector.norm()
        for other in vectors:
            vector.axpy(-other.dot(vector), other)
        if vector.norm() > NOTHING * size:
            vector.normalize()
            vectors.append(vector)
    return PETSc.NullSpace().create(vectors=vectors, comm=comm)

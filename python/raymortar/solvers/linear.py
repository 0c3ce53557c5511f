"""Iterative linear solvers: PETSc options for each method, and what they need to know.

The tangent is [[K, B], [C, D]] over [u, multiplier / gamma]: unsymmetric, and D is zero
where contact is closed. Multigrid takes neither as it is. With a penalty there is K
alone, and rigid bodies' motions are what its coarse levels have to hold.
"""

from __future__ import annotations

from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from .. import compat
from ..compat import Array
from ..errors import ContactError
from ..host.reference_facets import shape_functions
from ..interface.stiffness import owned_nodes_on

# Stiffness of the springs that stand for closed contact, in those of the volume at its
# surface: softer ones leave more to GMRES, stiffer ones are hard on multigrid (measured:
# docs/parallel.md)
SPRINGS = 10.0

_KRYLOV = {"ksp_type": "gmres", "ksp_gmres_restart": 200, "ksp_rtol": 1e-8}

_GAMG = {
    "pc_type": "gamg",
    # All entries: those that vanish in slip leave nodes without a neighbour
    "pc_gamg_threshold": -1.0,
    # Nodes that are left alone have fewer unknowns than there are rigid motions, so
    # that diagonals of coarse levels vanish: PETSc's Jacobi takes it, its SOR does not
    "mg_levels_ksp_type": "chebyshev",
    "mg_levels_ksp_max_it": 3,
    "mg_levels_pc_type": "jacobi",
}

_MULTIGRID = {
    "gamg": _GAMG,
    # Aggregates of direct neighbours on the finest level too: twice the set-up, and
    # iterations that do not grow (measured: docs/parallel.md)
    "gamg-bounded": {
        **_GAMG,
        "pc_gamg_aggressive_coarsening": 0,
        # What PETSc did up to 3.18, which passes over this: without, iterations grow
        "pc_gamg_mis_k_minimum_degree_ordering": 1,
        "pc_mg_cycle_type": "w",
    },
    "hypre": {
        "pc_type": "hypre",
        "pc_hypre_type": "boomeramg",
        "pc_hypre_boomeramg_strong_threshold": 0.5,
        "pc_hypre_boomeramg_nodal_coarsen": 6,
        "pc_hypre_boomeramg_relax_type_all": "SOR/Jacobi",
    },
}

MULTIGRIDS = tuple(_MULTIGRID)


def iterative(multigrid: str = "gamg", **options: Any) -> dict[str, Any]:
    """PETSc options of an iterative linear solver, for `NewtonSolver` or `SNESSolver`.

    Parameters
    ----------
    multigrid
        ``"gamg"`` (PETSc's own, smoothed aggregation), ``"gamg-bounded"`` (the same
        with finer coarse levels, for iterations that refinement does not change) or
        ``"hypre"`` (BoomerAMG).
    options
        Further ones, or others, such as ``ksp_rtol=1e-6``.

    Returns
    -------
    GMRES with `ContactPreconditioner`, whose multigrid has the prefix
    ``displacement_``.
    """
    if multigrid not in MULTIGRIDS:
        raise ValueError(f"multigrid must be one of {MULTIGRIDS}, not {multigrid!r}")
    inner = {f"displacement_{k}": v for k, v in _MULTIGRID[multigrid].items()}
    outer = {
        "pc_type": "python",
        "pc_python_type": f"{__name__}.{ContactPreconditioner.__name__}",
    }
    return {**_KRYLOV, **outer, **inner, **options}


def rigid_motions(V: Any) -> list[Array]:
    """Translations and rotations at the owned dofs of a vector space, unrolled.

    Rotations are about the mean of all ranks' dofs. Collective.
    """
    dim, index_map = V.mesh.geometry.dim, V.dofmap.index_map
    n = index_map.size_local
    x = V.tabulate_dof_coordinates()[:n, :dim]
    x = x - V.mesh.comm.allreduce(x.sum(axis=0)) / index_map.size_global
    motions = [np.tile(e, (n, 1)) for e in np.eye(dim)]
    for i, j in ((0, 1), (1, 2), (2, 0))[: 1 if dim == 2 else 3]:
        turn = np.zeros((n, dim))
        turn[:, i], turn[:, j] = -x[:, j], x[:, i]
        motions.append(turn)
    return [motion.ravel() for motion in motions]


def near_nullspace(contact: Any) -> PETSc.NullSpace:
    """Rigid motions as vectors over the owned displacement dofs. Collective."""
    comm = contact.layout.comm
    vectors: list[PETSc.Vec] = []
    for motion in rigid_motions(contact.u.function_space):
        vector = PETSc.Vec().createMPI((len(motion), None), comm=comm)
        vector.array[:] = motion
        for other in vectors:
            vector.axpy(-other.dot(vector), other)
        vector.normalize()
        vectors.append(vector)
    return PETSc.NullSpace().create(vectors=vectors, comm=comm)


def attach(ksp: PETSc.KSP, contact: Any, row_scale: PETSc.Vec | None = None) -> None:
    """Tell a solver whose options have been read about the contact, and by what the
    rows of its matrices have been multiplied.

    Raises
    ------
    ContactError
        If the solver is iterative, and the user solves for more than a displacement or
        for a rigid body that is free.
    """
    if ksp.getPC().getType() == "python":
        context = ksp.getPC().getPythonContext()
        if isinstance(context, ContactPreconditioner):
            if not contact.host.is_plain:
                raise ContactError(
                    "the iterative solver is for a displacement alone: with further "
                    "unknowns leave the direct one, which is the default"
                )
            if contact.layout.bodies:
                names = ", ".join(body.name for body in contact.layout.bodies)
                raise ContactError(
                    f"the iterative solver takes no rigid body that is free ({names}): "
                    "leave the direct one, which is the default"
                )
            context.contact, context.row_scale = contact, row_scale


class ContactPreconditioner:
    """Eliminates the multipliers; multigrid for the displacement. A PETSc python PC.

    With penalties alone, S below is the tangent itself. With a multiplier D, which is
    zero where contact is closed, is replaced by the blocks of its nodes less M, a
    multiple of the lumped mass matrix of the slave surface. What is left for
    the displacement, S = K - B E^-1 C with these blocks E, is then the stiffness with
    closed contact held by springs: it couples the bodies, and has no zeros. Where the
    springs are about as stiff as the volume's surface (the modulus over the mesh size),
    S is no worse for multigrid than K, and the error of E costs a number of iterations
    that refinement does not change.

    Attributes
    ----------
    contact, row_scale
        Set by `attach` before the first use.
    solver
        KSP of S, with prefix ``displacement_`` after that of the outer one.
    """

    def __init__(self) -> None:
        self.contact: Any = None
        self.row_scale: PETSc.Vec | None = None
        self.solver: Any = None  # PETSc.KSP from `setUp` on
        self._near: PETSc.NullSpace | None = None
        # Those of each contact, from the first elimination on
        self._springs: list[float] | None = None
        # Index sets of both unknowns, and what the elimination needs
        self._u: Any = None
        self._lam: Any = None
        self._B: Any = None
        self._C: Any = None
        self._inverse: Any = None

    def setUp(self, pc: PETSc.PC) -> None:
        """Take the blocks of the tangent anew. Collective."""
        A, _ = pc.getOperators()
        # A new solver each time: GAMG cannot change the sizes of its levels
        self.reset(pc)
        S = self._eliminate(A) if self._with_multiplier else A
        if self._near is None:
            self._near = near_nullspace(self.contact)
        S.setNearNullSpace(self._near)
        self.solver = PETSc.KSP().create(pc.comm)
        self.solver.setType("preonly")
        self.solver.setOptionsPrefix(f"{pc.getOptionsPrefix() or ''}displacement_")
        self.solver.setOperators(S)
        self.solver.setFromOptions()
        self.solver.setUp()

    @property
    def _with_multiplier(self) -> list[Any]:
        """The contacts that have one, in the order of its rows."""
        contacts = self.contact.contacts
        return [contact for contact in contacts if contact.multiplier is not None]

    def _eliminate(self, A: PETSc.Mat) -> PETSc.Mat:
        """S, and keep the blocks that the elimination needs."""
        if self._springs is None:
            # The multiplier is divided by gamma, and so its equation is multiplied
            self._springs = [
                contact.gamma_scale**2 / (SPRINGS * surface_stiffness(contact))
                for contact in self._with_multiplier
            ]
            self._u, self._lam = _index_sets(self.contact.layout)
        K, self._B, self._C, D = (
            self._unscaled(A.createSubMatrix(rows, columns), rows)
            for rows in (self._u, self._lam)
            for columns in (self._u, self._lam)
        )
        self._inverse = self._inverse_blocks(D)
        EC = self._inverse.matMult(self._C)
        S = self._B.matMult(EC)
        S.aypx(-1.0, K, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        S = _with_blocks(S, K.getBlockSize())
        for matrix in (K, D, EC):
            matrix.destroy()
        return S

    def _unscaled(self, block: PETSc.Mat, rows: PETSc.IS) -> PETSc.Mat:
        """A block whose rows are as they were assembled: springs are of those."""
        if self.row_scale is not None:
            factors = self.row_scale.getSubVector(rows)
            inverse = factors.copy()
            inverse.reciprocal()
            block.diagonalScale(inverse)
            inverse.destroy()
            self.row_scale.restoreSubVector(rows, factors)
        return block

    def _inverse_blocks(self, D: PETSc.Mat) -> PETSc.Mat:
        """E^-1 from the nodes' blocks of D and the lumped masses."""
        assert self._springs is not None
        begin, first, parts = D.getOwnershipRange()[0], 0, []
        csr = D.getValuesCSR()
        for contact, springs in zip(self._with_multiplier, self._springs):
            c, mass = contact.layout.components, springs * lumped_mass(contact)
            blocks = _node_blocks(csr, first, len(mass), c, begin)
            blocks -= mass[:, None, None] * np.eye(c)
            parts.append((begin + first, np.linalg.inv(blocks)))
            first += c * len(mass)
        E = PETSc.Mat().createAIJ(
            ((first, None), (first, None)), csr=_block_diagonal(parts), comm=D.comm
        )
        E.assemble()
        return E

    def apply(self, pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """y = P^-1 x: eliminate, solve, substitute. Collective."""
        if not self._with_multiplier:
            self.solver.solve(x, y)
            return
        r, q = x.getSubVector(self._u), x.getSubVector(self._lam)
        right, rest = r.copy(), q.copy()
        x.restoreSubVector(self._u, r)
        x.restoreSubVector(self._lam, q)
        if self.row_scale is not None:
            for part, rows in ((right, self._u), (rest, self._lam)):
                factors = self.row_scale.getSubVector(rows)
                part.pointwiseDivide(part, factors)
                self.row_scale.restoreSubVector(rows, factors)
        u, lam = right.duplicate(), rest.duplicate()
        self._inverse.mult(rest, lam)
        self._B.mult(lam, u)
        right.axpy(-1.0, u)
        self.solver.solve(right, u)
        self._C.mult(u, lam)
        rest.axpy(-1.0, lam)
        self._inverse.mult(rest, lam)
        n = self.contact.layout.n
        y.array[:n] = u.array_r
        y.array[n:] = lam.array_r
        for vector in (right, rest, u, lam):
            vector.destroy()

    def reset(self, pc: PETSc.PC) -> None:
        """Forget the operators: the next ones may have another pattern. Collective."""
        self._destroy("solver", "_B", "_C", "_inverse")

    def destroy(self, pc: PETSc.PC) -> None:
        """The end, called by PETSc. Collective."""
        self.reset(pc)
        self._destroy("_near", "_u", "_lam")

    def _destroy(self, *names: str) -> None:
        """Free PETSc objects at once: what Python drops is kept for a while."""
        for name in names:
            thing = getattr(self, name)
            if thing is not None:
                thing.destroy()
            setattr(self, name, None)


def _index_sets(layout: Any) -> tuple[PETSc.IS, PETSc.IS]:
    """Owned rows of the displacement, and of all multipliers."""
    bs = layout.u.function_space.dofmap.index_map_bs
    sets = []
    ends = layout.begin, layout.begin + layout.n, layout.begin + layout.size
    for first, last, block in zip(ends, ends[1:], (bs, 1)):
        rows = np.arange(first, last, dtype=PETSc.IntType)
        one = PETSc.IS().createGeneral(rows, comm=layout.comm)
        one.setBlockSize(block)
        sets.append(one)
    return sets[0], sets[1]


def _node_blocks(csr: Any, first: int, nodes: int, c: int, begin: int) -> Array:
    """Blocks on the diagonal of some rows, (nodes, c, c).

    Parameters
    ----------
    csr
        Compressed rows of this rank.
    first
        Of the rows, among those of this rank.
    nodes, c
        They are those of so many nodes with so many components.
    begin
        Column of this rank's first row.
    """
    offsets, columns, values = csr
    here = slice(offsets[first], offsets[first + nodes * c])
    rows = np.repeat(
        np.arange(nodes * c), np.diff(offsets[first : first + nodes * c + 1])
    )
    columns, values = columns[here] - begin - first, values[here]
    own = columns // c == rows // c
    rows, columns = rows[own], columns[own]
    blocks = np.zeros((nodes, c, c))
    blocks[rows // c, rows % c, columns % c] = values[own]
    return blocks


def _block_diagonal(parts: list[tuple[int, Array]]) -> tuple[Array, Array, Array]:
    """Compressed rows of a matrix with blocks of several sizes.

    Parameters
    ----------
    parts
        First column of blocks that follow each other, and these, (n, c, c).
    """
    offsets, columns, values = [np.zeros(1, dtype=PETSc.IntType)], [], []
    for first, blocks in parts:
        n, c, _ = blocks.shape
        row = np.arange(n * c)
        ends = c * (1 + row) + offsets[-1][-1]
        offsets.append(ends.astype(PETSc.IntType))
        pattern = first + c * (row // c)[:, None] + np.arange(c)
        columns.append(pattern.ravel().astype(PETSc.IntType))
        values.append(blocks.ravel())
    return tuple(map(np.concatenate, (offsets, columns, values)))  # type: ignore[return-value]


def _with_blocks(S: PETSc.Mat, bs: int) -> PETSc.Mat:
    """S with a block size, which products of matrices have lost."""
    if S.getBlockSize() == bs:
        return S
    offsets, columns, values = S.getValuesCSR()
    n = len(offsets) - 1
    T = PETSc.Mat().create(S.comm)
    T.setSizes(((n, None), (n, None)), bsize=bs)
    T.setType(PETSc.Mat.Type.AIJ)
    T.setPreallocationCSR((offsets, columns, values))
    T.assemble()
    S.destroy()
    return T


def lumped_mass(contact: Any) -> Array:
    """int N_a dG at the owned unknowns of the multiplier, (nodes,). Collective."""
    W = contact.multiplier.function_space
    mass = compat.create_la_vector(W.dofmap.index_map, 1)
    degree = compat.element_info(W).degree
    for zone in contact.zones:
        points = zone.cpp.points()
        shape = zone.facets.slave_surface.shape
        N, _ = shape_functions(shape, degree, points["xi"])
        dofs = zone.multiplier_table[points["slave"]]
        np.add.at(mass.array, dofs, points["weight"][:, None] * N)
    compat.scatter_reverse_add(mass)
    return mass.array[contact.layout.owned_multipliers]


def surface_stiffness(contact: Any) -> float:
    """Diagonal of the volume's stiffness per area of the slave surface. Collective."""
    V, comm = contact.u.function_space, contact.layout.comm
    bs = V.dofmap.index_map_bs
    slave = owned_nodes_on(V, [zone.facets.slave_surface for zone in contact.zones])
    diagonal = contact.stiffness_diagonal.reshape(-1, bs)[slave].sum() / bs
    sums = np.array([diagonal, lumped_mass(contact).sum()])
    comm.Allreduce(MPI.IN_PLACE, sums)
    return float(sums[0] / sums[1])

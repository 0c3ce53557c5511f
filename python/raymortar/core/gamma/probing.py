"""Pattern of the volume's matrix, and its answers to translations and strains."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np
from dolfinx.fem import Function
from dolfinx.fem.petsc import assemble_matrix

from ..compat import Array, Indices
from ..discretization.layout import CoupledRows
from ..discretization.ranks import destroy, ends_of
from ..discretization.unknowns import Unknowns

# The bulk modulus counts up to that of Poisson's ratio 0.3, where Lame's constants have
# this ratio
LARGEST_RATIO = 1.5
# It is that or less, but for rounding
_ROUNDING = 1e-6

_numbers = itertools.count()


class VolumePattern:
    """Sparsity and diagonal of the volume's matrix, in the coupled numbering.

    Read off one assembly, which every version of DOLFINx offers. Collective.

    Attributes
    ----------
    offsets, columns
        Compressed rows of this rank, int32; columns in the coupled numbering.
    diagonal
        Diagonal entries of the owned displacement dofs, unrolled. Force per length.
    translation
        Forces of the body's translation by 1 along each axis, of the owned displacement
        dofs, (d, dofs): those of masses and springs. Force per length.
    response
        Response of the owned nodes to strains, see `strain_response` and
        `response_of_revolution`; None where nothing needs it.
    couplings
        Sums of the absolute entries of each owned row over the columns of each field,
        (fields, rows); see `Unknowns.fields`. Empty where there is one field.
    stiffness
        Until `destroy`: matrices, their rows of the displacement, and the places of
        these among its dofs.
    number
        Its number, which no other pattern has.
    terms
        The terms of its problem, which may need room in the matrix too.
    """

    terms: Sequence[Any] = ()

    def __init__(
        self,
        form: Any,
        layout: CoupledRows,
        axisymmetric: bool = False,
        strains: bool = True,
    ) -> None:
        self.form, self.number = form, next(_numbers)
        u, table = layout.u, form if isinstance(form, list) else [[form]]
        blocks = [[_assembled(one) for one in row] for row in table]
        self.offsets, self.columns = _pattern(blocks, layout)
        self.couplings = _couplings(blocks, layout.unknowns)
        own = _of_displacement(blocks, layout.unknowns)
        self.diagonal = _diagonal(own, u)
        self.translation = translation_forces(own, u)
        self.response: Array | None = None
        self.stiffness = _parts(own)
        self._matrices = [K for K in itertools.chain(*blocks) if K is not None]
        if strains:
            probe = response_of_revolution if axisymmetric else strain_response
            self.response = probe(own, u)

    def include(self, A: PETSc.Mat) -> None:
        """Add the pattern of a matrix over the coupled rows, whose entries are between
        unknowns of the forms. A matrix with room for less is preallocated anew at its
        next tangent."""
        n = len(self.offsets) - 1
        offsets, columns, _ = A.getValuesCSR()
        both = np.diff(self.offsets), np.diff(offsets)[:n]
        rows = np.concatenate([np.repeat(np.arange(n), count) for count in both])
        pairs = np.column_stack([rows, np.concatenate([self.columns, columns])])
        rows, self.columns = np.unique(pairs, axis=0).T.astype(np.int32)
        counts = np.bincount(rows, minlength=n)
        self.offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        self.number = next(_numbers)

    def destroy(self) -> None:
        """Free the matrices; what was read off them stays. Collective."""
        self.stiffness = []
        destroy(*self._matrices)
        self._matrices = []


def _assembled(form: Any) -> PETSc.Mat | None:
    """Assemble a compiled form; None is zero."""
    if form is None:
        return None
    K = assemble_matrix(form)
    K.assemble()
    return K


def _pattern(
    blocks: Sequence[Sequence[Any]], layout: CoupledRows
) -> tuple[Indices, Indices]:
    """Compress the rows of the owned unknowns: offsets, and coupled columns."""
    rows, columns = [], []
    for start, of_row in zip(layout.unknowns.owned_starts, blocks):
        for k, K in enumerate(of_row):
            if K is not None:
                offsets, found, _ = K.getValuesCSR()
                columns.append(layout.coupled_columns(found, k))
                own = np.arange(len(offsets) - 1)
                rows.append(start + np.repeat(own, np.diff(offsets)))
    row, column = np.concatenate(rows), np.concatenate(columns)
    if len(rows) > 1:
        order = np.argsort(row, kind="stable")
        row, column = row[order], column[order]
    counts = np.bincount(row, minlength=layout.n)
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int32), column


def _couplings(blocks: Sequence[Sequence[Any]], unknowns: Unknowns) -> Array:
    """Sum absolute entries of owned rows by the fields of their columns. Collective."""
    fields = unknowns.fields() if unknowns.is_known else []
    if len(fields) < 2:
        return np.empty((0, 0))
    own = [
        slice(*ends) for ends in zip(unknowns.owned_starts, unknowns.owned_starts[1:])
    ]
    marks, found = np.zeros((2, len(fields), unknowns.owned_starts[-1]))
    for mark, field in zip(marks, fields):
        mark[field.rows] = 1.0
    for rows, of_row in zip(own, blocks):
        for columns, K in zip(own, of_row):
            if K is not None:
                *pattern, values = K.getValuesCSR()
                size = PETSc.Mat().createAIJ(
                    K.getSizes(), csr=(*pattern, abs(values)), comm=K.comm
                )
                found[:, rows] += [product(size, one[columns]) for one in marks]
                size.destroy()
    return found


def _of_displacement(blocks: Sequence[Sequence[Any]], unknowns: Unknowns) -> Any:
    """The displacement's diagonal block, or blocks, as `_parts` takes them."""
    if unknowns.is_plain:
        return blocks[0][0]
    return [
        (
            blocks[d.at][d.at],
            d.dofs[: d.size_owned],
            unknowns.u_places(k)[: d.size_owned],
        )
        for k, d in enumerate(unknowns.displacements)
    ]


def _parts(K: Any) -> Any:
    """Matrices, their rows of the displacement, and the places of these among its dofs."""
    return K if isinstance(K, list) else [(K, slice(None), slice(None))]


def product(A: PETSc.Mat, values: Array, transposed: bool = False) -> Array:
    """Multiply a matrix, or its transpose, with owned values of a vector; what `values`
    does not reach is zero. Collective."""
    x, y = A.createVecs()
    if transposed:
        x, y = y, x
    x.array[: len(values)] = values
    (A.multTranspose if transposed else A.mult)(x, y)
    found: Array = y.array.copy()
    destroy(x, y)
    return found


def _forces(K: Any, field: Array) -> Array:
    """Forces of a displacement of the owned nodes, in its shape. Collective."""
    values, found = field.ravel(), np.empty(field.size)
    for matrix, rows, at in _parts(K):
        whole = np.zeros(matrix.getLocalSize()[1])
        whole[rows] = values[at]
        found[at] = product(matrix, whole)[rows]
    return found.reshape(field.shape)


def _diagonal(K: Any, u: Function) -> Array:
    """Diagonal entries of the displacement's owned dofs."""
    dofmap = u.function_space.dofmap
    found = np.empty(dofmap.index_map.size_local * dofmap.index_map_bs)
    for matrix, rows, at in _parts(K):
        diagonal = matrix.getDiagonal()
        found[at] = diagonal.array_r[rows]
        diagonal.destroy()
    return found


def translation_forces(K: Any, u: Function) -> Array:
    """Forces of translations by 1 along each axis, (d, owned dofs).

    A body that is only elastic has none. Collective.
    """
    V = u.function_space
    d, n = V.mesh.geometry.dim, V.dofmap.index_map.size_local
    return np.array([_forces(K, np.tile(axis, n)) for axis in np.eye(d)])


def deviators(d: int) -> list[Array]:
    """Orthonormal symmetric strains without change of volume, (d, d) each."""
    found = []
    for i in range(d):
        for j in range(i):
            shear = np.zeros((d, d))
            shear[i, j] = shear[j, i] = np.sqrt(0.5)
            found.append(shear)
    for i in range(1, d):
        stretch = np.diag([1.0] * i + [-float(i)] + [0.0] * (d - 1 - i))
        found.append(stretch / np.linalg.norm(stretch))
    return found


def positions(u: Function, from_axis: bool = False) -> list[Array]:
    """Positions of the owned nodes from the middle of the mesh, (n, d) each.

    They are the undeformed ones, and the deformed ones where anything is displaced.
    From the axis, r is not from the middle. Collective.
    """
    V = u.function_space
    d, owned = V.mesh.geometry.dim, V.dofmap.index_map.size_local
    X = V.tabulate_dof_coordinates()[:owned, :d]
    middle = ends_of(X, V.mesh.comm).mean(axis=0)
    middle[:1] *= not from_axis
    moved = u.x.array[: owned * d].reshape(-1, d)
    is_moved = V.mesh.comm.allreduce(bool(moved.any()), op=MPI.LOR)
    return [X - middle, X - middle + moved] if is_moved else [X - middle]


def _squares(forces: Array) -> Array:
    """Square of the force at each node."""
    return np.einsum("ni,ni->n", forces, forces)


def strain_response(K: Any, u: Function) -> Array:
    """Forces of uniform strains at each owned node, (n, 2, 1 or 2).

    In a uniform strain E the nodal force of a homogeneous isotropic body is sigma c,
    with the node's share c of the boundary's vector area and sigma = 2 mu E for a
    deviator, (d lambda + 2 mu) I for E = I [theory (5.8)]. Only the cells around a node
    take part. Where matrices resist translation also (masses, springs), the strain is
    taken around each node. K is the stiffness of all cells at u, without conditions.

    Squares of the forces, summed over the deviators, and that of E = I; of strains of the
    undeformed bodies, and of the deformed ones if there is a displacement: only one of
    these keeps the volume, by whether the form is of small or large strains. Collective.
    """
    places = positions(u)
    n, d = places[0].shape
    pushed = translation_forces(K, u).reshape(d, n, d)

    def squares(x: Array, E: Array) -> Array:
        field = x @ E
        return _squares(_forces(K, field) - np.einsum("ni,inj->nj", field, pushed))

    found = [
        (np.sum([squares(x, E) for E in deviators(d)], axis=0), squares(x, np.eye(d)))
        for x in places
    ]
    return np.transpose(found, (2, 1, 0))


def response_of_revolution(K: Any, u: Function) -> Array:
    """`strain_response` for solids of revolution about the axis r = 0. Collective.

    A field that grows with r strains hoops as well. Of the strains of a full turn those
    are taken that a linear field makes, as it has them exactly on any mesh: the uniform
    one, and the stretch along the axis without change of volume, u = (r, -2 z) / 2
    [theory (5.15)]. What of this would be that of the plane's strains is returned, so
    that the relations of `strain_response` hold. Springs and masses that resist a growth
    of the radius count as hoops.
    """
    pushed = translation_forces(K, u)[1].reshape(-1, 2)
    found = []
    for x in positions(u, from_axis=True):
        # 2 mu (c_r, -2 c_z) / 2 and (3 lambda + 2 mu) c
        stretched = _forces(K, x * [0.5, -1.0]) + x[:, 1:] * pushed
        swollen = _forces(K, x) - x[:, 1:] * pushed
        sheared = stretched * [2.0, -1.0]
        found.append((_squares(sheared), _squares((2.0 * swollen + sheared) / 3.0)))
    return np.transpose(found, (2, 1, 0))


def stiffness_without_bulk(sheared: Array, swollen: Array, d: int) -> Array:
    """Share of a diagonal stiffness that does not grow with the bulk modulus.

    The diagonal's sum over the directions is (lambda + (d + 1) mu) times what depends
    on the mesh only. lambda counts up to 1.5 mu [theory (5.8)]. For sums of
    `strain_response` over nodes in space of dimension d; exactly 1 up to a Poisson's
    ratio of 0.3, and if the response is not that of an elastic body.
    """
    kappa = (d + 1.0) / 2.0 - 1.0 / d  # sum of E E over the deviators
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        bulk = 2.0 / d * np.sqrt(kappa * swollen / sheared)  # over mu
        ratio = bulk - 2.0 / d  # lambda / mu
        share = (LARGEST_RATIO + d + 1.0) / (ratio + d + 1.0)
        bulky = np.isfinite(ratio) & (ratio > LARGEST_RATIO * (1.0 + _ROUNDING))
    return np.where(bulky, share, 1.0)

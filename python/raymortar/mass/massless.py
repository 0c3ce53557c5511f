"""Nodes of contact surfaces without mass, and what stands for them."""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

import numpy as np
from dolfinx.fem.petsc import assemble_matrix

from ..core.compat import Array, Indices, Mask
from ..core.discretization.layout import CoupledRows
from ..core.discretization.ranks import marked_everywhere
from ..core.errors import SetUpError, format_point, together
from ..entries import in_own_rows, joined, values_at

# Layers of cells around a node in which neighbours are looked for
MOST_LAYERS = 4

# Relative difference of distances that count as the same
SAME = 1e-6
# Least singular value of the places of neighbours, over the largest: with a smaller one
# they are in a line or plane, and weights would be large
SPREAD = 0.1
# Weights up to this are rounding errors
NOTHING = 1e-14


def nearest_weights(x: Array, neighbours: Array) -> Array | None:
    """Share weight one among the nearest neighbours (n, d) of a node at x (d,).

    None without any neighbour. Values that are constant around the node are reproduced
    [theory (6.2)].
    """
    if len(neighbours) == 0:
        return None
    distance = np.linalg.norm(neighbours - x, axis=1)
    nearest = distance <= (1.0 + SAME) * distance.min()
    return np.asarray(nearest / np.count_nonzero(nearest))


def affine_weights(x: Array, neighbours: Array) -> Array | None:
    """Find the weights of neighbours (n, d) that extrapolate to a node at x (d,).

    None if the neighbours are in a line, in space in a plane. Affine functions of the
    place are reproduced; of all such weights these have the least sum of squares, each
    times the squared distance from the node [theory (6.3)].
    """
    count, d = neighbours.shape
    if count <= d:
        return None
    away = neighbours - x
    distance = np.linalg.norm(away, axis=1)
    centred = away - away.mean(axis=0)
    sizes = np.linalg.svd(centred, compute_uv=False)
    if sizes[-1] < SPREAD * sizes[0]:
        return None
    conditions = np.vstack([np.ones(count), away.T / distance.max()])
    scaled = conditions / distance
    sought = np.zeros(d + 1)
    sought[0] = 1.0
    weights = np.linalg.lstsq(scaled, sought, rcond=None)[0] / distance
    return np.where(np.abs(weights) > NOTHING, weights, 0.0)


RULES = {"nearest": nearest_weights, "affine": affine_weights}


def massless_nodes(contact: Any) -> Mask:
    """Mark the nodes of contact surfaces, and of the slave surfaces of ties, among the
    local nodes of the displacement. Collective."""
    found = [np.empty(0, dtype=np.int32)]
    for one in contact.contacts:
        for zone in one.zones:
            found.append(zone.facets.slave_surface.dofs)
            if one.tied is None:
                found.append(zone.facets.master_surface.dofs)
    return marked_everywhere(contact.u.function_space, np.concatenate(found))


class _Nodes:
    """Rows, places and marks of nodes, for any rank by the first row of a node."""

    def __init__(self, layout: CoupledRows, is_massless: Mask, fixed: Mask) -> None:
        V = layout.u.function_space
        n, self.d = V.dofmap.index_map.size_local, V.mesh.geometry.dim
        self.rows = layout.u_rows[:n]
        self.x = V.tabulate_dof_coordinates()[:n, : self.d]
        self.chosen = np.flatnonzero(is_massless[:n])
        self.is_held = fixed[self.rows - layout.begin].all(axis=1)
        # Whether a row is the first of a node, whether massless, whether held, its place,
        # all rows
        width = 3 + 2 * self.d
        table = np.zeros((layout.size, width))
        own = self.rows[:, 0] - layout.begin
        table[own, 0], table[own, 1], table[own, 2] = 1.0, is_massless[:n], self.is_held
        table[own, 3 : 3 + self.d], table[own, 3 + self.d :] = self.x, self.rows
        self.table = PETSc.Vec().createMPI(
            (table.size, None), bsize=width, comm=layout.comm
        )
        self.table.array[:] = table.ravel()


def replacement(
    contact: Any, layout: CoupledRows, M: PETSc.Mat, mass: str, fixed: Mask
) -> Any:
    """Make Q, which replaces the values of massless nodes by those of others.

    Parameters
    ----------
    contact
        Contact, or several.
    layout
        Rows of the coupled unknowns.
    M
        Mass matrix over these rows; nodes with a common entry are in one cell.
    mass
        Name of the weights, of `RULES`.
    fixed
        Whether conditions prescribe an owned unknown. Contact stops no node that they
        hold: such nodes may have mass where a body has no others.

    Returns
    -------
    Matrix over the coupled rows [theory (6.1)]. Collective.
    """
    nodes = _Nodes(layout, massless_nodes(contact), fixed)
    rule, d = RULES[mass], nodes.d
    weights: dict[int, tuple[Array, Indices]] = {}
    left = nodes.chosen
    own = nodes.rows[left, 0]
    reach = in_own_rows(layout, own, own, np.ones(len(own)))
    for _ in range(MOST_LAYERS):
        wider = reach.matMult(M)
        reach.destroy()
        reach = wider
        missing, held = [], []
        offsets, columns, _ = reach.getValuesCSR()
        known = values_at(nodes.table, columns)
        for node in left:
            row = nodes.rows[node, 0] - layout.begin
            mine = known[offsets[row] : offsets[row + 1]]
            mine = mine[(mine[:, 0] == 1.0)]
            if len(mine) == 0:  # no cell of its has mass
                continue
            others = mine[mine[:, 1] == 0.0]
            found = rule(nodes.x[node], others[:, 3 : 3 + d])
            if found is None:
                missing.append(node)
                held.append(mine[mine[:, 2] == 1.0])
            else:
                weights[node] = _used(found, others, d)
        left = np.array(missing, dtype=np.int64)
        if layout.comm.allreduce(len(left)) == 0:
            break
    reach.destroy()
    nodes.table.destroy()
    with together(layout.comm):
        for node, others in zip(left, held):
            if nodes.is_held[node]:
                continue
            found = nearest_weights(nodes.x[node], others[:, 3 : 3 + d])
            if found is None:
                place = format_point(nodes.x[node], nodes.x)
                other = "" if mass == "nearest" else '"nearest" or '
                raise SetUpError(
                    f'mass="{mass}" finds no nodes off the contact surfaces within '
                    f"{MOST_LAYERS} layers of cells that can stand for the one at "
                    f"{place}: the body is too thin there. Mesh it with two cells or "
                    f'more across, or take mass={other}"consistent"'
                )
            weights[node] = _used(found, others, d)
    parts = [
        (np.full(len(share), row), column, share)
        for node, (share, others) in weights.items()
        for row, column in zip(nodes.rows[node], others.T)
    ]
    own = layout.begin + np.arange(layout.size)
    kept = np.setdiff1d(own, nodes.rows[list(weights)])
    return in_own_rows(layout, *joined([*parts, (kept, kept, np.ones(len(kept)))]))


def _used(found: Array, others: Array, d: int) -> tuple[Array, Indices]:
    """Weights that are not zero, and all rows of the nodes that they are of."""
    used = found != 0.0
    return found[used], others[used, 3 + d :].astype(PETSc.IntType)


def coupled_matrix(layout: CoupledRows, forms: Any) -> PETSc.Mat:
    """Assemble compiled bilinear forms, None for zero, over the coupled rows.

    Collective.
    """
    parts = []
    for k, form in enumerate(forms):
        if form is None:
            continue
        K = assemble_matrix(form)
        K.assemble()
        offsets, found, entries = K.getValuesCSR()
        K.destroy()
        first = layout.begin + layout.unknowns.owned_starts[k]
        rows = first + np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
        parts.append((rows, layout.coupled_columns(found, k), entries))
    return in_own_rows(layout, *joined(parts))

"""Multipliers at nodes that move as other nodes do."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core.errors import SetUpError, raise_everywhere
from ..core.system.assembly import ContactAssembly
from .prolongation import Slaves


def mirrored_multipliers(system: Any, slaves: Slaves, bcs: Sequence[Any]) -> Slaves:
    """Find the multipliers of slave nodes whose displacements are slaves of constraints.

    Two nodes with one displacement have one multiplier: with two, only their sum would be
    determined. A vector turns as displacements do; a pressure is the same [theory
    (5.25)]. Collective.
    """
    found = Slaves(np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0))
    for part in system.parts:
        if part.surfaces.multiplier is not None:
            found = found.joined(_of_contact(part, system, slaves, bcs))
    return found


def _of_contact(
    part: ContactAssembly, system: Any, slaves: Slaves, bcs: Sequence[Any]
) -> Slaves:
    """Find such multipliers of one contact. Collective."""
    layout, comm = system.layout, part.surfaces.comm
    nodes = _nodes(part, system)
    # First row of u and of the multiplier, of all ranks
    d = layout.u.function_space.mesh.geometry.dim
    own = np.unique(np.concatenate(comm.allgather(nodes)), axis=0)
    multiplier_of = dict(own.tolist())
    prescribed = system.unknowns.owned_prescribed(bcs)
    order = np.argsort(slaves.rows, kind="stable")
    rows, masters, values = (
        one[order] for one in (slaves.rows, slaves.masters, slaves.values)
    )
    entries: list[tuple[int, int, float]] = []
    fault = None
    components = part.layout.components
    mine = layout.begin, layout.begin + layout.n
    for first, lam in own[(own[:, 0] >= mine[0]) & (own[:, 0] < mine[1])].tolist():
        each = [
            slice(*np.searchsorted(rows, [first + i, first + i + 1])) for i in range(d)
        ]
        is_slave = [one.stop > one.start for one in each]
        if not any(is_slave):
            continue
        held = prescribed[first - layout.begin : first - layout.begin + d]
        others = np.concatenate([masters[one] for one in each])
        place = _master_node(others, own[:, 0], d)
        if place is None or not all(a or b for a, b in zip(is_slave, held)):
            fault = fault or _text(part, place is None)
            continue
        if components == 1:
            entries.append((lam, multiplier_of[place], 1.0))
            continue
        for i, one in enumerate(each):
            if is_slave[i]:
                entries += [
                    (lam + i, multiplier_of[place] + int(m) - place, float(v))
                    for m, v in zip(masters[one], values[one])
                ]
            else:
                entries.append((lam + i, multiplier_of[place] + i, 1.0))
    raise_everywhere(comm, fault, SetUpError)
    _take_points(part, comm.allreduce(len(entries)) > 0)
    # Node and multiplier may have unlike owners
    every = [entry for of_rank in comm.allgather(entries) for entry in of_rank]
    end = layout.begin + layout.size
    entries = [entry for entry in every if layout.begin <= entry[0] < end]
    table = np.array(entries, dtype=object).reshape(-1, 3)
    return Slaves(
        table[:, 0].astype(np.int64),
        table[:, 1].astype(np.int64),
        table[:, 2].astype(np.float64),
    )


def _nodes(part: ContactAssembly, system: Any) -> Any:
    """First rows of displacement and multiplier of this rank's slave nodes that have
    both, (nodes, 2)."""
    found = [np.empty((0, 2), dtype=np.int64)]
    for zone in part.zones:
        side = zone.facets.slave_surface
        table = zone.multiplier_table
        m = table.shape[1]
        # A facet's corners are its first nodes
        of_u = system.layout.u_rows[side.dofs[side.facet_dofs[:, :m]]][..., 0]
        of_lam = part.layout.multiplier_rows[table]
        found.append(np.column_stack([of_u.ravel(), of_lam.ravel()]))
    return np.unique(np.concatenate(found), axis=0)


def _master_node(masters: Any, nodes: Any, d: int) -> int | None:
    """First row of the one slave node that has all masters, if there is one."""
    at = np.searchsorted(nodes, masters, side="right") - 1
    if not len(masters) or np.any(at < 0) or np.any(at != at[0]):
        return None
    first = int(nodes[at[0]])
    return first if np.all(masters < first + d) else None


def _text(part: ContactAssembly, is_alone: bool) -> str:
    """Say which nodes of a contact constraints may not hold."""
    why = (
        "whose masters are no single slave node of the same contact, and so have no "
        "multiplier for it"
        if is_alone
        else "of which only some components are slaves"
    )
    return (
        f"the slave {part.surfaces.tags} has nodes that are slaves of constraints, {why}: "
        "swap slave and master of the contact or of the constraint, or take Penalty()"
    )


def _take_points(part: ContactAssembly, is_mirrored: bool) -> None:
    """Let the law hold at points where nodes have one multiplier: at nodes it would hold
    for each of them. Collective."""
    if not is_mirrored or part.surfaces.tied is not None:
        return
    why = "constraints give nodes one multiplier"
    vector = "vector" if part.method.is_dual else None
    if part.method.condition == "points" or part.change_law("points", vector, why):
        return
    raise SetUpError(
        f"the slave {part.surfaces.tags} has nodes that are slaves of constraints, and a "
        'law at nodes holds at each alone: take condition="points"'
    )

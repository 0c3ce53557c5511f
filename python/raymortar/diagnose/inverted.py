"""Cells that a deformation has turned inside out, or pressed flat."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from mpi4py import MPI

import numpy as np

from ..core import compat
from ..core.compat import Array
from ..core.discretization.facets import coordinates, match_points
from ..core.discretization.joined import parts_of, places_of
from ..core.errors import format_point
from ..core.finding import Finding, placed
from ..core.interaction import Interaction

# Ratio of the Jacobians below which a cell is inside out: at sharp corners linear
# elasticity turns single cells over by less
TURNED = -0.2


def inverted_cells(contact: Interaction) -> Iterator[Finding]:
    """Find cells that are inside out, with the place of the worst one. Collective.

    A cell counts where the Jacobian of its vertices' positions in its middle has another
    sign than before any motion, and is not small. Laws for large strains resist that
    without limit, and linear elasticity does not.
    """
    comm, count = contact.layout.comm, 0
    worst: tuple[float, tuple[float, ...]] = (0.0, ())
    for x, before, now in _jacobians(contact, False):
        ratio = np.linalg.det(now[:, 0]) / np.linalg.det(before[:, 0])
        count += int(np.count_nonzero(ratio < TURNED))
        if ratio.min(initial=0.0) < TURNED:
            most = int(ratio.argmin())
            place = placed(x[most].mean(axis=0), x[most])
            worst = min(worst, (float(ratio[most]), place))
    count = comm.allreduce(count, op=MPI.SUM)
    if count:
        yield Finding(
            "the bodies",
            min(comm.allgather(worst))[1],
            f"{count} cell(s) are turned inside out, which linear elasticity does not "
            "resist",
            "Check the unit of motions, or take a law for large strains",
            count,
            about=("inverted",),
        )


def most_compressed(contact: Interaction) -> tuple[float, str]:
    """Find the least stretch of a line at the vertices or in the middle of a cell, 1 at
    rest, and where the cell is. Collective."""
    found: tuple[float, str] = (1.0, "")
    for x, before, now in _jacobians(contact, True):
        stretches = np.linalg.svd(np.linalg.solve(before, now), compute_uv=False)
        least = stretches.min(axis=(1, 2))
        if least.min(initial=1.0) < found[0]:
            k = int(least.argmin())
            found = float(least[k]), _middle(x[k])
    return min(contact.layout.comm.allgather(found))


def _middle(x: Array) -> str:
    """Place of the middle of a cell's vertices."""
    return format_point(x.mean(axis=0), x)


def _jacobians(
    contact: Interaction, at_vertices: bool
) -> Iterator[tuple[Array, Array, Array]]:
    """Yield for each mesh the undeformed vertices of this rank's own cells, and the
    Jacobians of their positions before any motion and now, in the middle and at the
    vertices, (cells, points, d, d)."""
    u = contact.u
    for k, part in enumerate(parts_of(u)):
        V, places = part.function_space, places_of(u, k)
        values = u.x.array.reshape(-1, V.mesh.geometry.dim)
        x, moved = _vertices(V, values if places is None else values[places])
        cell = compat.cell_name(V.mesh)
        at = compat.basix_element(cell, 1).points
        middle = at.mean(axis=0)[None]
        points = np.concatenate([middle, at]) if at_vertices else middle
        slopes = compat.tabulate(cell, 1, points)[1:].swapaxes(0, 1)
        yield x, slopes @ x[:, None], slopes @ moved[:, None]


def _vertices(V: Any, u: Array) -> tuple[Array, Array]:
    """Undeformed and deformed vertices of this rank's own cells, (cells, vertices, d)."""
    mesh, n = V.mesh, V.mesh.topology.index_map(V.mesh.topology.dim).size_local
    cell = compat.cell_name(mesh)
    element = compat.basix_element(cell, compat.geometry_degree(mesh))
    nodes = match_points(element.points, element.vertices)
    dofs = match_points(compat.element_points(V), element.vertices)
    x = coordinates(mesh)[compat.geometry_dofmap(mesh)[:n, nodes]]
    return x, x + u[compat.dofmap_array(V)[:n, dofs]]

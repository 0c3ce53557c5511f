"""Cells that a deformation has turned inside out."""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

import numpy as np

from .. import compat
from ..compat import Array
from ..discretization.facets import coordinates, match_points
from ..discretization.joined import parts_of, places_of
from ..errors import format_point
from ..interactions import Interaction

# Ratio of the Jacobians below which a cell is inside out: at sharp corners linear
# elasticity turns single cells over by less
TURNED = -0.2


def inverted_cells(contact: Interaction) -> tuple[int, str]:
    """Count the cells that are inside out, and say where the worst one is. Collective.

    A cell counts where the Jacobian of its vertices' positions in its middle has another
    sign than before any motion, and is not small. Laws for large strains resist that
    without limit, and linear elasticity does not.
    """
    comm, u, count = contact.layout.comm, contact.u, 0
    worst: tuple[float, str] = (0.0, "")
    for k, part in enumerate(parts_of(u)):
        V, places = part.function_space, places_of(u, k)
        values = u.x.array.reshape(-1, V.mesh.geometry.dim)
        x, moved = _vertices(V, values if places is None else values[places])
        cell = compat.cell_name(V.mesh)
        middle = compat.basix_element(cell, 1).points.mean(axis=0)
        slopes = compat.tabulate(cell, 1, middle[None])[1:, 0]
        before, now = (np.linalg.det(slopes @ corners) for corners in (x, moved))
        ratio = now / before
        count += int(np.count_nonzero(ratio < TURNED))
        if ratio.min(initial=0.0) < TURNED:
            most = int(ratio.argmin())
            place = format_point(x[most].mean(axis=0), x[most])
            worst = min(worst, (float(ratio[most]), place))
    count = comm.allreduce(count, op=MPI.SUM)
    return count, min(comm.allgather(worst))[1] if count else ""


def _vertices(V: Any, u: Array) -> tuple[Array, Array]:
    """Undeformed and deformed vertices of this rank's own cells, (cells, vertices, d)."""
    mesh, n = V.mesh, compat.owned_cells(V.mesh)
    cell = compat.cell_name(mesh)
    element = compat.basix_element(cell, compat.geometry_degree(mesh))
    nodes = match_points(element.points, element.vertices)
    dofs = match_points(compat.element_points(V), element.vertices)
    x = coordinates(mesh)[compat.geometry_dofmap(mesh)[:n, nodes]]
    return x, x + u[compat.dofmap_array(V)[:n, dofs]]

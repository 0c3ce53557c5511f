"""Vector areas of a surface at the nodes of a space."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import compat
from ..compat import Indices
from .facet_areas import surface_normals
from .reference_facets import shape_functions
from .surfaces import Surface


def vector_areas(surface: Surface, index_map: Any, degree: int, table: Indices) -> Any:
    """int N n dG over this rank's facets, added up at the owners. Collective.

    Parameters
    ----------
    surface
        One rank's share.
    index_map, degree
        Index map and degree of the space of N. table
        Its block dofs on each facet, (facets, n).

    Returns
    -------
    Vector over the block dofs, d values each. Area (length in 2D, or
    that of a full turn, see `Surface`).
    """
    points, weights, m = surface_normals(surface)
    N, _ = shape_functions(surface.shape, degree, points)
    areas = compat.create_la_vector(index_map, surface.gdim)
    shares = np.einsum("q,qa,fqd->fad", weights, N, m)
    np.add.at(areas.array.reshape(-1, surface.gdim), table, shares)
    compat.scatter_reverse_add(areas)
    return areas

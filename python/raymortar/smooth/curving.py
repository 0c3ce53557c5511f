"""Curved contact surfaces of meshes with straight facets.

Mid nodes make a facet of degree 2 of a straight one: on the arc that its edges' normals
ask for [theory (2.16)], or where a user's function puts them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from dolfinx.mesh import Mesh
from scipy.sparse import csr_array

from ..core import compat
from ..core.compat import Array, Indices, Mask
from ..core.discretization.facets import (
    N_CORNERS,
    Facets,
    Global,
    all_exterior_facets,
    coordinates,
    dot,
    facet_ids,
    facet_node_table,
    facet_nodes,
    middle_normals,
    shape_functions,
)
from ..core.discretization.joined import NUMBERS_OF_PART
from ..core.discretization.ranks import count_marks
from ..core.discretization.surfaces import Smooth, Surface, connected
from ..core.errors import ContactError, together

# Facets that meet at a larger angle meet at an edge. Not 30 degrees, the angle of a
# circle of twelve facets
SHARPEST = np.deg2rad(40.0)
# Facets at a node that turn by more from the first to the last are no smooth surface
# there, as at the tip of a cone
MOST_CURVED = np.deg2rad(75.0)
# An edge that goes on beyond a corner turns by less than this
ONWARD = np.deg2rad(30.0)
# Largest distance from a chord to where a function puts its middle, in chords
FARTHEST = 0.5
# More than a facet has mid nodes
MIDS_OF_FACET = 8


@dataclass(frozen=True)
class _Shape:
    """Edges of a facet shape, in the order of the mid nodes of degree 2."""

    name: str
    chord: Array  # weights of the corners in all nodes, (nodes, corners)
    ends: Indices  # corners of each edge, (edges, 2)
    arms: Indices  # of each corner the other ends of its edges, (corners, d - 1)
    back: Indices  # place of each corner among the arms of its arms' ends
    places: Indices  # of each edge among the arms of its ends, (edges, 2)


def _shape(name: str) -> _Shape:
    """Find the edges of a facet shape."""
    chord, _ = shape_functions(name, 1, facet_nodes(name, 2))
    ends = np.nonzero(np.isclose(chord, 0.5))[1].reshape(-1, 2)
    arms = [
        [int(sum(edge)) - corner for edge in ends if corner in edge]
        for corner in range(N_CORNERS[name])
    ]
    back = [[arms[j].index(i) for j in row] for i, row in enumerate(arms)]
    places = [[arms[a].index(b), arms[b].index(a)] for a, b in ends.tolist()]
    tables = (np.array(table, dtype=np.int32) for table in (ends, arms, back, places))
    return _Shape(name, chord, *tables)


def curve(surface: Surface, mesh: Mesh, facets: Facets, smooth: Smooth) -> Surface:
    """Curve the straight facets of a surface, given in the mesh too. Collective."""
    shape = _shape(surface.shape)
    n, d = len(shape.arms), surface.gdim
    corners = surface.X[surface.facet_nodes[:, :n]]
    chords = np.einsum("ka,fad->fkd", shape.chord, corners)
    nodes = chords.copy()
    if callable(smooth):
        with together(mesh.comm):
            nodes[:, n:] = _on_true_surface(smooth, nodes[:, n:], corners)
    else:
        sag = _sags(shape, *_neighbourhood(mesh, facets))
        nodes[:, n : n + len(shape.ends)] += sag
        if surface.shape == "quadrilateral":
            # The surface that blends four arcs
            nodes[:, -1] += 0.5 * sag.sum(axis=1)
    arcs = np.linalg.norm(nodes - chords, axis=-1).max(axis=1)
    mids = nodes[:, n:].reshape(-1, d)
    if surface.node_degree == 2:
        X = surface.X.copy()
        X[surface.facet_nodes[:, n:].ravel()] = mids
        return replace(surface, X=X, arcs=arcs)
    facets_here, each = len(surface.facet_ids), nodes.shape[1] - n
    # Nodes of one facet: nothing but corners tells neighbours
    places = len(surface.X) + np.arange(len(mids), dtype=np.int32)
    ids = surface.facet_ids[:, None] * MIDS_OF_FACET + np.arange(each)
    table = np.hstack([surface.facet_nodes, places.reshape(facets_here, each)])
    return replace(
        surface,
        node_degree=2,
        X=np.concatenate([surface.X, mids]),
        node_ids=np.concatenate([surface.node_ids, ids.ravel() + NUMBERS_OF_PART // 2]),
        facet_nodes=np.ascontiguousarray(table, dtype=np.int32),
        arcs=arcs,
    )


def _on_true_surface(
    function: Callable[[Array], Array], mids: Array, corners: Array
) -> Array:
    """Ask a user's function for mid nodes, (facets, n, d)."""
    if not len(mids):
        return mids
    d = mids.shape[-1]
    x = np.pad(mids.reshape(-1, d), ((0, 0), (0, 3 - d))).T
    given = np.asarray(function(x.copy()), dtype=np.float64)
    if given.shape not in ((3, x.shape[1]), (d, x.shape[1])):
        raise ContactError(
            f"smooth gives an array of shape {given.shape} for points of shape "
            f"{x.shape}: it must be a function of points (3, n) to points (3, n)"
        )
    moved = np.linalg.norm(given[:d] - x[:d], axis=0).reshape(mids.shape[:2])
    size = np.linalg.norm(np.ptp(corners, axis=1), axis=-1)
    # Written so that NaN is too far
    if not np.all(moved <= FARTHEST * size[:, None]):
        raise ContactError(
            f"smooth moves the middle of an edge by {moved.max():.3e}, more than half "
            "a facet: it must give the points of the true surface next to the facets"
        )
    return given[:d].T.reshape(mids.shape)


# Arcs from normals


def _touching(nodes: Global | Indices, some: Global | Indices) -> Mask:
    """Mark the rows of nodes that have one of some nodes."""
    return np.isin(nodes, some).any(axis=1)


def _neighbourhood(mesh: Mesh, facets: Facets) -> tuple[Global, Array, Indices]:
    """Find a surface's facets and the exterior ones around them, two deep. Collective.

    Global nodes of the corners (facets, corners), positions (facets, corners, d), and
    the places of the surface's own facets.
    """
    exterior, facet_numbers = all_exterior_facets(mesh)
    nodes = facet_node_table(mesh, exterior)
    own = compat.geometry_nodes_global(mesh)[nodes], coordinates(mesh)[nodes]
    # Other ranks may need the facets at nodes of several, and those beside them
    several = count_marks(mesh.geometry.index_map(), nodes) > 1
    shared = _touching(nodes, nodes[several[nodes].any(axis=1)])
    mine = *own, facet_numbers
    parts: list[Any] = mesh.comm.allgather(tuple(array[shared] for array in mine))
    parts[mesh.comm.rank] = mine
    ids, X, numbers = (np.concatenate(arrays) for arrays in zip(*parts))
    order = np.argsort(numbers)
    at = order[np.searchsorted(numbers[order], facet_ids(mesh, facets))]
    # Normals of the next facets stand in for those at rims
    near = _touching(ids, ids[_touching(ids, ids[at])])
    return ids[near], X[near], (np.cumsum(near) - 1)[at]


def _corner_normals(
    shape: _Shape, ids: Global, unit: Array, arms: Array
) -> tuple[Array, Mask]:
    """Find normals at the corners of facets, of the smooth surface that each is on.

    Also whether that goes on beyond the corner in the direction of each arm. Weights
    are those of Max (1999), exact for spheres; in 2D for circles.
    """
    n, d = ids.size, unit.shape[-1]
    unit, squares = np.repeat(unit, ids.shape[1], axis=0), dot(arms, arms)
    m = unit * np.sqrt(squares).reshape(n, d - 1)[:, :1]
    if d == 3:
        m = np.cross(arms[:, :, 0], arms[:, :, 1]).reshape(n, d)
        m *= np.sign(dot(m, unit))[:, None]
    weight = m / squares.prod(axis=-1).reshape(n, 1)
    directions = (arms / np.sqrt(squares)[..., None]).reshape(n, d - 1, d)
    # Corners of facets at the same node, each with each
    nodes, node = np.unique(ids, return_inverse=True)
    places = np.arange(n), node.ravel()
    at = csr_array((np.ones(n), places), shape=(n, len(nodes)))
    one, other = (at @ at.T).nonzero()
    cosine = dot(unit[one], unit[other])
    # Facets whose normals differ little, or which others lead to in small steps
    near = cosine > np.cos(SHARPEST)
    patch = connected(np.column_stack([one, other])[near], n)
    smooth = (patch[one] == patch[other]) & (cosine > np.cos(MOST_CURVED))
    goes_on = np.ones(n, dtype=bool)
    np.logical_and.at(goes_on, one, smooth)
    one, other = one[smooth], other[smooth]
    alike = csr_array((np.ones(len(one)), (one, other)), shape=(n, n))
    normal = alike @ weight
    normal = (normal / np.linalg.norm(normal, axis=1, keepdims=True)).reshape(
        *ids.shape, d
    )
    turn = np.ones((n, d - 1))
    cosines = np.einsum("pid,pjd->pij", directions[one], directions[other])
    np.minimum.at(turn, one, cosines.min(axis=2))
    reached = goes_on[:, None] | (turn < -np.cos(ONWARD))
    reached = reached.reshape(*ids.shape, d - 1)
    # At a rim the normals of circles through the other ends of arms are better
    circles, alone = _mirrored(shape, normal, arms, reached)
    better = alike @ (circles * alone[..., None]).sum(axis=2).reshape(n, d)
    size = np.linalg.norm(better, axis=1, keepdims=True)
    better = (better / np.where(size > 0.0, size, 1.0)).reshape(normal.shape)
    return np.where((size > 0.0).reshape(*ids.shape, 1), better, normal), reached


def _mirrored(
    shape: _Shape, normal: Array, arms: Array, reached: Mask
) -> tuple[Array, Mask]:
    """Mirror the normals at the far ends of arms, as on circles through both ends.

    Also find where the surface goes on beyond the far end alone.
    """
    far = normal[:, shape.arms]
    share = dot(far, arms) / dot(arms, arms)
    alone = reached[:, shape.arms, shape.back] & ~reached
    return far - 2.0 * share[..., None] * arms, alone


def _sags(shape: _Shape, ids: Global, X: Array, mine: Indices) -> Array:
    """Find the vectors from edge middles to curved edges, (facets, edges, d). Length."""
    m = middle_normals(shape.name, 1, X)
    unit = m / np.linalg.norm(m, axis=1, keepdims=True)
    arms = X[:, shape.arms] - X[:, :, None]
    normal, reached = _corner_normals(shape, ids, unit, arms)
    # At the rim of a surface one facet gives the normal, and the arc is a circle's
    circles, alone = _mirrored(shape, normal, arms, reached)
    of_arms = np.where(alone[..., None], circles, normal[:, :, None])
    n0, n1 = (of_arms[:, shape.ends[:, k], shape.places[:, k]] for k in (0, 1))
    length = np.linalg.norm(n0 + n1, axis=-1)
    direction = (n0 + n1) / length[..., None]
    chord = X[:, shape.ends[:, 1]] - X[:, shape.ends[:, 0]]
    height = -dot(n0 - n1, chord) / (2.0 * (2.0 + length))
    sag = height[..., None] * direction
    if X.shape[-1] == 3:
        keys = np.sort(ids[:, shape.ends].reshape(-1, 2), axis=1)
        sag = _agreed(keys, np.repeat(unit, len(shape.ends), axis=0), direction, height)
    return sag[mine]


def _agreed(keys: Global, unit: Array, direction: Array, height: Array) -> Array:
    """Find one sag for both facets of each edge, (facets, edges, d).

    On a smooth surface their mean; at a sharp edge what has the height of each in its
    direction, so that a straight edge stays straight, and a circular rim is round.
    """
    _, edge, count = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(edge.ravel(), kind="stable")
    paired = order[count[edge.ravel()[order]] == 2]
    one, two = paired[::2], paired[1::2]
    n, h = direction.reshape(-1, 3), height.reshape(-1, 1)
    smooth = dot(unit[one], unit[two]) > np.cos(SHARPEST)
    k = dot(n[one], n[two])[:, None]
    # Two sides of a thin sheet tell nothing of its edge
    clear = 1.0 - k**2 > np.sin(SHARPEST) ** 2
    divisor = np.where(clear, 1.0 - k**2, np.inf)
    both = (h[one] - k * h[two]) * n[one] + (h[two] - k * h[one]) * n[two]
    mean = 0.5 * (h[one] * n[one] + h[two] * n[two])
    sag = np.zeros_like(n)
    sag[one] = sag[two] = np.where(smooth[:, None], mean, both / divisor)
    return sag.reshape(direction.shape)

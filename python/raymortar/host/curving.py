"""Curved contact surfaces of meshes with straight facets.

Mid nodes make a facet of degree 2 of a straight one: on the arc that its edges' normals
ask for [theory (2.16)], or where a user's function puts them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from dolfinx.mesh import Mesh
from scipy.sparse import csr_array

from .. import compat
from ..compat import Array, Indices
from ..errors import ContactError, together
from .bodies import connected
from .facets import (
    Facets,
    Global,
    all_exterior_facets,
    coordinates,
    facet_ids,
    facet_node_table,
)
from .joined import NUMBERS_OF_PART
from .ranks import count_marks
from .reference_facets import N_CORNERS, facet_nodes, middle_normals, shape_functions
from .surfaces import Surface

# Undeformed positions (3, n) to points of the true surface (3, n), or whether normals
# tell the surface
Smooth: TypeAlias = "bool | Callable[[Array], Array]"
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
    """Edges of a facet shape, in the order of the mid nodes of degree 2.

    Attributes
    ----------
    name
        Of the shape.
    chord
        Weights of the corners in the nodes of the straight facet, (nodes, corners).
    ends
        Corners of each edge, (edges, 2).
    arms
        Of each corner the other ends of its edges, (corners, d - 1).
    """

    name: str
    chord: Array
    ends: Indices
    arms: Indices

    def arm(self, corner: int, end: int) -> int:
        """Place among a corner's arms of the one to another corner."""
        return self.arms[corner].tolist().index(end)


def _shape(name: str) -> _Shape:
    chord, _ = shape_functions(name, 1, facet_nodes(name, 2))
    edges = np.isclose(chord, 0.5)
    ends = np.nonzero(edges)[1].reshape(-1, 2)
    arms = [
        [int(sum(edge)) - corner for edge in ends if corner in edge]
        for corner in range(N_CORNERS[name])
    ]
    return _Shape(name, chord, ends.astype(np.int32), np.array(arms, dtype=np.int32))


def curve(surface: Surface, mesh: Mesh, facets: Facets, smooth: Smooth) -> Surface:
    """Curve the straight facets of a surface, given in the mesh too. Collective."""
    shape = _shape(surface.shape)
    n, d = len(shape.arms), surface.gdim
    corners = surface.X[surface.facet_nodes[:, :n]]
    nodes = np.einsum("ka,fad->fkd", shape.chord, corners)
    if callable(smooth):
        with together(mesh.comm):
            nodes[:, n:] = _on_true_surface(smooth, nodes[:, n:], corners)
    else:
        sag = _sags(_Neighbourhood(mesh, facets, shape))
        nodes[:, n : n + len(shape.ends)] += sag
        if surface.shape == "quadrilateral":
            # The surface that blends four arcs
            nodes[:, -1] += 0.5 * sag.sum(axis=1)
    off = nodes - np.einsum("ka,fad->fkd", shape.chord, corners)
    arcs = np.linalg.norm(off, axis=-1).max(axis=1)
    return replace(_with_mids(surface, nodes[:, n:].reshape(-1, d)), arcs=arcs)


def _with_mids(surface: Surface, mids: Array) -> Surface:
    """A surface with other mid nodes, (facets x mid nodes, d)."""
    corners = N_CORNERS[surface.shape]
    if surface.node_degree == 2:
        X = surface.X.copy()
        X[surface.facet_nodes[:, corners:].ravel()] = mids
        return replace(surface, X=X)
    facets, each = len(surface.facet_ids), len(facet_nodes(surface.shape, 2)) - corners
    # Nodes of one facet: nothing but corners tells neighbours
    places = len(surface.X) + np.arange(len(mids), dtype=np.int32)
    ids = surface.facet_ids[:, None] * MIDS_OF_FACET + np.arange(each)
    table = np.hstack([surface.facet_nodes, places.reshape(facets, each)])
    return replace(
        surface,
        node_degree=2,
        X=np.concatenate([surface.X, mids]),
        node_ids=np.concatenate([surface.node_ids, ids.ravel() + NUMBERS_OF_PART // 2]),
        facet_nodes=np.ascontiguousarray(table, dtype=np.int32),
    )


def _on_true_surface(
    function: Callable[[Array], Array], mids: Array, corners: Array
) -> Array:
    """Points that a user's function gives for mid nodes, (facets, n, d)."""
    if not len(mids):
        return mids
    d = mids.shape[-1]
    x = np.zeros((3, mids.size // d))
    x[:d] = mids.reshape(-1, d).T
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


class _Neighbourhood:
    """Facets of a surface and exterior facets around them, two deep. Collective.

    Attributes
    ----------
    ids, X
        Global nodes and positions of the corners, (facets, corners) and (..., d).
    unit
        Normals at centres, (facets, d).
    mine
        Places of the facets of the surface.
    """

    def __init__(self, mesh: Mesh, facets: Facets, shape: _Shape) -> None:
        self.shape = shape
        ids, X, numbers = _boundary(mesh)
        order = np.argsort(numbers)
        mine = order[np.searchsorted(numbers[order], facet_ids(mesh, facets))]
        # Normals of the next facets stand in for those at rims
        touching = _touching(ids, ids[_touching(ids, ids[mine])])
        self.ids, self.X = ids[touching], X[touching]
        self.mine = (np.cumsum(touching) - 1)[mine]
        m = middle_normals(shape.name, 1, self.X)
        self.unit = m / np.linalg.norm(m, axis=1, keepdims=True)

    def corner_pairs(self) -> tuple[Indices, Indices]:
        """Corners of facets at the same node, each with each, by number."""
        nodes, node = np.unique(self.ids, return_inverse=True)
        n = self.ids.size
        places = np.arange(n), node.ravel()
        at = csr_array((np.ones(n), places), shape=(n, len(nodes)))
        return (at @ at.T).nonzero()


def _touching(
    facets: Global | Indices, nodes: Global | Indices
) -> npt.NDArray[np.bool_]:
    """Mark facets, given by their corners, that have one of some nodes."""
    return np.isin(facets, nodes).any(axis=1)


def _boundary(mesh: Mesh) -> tuple[Global, Array, Global]:
    """Corners of this rank's exterior facets and of those around them, two deep, their
    positions, and the facets' global numbers. Collective."""
    facets, facet_ids = all_exterior_facets(mesh)
    nodes = facet_node_table(mesh, facets)
    own = compat.geometry_nodes_global(mesh)[nodes], coordinates(mesh)[nodes], facet_ids
    several = count_marks(mesh.geometry.index_map(), nodes) > 1
    shared = several[nodes].any(axis=1)
    shared = _touching(nodes, nodes[shared])
    parts: list[Any] = mesh.comm.allgather(tuple(array[shared] for array in own))
    parts[mesh.comm.rank] = own
    ids, X, numbers = (np.concatenate(arrays) for arrays in zip(*parts))
    return ids, X, numbers


def _corner_normals(
    around: _Neighbourhood, arms: Array
) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Normals at the corners of facets, of the smooth surface that each is on, and
    whether that goes on beyond the corner in the direction of each arm.

    Weights are those of Max (1999), exact for spheres; in 2D for circles.
    """
    n, d = around.ids.size, around.X.shape[-1]
    squares = np.einsum("fcjd,fcjd->fcj", arms, arms)
    unit = np.broadcast_to(around.unit[:, None], around.X.shape)
    if d == 2:
        m = unit * np.sqrt(squares)
    else:
        m = np.cross(arms[:, :, 0], arms[:, :, 1])
        m *= np.sign(np.einsum("fcd,fcd->fc", m, unit))[..., None]
    weight = (m / squares.prod(axis=-1)[..., None]).reshape(-1, d)
    unit, flat = unit.reshape(-1, d), arms.reshape(n, d - 1, d)
    directions = flat / np.linalg.norm(flat, axis=-1, keepdims=True)
    one, other = around.corner_pairs()
    cosine = np.einsum("pd,pd->p", unit[one], unit[other])
    # Facets whose normals differ little, or which others lead to in small steps
    near = cosine > np.cos(SHARPEST)
    patch = connected(np.column_stack([one, other])[near], n)
    smooth = (patch[one] == patch[other]) & (cosine > np.cos(MOST_CURVED))
    goes_on = np.ones(n, dtype=bool)
    np.logical_and.at(goes_on, one, smooth)
    one, other = one[smooth], other[smooth]
    alike = csr_array((np.ones(len(one)), (one, other)), shape=(n, n))
    normal = alike @ weight
    turn = np.ones((n, d - 1))
    cosines = np.einsum("pid,pjd->pij", directions[one], directions[other])
    np.minimum.at(turn, one, cosines.min(axis=2))
    reached = goes_on[:, None] | (turn < -np.cos(ONWARD))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normal = normal.reshape(around.X.shape)
    reached = reached.reshape(*around.ids.shape, d - 1)
    better = alike @ _from_inside(around, arms, normal, reached)
    size = np.linalg.norm(better, axis=1, keepdims=True)
    better /= np.where(size > 0.0, size, 1.0)
    found = (size > 0.0).reshape(*around.ids.shape, 1)
    return np.where(found, better.reshape(normal.shape), normal), reached


def _from_inside(
    around: _Neighbourhood, arms: Array, normal: Array, reached: npt.NDArray[np.bool_]
) -> Array:
    """Sums of the normals that circles through the other ends of arms give to corners
    at rims, (facets x corners, d)."""
    shape = around.shape
    back = np.array(
        [[shape.arm(j, i) for j in row] for i, row in enumerate(shape.arms)]
    )
    theirs = reached[:, shape.arms, back] & ~reached
    mirrored = _mirrored(normal[:, shape.arms], arms) * theirs[..., None]
    total: Array = mirrored.sum(axis=2).reshape(-1, arms.shape[-1])
    return total


def _sags(around: _Neighbourhood) -> Array:
    """From the middle of each edge to the curved one, (facets, edges, d). Length."""
    shape, X = around.shape, around.X
    arms = X[:, shape.arms] - X[:, :, None]
    normal, reached = _corner_normals(around, arms)
    ends = [shape.ends[:, 0], shape.ends[:, 1]]
    d = X[:, ends[1]] - X[:, ends[0]]
    n0, n1 = normal[:, ends[0]], normal[:, ends[1]]
    known0, known1 = (
        reached[:, a, [shape.arm(i, j) for i, j in zip(a, b)]]
        for a, b in (ends, ends[::-1])
    )
    # A normal at the rim of a surface is one facet's: there the arc is that of a circle
    n0, n1 = (
        np.where((theirs & ~known)[..., None], _mirrored(far, d), near)
        for near, far, known, theirs in (
            (n0, n1, known0, known1),
            (n1, n0, known1, known0),
        )
    )
    total = n0 + n1
    length = np.linalg.norm(total, axis=-1)
    direction = total / length[..., None]
    height = -np.einsum("fed,fed->fe", n0 - n1, d) / (2.0 * (2.0 + length))
    if X.shape[-1] == 3:
        return _agreed(around, direction, height)[around.mine]
    sag: Array = (height[..., None] * direction)[around.mine]
    return sag


def _mirrored(n: Array, d: Array) -> Array:
    """Normals at the other ends of chords d of circles."""
    share = np.einsum("...d,...d->...", n, d) / np.einsum("...d,...d->...", d, d)
    mirrored: Array = n - 2.0 * share[..., None] * d
    return mirrored


def _agreed(around: _Neighbourhood, direction: Array, height: Array) -> Array:
    """Find one sag for both facets of each edge, (facets, edges, d).

    On a smooth surface their mean; at a sharp edge what has the height of each in its
    direction, so that a straight edge stays straight, and a circular rim is round.
    """
    edges = len(around.shape.ends)
    keys = np.sort(around.ids[:, around.shape.ends].reshape(-1, 2), axis=1)
    _, edge, count = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(edge.ravel(), kind="stable")
    paired = order[count[edge.ravel()[order]] == 2]
    one, two = paired[::2], paired[1::2]
    n, h = direction.reshape(-1, 3), height.ravel()
    unit = around.unit
    flat = np.einsum("ed,ed->e", unit[one // edges], unit[two // edges])
    smooth = (flat > np.cos(SHARPEST))[:, None]
    mean = 0.5 * (h[one, None] * n[one] + h[two, None] * n[two])
    k = np.einsum("ed,ed->e", n[one], n[two])
    apart = 1.0 - k**2
    # Two sides of a thin sheet tell nothing of its edge
    clear = apart > np.sin(SHARPEST) ** 2
    divisor = np.where(clear, apart, 1.0)
    shares = (h[one] - k * h[two]) / divisor, (h[two] - k * h[one]) / divisor
    both = shares[0][:, None] * n[one] + shares[1][:, None] * n[two]
    both *= clear[:, None]
    sag = np.zeros((direction.size // 3, 3))
    sag[one] = sag[two] = np.where(smooth, mean, both)
    return sag.reshape(direction.shape)

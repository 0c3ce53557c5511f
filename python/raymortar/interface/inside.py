"""Facets that lie inside another body, however deep, in the undeformed meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mpi4py import MPI

import numpy as np

from ..compat import Array, Indices
from ..host.bodies import Bodies, bodies_of_facets
from ..host.facets import all_exterior_facets
from ..host.joined import parts_of
from ..host.reference_facets import (
    N_CORNERS,
    facet_nodes,
    middle_normals,
    shape_functions,
)
from ..host.surfaces import Surface, build_surface
from .contact_surfaces import ContactSurfaces

# Most pairs of a point and an exterior facet that are looked at, about 10 ms, and the
# number of points that are looked at in any case
MOST_PAIRS, FEWEST_POINTS = 200_000, 32
# Corners of the simplices that a facet consists of
SIMPLICES: dict[str, list[tuple[int, ...]]] = {
    "interval": [(0, 1)],
    "triangle": [(0, 1, 2)],
    "quadrilateral": [(0, 1, 2), (1, 3, 2)],
}


@dataclass(frozen=True)
class Skin:
    """Exterior facets of this rank, as simplices, whichever tags they have.

    Attributes
    ----------
    comm
        Communicator of the meshes.
    bodies
        Parts of the meshes that are connected.
    corners
        Of each simplex, outward, (n, d, d). Length.
    body
        Number of its body, (n,).
    """

    comm: MPI.Comm
    bodies: Bodies
    corners: Array
    body: Indices

    def place_inside(
        self, sides: Sequence[Surface], depths: Sequence[Array]
    ) -> list[float] | None:
        """Find a point of either side that is inside a body of the other. Collective.

        Parameters
        ----------
        sides
            Two surfaces. Of large ones some facets are looked at.
        depths
            How far below the middle of each facet the point is, (facets,). Length.
        """
        numbers = [bodies_of_facets(self.bodies, side) for side in sides]
        known = [self._on_all_ranks(number) for number in numbers]
        # Simplices lie off facets of degree 2
        bulge = sum(self.comm.allreduce(_bulge(side), op=MPI.MAX) for side in sides)
        found: list[list[float]] = []
        for k, side in enumerate(sides):
            x = _below(side, depths[k] + bulge)
            for body in sorted(known[k]):
                others = known[1 - k] - {body}
                found += self._inside(x[numbers[k] == body], others)
        return max(found, default=None)

    def _on_all_ranks(self, numbers: Indices) -> set[int]:
        """Numbers that occur on some rank. Collective."""
        parts = self.comm.allgather(numbers)
        return set(np.unique(np.concatenate(parts)).tolist())

    def _inside(self, x: Array, bodies: set[int]) -> list[list[float]]:
        """Points of all ranks that are inside one of some bodies. Collective."""
        corners = self.corners[np.isin(self.body, list(bodies))]
        low = corners.min(axis=(0, 1), initial=np.inf)
        high = corners.max(axis=(0, 1), initial=-np.inf)
        self.comm.Allreduce(MPI.IN_PLACE, low, op=MPI.MIN)
        self.comm.Allreduce(MPI.IN_PLACE, high, op=MPI.MAX)
        near = x[((x > low) & (x < high)).all(axis=1)]
        points = np.unique(np.concatenate(self.comm.allgather(near)), axis=0)
        if not len(points):
            return []
        most = MOST_PAIRS // self.comm.allreduce(len(corners))
        step = -(-len(points) // max(most, FEWEST_POINTS))
        points = points[::step]
        turns = _turns(corners, points)
        self.comm.Allreduce(MPI.IN_PLACE, turns)
        inside: list[list[float]] = points[turns > 0.5].tolist()
        return inside


def skin_of(surfaces: ContactSurfaces) -> Skin:
    """Collect the exterior facets of all meshes of a contact. Collective."""
    corners, body = [], []
    for k, part in enumerate(parts_of(surfaces.u)):
        facets, _ = all_exterior_facets(part.function_space.mesh)
        side = build_surface(surfaces.u, [facets], k)
        for simplex in SIMPLICES[side.shape]:
            corners.append(side.X[side.facet_nodes[:, simplex]])
            body.append(bodies_of_facets(surfaces.bodies, side))
    return Skin(
        surfaces.comm,
        surfaces.bodies,
        np.concatenate(corners),
        np.concatenate(body),
    )


def _middles(side: Surface) -> tuple[Array, Array]:
    """Middles of facets, and of their corners, (facets, d) each."""
    centre = facet_nodes(side.shape, 1).mean(axis=0)
    N, _ = shape_functions(side.shape, side.node_degree, centre[None])
    nodes = side.X[side.facet_nodes]
    corners = nodes[:, : N_CORNERS[side.shape]]
    return np.einsum("a,fad->fd", N[0], nodes), corners.mean(axis=1)


def _bulge(side: Surface) -> float:
    """Largest distance of a facet's middle from that of its corners. Length."""
    middle, flat = _middles(side)
    return float(np.linalg.norm(middle - flat, axis=1).max(initial=0.0))


def _below(side: Surface, depth: Array) -> Array:
    """Points below the middles of facets, (facets, d)."""
    m = middle_normals(side.shape, side.node_degree, side.X[side.facet_nodes])
    unit = m / np.linalg.norm(m, axis=1, keepdims=True)
    points: Array = _middles(side)[0] - depth[:, None] * unit
    return points


def _turns(corners: Array, points: Array) -> Array:
    """Angle under which points see simplices from behind, over a full one, (points,).

    Of a closed surface it is 1 inside and 0 outside. In space after van Oosterom and
    Strackee (1983).
    """
    to = corners[None] - points[:, None, None]
    if to.shape[-1] == 2:
        a, b = to[:, :, 0], to[:, :, 1]
        across = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
        angle = np.arctan2(across, np.einsum("pfd,pfd->pf", a, b))
    else:
        a, b, c = to[:, :, 0], to[:, :, 1], to[:, :, 2]
        la, lb, lc = np.moveaxis(np.linalg.norm(to, axis=-1), -1, 0)
        volume = np.einsum("pfd,pfd->pf", a, np.cross(b, c))
        ab, bc, ca = (
            np.einsum("pfd,pfd->pf", *two) for two in ((a, b), (b, c), (c, a))
        )
        angle = np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb)
    turns: Array = angle.sum(axis=1) / (2.0 * np.pi)
    return turns

"""1,000 random folded strips: what points hit, against all facets one by one (W4).

No hit is on a smooth neighbour or through a wall, and in 2D none is missed. Where floating
point leaves a doubt whether a ray meets a facet, it is solved in rational numbers.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from dolfinx import fem
from problems import COMM

from meshes.blocks import Block
from meshes.meshing import assemble_blocks
from raymortar import Contact, Penalty
from raymortar.core import compat
from raymortar.core.discretization.ranks import index_among
from raymortar.core.interface.zone_data import global_masters

SKIN, LENGTH, FACING, DOUBT, MOST = 1, 6.0, 0.2, 1e-9, 600
# Cell, thickness, cells along, states: the second wall is thinner than its facets. And
# the share of the area where strips that go through each other in space may have
# another layer: it is chosen in the middle of the overlap of two facets
STRIPS = {
    "triangle": ("triangle", 0.2, 48, 700, 0.0),
    "thin": ("quadrilateral", 0.06, 40, 200, 0.0),
    "tetrahedron": ("tetrahedron", 0.3, 16, 100, 2e-3),
}


def strip(cell, wall, along):
    """Contact of the whole skin of a straight strip, and its displacement."""
    dim = 3 if cell == "tetrahedron" else 2
    lower = (0.0,) * (dim - 1) + (-0.5 * wall,)
    upper = (LENGTH,) + (0.5,) * (dim - 2) + (0.5 * wall,)
    sides = ["left", "right", "bottom", "top", "front", "back"][: 2 * dim]
    tags = dict.fromkeys(sides, SKIN)
    block = Block((along,) + (1,) * (dim - 2) + (1,), lower, upper, tags=tags)
    mesh, _, facet_tags = assemble_blocks(COMM, [block], cell)
    u = fem.Function(compat.vector_space(mesh, 1))
    return Contact(u, facet_tags, [(SKIN, SKIN)], Penalty(1.0)), u


def fold(X, rng):
    """Displacement that bends the middle line at random, with turns of up to 300
    degrees, and leaves the thickness as it is."""
    s = np.linspace(0.0, LENGTH, 2001)
    k = np.arange(1, 6)[:, None]
    waves = np.sin(k * np.pi * s / LENGTH + rng.uniform(0.0, 2.0 * np.pi, (5, 1)))
    angle = rng.uniform(0.5, 2.6) * (rng.normal(size=(5, 1)) * waves / k**0.5).sum(0)
    step = s[1]
    line = np.cumsum(np.stack([np.cos(angle), np.sin(angle)]), axis=1) * step
    x, y, turn = (np.interp(X[:, 0], s, of) for of in (*line, angle))
    across = X[:, -1]
    moved = X.copy()
    moved[:, 0] = x - across * np.sin(turn)
    moved[:, -1] = y + across * np.cos(turn)
    return moved + 0.01 * rng.normal(size=X.shape) - X


def exact_hit(x, n, nodes):
    """Reference coordinates and length of a ray on a facet, in rational numbers."""
    x, n = ([Fraction(float(v)) for v in of] for of in (x, n))
    a = [[Fraction(float(v)) for v in node] for node in nodes]
    d = len(x)
    # Columns: edges of the facet, and minus the ray
    A = [[a[j + 1][i] - a[0][i] for j in range(d - 1)] + [-n[i]] for i in range(d)]
    b = [x[i] - a[0][i] for i in range(d)]
    for col in range(d):
        pivot = next((r for r in range(col, d) if A[r][col] != 0), None)
        if pivot is None:
            return None
        A[col], A[pivot], b[col], b[pivot] = A[pivot], A[col], b[pivot], b[col]
        for r in range(d):
            if r != col:
                f = A[r][col] / A[col][col]
                A[r] = [p - f * q for p, q in zip(A[r], A[col])]
                b[r] -= f * b[col]
    return [b[i] / A[i][i] for i in range(d)]


def meets(x, n, nodes):
    """Whether rays (p,) meet facets (f,) inside, and their lengths, (p, f)."""
    edges = np.moveaxis(nodes[:, 1:] - nodes[:, :1], 1, 2)
    A = np.concatenate(
        [
            np.broadcast_to(edges, (len(x), *edges.shape)),
            np.broadcast_to(-n[:, None, :, None], (len(x), *edges.shape[:2], 1)),
        ],
        axis=3,
    )
    b = x[:, None] - nodes[:, 0]
    singular = np.abs(np.linalg.det(A)) < 1e-14
    A[singular] = np.eye(A.shape[-1])
    found = np.linalg.solve(A, b[..., None])[..., 0]
    bary = np.concatenate(
        [found[..., :-1], 1.0 - found[..., :-1].sum(-1)[..., None]], -1
    )
    least = bary.min(axis=-1)
    inside, g = (least > 0.0) & ~singular, found[..., -1]
    for p, f in zip(*np.nonzero((np.abs(least) < DOUBT) & ~singular)):
        of = exact_hit(x[p], n[p], nodes[f])
        assert of is not None
        inside[p, f] = min(*of[:-1], 1 - sum(of[:-1])) >= 0
        g[p, f] = float(of[-1])
    return inside, g


def normals(nodes):
    """Outward normals of flat facets."""
    if nodes.shape[-1] == 2:
        t = nodes[:, 1] - nodes[:, 0]
        n = np.column_stack([t[:, 1], -t[:, 0]])
    else:
        n = np.cross(nodes[:, 1] - nodes[:, 0], nodes[:, 2] - nodes[:, 0])
    return n / np.linalg.norm(n, axis=1, keepdims=True)


class Facets:
    """The skin, facet by facet, with what may count as a hit."""

    def __init__(self, contact):
        self.zone = contact.zones[0]
        self.surface = surface = self.zone.facets.slave_surface
        corners = surface.facet_dofs
        share = (corners[:, None, :, None] == corners[None, :, None, :]).any((2, 3))
        n = normals(surface.X[surface.facet_nodes])
        # At the edges of the strip there is material between facets
        wedge = share & (n @ n.T < 0.5)
        self.apart, thickness = ~wedge, self.zone.thickness[0]
        depth, reach = (self.zone.distances[name] for name in ("depth", "reach"))
        half = 0.5 * np.minimum(thickness[:, None], thickness)
        self.depth, self.reach = np.minimum(depth[:, None], half), reach[:, None]

    def admissible(self, points, nodes):
        """Which facets each point may hit, and the lengths of its rays."""
        x, n, f = points["x"], points["normal"], points["slave"]
        inside, g = meets(x, n, nodes)
        facing = -n @ normals(nodes).T
        counts = inside & self.apart[f] & (facing > FACING) & (g <= self.reach[f])
        return counts & (g >= -self.depth[f] * facing), g


def hits(zone, points):
    """Facet that each point hits, -1: none."""
    ids = zone.facets.master_surface.facet_ids
    return index_among(ids, global_masters(points, zone.cpp.pairs()))


@pytest.mark.parametrize("kind", STRIPS)
def test_random_folds_hit_what_all_facets_tell(kind):
    cell, wall, along, count, missed = STRIPS[kind]
    contact, u = strip(cell, wall, along)
    facets, seen, unlike = Facets(contact), np.zeros(3), 0.0
    surface, zone = facets.surface, facets.zone
    X = u.function_space.tabulate_dof_coordinates()[:, : surface.gdim]
    for seed in range(count):
        rng = np.random.default_rng(seed)
        u.x.array[:] = fold(X, rng).ravel()
        contact.update()
        points = zone.points()
        master, n = hits(zone, points), len(points["status"])
        some = rng.permutation(n)[:MOST]
        points, master = {k: v[some] for k, v in points.items()}, master[some]
        moved = surface.X + u.x.array.reshape(X.shape)[surface.dofs]
        counts, g = facets.admissible(points, moved[surface.facet_nodes])
        hit, way, w = points["status"] > 0, points["distance"], points["weight"]
        row = np.flatnonzero(hit)
        # Nothing is hit that may not be
        assert facets.apart[points["slave"][row], master[row]].all()
        assert counts[row, master[row]].all(), seed
        assert np.abs(way[row] - g[row, master[row]]).max(initial=0.0) < 1e-9
        # Open ones meet the first surface on their way, and nothing is missed
        first = np.where(counts, g, np.inf).min(axis=1)
        is_open = hit & ~(counts & (g < 0.0)).any(axis=1)
        unlike += w[is_open][~np.isclose(way[is_open], first[is_open])].sum()
        unlike += w[~hit & counts.any(axis=1)].sum()
        seen += w[hit].sum(), w[hit & (way < 0.0)].sum(), w[~hit].sum()
    assert unlike <= missed * seen[0]
    # The states have what they are for: hits, overlaps, and rays that go past
    assert (seen[1:] > 0.05 * seen[0]).all(), seen

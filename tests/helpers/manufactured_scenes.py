"""Meshes of the manufactured solutions: a body on a rigid or on an elastic one.

Rigid masters are curved by their geometry of degree 2, which holds a parabola exactly,
or flat and bent by what is prescribed. Tags: top, slave, side, master, bottom, free.
"""

from __future__ import annotations

import itertools

import numpy as np
from problems import COMM, DIMENSION

from meshes.blocks import SIDES, Block
from meshes.meshing import Scene, assemble_blocks

TAGS = {"top": 1, "slave": 2, "side": 3, "master": 4, "bottom": 5, "free": 6}
# Slide of the upper body of two elastic ones: the lower one's nodes are aligned to it
SLIDE = {2: (0.1,), 3: (0.1, 0.05)}


def _upper(dim, n, pattern):
    """Unit square or cube with n cells along each edge."""
    sides = dict.fromkeys(SIDES[dim], TAGS["side"])
    sides |= {"top": TAGS["top"], "bottom": TAGS["slave"]}
    start = 0.0 if dim == 2 else -0.5
    lower = (start,) * (dim - 1) + (0.0,)
    upper = (start + 1.0,) * (dim - 1) + (1.0,)
    return Block((n,) * dim, lower, upper, tags=sides, pattern=pattern)


def _parabola(x):
    """Heights of the rigid surface at points (n, d)."""
    if x.shape[1] == 2:
        return -0.05 * (x[:, 0] - 0.5) ** 2
    return -0.5 - 0.2 * (x[:, :2] ** 2).sum(axis=1)


def _warped(x, bend, corner, size):
    """Places (n, d) whose lateral components are moved within a square (an interval):
    straight lines become arcs, the outline stays."""
    inside = (x[:, :-1] - corner) / size
    wave = (
        bend
        * np.sin(np.pi * inside).prod(axis=1)
        * np.all((inside > 0.0) & (inside < 1.0), axis=1)
    )
    moved = x.copy()
    moved[:, :-1] += wave[:, None] * (1.0, -1.0)[: x.shape[1] - 1]
    return moved


def on_rigid(cell, n, curved=True, shake=0.0, geometry_degree=2, seed=0, bend=0.0):
    """The upper body with n facets along an edge, on a thin rigid one. Collective.

    Parameters
    ----------
    cell
        Name of the cell.
    n
        Cells along an edge of the upper body; the master's are of other sizes.
    curved
        The master is curved by its geometry (of degree 2), else flat.
    shake
        Irregular mesh: random shift of vertices as a share of their cells. Simplices
        then have random diagonals.
    bend
        Amplitude of the master's edges, curved within its surface. Length.
    """
    dim = DIMENSION[cell]
    pattern = "random" if shake else "right"

    def bent(x):
        x = _warped(x, bend, np.full(dim - 1, -1.0), 2.0) if bend else x
        return np.column_stack([x[:, :-1], x[:, -1] + _parabola(x)])

    mapping = bent if curved else None
    tags = {"top": TAGS["master"]}
    if dim == 2:
        divisions, ends = (n + 3, 1), ((-0.5, -0.4), (1.5, 0.0))
    else:
        divisions, ends = (n + 1, n + 1, 1), ((-1.0, -1.0, -0.4), (1.0, 1.0, 0.0))
    master = Block(divisions, *ends, mapping=mapping, tags=tags, pattern=pattern)
    return _scene(cell, [master, _upper(dim, n, pattern)], geometry_degree, shake, seed)


def _sections(n, starts, ends):
    """Ends and cells of the parts of an edge of the lower body: beside, below and
    beside the upper one, at about the same size of the cells."""
    parts = []
    for low, high in zip(starts, ends):
        length = high - low
        below = abs(length - 1.0) < 1e-9
        parts.append(
            (low, high, -(-5 * n // 4) if below else max(1, round(length * n)))
        )
    return parts


def on_elastic(cell, n, shake=0.0, geometry_degree=1, seed=0, bend=0.0):
    """The upper body on an elastic one, both flat. Collective.

    The lower body's nodes line up with the place of the upper body's edges: its loads
    jump there. The part between is tagged "master", the rest of the face "free", all
    the rest of its boundary "bottom". `bend`, as in `on_rigid`, is that of the part
    between, for geometry of degree 2.
    """
    dim = DIMENSION[cell]
    pattern = "random" if shake else "right"
    foot, floor = (0.0, -1.0) if dim == 2 else (-0.5, -2.0)
    start = 0.0 if dim == 2 else -0.5
    margin = (0.6, 0.4) if dim == 2 else (0.25, 0.25)
    lateral = []
    corner = start + np.array(SLIDE[dim])
    for slide in SLIDE[dim]:
        a, b = start + slide, start + slide + 1.0
        lateral.append(_sections(n, (a - margin[0], a, b), (a, b, b + margin[1])))
    blocks = [_upper(dim, n, pattern)]
    for index in itertools.product(range(3), repeat=dim - 1):
        parts = [sections[i] for sections, i in zip(lateral, index)]
        centre = all(i == 1 for i in index)
        tags = {"top": TAGS["master" if centre else "free"], "bottom": TAGS["bottom"]}
        for axis, i in enumerate(index):
            names = [name for name, (a, _) in SIDES[dim].items() if a == axis]
            if i != 1:
                tags[names[i // 2]] = TAGS["bottom"]
        low, high, counts = zip(*parts)
        depth = int(np.ceil((foot - floor) * n))
        blocks.append(
            Block(
                (*counts, depth),
                (*low, floor),
                (*high, foot),
                tags=tags,
                pattern=pattern,
                body="lower",
                mapping=(lambda x: _warped(x, bend, corner, 1.0)) if bend else None,
            )
        )
    # Bodies are numbered in the order of the blocks: the lower one first
    return _scene(cell, blocks[1:] + blocks[:1], geometry_degree, shake, seed)


def _scene(cell, blocks, geometry_degree, shake, seed):
    mesh, cells, facets = assemble_blocks(
        COMM,
        blocks,
        cell,
        geometry_degree,
        perturb=shake,
        perturb_sides=shake,
        seed=seed,
    )
    return Scene(mesh, cells, facets, TAGS)

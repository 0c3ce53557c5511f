"""Paths with multipliers, with and without statuses where linear steps end."""

from __future__ import annotations

import statistics
import time
import warnings
from contextlib import nullcontext

import numpy as np
from ahead import without
from bodies_2d import snap_fit
from corrections import sheared
from dolfinx import fem
from pathing import Path, take
from points_and_nodes import law_at
from problems import build, fix
from scenes_that_arrive import drawing, o_ring
from slender import belt, bent, leaves

import raymortar

RUNS = 3
DUAL = raymortar.AugmentedLagrangian(condition="nodes", multiplier="dual")
AT_NODES = raymortar.AugmentedLagrangian(condition="nodes")
AT_POINTS = raymortar.AugmentedLagrangian(condition="points")


def snapping(method, degree=1):
    """A hook that snaps over a tooth with friction."""
    scene = snap_fit()
    top = fem.Constant(scene.mesh, np.zeros(2))

    def held(V, scene):
        return [fix(V, scene, "bottom"), fix(V, scene, "top", None, top)]

    options = {"search": raymortar.Search(reach=1.0, depth=1.0), "method": method}
    options |= {"E": 1000.0, "bcs": held, "friction": raymortar.Coulomb(0.3)}
    problem = build(scene, degree, "neo-hookean", **options).problem

    def push(t):
        top.value[0] = 3.2 * t

    return Path(problem, push, 32)


def blocks(*case):
    """A block that is pressed on another one and drawn along."""
    problem, load = sheared(*case, "direct")
    return Path(problem, load.apply, 4)


AT_NODES_CASES = {
    "strip, L/t 20, mu 0.3": lambda: bent(20, 0.3),
    "strip, L/t 60, mu 0.3": lambda: bent(60, 0.3),
    "strip, L/t 100, mu 0.3": lambda: bent(100, 0.3),
    "belt, 40 cells": lambda: belt(40),
    "belt, 134 cells": lambda: belt(134),
    "belt, 268 cells": lambda: belt(268),
    "2 leaves": lambda: leaves(2, 1.0, 4),
    "3 leaves": lambda: leaves(3, 1.0, 4),
    "3 leaves, 8 steps": lambda: leaves(3, 1.0, 8),
    "4 leaves": lambda: leaves(4, 1.0, 4),
    "deep drawing": drawing,
    "O-ring, squeezed and wetted": o_ring,
    "snap-fit, mu 0.3": lambda: snapping(AT_NODES),
    "snap-fit, mu 0.3, dual": lambda: snapping(DUAL),
    "snap-fit, mu 0.3, degree 2": lambda: snapping(AT_NODES, 2),
    "blocks, triangles, mu 0.3": lambda: blocks("triangle", 1, 25, 0.3),
    "blocks, tetrahedra, mu 0.3": lambda: blocks("tetrahedron", 1, 3, 0.3),
    "blocks, hexahedra, mu 0.3": lambda: blocks("hexahedron", 1, 3, 0.3),
    "blocks, tetrahedra of degree 2": lambda: blocks("tetrahedron", 2, 2, 0.0),
}


AT_POINTS_CASES = {
    "strip, L/t 20, mu 0.3": lambda: bent(20, 0.3),
    "strip, L/t 60, mu 0.3": lambda: bent(60, 0.3),
    "strip, L/t 100, mu 0.3": lambda: bent(100, 0.3),
    "belt, 134 cells": lambda: belt(134),
    "2 leaves": lambda: leaves(2, 1.0, 4),
    "3 leaves": lambda: leaves(3, 1.0, 4),
    "4 leaves": lambda: leaves(4, 1.0, 4),
    "deep drawing": drawing,
    "O-ring, squeezed and wetted": o_ring,
    "snap-fit, mu 0.3": lambda: snapping(AT_POINTS),
    "snap-fit, mu 0.3, degree 2": lambda: snapping(AT_POINTS, 2),
    "blocks, triangles of degree 2, mu 0.3": lambda: blocks("triangle", 2, 13, 0.3),
    "blocks, tetrahedra of degree 2, mu 0.3": lambda: blocks("tetrahedron", 2, 2, 0.3),
    "blocks, hexahedra of degree 2, mu 0.3": lambda: blocks("hexahedron", 2, 2, 0.3),
}
CASES = [
    *(("nodes", *case) for case in AT_NODES_CASES.items()),
    *(("points", *case) for case in AT_POINTS_CASES.items()),
]


def taken(law, make, ahead):
    """Iterations a step and tangents of a path, unknowns, and CPU seconds."""
    with law_at(law), warnings.catch_warnings():
        warnings.simplefilter("ignore", raymortar.ContactWarning)
        path = make()
        start = time.process_time()
        with nullcontext() if ahead else without():
            found = take(path)
    seconds = time.process_time() - start
    mean = found.iterations / max(len(found.steps), 1)
    unknowns = path.problem.contact.system.layout.ranges[-1]
    return unknowns, found.arrived, mean, found.tangents, seconds


def statuses():
    """Both by turns, so that a slow machine slows both; medians of seconds."""
    for law, name, make in CASES:
        runs = [[taken(law, make, on) for on in (False, True)] for _ in range(RUNS)]
        before, after = runs[0]
        seconds = [statistics.median(run[k][-1] for run in runs) for k in (0, 1)]
        yield {
            "scene": name,
            "law": law,
            "unknowns": before[0],
            "arrived": "yes" if before[1] and after[1] else "no",
            "plain_mean": before[2],
            "plain_tangents": before[3],
            "plain_seconds": f"{seconds[0]:.2f}",
            "mean": after[2],
            "tangents": after[3],
            "seconds": f"{seconds[1]:.2f}",
        }

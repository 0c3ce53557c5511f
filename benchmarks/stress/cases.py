"""The grid of settings: what is varied, alone and in pairs."""

from __future__ import annotations

import itertools

from scenes import Setting

RATIOS = [1e-6, 1e-4, 1e-2, 1.0, 1e2, 1e4, 1e6]
GAMMAS = [1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3, 1e4]
FRICTIONS = [0.0, 0.1, 0.3, 0.6, 1.0, 2.0]
UNITS = [1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6]
PUSHES = [1e-6, 1e-3, 0.01, 0.05, 0.1, 0.2, 0.4, 0.8]
DIVISIONS = [(2, 20), (4, 12), (7, 5), (12, 4), (20, 2)]
ASPECTS = [1e-3, 1e-2, 1.0, 1e2, 1e3]
GAPS = [-0.4, -0.1, -0.01, 0.0, 1e-6, 0.1, 0.5]
POISSONS = [0.0, 0.3, 0.49, 0.499, 0.4999, 0.49999]
# Cell, degree, cells along an edge of the interface
CELLS = [
    (cell, degree, divisions)
    for degree in (1, 2)
    for cell, divisions in (
        ("triangle", (7, 5)),
        ("quadrilateral", (7, 5)),
        ("tetrahedron", (3, 2)),
        ("hexahedron", (3, 2)),
    )
]
CELL = ("cell", "degree", "divisions")

# Name of a panel: scene, (field, values) down, (field, values) across. Where no cell is
# named these are triangles of degree 1
PANELS = {
    "column: stiffness x gamma": ("column", ("ratio", RATIOS), ("gamma", GAMMAS)),
    "punch: stiffness x gamma": ("punch", ("ratio", RATIOS), ("gamma", GAMMAS)),
    "punch: friction x push": ("punch", ("friction", FRICTIONS), ("push", PUSHES)),
    "punch: cells x push": ("punch", ("divisions", DIVISIONS), ("push", PUSHES)),
    "column: cells x unit": ("column", ("divisions", DIVISIONS), ("unit", UNITS)),
    "punch: friction x unit": ("punch", ("friction", [0.0, 0.3]), ("unit", UNITS)),
    "column: gap x push": ("column", ("gap", GAPS), ("push", PUSHES)),
    "column: slivers x stiffness": ("column", ("aspect", ASPECTS), ("ratio", RATIOS)),
    "column: Poisson x gamma": ("column", ("nu", POISSONS), ("gamma", GAMMAS)),
    "punch: flanks x push": ("punch", ("perpendicular", [True]), ("push", PUSHES)),
    "slide off the edge: friction x push": (
        "slide",
        ("friction", [0.0, 0.3, 1.0]),
        ("push", [0.01, 0.05, 0.1]),
    ),
    "slide off the edge: friction x tangent": (
        "slide",
        ("friction", [0.0, 0.3, 1.0]),
        ("tangent", ["fixed", "full"]),
    ),
    "column: cell x stiffness": ("column", (CELL, CELLS), ("ratio", RATIOS)),
    "column: cell x gamma": ("column", (CELL, CELLS), ("gamma", GAMMAS)),
    "column: cell x unit": ("column", (CELL, CELLS), ("unit", UNITS)),
    "punch: cell x push": ("punch", (CELL, CELLS), ("push", [1e-6, 0.01, 0.1, 0.2])),
    "punch: cell x stiffness": (
        "punch",
        (CELL, CELLS),
        ("ratio", [1e-4, 1e-2, 1e2, 1e4]),
    ),
    "punch: cell x gamma": (
        "punch",
        (CELL, CELLS),
        ("gamma", [0.01, 0.1, 10.0, 100.0]),
    ),
    "punch: cell x friction": ("punch", (CELL, CELLS), ("friction", [0.0, 0.3, 1.0])),
    "slide off the edge: cell x friction": (
        "slide",
        (CELL, CELLS),
        ("friction", [0.0, 0.3]),
    ),
}


def settings(panel):
    """Rows of settings of a panel."""
    scene, (down, rows), (across, columns) = PANELS[panel]
    return [
        [Setting(scene, **_fields(down, row), **{across: value}) for value in columns]
        for row in rows
    ]


def _fields(names, values):
    """One field, or several that go together."""
    return {names: values} if isinstance(names, str) else dict(zip(names, values))


def all_settings():
    """Every setting once, in the order of the panels."""
    every = itertools.chain.from_iterable(
        itertools.chain.from_iterable(settings(panel)) for panel in PANELS
    )
    return list(dict.fromkeys(every))

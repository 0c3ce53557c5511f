"""Tables of docs/measured/accuracy.md that are not sweeps of benchmarks/accuracy."""

from __future__ import annotations

import manufactured
import two_layers
from manufactured_fields import SQUARE

CELLS = [(c, p) for c in ("quadrilateral", "triangle") for p in (1, 2)]


def oscillation():
    """Total variation of the multiplier over that of the wave, and its roughness."""
    settings = [(8, 64, 1.0), (8, 64, 1e3), (8, 64, 1e-3), (64, 8, 1e3), (64, 8, 1.0)]
    settings += [(8 * master, master, 1e-3) for master in (4, 8, 16)]
    for slave, master, ratio in settings:
        for cell, degree in CELLS:
            found = two_layers.press(cell, degree, master, slave, ratio)
            yield {
                "slave": slave,
                "master": master,
                "ratio": ratio,
                "cell": cell,
                "degree": degree,
                "variation": float(found.variation / (4.0 * found.a)),
                "roughness": float(found.rough),
            }


def flux():
    """Error of the multiplier, and of the consistent flux without contact, in B2."""
    for cell, degree in CELLS:
        for shake in (0.0, 0.2):
            n = 32 // degree
            problem = manufactured.solve(SQUARE, cell, n, degree, shake=shake)
            yield {
                "cell": cell,
                "degree": degree,
                "shake": shake,
                "n": n,
                "multiplier": float(problem.errors()["multiplier"]),
                "flux": float(manufactured.flux_error(problem)),
            }

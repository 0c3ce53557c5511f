"""How much it matters that segments have chords for curved edges of the master.

    scripts/python benchmarks/accuracy/breaks.py

Manufactured problems in 3D whose master's edges are bent within its surface. Found with
the defaults, with subdivided facets, with many points, and with both, which stands for
exact integration. Writes `results/breaks.csv`: relative errors against the exact fields,
relative differences from exact integration.
"""

import csv
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(ROOT / "tests" / "helpers")]

import numpy as np  # noqa: E402
from manufactured import REST, Manufactured  # noqa: E402
from manufactured_fields import CUBE, TWO_CUBES, Motion  # noqa: E402
from manufactured_scenes import SLIDE  # noqa: E402

from raymortar import Search  # noqa: E402

BEND = 0.1  # of a master 2 (B1) and 1 (B4) wide
PROBLEMS = {
    "B1": (CUBE, REST, (2, 4, 6)),
    "B4 3D": (TWO_CUBES, Motion((0.0, 0.0), SLIDE[3]), (2, 4)),
}
# Degree of the rule, and whether facets are subdivided. The last is the reference
SETTINGS = {
    "default": (None, False),
    "subdivided": (None, True),
    "degree 12": (12, False),
    "exact": (16, True),
}
NAMES = ("u", "multiplier")
COLUMNS = (
    *("problem", "cell", "n", "setting", "iterations", "other_master"),
    *(f"error_{name}" for name in NAMES),
    *(f"difference_{name}" for name in NAMES),
)


def other_masters(contact):
    """Share of the points whose ray hits another master than their segment's."""
    points = contact.points()
    own = points["seed"] >= 0
    return np.mean(points["master"][own] != points["seed"][own])


def solved(problem, cell, n, setting, degree=2):
    """Problem, iterations and unknowns."""
    fields, motion, _ = PROBLEMS[problem]
    quadrature, subdivide = SETTINGS[setting]
    found = Manufactured(
        fields,
        cell,
        n,
        degree,
        motion,
        bend=BEND,
        quadrature_degree=quadrature,
        search=Search(subdivide=subdivide),
    )
    iterations = found.solve()
    unknowns = found.u.x.array, found.contact.multiplier.x.array
    return found, iterations, unknowns


def rows(problem, cell, n):
    """A row for each setting."""
    *_, exact = solved(problem, cell, n, "exact")
    for setting in SETTINGS:
        found, iterations, unknowns = solved(problem, cell, n, setting)
        errors = found.errors()
        u = max(errors["u_upper"], errors.get("u_lower", 0.0))
        apart = [
            np.linalg.norm(a - b) / np.linalg.norm(b) for a, b in zip(unknowns, exact)
        ]
        yield (
            *(problem, cell, n, setting, iterations),
            f"{other_masters(found.contact):.4f}",
            *(f"{value:.3e}" for value in (u, errors["multiplier"], *apart)),
        )


def main():
    """Run all; some minutes."""
    with (HERE / "results" / "breaks.csv").open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(COLUMNS)
        for problem, (_, _, sizes) in PROBLEMS.items():
            for cell in ("hexahedron", "tetrahedron"):
                for n in sizes:
                    for row in rows(problem, cell, n):
                        table.writerow(row)
                        print(*row, flush=True)
                    file.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())

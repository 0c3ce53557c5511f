"""How fast contact is, and against what: tables, and plots of growth.

    scripts/python benchmarks/speed/run.py [--quick] [--parts stages,...] [--output DIR]

CPU seconds, medians of five calls. Parts: `stages` (every stage against the number of
slave facets, and the floor of the insertion), `pairing` (up to a million facets, all
strategies), `peer` (GetFEM on the same surfaces), `share` (of a Newton iteration with
MUMPS), `ironing` (a path from end to end, and in GetFEM).
"""

from __future__ import annotations

import argparse
import csv
import logging
from pathlib import Path

import ironing
import numpy as np
import peer
import plots
import share
import stages

HERE = Path(__file__).parent
FACETS = {"interval": "2D", "triangle": "tets", "quadrilateral": "hexes"}
STRATEGIES = ("bvh", "pang")


def cells_for(shape, facets):
    """Cells per direction that make about so many slave facets."""
    if shape == "interval":
        return facets
    return round((facets / (2 if shape == "triangle" else 1)) ** 0.5)


def exponent(facets, seconds):
    """Slope of log seconds over log facets, least squares."""
    facets, seconds = np.asarray(facets, float), np.asarray(seconds, float)
    return float(np.polyfit(np.log(facets), np.log(seconds), 1)[0])


def stage_rows(quick):
    """Stages for every kind of facet and size."""
    rows = []
    for shape in FACETS:
        for degree in (1, 2):
            # A quadratic facet in 3D takes about 10 kB of points and 40 kB of matrix
            large = degree == 2 and shape != "interval"
            sizes = (100, 1_000, 10_000) if large else (100, 1_000, 10_000, 100_000)
            runs = [(facets, False) for facets in ((100, 400) if quick else sizes)]
            # What friction adds, at one size
            runs.append((100 if quick else 10_000, True))
            for facets, friction in runs:
                repeats = 2 if quick else (5 if facets < 10_000 else 3)
                n = cells_for(shape, facets)
                rows.append(stages.row(shape, degree, n, repeats, friction))
                show(rows[-1], ("shape", "degree", "contact", "facets", "points"))
    return rows


def pairing_rows(quick):
    """First pairing and candidates alone up to a million facets."""
    sizes = (100, 1000) if quick else (1_000, 10_000, 100_000, 1_000_000)
    rows = []
    for shape in FACETS:
        for strategy in STRATEGIES + (("brute-force",) if quick else ()):
            for facets in sizes:
                n = cells_for(shape, facets)
                seconds, found = stages.search(shape, n, strategy, 2 if quick else 5)
                rows.append(
                    {
                        "shape": shape,
                        "strategy": strategy,
                        "facets": facets,
                        "candidates": found,
                        "s_candidates": seconds,
                    }
                )
                show(rows[-1], ("shape", "strategy", "facets"))
    return rows


def peer_rows(quick):
    """GetFEM and raymortar, if GetFEM is there."""
    if peer.gf is None:
        print(peer.MISSING)
        return []
    rows = []
    for (cell, degree), n in {
        ("quadrilateral", 1): 400,
        ("quadrilateral", 2): 400,
        ("tetrahedron", 1): 14,
        ("tetrahedron", 2): 10,
        ("hexahedron", 1): 16,
        ("hexahedron", 2): 8,
    }.items():
        turns = [
            peer.compare(cell, degree, n // 4 if quick else n, 2 if quick else 5)
            for _ in range(1 if quick else 3)
        ]
        rows.append(
            {
                name: float(np.median([row[name] for row in turns]))
                if isinstance(value, float)
                else value
                for name, value in turns[0].items()
            }
        )
        show(rows[-1], ("cell", "degree", "facets"))
    return rows


# Cells of an edge of each cube by kind, that make about 600, 6,000 and 40,000 unknowns
SHARED = {
    ("quadrilateral", 1): (12, 38, 99),
    ("quadrilateral", 2): (6, 19, 50),
    ("tetrahedron", 1): (4, 9, 18),
    ("tetrahedron", 2): (2, 5, 9),
    ("hexahedron", 1): (4, 9, 18),
    ("hexahedron", 2): (2, 5, 9),
}


def share_rows(quick):
    """Two cubes without and with friction, and one on a plane with as many unknowns."""
    rows = []
    for (cell, degree), sizes in SHARED.items():
        for kind in share.KINDS:
            for n in sizes[:1] if quick else sizes:
                # Of one cube, whose cells are as many as those of two
                dim = 2 if cell == "quadrilateral" else 3
                n = round(n * 2 ** (1 / dim)) if "plane" in kind else n
                repeats = 2 if quick else (5 if n > sizes[1] else 15)
                rows.append(share.row(cell, degree, n, kind, repeats))
                show(rows[-1], ("cell", "degree", "contact", "unknowns"))
    return rows


def ironing_rows(quick):
    """Run time of a path in both programs."""
    return listed(ironing.rows(quick))


def listed(rows):
    """The rows, printed with the names of their columns."""
    for row in rows:
        print(", ".join(f"{name} {value}" for name, value in row.items()))
    return rows


PARTS = {
    "stages": stage_rows,
    "pairing": pairing_rows,
    "peer": peer_rows,
    "share": share_rows,
    "ironing": ironing_rows,
}


def show(row, keys):
    """A row on one line: what it is, then its numbers."""
    head = " ".join(
        str(round(row[k]) if isinstance(row[k], float) else row[k]) for k in keys
    )
    facets = row.get("facets", 1)
    rest = []
    for name, value in row.items():
        if name in keys or not isinstance(value, float):
            continue
        if name.startswith("s_"):
            rest.append(f"{name[2:]} {1e6 * value / facets:.3g}")
        else:
            rest.append(f"{name} {value:.3g}")
    print(f"{head}: {', '.join(rest)}", flush=True)


def growth(rows, key):
    """Exponent of each column of seconds from a thousand facets on."""
    lines = []
    for group in sorted({tuple(row[k] for k in key) for row in rows}):
        own = [r for r in rows if tuple(r[k] for k in key) == group]
        own = [r for r in own if r["facets"] >= 900]
        if len(own) < 2:
            continue
        line = dict(zip(key, group))
        facets = [r["facets"] for r in own]
        for name in own[0]:
            if name.startswith("s_") and name not in ("s_unmoved", "s_insertion"):
                line[name[2:]] = exponent(facets, [r[name] for r in own])
        lines.append(line)
        show(line, key)
    return lines


def save(path, rows):
    """Rows as CSV with four digits."""
    if not rows:
        return
    columns = list(dict.fromkeys(name for row in rows for name in row))
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        for row in rows:
            writer.writerow(
                {k: f"{v:.4g}" if isinstance(v, float) else v for k, v in row.items()}
            )


def main(arguments=None):
    """Run the parts; 0 if nothing failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a minute, for tests")
    parser.add_argument("--parts", default=",".join(PARTS))
    parser.add_argument("--output", type=Path, default=HERE / "results")
    args = parser.parse_args(arguments)
    args.output.mkdir(parents=True, exist_ok=True)
    # Compilers of forms are talkative
    logging.disable(logging.WARNING)
    for part in args.parts.split(","):
        print(f"-- {part}: microseconds per slave facet where nothing else is said")
        rows = PARTS[part](args.quick)
        save(args.output / f"{part}.csv", rows)
        if part in ("stages", "pairing"):
            key = ("shape", "degree" if part == "stages" else "strategy")
            rows = [r for r in rows if r.get("contact") != "friction"]
            print(f"-- {part}: exponents of growth")
            save(args.output / f"{part}_growth.csv", growth(rows, key))
            plots.growth(rows, key, args.output / f"{part}.png")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())

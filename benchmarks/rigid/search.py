"""How the search of a `rigid.Surface` grows with its facets: time of a ray.

Writes search.csv beside it. Rays meet a bumpy square from above, as slave points do. The
times are the least of some repeats in one process; what is compared is their ratio.
"""

import argparse
import csv
import time
from pathlib import Path

import numpy as np

from raymortar import rigid

RAYS, REPEATS = 20_000, 5


def bumpy(facets):
    """A face of about as many triangles over the unit square."""
    n = max(1, round(np.sqrt(facets / 2)))
    t = np.linspace(0.0, 1.0, n + 1)
    x, y = (a.ravel() for a in np.meshgrid(t, t, indexing="ij"))
    points = np.column_stack([x, y, 0.05 * np.sin(9.0 * x) * np.cos(7.0 * y)])
    i, j = (a.ravel() for a in np.indices((n, n)))
    k = i * (n + 1) + j
    lower = np.column_stack([k, k + n + 1, k + 1])
    upper = np.column_stack([k + n + 1, k + n + 2, k + 1])
    return rigid.Surface(points, np.vstack([lower, upper]), closed=False)


def measure(facets, rng):
    """Facets, seconds to make it, and seconds a ray, in order and at random."""
    start = time.perf_counter()
    surface = bumpy(facets)
    tool = rigid.Body(surface).tool
    made = time.perf_counter() - start
    n = round(np.sqrt(RAYS))
    t = (np.arange(n) + 0.5) / n
    x, y = (a.ravel() for a in np.meshgrid(t, t, indexing="ij"))
    grid = np.column_stack([x, y, np.full(n * n, 0.1)])
    rays = np.tile([0.0, 0.0, -1.0], (n * n, 1))
    times = []
    for points in (grid, rng.permutation(grid)):
        spent = []
        for _ in range(REPEATS):
            start = time.perf_counter()
            found = tool.distances_along(points.copy(), rays.copy())
            spent.append((time.perf_counter() - start) / len(points))
        assert np.isfinite(found).all()
        times.append(min(spent))
    return [len(surface.facets), made, *times]


def main():
    """Measure and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--facets", type=float, nargs="+", default=[1e3, 1e4, 1e5, 1e6])
    parser.add_argument(
        "--file", type=Path, default=Path(__file__).parent / "search.csv"
    )
    args = parser.parse_args()
    rng = np.random.default_rng(0)
    rows = []
    for facets in args.facets:
        rows.append(measure(facets, rng))
        count, made, ordered, shuffled = rows[-1]
        print(
            f"{count:9} facets, made in {made:8.3f} s, a ray {1e6 * ordered:7.3f} us "
            f"in order, {1e6 * shuffled:7.3f} us at random",
            flush=True,
        )
    with args.file.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["facets", "seconds_made", "seconds_ray", "seconds_ray_random"])
        table.writerows([row[0], *(f"{x:.3e}" for x in row[1:])] for row in rows)


if __name__ == "__main__":
    main()

"""How the search of a `rigid.Surface` grows with its facets: time of a ray.

Writes search.csv beside it. Rays meet a bumpy square from above, as slave points do: as
many as there are facets, as from a slave as fine as the tool, and 20,000, as from a
coarse one, where most of a ray's time is waiting for memory that no ray before has
touched. The times are the least of some repeats in one process; what is compared is
their ratio.
"""

import argparse
import csv
import time
from pathlib import Path

import numpy as np

from raymortar import rigid

FEW_RAYS, REPEATS = 20_000, 5


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


def grid(rays):
    """Starts of about as many rays above the square, neighbours one after the other."""
    n = round(np.sqrt(rays))
    t = (np.arange(n) + 0.5) / n
    x, y = (a.ravel() for a in np.meshgrid(t, t, indexing="ij"))
    return np.column_stack([x, y, np.full(n * n, 0.1)])


def seconds_of(tool, starts):
    """Seconds of a ray downwards."""
    directions = np.tile([0.0, 0.0, -1.0], (len(starts), 1))
    spent = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        found = tool.distances_along(starts.copy(), directions.copy())
        spent.append((time.perf_counter() - start) / len(starts))
        assert np.isfinite(found).all()
    return min(spent)


def measure(facets, rng):
    """Facets, seconds to make it, and seconds a ray: many, few, few at random."""
    start = time.perf_counter()
    surface = bumpy(facets)
    tool = rigid.Body(surface).tool
    made = time.perf_counter() - start
    count = len(surface.facets)
    few = grid(FEW_RAYS)
    starts = grid(max(count, FEW_RAYS)), few, rng.permutation(few)
    return [count, made, *(seconds_of(tool, points) for points in starts)]


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
        count, made, many, few, shuffled = rows[-1]
        print(
            f"{count:9} facets, made in {made:8.3f} s, a ray {1e6 * many:7.3f} us, of "
            f"few {1e6 * few:7.3f} us, of few at random {1e6 * shuffled:7.3f} us",
            flush=True,
        )
    with args.file.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(
            [
                "facets",
                "seconds_made",
                "seconds_ray",
                "seconds_ray_of_few",
                "seconds_ray_of_few_random",
            ]
        )
        table.writerows([row[0], *(f"{x:.3e}" for x in row[1:])] for row in rows)


if __name__ == "__main__":
    main()

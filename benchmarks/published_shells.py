"""Which shells have the published forces: the demo's meridian, other radii and plates.

    scripts/python benchmarks/published_shells.py [--output FILE]

Radii of 10, 12 and 14 have 1.6 times the force of the curves that go by their name
(Puso and Laursen 2004, and FEBio), here as in 3D. Each row has the radii of the inner
and of the outer shell, the height of the plate, the force where the curves have points,
up to where the shells buckle, and the root of the mean square of its differences from
them.
"""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path

from mpi4py import MPI

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / "demos")]

import shells  # noqa: E402

# Closing of the plates and force
PUSO = [(0.970, 0.144), (1.91, 0.626), (2.83, 1.112), (3.80, 1.738), (4.79, 2.221)]
FEBIO = [(2.18, 0.837), (3.90, 1.751), (5.19, 2.543)]
PUBLISHED = np.array(PUSO + FEBIO)
CLOSING, STEPS = 5.2, 13
# Radii of the inner and the outer shell, height of the plate
SCENES = [
    ((10.0, 12.0), (12.0, 14.0), 14.0),
    ((10.0, 12.0), (12.0, 14.0), 14.3),
    ((10.0, 12.0), (12.3, 14.3), 14.3),
    ((8.0, 10.0), (10.0, 12.0), 12.0),
    ((15.0, 17.0), (17.0, 19.0), 19.0),
    ((10.0, 11.5), (12.0, 13.5), 13.5),
    ((10.0, 11.6), (12.0, 13.6), 13.6),
    ((10.0, 11.7), (12.0, 13.7), 13.7),
    ((10.0, 11.7), (12.0, 13.7), 14.0),
    ((10.3, 12.0), (12.0, 13.7), 13.7),
    ((10.3, 12.0), (12.0, 13.7), 14.0),
]


def forces(inner, outer, plate):
    """At the published closings."""
    found = shells.meridian(MPI.COMM_SELF, STEPS, CLOSING, (inner, outer), plate)
    return np.interp(PUBLISHED[:, 0], found.closing, found.force)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--output", type=Path, default=HERE / "published_shells.csv")
    parser.add_argument("--scenes", type=int, default=len(SCENES), help="the first")
    arguments = parser.parse_args(arguments)
    with arguments.output.open("w", newline="") as file:
        table = csv.writer(file)
        at = [f"at_{closing:g}" for closing in PUBLISHED[:, 0]]
        table.writerow(["inner", "outer", "plate", *at, "apart"])
        table.writerow(["published", "", "", *PUBLISHED[:, 1], 0])
        for inner, outer, plate in SCENES[: arguments.scenes]:
            found = forces(inner, outer, plate)
            apart = np.sqrt(np.mean((found - PUBLISHED[:, 1]) ** 2))
            radii = [f"{low:g} to {high:g}" for low, high in (inner, outer)]
            row = [*radii, plate, *(f"{force:.3f}" for force in (*found, apart))]
            table.writerow(row)
            file.flush()
            print(*row, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""What ranks send each other, against the size of the surface and the number of ranks.

    scripts/python benchmarks/parallel/run.py [--quick] [--output DIR]

Counts are of the rank that sends most, with DOLFINx's graph partitioner and with
`raymortar.io.partitions.columns`. Writes `fixed_ranks.csv` (growing surfaces on 2 and 4
ranks), `fixed_share.csv` (1 to 8 ranks, the surface in proportion) and prints both with
the exponents of growth.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
PARTITIONS = ("graph", "columns")
COUNTS = (
    "fetched_facets",
    "update_messages",
    "update_bytes",
    "renewal_messages",
    "renewal_bytes",
    "assembly_messages",
    "matrix_bytes",
    "vector_bytes",
    "slid_matrix_bytes",
)


def environment():
    """Without what an enclosing MPI process has left, which a new mpirun would take
    for its own; ranks that wait leave the processor to the others."""
    own = {
        k: v for k, v in os.environ.items() if not k.startswith(("PMIX_", "OMPI_COMM"))
    }
    return {**own, "OMPI_MCA_mpi_yield_when_idle": "1", "OMP_NUM_THREADS": "1"}


def measured(ranks, facets, partition):
    """Counts of `slabs.py` on some ranks."""
    version = subprocess.run(["mpirun", "--version"], capture_output=True, text=True)
    options = ["--map-by", ":OVERSUBSCRIBE", "--bind-to", "none"]
    options = options if "Open MPI" in version.stdout else []
    command = ["mpirun", *options, "-n", str(ranks), sys.executable]
    done = subprocess.run(
        [*command, str(HERE / "slabs.py"), str(facets), partition],
        capture_output=True,
        text=True,
        env=environment(),
        timeout=1200,
    )
    if done.returncode:
        raise RuntimeError(f"{ranks} ranks failed:\n{done.stderr[-2000:]}")
    return json.loads(done.stdout.strip().splitlines()[-1])


def exponents(rows, against):
    """Slopes of the counts' logarithms, least squares; no number where one is zero."""
    x = np.log([row[against] for row in rows])
    slopes = {}
    for name in COUNTS:
        y = np.array([row[name] for row in rows], dtype=float)
        positive = len(rows) > 1 and np.all(y > 0.0)
        slopes[name] = float(np.polyfit(x, np.log(y), 1)[0]) if positive else np.nan
    return slopes


def write(path, rows):
    with open(path, "w", newline="") as file:
        table = csv.DictWriter(file, rows[0], lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def show(title, rows, slopes):
    print(f"\n{title}\n\n| ranks | slave facets | " + " | ".join(COUNTS) + " |")
    print("|" + "---|" * (len(COUNTS) + 2))
    for row in rows:
        cells = [row["ranks"], row["slave_facets"], *(row[name] for name in COUNTS)]
        print("| " + " | ".join(map(str, cells)) + " |")
    print("| exponent | | " + " | ".join(f"{slopes[n]:.2f}" for n in COUNTS) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--quick", action="store_true", help="small surfaces, 1-4 ranks"
    )
    parser.add_argument("--output", type=Path, default=HERE)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    surfaces = (144, 576) if arguments.quick else (576, 2304, 9216)
    rows = []
    for ranks in (2,) if arguments.quick else (2, 4):
        for partition in PARTITIONS:
            some = [measured(ranks, facets, partition) for facets in surfaces]
            show(f"{ranks} ranks, {partition}", some, exponents(some, "slave_facets"))
            rows += some
    write(arguments.output / "fixed_ranks.csv", rows)
    share, most = (144, (1, 2, 4)) if arguments.quick else (576, (1, 2, 4, 8))
    rows = []
    for partition in PARTITIONS:
        some = [measured(ranks, share * ranks, partition) for ranks in most]
        title = f"{share} slave facets per rank, {partition}"
        show(title, some, exponents(some[1:], "ranks"))
        rows += some
    write(arguments.output / "fixed_share.csv", rows)


if __name__ == "__main__":
    main()

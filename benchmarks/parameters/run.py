"""Tables of docs/measured: parameters, load steps, line search and accuracy, as CSV.

    scripts/python benchmarks/parameters/run.py [NAME ...] [--quick] [--output DIR]

Each table is a function that yields rows. Without names all are made, in ten minutes;
`--quick` takes the first row of each.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import logging
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [
    str(ROOT / "tests" / "helpers"),
    str(ROOT / "demos"),
    str(ROOT / "benchmarks"),
    str(HERE),
    str(ROOT / "benchmarks" / "robustness"),  # behind: both have `paths`
]

import accuracy_tables  # noqa: E402
import coefficient  # noqa: E402
import corrections  # noqa: E402
import paths  # noqa: E402
import points_and_nodes  # noqa: E402
import scenes_that_arrive  # noqa: E402
import slip_fronts  # noqa: E402
import small  # noqa: E402
import statuses  # noqa: E402

# In the order of the page
TABLES = {
    "holding": small.holding,
    "cycles": small.cycles,
    "automatic": coefficient.automatic,
    "automatic_penalty": coefficient.automatic_penalty,
    "gamma_blocks": small.gamma_blocks,
    "gamma_cylinder": small.gamma_cylinder,
    "gamma_friction": coefficient.with_friction,
    "quadrature": small.quadrature,
    "growing_steps": paths.growing_steps,
    "extrapolated": paths.extrapolated,
    "line_search": paths.line_search,
    "oscillation": accuracy_tables.oscillation,
    "flux": accuracy_tables.flux,
    "conditions": points_and_nodes.paths,
    "partial_slip": points_and_nodes.partial_slip,
    "slip_fronts": slip_fronts.slip_fronts,
    "corrections": corrections.corrections,
    "arriving": scenes_that_arrive.arriving,
    "statuses": statuses.statuses,
}


def shown(value):
    """Numbers to six digits."""
    return f"{value:.6g}" if isinstance(value, float) else value


def write(name, folder, quick):
    """One table; each row as soon as it is found."""
    start = time.process_time()
    found = itertools.islice(TABLES[name](), 1 if quick else None)
    with (folder / f"{name}.csv").open("w", newline="") as file:
        table = None
        for row in found:
            if table is None:
                table = csv.DictWriter(file, row, lineterminator="\n")
                table.writeheader()
            table.writerow({key: shown(value) for key, value in row.items()})
            file.flush()
            print(name, *map(shown, row.values()), sep=", ", flush=True)
    print(f"{name}: {time.process_time() - start:.0f} s", flush=True)


def main(arguments=None):
    """Make the tables."""
    logging.getLogger().setLevel(logging.WARNING)
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(TABLES))
    parser.add_argument("--quick", action="store_true", help="the first row of each")
    parser.add_argument("--output", type=Path, default=HERE)
    options = parser.parse_args(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    for name in options.names or TABLES:
        write(name, options.output, options.quick)
    return 0


if __name__ == "__main__":
    sys.exit(main())

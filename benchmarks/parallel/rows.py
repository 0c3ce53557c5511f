"""Rows of CSV files, each measured in a process of its own and written at once."""

import argparse
import csv
import itertools
import json
import subprocess
import sys
from pathlib import Path


def write_row(path, row, mode):
    """Write a row, whose order is that of the columns; `mode` is that of `open`."""
    with open(path, mode, newline="") as file:
        csv.writer(file, lineterminator="\n").writerow(row.values())


def measure_rows(program, choices, path):
    """Add a row for each combination of choices to a file: the last line, in JSON, that
    the program prints when it is given them after `--row`."""
    for row in itertools.product(*choices):
        command = [sys.executable, program, "--row", *row]
        out = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
        found = json.loads(out.stdout.splitlines()[-1])
        print(*found.values(), flush=True)
        write_row(path, found, "a")  # one by one: large ones take long


def run(program, doc, columns, measure, cases, linear):
    """Measure cases and sizes with linear solvers, as the command line says, into the
    CSV file beside a program."""
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    parser.add_argument("--cases", default=",".join(cases))
    parser.add_argument("--sizes", default="0,1,2")
    parser.add_argument("--linear", default=linear)
    parser.add_argument("--more", action="store_true", help="add to the file's rows")
    parser.add_argument("--output", type=Path, default=Path(program).parent)
    parser.add_argument("--row", nargs=3, metavar=("CASE", "SIZE", "LINEAR"))
    arguments = parser.parse_args()
    if arguments.row:
        case, size, linear = arguments.row
        print(json.dumps(measure(case, int(size), linear)))
        return
    path = arguments.output / f"{Path(program).stem}.csv"
    if not (arguments.more and path.exists()):
        write_row(path, {name: name for name in columns}, "w")
    names = "cases", "sizes", "linear"
    choices = [getattr(arguments, name).split(",") for name in names]
    measure_rows(program, choices, path)

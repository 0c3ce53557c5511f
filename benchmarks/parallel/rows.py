"""Rows of CSV files, each measured in a process of its own and written at once."""

import csv
import itertools
import json
import subprocess
import sys


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

"""Rows of CSV files, written one by one."""

import csv


def write_row(path, row, mode):
    """Write a row, whose order is that of the columns; `mode` is that of `open`."""
    with open(path, mode, newline="") as file:
        csv.writer(file, lineterminator="\n").writerow(row.values())

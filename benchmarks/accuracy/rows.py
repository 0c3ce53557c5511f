"""Results: one row per solve, as CSV."""

from __future__ import annotations

import csv
from pathlib import Path

FIELDS = (
    "problem",
    "program",
    "cell",
    "degree",
    "n",
    "mesh",
    "quadrature",
    "method",
    "multiplier",
    "measure",
    "tangent",
    "unknowns",
    "iterations",
    "error_u",
    "error_H",
    "error_multiplier",
    "error_pressure",
    "error_tangential",
    "seconds",
    "pairing",
    "integration",
    "assembly",
    "volume",
    "solve",
)
_TEXT = ("problem", "program", "cell", "mesh", "method", "multiplier", "measure")
_TEXT += ("quadrature", "tangent")


def _format(value):
    return f"{value:.4g}" if isinstance(value, float) else value


class Table:
    """A CSV file that is written row by row: an interrupted run keeps its results."""

    def __init__(self, path: Path, append: bool = False):
        path.parent.mkdir(parents=True, exist_ok=True)
        self._path = path
        if append and path.exists():
            return
        with path.open("w", newline="") as file:
            csv.DictWriter(file, FIELDS).writeheader()

    def add(self, row: dict):
        """Append, and say so on the terminal."""
        row = {name: _format(value) for name, value in row.items()}
        with self._path.open("a", newline="") as file:
            csv.DictWriter(file, FIELDS).writerow(row)
        shown = [str(row[name]) for name in FIELDS[:13] if row.get(name, "") != ""]
        errors = [f"{k[6:]} {v}" for k, v in row.items() if k.startswith("error_")]
        print(" ".join(shown), "|", ", ".join(errors), "|", row["seconds"], "s")


def read(path: Path) -> list[dict]:
    """Rows of a file, numbers as numbers."""
    with path.open() as file:
        return [
            {k: _number(k, v) for k, v in row.items()} for row in csv.DictReader(file)
        ]


def _number(name, text):
    return text if name in _TEXT or text == "" else float(text)

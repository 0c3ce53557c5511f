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
    """A CSV file that is written row by row: an interrupted run keeps its results.

    Of an earlier file all rows stay with `append`, else those of the program `keep`.
    """

    def __init__(self, path: Path, append: bool = False, keep: str | None = None):
        path.parent.mkdir(parents=True, exist_ok=True)
        self._path, old = path, []
        if path.exists():
            with path.open() as file:
                old = list(csv.DictReader(file))
        kept = [row for row in old if append or row["program"] == keep]
        with path.open("w", newline="") as file:
            table = csv.DictWriter(file, FIELDS)
            table.writeheader()
            table.writerows(kept)

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

"""Numbers and rows as the measured pages show them."""

from __future__ import annotations

import csv
import itertools
import math
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

BENCHMARKS = Path(__file__).resolve().parents[1]

Row = dict[str, str]
# The first line has the headings
Table = list[list[str]]
# Name of a table: its CSV files below `benchmarks`, and what makes it of their rows
TABLES: dict[str, tuple[tuple[str, ...], Callable[..., Table]]] = {}

KINDS = {
    "interval": "2D",
    "quadrilateral": "hexahedra",
    "triangle": "tetrahedra",
    "tetrahedron": "tetrahedra",
    "hexahedron": "hexahedra",
}


def table(*files: str) -> Callable[[Callable[..., Table]], Callable[..., Table]]:
    """Register a function that makes a table of the rows of CSV files."""

    def register(make: Callable[..., Table]) -> Callable[..., Table]:
        TABLES[make.__name__] = (files, make)
        return make

    return register


def rows_of(file: str) -> list[Row]:
    """Read the rows of a CSV file below `benchmarks`."""
    with (BENCHMARKS / file).open(newline="", encoding="utf-8") as lines:
        return list(csv.DictReader(lines))


def markdown(lines: Table) -> str:
    """Write a table in Markdown, a line each."""
    head, *body = lines
    return "\n".join(
        "| " + " | ".join(cells) + " |" if cells else "|" + "---|" * len(head)
        for cells in ([head, [], *body])
    )


def grouped(rows: Iterable[Row], *names: str) -> Iterator[tuple[list[str], list[Row]]]:
    """Neighbouring rows that agree in some columns, with these columns."""
    for key, group in itertools.groupby(rows, lambda row: [row[n] for n in names]):
        yield key, list(group)


def shaped(value: float, digits: int) -> str:
    """Significant digits without an exponent."""
    if not value:
        return "0"
    places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    return f"{float(f'{value:.{digits}g}'):,.{places}f}"


def brief(value: str | float, digits: int = 2) -> str:
    """Significant digits, trailing zeros left out."""
    shown = shaped(float(value), digits)
    return shown.rstrip("0").rstrip(".") if "." in shown else shown


def spaced(number: str | float) -> str:
    """A whole number in groups of three digits."""
    return f"{int(number):,}".replace(",", " ")


def percent(value: str | float, signed: bool = False) -> str:
    """A share in per cent, to two digits."""
    sign, share = "+" if signed and float(value) > 0 else "", 100 * float(value)
    return f"{sign}{share:.2g} %" if abs(share) < 99.5 else f"{sign}{share:.0f} %"


def halved(iterations: str, cuts: str | None) -> str:
    """Iterations, and in brackets how many steps were halved."""
    return iterations if not cuts or cuts == "0" else f"{iterations} ({cuts})"


def once(names: Iterable[str], repeated: str = "") -> list[str]:
    """Names of rows, those left out that repeat the one above."""
    found, last = [], None
    for name in names:
        found.append(repeated if name == last else name)
        last = name
    return found

"""What CalculiX has written: .dat, .cvg, .sta and the last fields of an .frd file."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from peer_case import Effort

_TOTAL = re.compile(r"total force \(fx,fy,fz\) for set \S+ and time\s+(\S+)")


def totals(dat: str) -> tuple[np.ndarray, np.ndarray]:
    """Times and total forces (n, 3) of the increments."""
    lines = dat.splitlines()
    times, forces = [], []
    for k, line in enumerate(lines):
        if match := _TOTAL.search(line):
            times.append(float(match[1]))
            values = next(text for text in lines[k + 1 :] if text.strip())
            forces.append([float(value) for value in values.split()])
    return np.array(times), np.array(forces).reshape(-1, 3)


def effort(cvg: str, sta: str) -> Effort:
    """Iterations of all attempts, accepted increments, attempts that were cut."""
    tried = _rows(cvg)
    attempts = {tuple(row[:3]) for row in tried}
    increments = {tuple(row[:2]) for row in _rows(sta)}
    return Effort(len(tried), len(increments), len(attempts) - len(increments))


def _rows(text: str) -> list[list[str]]:
    """Rows that begin with whole numbers, as tables of both files have."""
    rows = [line.split() for line in text.splitlines()]
    return [row for row in rows if len(row) > 3 and all(map(str.isdigit, row[:4]))]


def last_field(frd: Path, name: str) -> tuple[np.ndarray, list[str], np.ndarray]:
    """Nodes (n,), names of the columns and values (n, columns) of the last field with
    a name. Numbers have fixed widths: 10 for a node, 12 for a value, 6 values a line.
    """
    columns: list[str] = []
    rows: dict[int, list[float]] = {}
    here, node = False, 0
    with frd.open() as lines:
        for line in lines:
            if line.startswith(" -4"):
                here = line.split()[1] == name
                if here:
                    columns, rows = [], {}
            elif here and line.startswith(" -5"):
                columns.append(line.split()[1])
            elif here and line.startswith(" -1"):
                node = int(line[3:13])
                rows[node] = _values(line)
            elif here and line.startswith(" -2"):
                rows[node] += _values(line)
            elif line.startswith(" -3"):
                here = False
    values = np.array(list(rows.values()), dtype=float).reshape(len(rows), -1)
    return np.array(list(rows), dtype=int), columns, values


def _values(line: str) -> list[float]:
    text = line[13:].rstrip("\n")
    return [float(text[k : k + 12]) for k in range(0, len(text.rstrip()), 12)]


def places(frd: Path) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (n,) and their undeformed places (n, 3): CalculiX writes elements of the
    plane as a layer of solid ones, with nodes of its own."""
    found, here = {}, False
    with frd.open() as lines:
        for line in lines:
            if line.startswith("    2C"):
                here = True
            elif here and line.startswith(" -1"):
                found[int(line[3:13])] = _values(line)
            elif here and line.startswith(" -3"):
                break
    return np.array(list(found), dtype=int), np.array(list(found.values()))

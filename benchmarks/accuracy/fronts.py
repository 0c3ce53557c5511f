"""Rows of results, and the least time in which they reach an error."""

from __future__ import annotations

from math import exp, log


def pareto(found, error):
    """Rows that no other one beats in both time and error, by time."""
    front, least = [], float("inf")
    for row in sorted(found, key=lambda r: (r["seconds"], r[error])):
        if row[error] < least:
            front.append(row)
            least = row[error]
    return front


def seconds_at(found, error, level):
    """Least run time with an error below a level, between sizes on log scales; None if
    it is not reached."""
    front = pareto(found, error)
    e = [log(row[error]) for row in front]
    t = [log(row["seconds"]) for row in front]
    if not front or e[-1] > log(level):
        return None
    below = next(k for k, value in enumerate(e) if value <= log(level))
    if below == 0:
        return exp(t[0])
    share = (e[below - 1] - log(level)) / (e[below - 1] - e[below])
    return exp(t[below - 1] + share * (t[below] - t[below - 1]))


def of(found, **values):
    """Rows with these settings."""
    return [r for r in found if all(r[name] == v for name, v in values.items())]
